// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/seen_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct PixelStep {
  int dx, dy;
};

// In inverse depth planes are linear over the picture.
DepthMap inverse_of(const DepthMap& depth) {
  DepthMap out(depth.width, depth.height, kNan);
  for (size_t i = 0; i < out.data.size(); ++i) {
    if (depth.data[i] > 0) out.data[i] = 1 / depth.data[i];
  }
  return out;
}

float value_at(const DepthMap& map, int x, int y) { return map.contains(x, y) ? map(x, y) : kNan; }

constexpr uint8_t kLinkedRight = 1;
constexpr uint8_t kLinkedBelow = 2;

// Whether a pixel and the next one lie on one surface; the same from either of the two.
bool are_linked(const DepthMap& inverse_depth, const DepthMap& gap, int x, int y, PixelStep s) {
  constexpr float kSteepest = 0.1f;   // step of a slanted surface, part of the inverse depth
  constexpr float kCurvature = 0.5f;  // change from step to step, part of the step
  const float here = value_at(inverse_depth, x, y);
  const float there = value_at(inverse_depth, x + s.dx, y + s.dy);
  if (std::isnan(here) || std::isnan(there)) return false;
  const float step = there - here;
  const float size = std::abs(step) / std::min(here, there);
  if (size <= std::max(gap(x, y), gap(x + s.dx, y + s.dy))) return true;
  if (size > kSteepest) return false;
  const float before = here - value_at(inverse_depth, x - s.dx, y - s.dy);
  const float after = value_at(inverse_depth, x + 2 * s.dx, y + 2 * s.dy) - there;
  const float change = std::fmin(std::abs(before - step), std::abs(after - step));
  return change <= kCurvature * std::abs(step);  // not if unknown
}

// The cells of a view in inverse depth.
class Surface {
 public:
  explicit Surface(const DepthCells& cells)
      : links_(cells.links), inverse_depth_(inverse_of(cells.depth)) {}

  float at(int x, int y) const { return value_at(inverse_depth_, x, y); }

  bool continues(int x, int y, PixelStep s) const {
    const int left = std::min(x, x + s.dx);
    const int top = std::min(y, y + s.dy);
    if (!links_.contains(left, top)) return false;
    return (links_(left, top) & (s.dx != 0 ? kLinkedRight : kLinkedBelow)) != 0;
  }

  // Change over one pixel along an axis, of the neighbours on the same surface.
  float slope(int x, int y, PixelStep s) const {
    const bool after = continues(x, y, s);
    const bool before = continues(x, y, {-s.dx, -s.dy});
    if (!after && !before) return 0;
    const float first = before ? at(x - s.dx, y - s.dy) : at(x, y);
    const float last = after ? at(x + s.dx, y + s.dy) : at(x, y);
    return (last - first) / (after && before ? 2.0f : 1.0f);
  }

  // At the corner of a cell; sx, sy = -1 or 1.
  float corner(int x, int y, int sx, int sy) const {
    if (continues(x, y, {sx, 0}) && continues(x, y, {0, sy}) && continues(x + sx, y, {0, sy}) &&
        continues(x, y + sy, {sx, 0})) {
      return (at(x, y) + at(x + sx, y) + at(x, y + sy) + at(x + sx, y + sy)) / 4;
    }
    return at(x, y) + 0.5f * (static_cast<float>(sx) * slope(x, y, {1, 0}) +
                              static_cast<float>(sy) * slope(x, y, {0, 1}));
  }

 private:
  const SurfaceLinks& links_;
  DepthMap inverse_depth_;
};

// u, v [pixels] and inverse depth in the camera that cells are drawn into.
using Corner = Eigen::Vector3d;

class Canvas {
 public:
  // \param largest  side of a cell [pixels]: one larger shows that the camera is almost inside the
  //                 surface, where depth says nothing
  Canvas(const Camera& camera, double largest)
      : inverse_depth_(camera.width, camera.height, kNan),
        pixel_(camera.width, camera.height, -1),
        largest_(largest) {}

  // Twice the area, positive where the other camera sees the side that the view saw.
  static double area(const Corner& a, const Corner& b, const Corner& c) {
    const Eigen::Vector2d ab = (b - a).head<2>();
    const Eigen::Vector2d ac = (c - a).head<2>();
    return ab.x() * ac.y() - ab.y() * ac.x();
  }

  void draw(const Corner& a, const Corner& b, const Corner& c, int32_t pixel) {
    cover(a, b, c, [&](int x, int y, float value) {
      if (inverse_depth_(x, y) >= value) return;
      inverse_depth_(x, y) = value;
      pixel_(x, y) = pixel;
    });
  }

  // The side that the view did not see; nobody knows what is there, and it hides what is farther.
  // After all others: cells that noise has turned lie at the depth of their neighbours.
  void draw_back(const Corner& a, const Corner& b, const Corner& c) {
    constexpr float kNearer = 1.02f;
    cover(a, b, c, [&](int x, int y, float value) {
      if (inverse_depth_(x, y) * kNearer >= value) return;
      inverse_depth_(x, y) = value;
      pixel_(x, y) = -1;
    });
  }

  SeenSurface take() {
    for (size_t i = 0; i < pixel_.data.size(); ++i) {
      float& value = inverse_depth_.data[i];
      value = pixel_.data[i] < 0 ? kNan : 1 / value;
    }
    return {std::move(inverse_depth_), std::move(pixel_)};
  }

 private:
  template <typename Visit>
  void cover(const Corner& a, const Corner& b, const Corner& c, const Visit& visit) {
    const auto first = [](double p, double q, double r) {
      return std::ceil(std::min({p, q, r}) - 0.5 - kEdge);
    };
    const auto last = [](double p, double q, double r) {
      return std::floor(std::max({p, q, r}) - 0.5 + kEdge);
    };
    const double x0 = std::max(first(a.x(), b.x(), c.x()), 0.0);
    const double y0 = std::max(first(a.y(), b.y(), c.y()), 0.0);
    const double x1 = std::min(last(a.x(), b.x(), c.x()), double(pixel_.width - 1));
    const double y1 = std::min(last(a.y(), b.y(), c.y()), double(pixel_.height - 1));
    // Close before the camera, corners may lie farther beside the picture than an int can say.
    if (!(x0 <= x1 && y0 <= y1)) return;
    const Eigen::Vector2d ab = (b - a).head<2>();
    const Eigen::Vector2d ac = (c - a).head<2>();
    const double area = Canvas::area(a, b, c);
    if (!(std::abs(area) > 1e-12) || x1 - x0 > largest_ || y1 - y0 > largest_) return;
    for (int y = static_cast<int>(y0); y <= static_cast<int>(y1); ++y) {
      for (int x = static_cast<int>(x0); x <= static_cast<int>(x1); ++x) {
        const Eigen::Vector2d p(x + 0.5 - a.x(), y + 0.5 - a.y());
        const double wb = (p.x() * ac.y() - p.y() * ac.x()) / area;
        const double wc = (ab.x() * p.y() - ab.y() * p.x()) / area;
        if (wb < -kEdge || wc < -kEdge || wb + wc > 1 + kEdge) continue;
        const auto value = static_cast<float>(a.z() + wb * (b.z() - a.z()) + wc * (c.z() - a.z()));
        visit(x, y, value);
      }
    }
  }

  static constexpr double kEdge = 1e-4;  // so that rounding leaves no crack between triangles

  DepthMap inverse_depth_;
  Raster<int32_t> pixel_;
  double largest_;
};

}  // namespace

SurfaceLinks surface_links(const DepthMap& depth, const DepthMap& gap) {
  const DepthMap inverse_depth = inverse_of(depth);
  SurfaceLinks out(depth.width, depth.height, 0);
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      const bool right = are_linked(inverse_depth, gap, x, y, {1, 0});
      const bool below = are_linked(inverse_depth, gap, x, y, {0, 1});
      out(x, y) = static_cast<uint8_t>((right ? kLinkedRight : 0) | (below ? kLinkedBelow : 0));
    }
  });
  return out;
}

SeenSurface seen_surface(const DepthCells& cells, const Camera& camera) {
  constexpr std::array<PixelStep, 4> kCorners = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  const Surface surface(cells);
  const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
  // A longer lens enlarges cells without coming nearer.
  constexpr double kNearest = 64;
  Canvas canvas(camera, kNearest * std::max(1.0, camera.fx / cells.camera.fx));
  std::vector<std::array<Corner, 3>> backs;
  for (int y = 0; y < cells.depth.height; ++y) {
    for (int x = 0; x < cells.depth.width; ++x) {
      if (std::isnan(surface.at(x, y))) continue;
      std::array<Corner, 4> corners;
      bool before_camera = true;
      for (size_t k = 0; k < corners.size(); ++k) {
        const auto [sx, sy] = kCorners[k];
        const double z = 1 / double(surface.corner(x, y, sx, sy));
        const Eigen::Vector3d point =
            cells.camera.unproject(x + 0.5 + 0.5 * sx, y + 0.5 + 0.5 * sy, z);
        corners[k] = camera.project_in_cam(cam_from_world * point);
        before_camera = before_camera && z > 0 && corners[k].z() > 0;
        corners[k].z() = 1 / corners[k].z();
      }
      if (!before_camera) continue;
      const auto pixel = static_cast<int32_t>(cells.depth.index(x, y));
      for (const auto& [b, c] : {std::pair(corners[1], corners[2]), {corners[2], corners[3]}}) {
        if (Canvas::area(corners[0], b, c) < 0) {
          backs.push_back({corners[0], b, c});
        } else {
          canvas.draw(corners[0], b, c, pixel);
        }
      }
    }
  }
  for (const auto& [a, b, c] : backs) canvas.draw_back(a, b, c);
  return canvas.take();
}

}  // namespace cgs
