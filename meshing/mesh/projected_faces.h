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
template <typename Scalar>
Scalar edge_function(const Eigen::Matrix<Scalar, 3, 1>& a,
                     const Eigen::Matrix<Scalar, 3, 1>& b,
                     Scalar u,
                     Scalar v) {
  return (b.x() - a.x()) * (v - a.y()) - (b.y() - a.y()) * (u - a.x());
}

/// Pixels [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

/// Calls visit(x, y, weights, third) for every pixel of `rect` whose centre the triangle covers:
/// `weights` are those of the corners (barycentric in the picture), `third` is what they give for
/// the third coordinate. A centre counts as covered down to a weight of -slack.
template <typename Scalar, typename Visit>
void for_each_pixel(const std::array<Eigen::Matrix<Scalar, 3, 1>, 3>& corner,
                    const PixelRect& rect,
                    const Visit& visit,
                    Scalar slack = 0) {
  constexpr Scalar kHalf(0.5);
  const auto& [a, b, c] = corner;
  const auto within = [](Scalar value, int low, int high) {  // corners may lie beyond all integers
    return static_cast<int>(std::clamp(value, static_cast<Scalar>(low), static_cast<Scalar>(high)));
  };
  const auto first = [&](Scalar low, int begin, int end) {
    return within(std::ceil(low - kHalf), begin, end);
  };
  const auto last = [&](Scalar high, int begin, int end) {
    return within(std::floor(high - kHalf), begin - 1, end - 1);
  };
  const int y0 = first(std::min({a.y(), b.y(), c.y()}), rect.y0, rect.y1);
  const int y1 = last(std::max({a.y(), b.y(), c.y()}), rect.y0, rect.y1);
  if (y0 > y1) return;
  const int x0 = first(std::min({a.x(), b.x(), c.x()}), rect.x0, rect.x1);
  const int x1 = last(std::max({a.x(), b.x(), c.x()}), rect.x0, rect.x1);
  const Scalar area = edge_function<Scalar>(a, b, c.x(), c.y());
  if (!(std::abs(area) > 0)) return;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Scalar u = static_cast<Scalar>(x) + kHalf;
      const Scalar v = static_cast<Scalar>(y) + kHalf;
      Eigen::Matrix<Scalar, 3, 1> w(edge_function<Scalar>(b, c, u, v),
                                    edge_function<Scalar>(c, a, u, v),
                                    edge_function<Scalar>(a, b, u, v));
      w /= area;
      if (w.minCoeff() < -slack) continue;
      visit(x, y, w, w.x() * a.z() + w.y() * b.z() + w.z() * c.z());
    }
  }
}

/// The same for a face before a camera; the third coordinate is `nearness`, 1 / z.
template <typename Visit>
void for_each_pixel(const ProjectedFace& face, const PixelRect& rect, const Visit& visit) {
  for_each_pixel<float>(face.corner, rect, visit);
}

/// 1 / z of the nearest surface at every pixel centre, 0 = nothing. Same bits for any number of
/// threads.
Raster<float> nearness_map(const std::vector<ProjectedFace>& faces, int width, int height);
/// The same with what lies before the camera of faces that reach behind it: it hides others, too.
/// \param faces  projected_faces() of the two
Raster<float> nearness_map(const TriangleMesh& mesh,
                           const Camera& camera,
                           const std::vector<ProjectedFace>& faces);

}  // namespace cgs
