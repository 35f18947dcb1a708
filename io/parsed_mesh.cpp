// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/parsed_mesh.h"

#include <bit>
#include <cmath>
#include <limits>

namespace cgs {

void append_fan(const std::vector<uint32_t>& corners,
                std::vector<std::array<uint32_t, 3>>& triangles) {
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
