// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/glb_file.h"
#include "tests/support/temp_dir.h"

namespace cgs::test {

using Triangle = std::array<Eigen::Vector3d, 3>;

// Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
inline Eigen::Vector3d nearest_on(const Triangle& t, const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = t[1] - t[0];
  const Eigen::Vector3d ac = t[2] - t[0];
  const double d1 = ab.dot(p - t[0]);
  const double d2 = ac.dot(p - t[0]);
  if (d1 <= 0 && d2 <= 0) return t[0];
  const double d3 = ab.dot(p - t[1]);
  const double d4 = ac.dot(p - t[1]);
  if (d3 >= 0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(p - t[2]);
  const double d6 = ac.dot(p - t[2]);
  if (d6 >= 0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  }
  const double sum = va + vb + vc;
  return t[0] + vb / sum * ab + vc / sum * ac;
}

// The largest distance of places on some triangles to others, every pair of both tried.
inline double farthest(const std::vector<Triangle>& from, const std::vector<Triangle>& to) {
  std::mt19937 random(11);
  std::uniform_real_distribution<> part(0, 1);
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const Triangle& t = from[random() % from.size()];
    const double a = part(random);
    const double b = part(random) * (1 - a);
    const Eigen::Vector3d p =
        i % 3 == 0 ? t[0] : Eigen::Vector3d(t[0] + a * (t[1] - t[0]) + b * (t[2] - t[0]));
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle& other : to) least = std::min(least, (nearest_on(other, p) - p).norm());
    worst = std::max(worst, least);
  }
  return worst;
}

inline std::vector<Triangle> triangles_of_glb(const std::filesystem::path& path) {
  const Glb glb = parse_glb(read_bytes(path));
  std::vector<Triangle> out;
  for (const GlbPart& part : glb.parts) {
    for (const auto& face : part.faces) {
      Triangle& t = out.emplace_back();
      for (size_t k = 0; k < 3; ++k) {
        t.at(k) = in_world(glb, part.values.at("POSITION")[face.at(k)]);
      }
    }
  }
  return out;
}

inline double two_ways(const std::vector<Triangle>& a, const std::vector<Triangle>& b) {
  return std::max(farthest(a, b), farthest(b, a));
}

}  // namespace cgs::test
