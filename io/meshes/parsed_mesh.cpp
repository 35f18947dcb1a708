// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/parsed_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace cgs {

namespace {

// A polygon laid into the plane of its two largest extents, counter-clockwise.
class FlatPolygon {
 public:
  FlatPolygon(const std::vector<uint32_t>& corners, const std::vector<Eigen::Vector3d>& positions) {
    const Eigen::Vector3d& first = positions[corners[0]];
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < corners.size(); ++k) {
      const Eigen::Vector3d a = positions[corners[k]] - first;
      const Eigen::Vector3d b = positions[corners[(k + 1) % corners.size()]] - first;
      normal += a.cross(b);
    }
    Eigen::Index across = 0;
    normal.cwiseAbs().maxCoeff(&across);
    const Eigen::Index x = (across + 1) % 3;
    const Eigen::Index y = (across + 2) % 3;
    const double sign = normal[across] < 0 ? -1 : 1;
    for (const uint32_t corner : corners) {
      const Eigen::Vector3d p = positions[corner] - first;
      places_.emplace_back(p[x], sign * p[y]);
    }
    for (size_t k = 0; k < corners.size(); ++k) left_.push_back(k);
  }

  bool is_convex() const {
    for (size_t i = 0; i < left_.size(); ++i) {
      if (turn(before(i), left_[i], after(i)) < 0) return false;
    }
    return true;
  }

  // Cuts off an ear: a corner whose triangle holds no other. \return its place, none if there is
  // none
  std::optional<std::array<size_t, 3>> cut_ear() {
    for (size_t i = 0; i < left_.size(); ++i) {
      const std::array<size_t, 3> ear = {before(i), left_[i], after(i)};
      if (!(turn(ear[0], ear[1], ear[2]) > 0) || holds_another(ear)) continue;
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(i));
      return ear;
    }
    return std::nullopt;
  }

  size_t size() const { return left_.size(); }

 private:
  size_t before(size_t i) const { return left_[(i + left_.size() - 1) % left_.size()]; }
  size_t after(size_t i) const { return left_[(i + 1) % left_.size()]; }
  // Twice the area of a triangle.
  double turn(size_t a, size_t b, size_t c) const {
    const Eigen::Vector2d ab = places_[b] - places_[a];
    const Eigen::Vector2d ac = places_[c] - places_[a];
    return ab.x() * ac.y() - ab.y() * ac.x();
  }
  bool holds_another(const std::array<size_t, 3>& ear) const {
    return std::any_of(left_.begin(), left_.end(), [&](size_t k) {
      const auto is_corner = [&](size_t e) { return places_[e] == places_[k]; };
      if (std::any_of(ear.begin(), ear.end(), is_corner)) return false;
      return turn(ear[0], ear[1], k) >= 0 && turn(ear[1], ear[2], k) >= 0 &&
             turn(ear[2], ear[0], k) >= 0;
    });
  }

  std::vector<Eigen::Vector2d> places_;
  std::vector<size_t> left_;  // corners that are not cut off yet
};

// The triangles of a polygon with reflex corners; none if it cannot be cut up.
std::vector<std::array<uint32_t, 3>> ears_of(const std::vector<uint32_t>& corners,
                                             FlatPolygon polygon) {
  std::vector<std::array<uint32_t, 3>> out;
  const auto add = [&](const std::array<size_t, 3>& ear) {
    out.push_back({corners[ear[0]], corners[ear[1]], corners[ear[2]]});
  };
  while (polygon.size() > 2) {
    const auto ear = polygon.cut_ear();
    if (!ear) return {};
    add(*ear);
  }
  return out;
}

}  // namespace

void settle_colors(ParsedMesh& parsed) {
  constexpr float kBeyondWhite = 2;
  std::vector<Eigen::Vector3f>& colors = parsed.mesh.colors;
  const bool are_bytes = std::any_of(colors.begin(), colors.end(), [](const Eigen::Vector3f& c) {
    return c.maxCoeff() > kBeyondWhite;
  });
  if (are_bytes) {
    parsed.warnings.emplace_back("colours above 2: taken as values from 0 to 255");
  }
  for (Eigen::Vector3f& c : colors) {
    if (are_bytes) c /= 255;
    c = c.cwiseMax(0).cwiseMin(1);
  }
}

void fill_in_colors(ParsedMesh& parsed, const std::vector<size_t>& colored) {
  const size_t count = parsed.positions.size();
  if (colored.empty() || colored.size() == count) return;
  std::vector<Eigen::Vector3f> colors(count, Eigen::Vector3f::Ones());
  for (size_t k = 0; k < colored.size(); ++k) colors[colored[k]] = parsed.mesh.colors[k];
  parsed.mesh.colors = std::move(colors);
  parsed.warnings.push_back(std::to_string(count - colored.size()) + " of " +
                            std::to_string(count) + " vertices state no colour: white");
}

void append_polygon(const std::vector<uint32_t>& corners,
                    const std::vector<Eigen::Vector3d>& positions,
                    std::vector<std::array<uint32_t, 3>>& triangles) {
  constexpr size_t kMost = 1024;
  const auto is_placed = [&](uint32_t corner) { return corner < positions.size(); };
  if (corners.size() > 3 && corners.size() <= kMost &&
      std::all_of(corners.begin(), corners.end(), is_placed)) {
    const FlatPolygon polygon(corners, positions);
    if (!polygon.is_convex()) {
      const auto ears = ears_of(corners, polygon);
      triangles.insert(triangles.end(), ears.begin(), ears.end());
      if (!ears.empty()) return;
    }
  }
  for (size_t k = 2; k < corners.size(); ++k) {
    triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }
}

size_t PlaceNumbers::Hash::operator()(const Eigen::Vector3d& place) const {
  uint64_t hash = 0;
  for (const double c : place) {
    hash = (hash ^ std::bit_cast<uint64_t>(c)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 29;
  }
  return hash;
}

std::string_view expect_line(TextLines& lines, std::string_view what) {
  constexpr size_t kLongest = size_t{4} << 20;
  const auto line = lines.next_data();
  if (!line) lines.fail(Defect::Truncated, "the file ends before " + std::string(what));
  if (line->size() > kLongest) {
    throw LimitError(printable(lines.path()) + ": a line is longer than 4 MiB");
  }
  return *line;
}

std::vector<Eigen::Vector3d> opposite_corners(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d low = points.front();
  Eigen::Vector3d high = points.front();
  for (const Eigen::Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {low, high};
}

void check_significance(ParsedMesh& parsed, const std::filesystem::path& path) {
  const std::vector<Eigen::Vector3d> corners = opposite_corners(parsed.positions);
  const std::string odd = check_significance(path, {corners[0], corners[1]}, parsed.digits);
  if (!odd.empty()) parsed.warnings.push_back(odd);
}

float internal_sigma(float sigma_in_file, const Frame& frame) {
  return sigma_in_file >= 0 && std::isfinite(sigma_in_file)
             ? static_cast<float>(sigma_in_file / frame.scale)
             : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace cgs
