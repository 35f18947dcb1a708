// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/frame.h"

namespace cgs {

/// Header lines that say in which unit the coordinates of a PLY file are and where its origin lies:
/// "comment unit …", "comment metres_per_unit …", "comment metres_sigma …",
/// "comment scale_source …", "comment file_origin x y z", "comment up x y z" where it is known, the
/// numbers exact.
std::string ply_frame_comments(const Frame& frame);

/// The same for other text formats, where lines start with `mark` instead of "comment ".
std::string frame_comments(const Frame& frame, const std::string& mark);

/// The header line by which a PLY file says that it is one of ours, without "comment ".
inline constexpr const char* kPlyGenerator = "generator cgs";

/// Whether its comments hold that line.
bool is_our_ply(const std::vector<std::string>& comments);

/// The header line "comment evidence …" that says in words what splats rest on: which part of their
/// depth was measured, and which was made up. Cut after 1000 bytes; "" if nobody says.
std::string ply_evidence_comment(const std::string& evidence);

/// What that line says in the comments of a file of ours; "" in those of others, or without it.
std::string ply_evidence(const std::vector<std::string>& comments);

/// Where the coordinates of a PLY file belong.
struct PlyPlacement {
  Frame frame;                  ///< The frame the content is read into.
  Eigen::Vector3d file_origin;  ///< World point of (0, 0, 0) of the file.
  std::vector<std::string> warnings;

  Eigen::Vector3d internal(const Eigen::Vector3d& point_in_file) const {
    return (point_in_file - (frame.origin - file_origin)) / frame.scale;
  }
};

/// The frame to read a PLY file into.
///
/// \param comments  of its header; lines that ply_frame_comments() did not write are ignored
/// \param bounds    two opposite corners of its content in file coordinates; finite
/// \param wanted    read into exactly this frame; empty = a canonical frame made from the bounds,
///                  with the unit and the file origin that the comments tell. Where the content
///                  is too far from that for float, files written in the frame have another one
PlyPlacement ply_placement(const std::vector<std::string>& comments,
                           const std::vector<Eigen::Vector3d>& bounds,
                           const std::optional<Frame>& wanted);

}  // namespace cgs
