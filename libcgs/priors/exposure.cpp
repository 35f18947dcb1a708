// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/exposure.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/shown_pixel.h"

namespace cgs {

namespace {

std::vector<Eigen::Vector3d> shared_surface(const View& a,
                                            const ViewPriors& priors_of_a,
                                            const View& b,
                                            const ViewPriors& priors_of_b) {
  constexpr double kMostSamples = 100000;  // of the pixels of a view, on a grid
  const double pixels = static_cast<double>(a.camera.width) * a.camera.height;
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kMostSamples))));
  std::vector<Eigen::Vector3d> out;
  for (int y = 0; y < a.camera.height; y += step) {
    for (int x = 0; x < a.camera.width; x += step) {
      if (priors_of_a.origin(x, y) != DepthOrigin::Measured) continue;
      const Eigen::Vector3d point = a.camera.unproject(x + 0.5, y + 0.5, priors_of_a.depth(x, y));
      if (confirmed_pixel(b.camera, priors_of_b, point)) out.push_back(point);
    }
  }
  return out;
}

/// The middle value; of an even number of them the mean of the two in the middle.
float middle(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// Makes the exposure that most views of a group have the common one.
void keep_most_as_they_are(ExposureGains& exposure) {
  const std::vector<Eigen::Vector3f> gains = exposure.gain;
  for (size_t v = 0; v < gains.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      std::vector<float> logs;
      for (size_t other = 0; other < gains.size(); ++other) {
        if (exposure.group[other] == exposure.group[v]) logs.push_back(std::log(gains[other][c]));
      }
      if (logs.size() > 1) exposure.gain[v][c] /= std::exp(middle(std::move(logs)));
    }
  }
}

}  // namespace

ExposureGains exposure_gains(const Scene& scene, const std::vector<ViewPriors>& priors) {
  std::vector<const View*> views;
  for (const int i : scene.input) views.push_back(&scene.views[static_cast<size_t>(i)]);
  require(priors.size() == views.size(),
          "exposure_gains: number of priors must be that of the input views",
          priors.size());
  ExposureGains out = exposure_gains(views, neighbouring_pairs(scene), [&](size_t a, size_t b) {
    return shared_surface(*views[a], priors[a], *views[b], priors[b]);
  });
  keep_most_as_they_are(out);
  if (out.difference() < kLeastDifference) {
    std::fill(out.gain.begin(), out.gain.end(), Eigen::Vector3f::Ones());
  }
  return out;
}

}  // namespace cgs
