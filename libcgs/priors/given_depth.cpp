// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/given_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "libcgs/core/error.h"
#include "libcgs/priors/depth_fit.h"
#include "libcgs/priors/directions.h"

namespace cgs {

namespace {

constexpr float kNotMeasured = std::numeric_limits<float>::quiet_NaN();
constexpr double kWorstSensor = 0.2;  // relative scatter beyond which depth is not metric
constexpr double kNoFit = 1;          // scatter that stands for none
constexpr double kSameUnit = 0.02;    // by which scales differ that are meant to be one

std::string percent(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2g %%", 100 * share);
  return text.data();
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

// Pixels that both a view and its given depth measure; y is depth, or its inverse for disparity.
std::vector<FitPoint> points_of(const View& view, const ViewPriors& priors, DepthKind kind) {
  constexpr size_t kMost = 20000;
  const DepthMap& given = view.given_depth;
  std::vector<FitPoint> out;
  const size_t step = given.data.size() / kMost + 1;  // prime to most widths, or as good as
  for (size_t i = 0; i < given.data.size(); i += step) {
    if (priors.origin.data[i] != DepthOrigin::Measured || !(given.data[i] > 0)) continue;
    const auto z = double(priors.depth.data[i]);
    const auto sigma = double(priors.sigma.data[i]);
    const auto x = double(given.data[i]);
    if (kind == DepthKind::Disparity) {
      out.push_back({x, 1 / z, sigma / (z * z)});
    } else {
      out.push_back({x, z, sigma});
    }
  }
  return out;
}

class Fitter {
 public:
  Fitter(const Scene& scene, const std::vector<ViewPriors>& priors)
      : scene_(scene), priors_(priors) {
    out_.views.resize(priors.size());
  }

  GivenDepth run() {
    scale_ = fit_scale(all_points());
    lines_[0] = lines_of(DepthKind::Relative);
    lines_[1] = lines_of(DepthKind::Disparity);
    out_.kind = scene_.depth_kind == DepthKind::Unknown ? likely_kind() : scene_.depth_kind;
    if (out_.kind == DepthKind::Metric) {
      take_scale();
    } else if (out_.kind != DepthKind::Unknown) {
      take_lines();
    } else {
      leave_out(
          "neither as metric nor as relative depth nor as disparity do they fit what the "
          "photographs show");
    }
    return std::move(out_);
  }

 private:
  const View& view(size_t k) const { return scene_.views[static_cast<size_t>(scene_.input[k])]; }
  bool has_depth(size_t k) const { return !view(k).given_depth.empty(); }

  std::vector<FitPoint> all_points() const {
    std::vector<FitPoint> out;
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (!has_depth(k)) continue;
      const std::vector<FitPoint> own = points_of(view(k), priors_[k], DepthKind::Metric);
      out.insert(out.end(), own.begin(), own.end());
    }
    return out;
  }

  std::vector<std::optional<LineFit>> lines_of(DepthKind kind) const {
    std::vector<std::optional<LineFit>> out(priors_.size());
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (has_depth(k)) out[k] = fit_line(points_of(view(k), priors_[k], kind));
    }
    return out;
  }

  double mean_scatter(const std::vector<std::optional<LineFit>>& lines) const {
    double sum = 0;
    double count = 0;
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (!has_depth(k)) continue;
      sum += lines[k] ? std::min(lines[k]->scatter, kNoFit) : kNoFit;
      count += 1;
    }
    return sum / count;
  }

  bool states_metres() const {
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (has_depth(k) && !view(k).depth_states_metres) return false;
    }
    return true;
  }

  // World units per metre.
  double world_scale() const { return scale_->scale * scene_.frame.scale; }
  // Units in which the cameras were stated, per value.
  double stated_scale() const { return world_scale() / scene_.world_per_stated_unit; }

  DepthKind likely_kind() const {
    const double relative = mean_scatter(lines_[0]);
    const double disparity = mean_scatter(lines_[1]);
    const double best = std::min(relative, disparity);
    if (scale_) {
      constexpr double kFits = 0.05;
      constexpr double kAboutAsWell = 1.5;
      const bool may_be_metric = states_metres() || std::abs(std::log(stated_scale())) < kSameUnit;
      const bool fits =
          scale_->scatter < kFits && scale_->scatter < std::max(kAboutAsWell * best, kSensorSigma);
      if (may_be_metric && fits) return DepthKind::Metric;
    }
    if (!(best < kNoFit)) return DepthKind::Unknown;
    return relative < disparity ? DepthKind::Relative : DepthKind::Disparity;
  }

  // By how much the scale of each view is off that of all, in logarithms.
  std::vector<double> scales_of_views() const {
    std::vector<double> logs;
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (!has_depth(k)) continue;
      const auto own = fit_scale(points_of(view(k), priors_[k], DepthKind::Metric));
      if (own) logs.push_back(std::log(own->scale / scale_->scale));
    }
    return logs;
  }

  // Relative standard deviation of the scale: views err as one, so they are what is counted.
  double scale_sigma(const std::vector<double>& logs) const {
    double squares = 0;
    for (const double log : logs) squares += log * log;
    const auto n = double(logs.size());
    // Of a single view nothing tells how far it errs as a whole: its pixels must do.
    const double of_mean = n > 1 ? std::sqrt(squares / (n * (n - 1))) : scale_->scatter;
    return std::hypot(kSensorSigma, of_mean);
  }

  // Whether the scale is the one that the cameras were stated in. How its pixels scatter tells
  // nothing of how far a single view errs as a whole, and would excuse any other unit.
  bool is_stated_scale(double sigma, size_t views) const {
    const double within = views > 1 ? kSigmas * sigma : std::min(kSigmas * sigma, kSameUnit);
    return std::abs(std::log(stated_scale())) < within;
  }

  void leave_out(const std::string& why) {
    out_.kind = DepthKind::Unknown;
    out_.remarks.push_back("the depth files were left out: " + why);
  }

  void take_scale() {
    const Frame& frame = scene_.frame;
    const bool is_told = scene_.depth_kind == DepthKind::Metric || states_metres();
    double internal_per_metre = 0;
    double scatter = kSensorSigma;
    if (scale_ && scale_->scatter > kWorstSensor) {
      leave_out("as metric depth they are " + percent(scale_->scatter) +
                " from what the photographs show");
      return;
    }
    if (scale_) {
      const std::vector<double> of_views = scales_of_views();
      const double sigma = scale_sigma(of_views);
      const bool is_stated = is_stated_scale(sigma, of_views.size());
      const double metres = 1 / (is_stated ? scene_.world_per_stated_unit : world_scale());
      internal_per_metre = is_stated ? scene_.world_per_stated_unit / frame.scale : scale_->scale;
      scatter = std::max(scatter, scale_->scatter);
      if (is_told) {
        out_.metres_per_unit = metres;
        out_.metres_sigma = sigma * metres;
      }
      out_.found = (is_told ? "metric, " + number(1 / world_scale()) + " m per scene unit, "
                            : std::string("in units of the scene, ")) +
                   percent(scale_->scatter) + " from what the photographs show";
      const bool is_other = frame.has_metric_scale() && is_told &&
                            std::abs(std::log(frame.metres_per_unit / metres)) > kSigmas * sigma;
      if (is_other) {
        out_.remarks.push_back("the scene states " + number(frame.metres_per_unit) +
                               " m per unit, its depth files " + number(metres) +
                               "; what the scene states was kept");
      }
    } else if (frame.has_metric_scale()) {
      internal_per_metre = 1 / (frame.metres_per_unit * frame.scale);
    } else {
      leave_out("the photographs show too little to find their scale");
      return;
    }
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (!has_depth(k)) continue;
      out_.views[k] = {view(k).given_depth, scatter};
      for (float& z : out_.views[k].depth.data) {
        z = static_cast<float>(double(z) * internal_per_metre);
      }
    }
  }

  void take_lines() {
    const bool is_disparity = out_.kind == DepthKind::Disparity;
    const auto& lines = lines_[is_disparity ? 1 : 0];
    double worst = 0;
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (!has_depth(k)) continue;
      if (!lines[k]) {
        out_.remarks.push_back("the depth file of view " + printable(view(k).name) +
                               " was left out: it does not fit what the photographs show");
        continue;
      }
      worst = std::max(worst, lines[k]->scatter);
      out_.views[k] = {view(k).given_depth, lines[k]->scatter};
      for (float& z : out_.views[k].depth.data) {
        const double value = lines[k]->at(double(z));
        z = value > 0 ? static_cast<float>(is_disparity ? 1 / value : value) : kNotMeasured;
      }
    }
    const bool is_used = worst > 0;
    if (!is_used) out_.kind = DepthKind::Unknown;
    if (is_used) {
      out_.found = std::string(is_disparity ? "disparity" : "depth") +
                   " up to scale and offset, within " + percent(worst) +
                   " of what the photographs show";
    }
  }

  static constexpr double kSigmas = 3;

  const Scene& scene_;
  const std::vector<ViewPriors>& priors_;
  std::optional<LineFit> scale_;                              // internal units per metre
  std::array<std::vector<std::optional<LineFit>>, 2> lines_;  // relative, disparity
  GivenDepth out_;
};

}  // namespace

bool is_at_depth_edge(const DepthMap& depth, int x, int y) {
  constexpr float kJump = 0.05f;  // relative
  const float z = depth(x, y);
  for (const auto& [dx, dy] : kNeighbors) {
    if (!depth.contains(x + dx, y + dy)) continue;
    if (std::abs(depth(x + dx, y + dy) - z) > kJump * z) return true;
  }
  return false;
}

GivenDepth fit_given_depth(const Scene& scene, const std::vector<ViewPriors>& priors) {
  const bool is_given = std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
    return !scene.views[static_cast<size_t>(i)].given_depth.empty();
  });
  if (is_given) return Fitter(scene, priors).run();
  GivenDepth none;
  none.views.resize(priors.size());
  return none;
}

void merge_sensor_depth(const FittedDepth& sensor, const View& view, ViewPriors& priors) {
  constexpr double kSigmas = 3;
  constexpr float kConfidence = 0.5f;  // of a pixel that no other view confirms
  // COLMAP's was made of the same photographs: no second witness where these measured by
  // themselves.
  const bool is_of_photographs = view.depth_path.extension() == ".bin";
  const double relative = std::max(kSensorSigma, sensor.scatter);
  for (int y = 0; y < sensor.depth.height; ++y) {
    for (int x = 0; x < sensor.depth.width; ++x) {
      const auto z = double(sensor.depth(x, y));
      if (!(z > 0) || !view.is_usable(x, y) || is_at_depth_edge(sensor.depth, x, y)) continue;
      const double sigma = relative * z;
      if (priors.origin(x, y) == DepthOrigin::Measured) {
        if (is_of_photographs) continue;
        const auto own = double(priors.depth(x, y));
        const auto own_sigma = double(priors.sigma(x, y));
        if (std::abs(own - z) > kSigmas * std::hypot(own_sigma, sigma)) continue;
        const double w = 1 / (own_sigma * own_sigma);
        const double v = 1 / (sigma * sigma);
        priors.depth(x, y) = static_cast<float>((w * own + v * z) / (w + v));
        priors.sigma(x, y) = static_cast<float>(1 / std::sqrt(w + v));
        continue;
      }
      priors.depth(x, y) = static_cast<float>(z);
      priors.sigma(x, y) = static_cast<float>(sigma);
      priors.confidence(x, y) = kConfidence;
      priors.origin(x, y) = DepthOrigin::Measured;
    }
  }
}

}  // namespace cgs
