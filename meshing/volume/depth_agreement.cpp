// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/depth_agreement.h"

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
constexpr int kPixelStep = 7;   // [pixels]
constexpr size_t kFewest = 50;  // comparisons that tell something
constexpr double kFewestShare = 0.05;
constexpr double kAgrees = 0.05;

// Around 1, and what centimetres, inches, feet … are to metres.
constexpr std::array<double, 23> kFactors = {0.001, 0.01, 0.0254, 0.1, 0.3048, 0.5,  0.667, 0.8,
                                             0.9,   0.95, 0.975,  1,   1.025,  1.05, 1.1,   1.25,
                                             1.5,   2,    3.281,  10,  39.37,  100,  1000};

/// Some frames at some of their pixels, and what these measured of what others did.
///
/// Every frame is asked for when it is needed and let go: of full size, only one is there at a
/// time.
class Comparison {
 public:
  Comparison(const std::vector<Camera>& cameras, const std::function<TsdfView(size_t)>& frame)
      : cameras_(cameras), frame_(frame) {
    const size_t count = std::min(kFrames, cameras.size());
    for (size_t n = 0; n < count; ++n) {
      const size_t i = n * cameras.size() / count;
      sampled_.push_back(sampled(frame(i)));
      for (size_t f = 0; f < kFactors.size(); ++f) {
        const size_t k = partner(i, kFarthest * kFactors.at(f) * sampled_.back().median_depth);
        if (k != i) asked_[k].push_back({n, f});
      }
    }
  }

  /// Per factor the median of what depth multiplied by it is off; NaN if too little is shown twice.
  std::map<double, double> off() {
    std::array<Found, kFactors.size()> found;
    for (const auto& [k, pairs] : asked_) {
      const TsdfView to = frame_(k);
      for (const Pair& pair : pairs) {
        compare(sampled_[pair.from], to, kFactors.at(pair.factor), found.at(pair.factor));
      }
    }
    std::map<double, double> out;
    for (size_t f = 0; f < kFactors.size(); ++f) {
      auto& [off, looked_at] = found.at(f);
      const bool is_enough =
          off.size() >= kFewest && double(off.size()) >= kFewestShare * double(looked_at);
      out[kFactors.at(f)] = is_enough ? median(off) : std::numeric_limits<double>::quiet_NaN();
    }
    return out;
  }

 private:
  static constexpr double kFarthest = 1.5;  // partner [depths]

  // A pixel with depth.
  struct Pixel {
    int x = 0;
    int y = 0;
    float depth = 0;
  };
  // What is kept of a frame.
  struct Sampled {
    Camera camera;
    std::vector<Pixel> pixels;
    double median_depth = 0;
  };
  // Indices of a sampled frame and a factor.
  struct Pair {
    size_t from = 0;
    size_t factor = 0;
  };
  struct Found {
    std::vector<double> off;
    size_t looked_at = 0;
  };

  static Sampled sampled(const TsdfView& view) {
    Sampled out;
    out.camera = view.camera;
    for (int y = 0; y < view.depth.height; y += kPixelStep) {
      for (int x = 0; x < view.depth.width; x += kPixelStep) {
        if (view.depth(x, y) > 0) out.pixels.push_back({x, y, view.depth(x, y)});
      }
    }
    std::vector<double> values;
    for (const float z : view.depth.data) {
      if (z > 0) values.push_back(double(z));
    }
    if (!values.empty()) out.median_depth = median(values);
    return out;
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

  // Adds what pixels of a frame are off in its partner.
  static void compare(const Sampled& from, const TsdfView& to, double factor, Found& found) {
    constexpr double kHidden = 0.7;  // of the depth: the partner shows something before it
    found.looked_at += from.pixels.size();
    for (const Pixel& pixel : from.pixels) {
      const double z = factor * double(pixel.depth);
      const Eigen::Vector3d uvz =
          to.camera.project(from.camera.unproject(pixel.x + 0.5, pixel.y + 0.5, z));
      if (!to.camera.sees(uvz)) continue;
      const double measured = factor * double(to.depth(int(uvz.x()), int(uvz.y())));
      if (measured > kHidden * uvz.z()) found.off.push_back(std::abs(measured / uvz.z() - 1));
    }
  }

  const std::vector<Camera>& cameras_;
  const std::function<TsdfView(size_t)>& frame_;
  std::vector<Sampled> sampled_;
  std::map<size_t, std::vector<Pair>> asked_;  // per partner
};

}  // namespace

DepthAgreement depth_agreement(const std::vector<Camera>& cameras,
                               const std::function<TsdfView(size_t)>& frame) {
  constexpr double kClearly = 1.5;
  constexpr double kNoise = 0.01;  // of sensors
  const auto is_worse = [&](double off, double than) {
    return !(off <= std::max(kNoise, kClearly * than));
  };
  const std::map<double, double> off = Comparison(cameras, frame).off();
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
