// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/unmeasured.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

#include "libcgs/core/angle_between.h"

namespace cgs {

namespace {

enum class Reason : uint8_t { None, Unseen, Hidden, Even, Wide, Unconfirmed };

// Whether the pixels around one differ by less than noise of photographs does.
bool is_even(const ColorImage& image, int x, int y) {
  constexpr int kRadius = 3;
  constexpr float kNoise = 0.01f;  // standard deviation of the brightness
  float sum = 0;
  float squares = 0;
  int count = 0;
  for (int v = std::max(0, y - kRadius); v <= std::min(image.height - 1, y + kRadius); ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min(image.width - 1, x + kRadius); ++u) {
      const float level = image(u, v).mean();
      sum += level;
      squares += level * level;
      ++count;
    }
  }
  const float mean = sum / static_cast<float>(count);
  return squares / static_cast<float>(count) - mean * mean < kNoise * kNoise;
}

bool is_asked_for(const View& view, const ViewPriors& priors, int x, int y) {
  const DepthOrigin origin = priors.origin(x, y);
  return view.is_usable(x, y) && origin != DepthOrigin::Measured && !shows_no_surface(origin);
}

class Reasons {
 public:
  Reasons(const Scene& scene, const std::vector<ViewPriors>& priors)
      : scene_(scene), priors_(priors) {}

  Reason of(size_t i, int x, int y) const {
    const View& view = this->view(i);
    if (!is_asked_for(view, priors_[i], x, y)) return Reason::None;
    const float depth = priors_[i].depth(x, y);
    const bool is_placed = !std::isnan(depth);
    const Sight sight =
        is_placed ? sight_of(i, view.camera.unproject(x + 0.5, y + 0.5, double{depth})) : Sight{};
    if (is_placed && sight.seen == 0) return Reason::Unseen;
    if (is_placed && sight.hidden == sight.seen) return Reason::Hidden;
    if (is_even(view.image, x, y)) return Reason::Even;
    constexpr double kWide = 40 * std::numbers::pi / 180;
    if (is_placed && sight.least_angle > kWide) return Reason::Wide;
    return Reason::Unconfirmed;
  }

 private:
  struct Sight {
    int seen = 0;    // other views that have the point in their picture
    int hidden = 0;  // of these, those that measured something before it
    double least_angle = std::numbers::pi;
  };

  const View& view(size_t i) const { return scene_.views[static_cast<size_t>(scene_.input[i])]; }

  Sight sight_of(size_t i, const Eigen::Vector3d& point) const {
    constexpr double kBefore = 0.03;  // of the depth
    Sight out;
    const Eigen::Vector3d to_here = view(i).camera.center() - point;
    for (size_t j = 0; j < priors_.size(); ++j) {
      if (j == i) continue;
      const View& other = view(j);
      const Eigen::Vector3d uvz = other.camera.project(point);
      if (!other.camera.sees(uvz)) continue;
      const int u = static_cast<int>(uvz.x());
      const int v = static_cast<int>(uvz.y());
      if (!other.is_usable(u, v)) continue;
      ++out.seen;
      const bool is_hidden = priors_[j].origin(u, v) == DepthOrigin::Measured &&
                             double{priors_[j].depth(u, v)} < (1 - kBefore) * uvz.z();
      out.hidden += is_hidden ? 1 : 0;
      const Eigen::Vector3d to_there = other.camera.center() - point;
      if (!is_hidden) out.least_angle = std::min(out.least_angle, angle_between(to_here, to_there));
    }
    return out;
  }

  const Scene& scene_;
  const std::vector<ViewPriors>& priors_;
};

UnmeasuredShares shares_of(const Raster<Reason>& reasons, const View& view) {
  const auto masked = std::count(view.valid.data.begin(), view.valid.data.end(), 0);
  const double valid = double(reasons.data.size()) - double(masked);
  const auto share = [&](Reason reason) {
    const auto count = std::count(reasons.data.begin(), reasons.data.end(), reason);
    return valid > 0 ? double(count) / valid : 0;
  };
  return {share(Reason::Unseen),
          share(Reason::Hidden),
          share(Reason::Even),
          share(Reason::Wide),
          share(Reason::Unconfirmed)};
}

}  // namespace

std::vector<UnmeasuredShares> unmeasured_shares(const Scene& scene,
                                                const std::vector<ViewPriors>& priors) {
  const Reasons reasons(scene, priors);
  std::vector<UnmeasuredShares> out;
  for (size_t i = 0; i < priors.size(); ++i) {
    Raster<Reason> of_view(priors[i].depth.width, priors[i].depth.height, Reason::None);
    tbb::parallel_for(0, of_view.height, [&](int y) {
      for (int x = 0; x < of_view.width; ++x) of_view(x, y) = reasons.of(i, x, y);
    });
    out.push_back(shares_of(of_view, scene.views[static_cast<size_t>(scene.input[i])]));
  }
  return out;
}

}  // namespace cgs
