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
  const bool fit = colors.size() == parsed.positions.size();
  size_t bad = 0;
  for (size_t i = 0; i < colors.size(); ++i) {
    if (colors[i].allFinite()) continue;
    const bool is_dropped = fit && !parsed.positions[i].allFinite();
    bad += is_dropped ? 0 : 1;
    for (float& c : colors[i]) c = std::isfinite(c) ? c : 0.0f;
  }
  if (bad > 0) {
    parsed.warnings.push_back("colours of " + counted(bad, "vertex") + " are not finite: 0");
  }
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

void CornerColors::add(uint32_t vertex, const Eigen::Vector3f& color) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  constexpr float kOtherColor = 0.1f;  // more than compression or shading makes of one
  if (!color.allFinite()) return;
  if (vertex >= colors_.size()) {
    const size_t size = std::max<size_t>(size_t{vertex} + 1, colors_.size() + colors_.size() / 2);
    colors_.resize(size, Eigen::Vector3f::Constant(kNone));
  }
  Eigen::Vector3f& known = colors_[vertex];
  if (known.hasNaN()) known = color;
  if ((known - color).cwiseAbs().maxCoeff() > kOtherColor) ++recolored_;
}

void CornerColors::settle(ParsedMesh& parsed) {
  std::vector<size_t> colored;
  colors_.resize(parsed.positions.size(),
                 Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  parsed.mesh.colors.clear();
  for (size_t v = 0; v < colors_.size(); ++v) {
    if (colors_[v].hasNaN()) continue;
    colored.push_back(v);
    parsed.mesh.colors.push_back(colors_[v]);
  }
  settle_colors(parsed);
  fill_in_colors(parsed, colored);
  if (recolored_ == 0) return;
  parsed.warnings.push_back("surfaces of different colours meet at " + std::to_string(recolored_) +
                            " corners; vertices have one, that of the first");
}

std::string counted(size_t count, const std::string& what) {
  if (count == 1) return "1 " + what;
  const bool is_vertex = what.ends_with("ex");
  return std::to_string(count) + " " +
         (is_vertex ? what.substr(0, what.size() - 2) + "ices" : what + "s");
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
  const auto is_lost = [&](uint32_t corner) {
    return is_placed(corner) && !positions[corner].allFinite();
  };
  const auto lost = std::find_if(corners.begin(), corners.end(), is_lost);
  if (corners.size() > 3 && corners.size() <= kMost && lost == corners.end() &&
      std::all_of(corners.begin(), corners.end(), is_placed)) {
    const FlatPolygon polygon(corners, positions);
    if (!polygon.is_convex()) {
      const auto ears = ears_of(corners, polygon);
      triangles.insert(triangles.end(), ears.begin(), ears.end());
      if (!ears.empty()) return;
    }
  }
  const size_t n = corners.size();
  const size_t first = lost == corners.end() ? 0 : static_cast<size_t>(lost - corners.begin());
  for (size_t k = 2; k < n; ++k) {
    triangles.push_back({corners[first], corners[(first + k - 1) % n], corners[(first + k) % n]});
  }
}

namespace {

constexpr uint32_t kDropped = 0xffffffff;

// Keeps the entries whose new number is known, in their order.
template <typename T>
void keep_numbered(std::vector<T>& values, const std::vector<uint32_t>& number) {
  if (values.empty()) return;
  size_t kept = 0;
  for (size_t v = 0; v < number.size(); ++v) {
    if (number[v] != kDropped) values[kept++] = values[v];
  }
  values.resize(kept);
}

// \return how many are gone
size_t drop_faces_of_dropped(TriangleMesh& mesh, const std::vector<uint32_t>& number) {
  size_t kept = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    std::array<uint32_t, 3> face{};
    for (size_t k = 0; k < 3; ++k) face.at(k) = number[mesh.faces[f].at(k)];
    if (std::find(face.begin(), face.end(), kDropped) != face.end()) continue;
    mesh.faces[kept] = face;
    if (!mesh.provenance.empty()) mesh.provenance[kept] = mesh.provenance[f];
    ++kept;
  }
  const size_t dropped = mesh.faces.size() - kept;
  mesh.faces.resize(kept);
  if (!mesh.provenance.empty()) mesh.provenance.resize(kept);
  return dropped;
}

void settle_normals(ParsedMesh& parsed) {
  size_t bad = 0;
  for (size_t v = 0; v < parsed.mesh.normals.size(); ++v) {
    Eigen::Vector3f& normal = parsed.mesh.normals[v];
    if (normal.allFinite()) continue;
    bad += parsed.positions[v].allFinite() ? 1 : 0;
    normal.setZero();
  }
  if (bad == 0) return;
  parsed.warnings.push_back("normals of " + counted(bad, "vertex") + " are not finite: none");
}

size_t first_dropped(const std::vector<uint32_t>& number) {
  return size_t(std::find(number.begin(), number.end(), kDropped) - number.begin());
}

}  // namespace

void drop_unusable(ParsedMesh& parsed, const std::filesystem::path& path) {
  settle_normals(parsed);
  const size_t vertices = parsed.positions.size();
  const size_t faces = parsed.mesh.faces.size();
  std::vector<uint32_t> number(vertices, kDropped);
  uint32_t kept = 0;
  for (size_t v = 0; v < vertices; ++v) {
    if (parsed.positions[v].allFinite()) number[v] = kept++;
  }
  const size_t dropped = vertices - kept;
  if (dropped == 0) return;
  const size_t dropped_faces = drop_faces_of_dropped(parsed.mesh, number);
  const bool is_cloud = faces == 0;
  if (is_cloud ? 2 * dropped > vertices : 2 * dropped_faces > faces) {
    const auto share = [](size_t part, size_t all) {
      return std::to_string(part) + " of " + std::to_string(all);
    };
    throw BadInput(Defect::Value,
                   path,
                   "vertices that are not finite: " + share(dropped, vertices) + ", the first is " +
                       std::to_string(first_dropped(number) + 1) +
                       (is_cloud ? "" : ", faces there: " + share(dropped_faces, faces)) +
                       "; that is more than half");
  }
  keep_numbered(parsed.positions, number);
  keep_numbered(parsed.mesh.normals, number);
  keep_numbered(parsed.mesh.colors, number);
  keep_numbered(parsed.mesh.support, number);
  keep_numbered(parsed.mesh.sigma, number);
  parsed.warnings.push_back(
      "dropped " + counted(dropped, "vertex") + " of " + std::to_string(vertices) +
      (dropped == 1 ? " that is" : " that are") + " not finite" +
      (dropped_faces > 0 ? ", and " + counted(dropped_faces, "face") + " there" : ""));
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
