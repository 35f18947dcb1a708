// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "libcgs/core/frame.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A mesh, or a point cloud if it has no faces, on its way through a chain of operations.
struct FilterState {
  TriangleMesh mesh;
  Frame frame;
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0, 0) of the file
                                                          ///< read, in which arguments are given.

  Eigen::Vector3d internal_from_file(const Eigen::Vector3d& p) const {
    return (p - (frame.origin - file_origin)) / frame.scale;
  }
  Eigen::Vector3d file_from_internal(const Eigen::Vector3d& p) const {
    return (frame.origin - file_origin) + frame.scale * p;
  }
  bool is_cloud() const { return mesh.faces.empty(); }
};

/// What an operation says about its work.
struct FilterRemark {
  // NOLINTNEXTLINE(google-explicit-constructor): most operations have no more to say than words
  FilterRemark(std::string words) : text(std::move(words)) {}
  FilterRemark(std::string words, nlohmann::ordered_json figures)
      : text(std::move(words)), details(std::move(figures)) {}

  std::string text;                ///< For the user: "12 holes"; may be empty.
  nlohmann::ordered_json details;  ///< For machines, in file units; null = no more than the text.
};

/// One operation with its arguments: changes the state. Throws what libcgs/core/error.h lists.
using FilterStep = std::function<FilterRemark(FilterState& state, const Progress& progress)>;

}  // namespace cgs
