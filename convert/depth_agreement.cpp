// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/depth_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr size_t kFrames = 8;
constexpr int kStep = 7;        // [pixels]
constexpr size_t kFewest = 50;  // comparisons that tell something
constexpr double kFewestShare = 0.05;
constexpr double kAgrees = 0.05;

// Around 1, and what centimetres, inches, feet … are to metres.
constexpr std::array<double, 23> kFactors = {0.001, 0.01, 0.0254, 0.1, 0.3048, 0.5,  0.667, 0.8,
                                             0.9,   0.95, 0.975,  1,   1.025,  1.05, 1.1,   1.25,
                                             1.5,   2,    3.281,  10,  39.37,  100,  1000};

/// Some frames, and what they measured of what others did.
class Comparison {
 public:
  Comparison(const std::vector<Camera>& cameras, const std::function<TsdfView(size_t)>& frame)
      : cameras_(cameras), frame_(frame) {}

  /// Median of what depth multiplied by `factor` is off; NaN if too little is shown twice.
  double off(double factor) {
    std::vector<double> all;
    size_t looked_at = 0;
    const size_t count = std::min(kFrames, cameras_.size());
    for (size_t n = 0; n < count; ++n) {
      const size_t i = n * cameras_.size() / count;
      const size_t k = partner(i, kFarthest * factor * frame(i).median_depth);
      if (k != i) looked_at += compare(i, k, factor, all);
    }
    if (all.size() < kFewest || double(all.size()) < kFewestShare * double(looked_at)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return median(all);
  }

 private:
  static constexpr double kFarthest = 1.5;  // partner [depths]

  // What is kept of a frame.
  struct Frame {
    Camera camera;
    DepthMap depth;
    double median_depth = 0;
  };

  const Frame& frame(size_t i) {
    const auto found = frames_.find(i);
    if (found != frames_.end()) return found->second;
    TsdfView view = frame_(i);
    std::vector<double> values;
    for (const float z : view.depth.data) {
      if (z > 0) values.push_back(double(z));
    }
    const double middle = values.empty() ? 0 : median(values);
    return frames_.emplace(i, Frame{view.camera, std::move(view.depth), middle}).first->second;
  }

  // The frame from as far off as allowed that looks the same way; itself if there is none.
  size_t partner(size_t i, double farthest) const {
    constexpr double kSameDirection = 0.5;  // cosine
    const Eigen::Vector3d axis = cameras_[i].world_from_cam.linear().col(2);
    const auto distance = [&](size_t k) {
      return (cameras_[k].center() - cameras_[i].center()).norm();
    };
    size_t best = i;
    for (size_t k = 0; k < cameras_.size(); ++k) {
      if (axis.dot(cameras_[k].world_from_cam.linear().col(2)) < kSameDirection) continue;
      if (distance(k) <= farthest && distance(k) > distance(best)) best = k;
    }
    return best;
  }

  // Appends what pixels of a frame are off in its partner. \return how many were looked at
  size_t compare(size_t i, size_t k, double factor, std::vector<double>& off) {
    constexpr double kHidden = 0.7;  // of the depth: the partner shows something before it
    const Frame& from = frame(i);
    const Frame& to = frame(k);
    size_t looked_at = 0;
    for (int y = 0; y < from.depth.height; y += kStep) {
      for (int x = 0; x < from.depth.width; x += kStep) {
        const double z = factor * double(from.depth(x, y));
        if (!(z > 0)) continue;
        ++looked_at;
        const Eigen::Vector3d uvz = to.camera.project(from.camera.unproject(x + 0.5, y + 0.5, z));
        if (!to.camera.sees(uvz)) continue;
        const double measured = factor * double(to.depth(int(uvz.x()), int(uvz.y())));
        if (measured > kHidden * uvz.z()) off.push_back(std::abs(measured / uvz.z() - 1));
      }
    }
    return looked_at;
  }

  const std::vector<Camera>& cameras_;
  const std::function<TsdfView(size_t)>& frame_;
  std::map<size_t, Frame> frames_;
};

}  // namespace

DepthAgreement depth_agreement(const std::vector<Camera>& cameras,
                               const std::function<TsdfView(size_t)>& frame) {
  Comparison comparison(cameras, frame);
  constexpr double kClearly = 1.5;
  constexpr double kNoise = 0.01;  // of sensors
  const auto is_worse = [&](double off, double than) {
    return !(off <= std::max(kNoise, kClearly * than));
  };
  std::map<double, double> off;
  for (const double factor : kFactors) off[factor] = comparison.off(factor);
  DepthAgreement out;
  out.off = off.at(1);
  double least = out.off;
  if (!std::isnan(out.off)) out.best_factor = 1;
  for (const auto& [factor, of_factor] : off) {
    if (!(of_factor < least || std::isnan(least)) || !is_worse(out.off, of_factor)) continue;
    least = of_factor;
    out.best_factor = factor;
  }
  out.shows_scale = out.off < kAgrees && out.best_factor >= 0.95 && out.best_factor <= 1.05 &&
                    is_worse(off.at(0.8), out.off) && is_worse(off.at(1.25), out.off);
  return out;
}

}  // namespace cgs
