// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/camera.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// A face in a picture: corners as (u, v, 1 / z), all of which are linear along straight lines of
/// the picture.
struct ProjectedFace {
  std::array<Eigen::Vector3f, 3> corner;
  bool in_front = false;  ///< All of it lies before the camera; else the corners mean nothing.
};

std::vector<ProjectedFace> projected_faces(const TriangleMesh& mesh, const Camera& camera);

/// Twice the signed area of (a, b, (u, v)) in the picture.
inline float edge_function(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float u, float v) {
  return (b.x() - a.x()) * (v - a.y()) - (b.y() - a.y()) * (u - a.x());
}

/// Pixels [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

/// Calls visit(x, y, weights, nearness) for every pixel of `rect` whose centre the face covers:
/// `weights` are those of the corners (barycentric in the picture), `nearness` is 1 / z.
template <typename Visit>
void for_each_pixel(const ProjectedFace& face, const PixelRect& rect, const Visit& visit) {
  const auto& [a, b, c] = face.corner;
  const auto first = [](float low, int begin) {
    return std::max(begin, static_cast<int>(std::ceil(low - 0.5f)));
  };
  const auto last = [](float high, int end) {
    return std::min(end - 1, static_cast<int>(std::floor(high - 0.5f)));
  };
  const int y0 = first(std::min({a.y(), b.y(), c.y()}), rect.y0);
  const int y1 = last(std::max({a.y(), b.y(), c.y()}), rect.y1);
  if (y0 > y1) return;
  const int x0 = first(std::min({a.x(), b.x(), c.x()}), rect.x0);
  const int x1 = last(std::max({a.x(), b.x(), c.x()}), rect.x1);
  const float area = edge_function(a, b, c.x(), c.y());
  if (!(std::abs(area) > 0)) return;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const float u = static_cast<float>(x) + 0.5f;
      const float v = static_cast<float>(y) + 0.5f;
      Eigen::Vector3f w(
          edge_function(b, c, u, v), edge_function(c, a, u, v), edge_function(a, b, u, v));
      w /= area;
      if (w.minCoeff() < 0) continue;
      visit(x, y, w, w.x() * a.z() + w.y() * b.z() + w.z() * c.z());
    }
  }
}

/// 1 / z of the nearest surface at every pixel centre, 0 = nothing. Same bits for any number of
/// threads.
Raster<float> nearness_map(const std::vector<ProjectedFace>& faces, int width, int height);

}  // namespace cgs
