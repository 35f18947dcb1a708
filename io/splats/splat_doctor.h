// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/splats/raw_splats.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// What was found wrong in a file of splats and what was done about it. Counts are splats.
struct SplatFindings {
  uint64_t in_file = 0;
  uint64_t not_finite = 0;        ///< Dropped: a value is NaN or infinite.
  uint64_t without_rotation = 0;  ///< Dropped: quaternion 0, as in rows that were never filled.
  uint64_t transparent = 0;       ///< Dropped: opacity 0.
  uint64_t out_of_range = 0;      ///< Dropped: too wide or too far away for float.
  uint64_t clamped = 0;           ///< Kept: opacity 1 became 0.99, vanishing scales the smallest.
  uint64_t flyaways = 0;          ///< Kept: more than ten times the scene's size away from it.
  bool linear_scales = false;     ///< Repaired: scales were lengths, not their logarithms.
  bool linear_opacity = false;    ///< Repaired: opacities were probabilities, not logits.
  double fill_ratio = 0;  ///< How often the splats would cover a square of the scene's size.

  uint64_t dropped() const { return not_finite + without_rotation + transparent + out_of_range; }
};

/// Gaussians from a file and the frame they were read into.
struct GaussianFile {
  Gaussians gaussians;
  Frame frame;
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0, 0) of the file.
  std::vector<std::string> warnings;  ///< One line each: what was dropped, clamped, or looks odd.
  std::string format;                 ///< For people.
  std::string evidence;  ///< What the splats rest on, in the words of a file of ours; else empty.
  SplatFindings findings;
};

/// Judges every splat and moves the good ones into their frame.
///
/// - Dropped and counted: values that are not finite, quaternion 0, opacity 0, scales or positions
///   that leave the range of float.
/// - Clamped and counted: opacity 1 becomes 0.99, vanishing scales become the smallest that can be
///   squared.
/// - Opacities that all lie in [0, 1] and spread over a tenth of it are probabilities, not logits.
/// - Scales of which none is negative are taken for lengths instead of logarithms if opacities are
///   probabilities, or if as logarithms they would cover the scene a thousand times over, and as
///   lengths do not.
/// - Quaternions are normalised.
/// - Labels of provenance are kept where every splat has one; else they are left out, with a
///   warning.
/// - Tags of what is made up are kept in any case; what is no tag counts as one.
///
/// \param raw    taken apart, so that no second copy is in memory
/// \param frame  read into exactly this frame; without it a canonical frame is made from the 1st
///               to 99th percentile of the positions, so that stray splats do not shrink the scene,
///               with unit and origin from the comments
/// \throws BadInput Value (no splat is left; as check_significance())
GaussianFile examine_splats(RawSplats raw,
                            const std::filesystem::path& path,
                            const std::optional<Frame>& frame);

}  // namespace cgs
