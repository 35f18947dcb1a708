// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pixel_matches.h"

#include <cmath>

namespace cgs {

std::vector<PixelMatch> pixel_matches(const Camera& first,
                                      const ViewPriors& own,
                                      const Camera& second,
                                      const ViewPriors& other) {
  std::vector<PixelMatch> out;
  for (int y = 0; y < own.origin.height; ++y) {
    for (int x = 0; x < own.origin.width; ++x) {
      if (own.origin(x, y) != DepthOrigin::Measured) continue;
      const Eigen::Vector3d uvz =
          second.project(first.unproject(x + 0.5, y + 0.5, double(own.depth(x, y))));
      if (!second.sees(uvz)) continue;
      const auto u = static_cast<int>(uvz.x());
      const auto v = static_cast<int>(uvz.y());
      if (!other.origin.contains(u, v) || other.origin(u, v) != DepthOrigin::Measured) continue;
      const double tolerance =
          3 * std::hypot(double(own.sigma(x, y)), double(other.sigma(u, v))) + 0.005 * uvz.z();
      if (std::abs(double(other.depth(u, v)) - uvz.z()) > tolerance) continue;
      out.push_back({static_cast<int32_t>(own.depth.index(x, y)),
                     static_cast<float>(uvz.x()),
                     static_cast<float>(uvz.y())});
    }
  }
  return out;
}

}  // namespace cgs
