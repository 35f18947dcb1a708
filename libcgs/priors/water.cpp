// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/water.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>

#include <Eigen/Cholesky>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/remedy.h"

namespace cgs {

WaterResidual water_residual(const WaterMatch& match,
                             int channel,
                             const WaterChannel& water,
                             WaterLight light) {
  const double behind_a = std::exp(-water.backscatter * match.range_a);
  const double behind_b = std::exp(-water.backscatter * match.range_b);
  const double own_a = match.light_a[channel] - water.veil * (1 - behind_a);
  const double own_b = match.light_b[channel] - water.veil * (1 - behind_b);
  // The transmissions over their norm, by their ratio: each may be too small for a number.
  const double farther = match.range_a - match.range_b;
  double ratio = std::exp(water.attenuation * farther);  // t_b / t_a
  if (light == WaterLight::Lamp) {
    const double falloff = match.range_a / match.range_b;
    ratio *= falloff * falloff;
  }
  const double a = 1 / std::sqrt(1 + ratio * ratio);
  const double b = 1 / std::sqrt(1 + 1 / (ratio * ratio));
  WaterResidual out;
  out.value = b * own_a - a * own_b;
  out.gradient = {farther * a * b * (a * own_a + b * own_b),
                  water.veil * (a * match.range_b * behind_b - b * match.range_a * behind_a),
                  a * (1 - behind_b) - b * (1 - behind_a)};
  return out;
}

namespace {

/// What the fit minimises, in units in which the median range is 1: half the sum of squares, those
/// of matches under a robust loss.
class ChannelFit {
 public:
  ChannelFit(const WaterEvidence& scaled, int channel, WaterLight light)
      : evidence_(scaled), channel_(channel), light_(light) {}

  /// From three starts, the end that leaves the smallest differences.
  WaterChannel best() {
    constexpr std::array<double, 3> kStarts = {0.05, 0.5, 2};  // optical depths
    WaterChannel out;
    double least = INFINITY;
    for (const double start : kStarts) {
      const WaterChannel end = minimised({start, start, kMiddleVeil}, Loss::Huber);
      const double left = mean_difference(end);
      if (left < least) {
        least = left;
        out = end;
      }
    }
    return minimised(out, Loss::Tukey);
  }

  /// Standard deviations at the end of best().
  Eigen::Vector3d sigma(const WaterChannel& at) const {
    const Normal normal = normal_at(at, Loss::Tukey);
    std::map<size_t, Eigen::Vector3d> of_group;
    for (const WaterMatch& match : evidence_.matches) {
      const WaterResidual r = residual(match, at);
      const double weight = weight_of(r.value, Loss::Tukey) / (scale_ * scale_);
      of_group.try_emplace(match.group, Eigen::Vector3d::Zero()).first->second +=
          weight * r.value * r.gradient;
    }
    Eigen::Matrix3d spread = normal.of_priors;
    for (const auto& [group, sum] : of_group) spread += sum * sum.transpose();
    const Eigen::Matrix3d inverse = normal.matrix.inverse();
    return (inverse * spread * inverse).diagonal().cwiseMax(0.0).cwiseSqrt();
  }

  double scale() const { return scale_; }

 private:
  enum class Loss : uint8_t { Huber, Tukey };

  struct Normal {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d of_priors = Eigen::Matrix3d::Zero();  ///< The part of it without matches.
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double cost = 0;

    /// A term value^2 / 2.
    void add_prior(double value, const Eigen::Vector3d& gradient) {
      cost += value * value / 2;
      of_priors += gradient * gradient.transpose();
      right += value * gradient;
    }
  };

  static constexpr double kMiddleVeil = 0.3;
  static constexpr double kThickest = 12;  // optical depths over the median range
  static constexpr double kHuber = 1.345;  // of the scale: 95 % as efficient as least squares
  static constexpr double kTukey = 4.685;  // likewise

  double loss_of(double value, Loss loss) const {
    const double r = std::abs(value) / scale_;
    if (loss == Loss::Huber) return r <= kHuber ? r * r / 2 : kHuber * (r - kHuber / 2);
    const double inside = 1 - std::min(1.0, r * r / (kTukey * kTukey));
    return kTukey * kTukey / 6 * (1 - inside * inside * inside);
  }

  double weight_of(double value, Loss loss) const {
    const double r = std::abs(value) / scale_;
    if (loss == Loss::Huber) return r <= kHuber ? 1 : kHuber / r;
    const double inside = 1 - std::min(1.0, r * r / (kTukey * kTukey));
    return inside * inside;
  }

  // What is known without matches, or tells what these cannot.
  void add_priors(const WaterChannel& at, Normal& out) const {
    constexpr double kAttenuationSigma = 2;  // optical depths
    constexpr double kDifferenceSigma = 1;
    constexpr double kVeilSigma = 0.5;
    constexpr double kOpenSigma = 0.02;
    out.add_prior((at.attenuation - 0.5) / kAttenuationSigma, {1 / kAttenuationSigma, 0, 0});
    out.add_prior((at.backscatter - at.attenuation) / kDifferenceSigma,
                  {-1 / kDifferenceSigma, 1 / kDifferenceSigma, 0});
    out.add_prior((at.veil - kMiddleVeil) / kVeilSigma, {0, 0, 1 / kVeilSigma});
    if (evidence_.open_water) {
      const double open = (*evidence_.open_water)[channel_];
      out.add_prior((at.veil - open) / kOpenSigma, {0, 0, 1 / kOpenSigma});
    }
    const double dark_sigma = std::max(scale_, 1e-3);
    for (const DarkLight& dark : evidence_.darkest) {
      const double behind = std::exp(-at.backscatter * dark.range);
      const double over = at.veil * (1 - behind) - dark.light[channel_];
      if (over <= 0) continue;  // a surface adds light, how much is not known
      out.add_prior(over / dark_sigma,
                    Eigen::Vector3d(0, at.veil * dark.range * behind, 1 - behind) / dark_sigma);
    }
  }

  Normal normal_at(const WaterChannel& at, Loss loss) const {
    Normal out;
    add_priors(at, out);
    out.matrix = out.of_priors;
    const double square = scale_ * scale_;
    for (const WaterMatch& match : evidence_.matches) {
      const WaterResidual r = residual(match, at);
      const double weight = weight_of(r.value, loss) / square;
      out.cost += loss_of(r.value, loss);
      out.matrix += weight * r.gradient * r.gradient.transpose();
      out.right += weight * r.value * r.gradient;
    }
    return out;
  }

  double cost_at(const WaterChannel& at, Loss loss) const {
    Normal priors;
    add_priors(at, priors);
    double out = priors.cost;
    for (const WaterMatch& match : evidence_.matches) {
      out += loss_of(residual(match, at).value, loss);
    }
    return out;
  }

  double mean_difference(const WaterChannel& at) const {
    double sum = 0;
    for (const WaterMatch& match : evidence_.matches) {
      sum += std::abs(residual(match, at).value);
    }
    return sum / static_cast<double>(evidence_.matches.size());
  }

  // 1.4826 times the median absolute difference: the sigma of normally distributed ones.
  double scale_at(const WaterChannel& at) const {
    constexpr double kLeast = 1e-5;  // far below the steps of a photograph
    std::vector<double> all;
    for (const WaterMatch& match : evidence_.matches) {
      all.push_back(std::abs(residual(match, at).value));
    }
    return std::max(kLeast, 1.4826 * median(all));
  }

  static WaterChannel moved(const WaterChannel& from, const Eigen::Vector3d& step) {
    return {std::clamp(from.attenuation - step.x(), 0.0, kThickest),
            std::clamp(from.backscatter - step.y(), 0.0, kThickest),
            std::clamp(from.veil - step.z(), 0.0, 1.0)};
  }

  // What lies at the end of what is possible and would go on beyond it stays.
  static void hold_at_bounds(const WaterChannel& at, Normal& normal) {
    const std::array<double, 3> values = {at.attenuation, at.backscatter, at.veil};
    for (int i = 0; i < 3; ++i) {
      const double value = values.at(static_cast<size_t>(i));
      const double most = i == 2 ? 1 : kThickest;
      const bool leaves =
          (value <= 0 && normal.right[i] > 0) || (value >= most && normal.right[i] < 0);
      if (!leaves) continue;
      normal.matrix.row(i).setZero();
      normal.matrix.col(i).setZero();
      normal.matrix(i, i) = 1;
      normal.right[i] = 0;
    }
  }

  // A step of Levenberg and Marquardt; false where none makes the cost smaller.
  bool improve(WaterChannel& at, double& damping, Loss loss) const {
    constexpr double kMostDamping = 1e8;
    constexpr double kEnough = 1e-9;  // of the cost
    Normal normal = normal_at(at, loss);
    hold_at_bounds(at, normal);
    for (; damping < kMostDamping; damping *= 4) {
      Eigen::Matrix3d damped = normal.matrix;
      damped.diagonal() *= 1 + damping;
      const WaterChannel next = moved(at, damped.ldlt().solve(normal.right));
      const double cost = cost_at(next, loss);
      if (!(cost < normal.cost)) continue;
      at = next;
      damping = std::max(1e-9, damping / 8);
      return cost < (1 - kEnough) * normal.cost;
    }
    return false;
  }

  WaterChannel minimised(WaterChannel at, Loss loss) {
    constexpr int kScales = 6;
    constexpr int kSteps = 25;
    for (int k = 0; k < kScales; ++k) {
      scale_ = scale_at(at);
      double damping = 1e-3;
      for (int step = 0; step < kSteps && improve(at, damping, loss); ++step) {
      }
    }
    return at;
  }

  WaterResidual residual(const WaterMatch& match, const WaterChannel& at) const {
    return water_residual(match, channel_, at, light_);
  }

  const WaterEvidence& evidence_;
  int channel_;
  WaterLight light_;
  double scale_ = 1;
};

double median_range(const std::vector<WaterMatch>& matches) {
  std::vector<double> ranges;
  for (const WaterMatch& m : matches) ranges.insert(ranges.end(), {m.range_a, m.range_b});
  return median(ranges);
}

double usual_ratio(const std::vector<WaterMatch>& matches) {
  std::vector<double> ratios;
  for (const WaterMatch& m : matches) {
    ratios.push_back(std::max(m.range_a, m.range_b) / std::min(m.range_a, m.range_b));
  }
  return quantile(ratios, 0.9);
}

WaterEvidence in_ranges_of(const WaterEvidence& evidence, double range) {
  WaterEvidence out = evidence;
  for (WaterMatch& match : out.matches) {
    match.range_a /= range;
    match.range_b /= range;
  }
  for (DarkLight& dark : out.darkest) dark.range /= range;
  return out;
}

// \param doubt  sigma of attenuation times the median range
void refuse_doubt(const Eigen::Vector3d& doubt, const WaterEstimate& found) {
  if (doubt.maxCoeff() <= kMostDoubt) return;
  constexpr std::array<const char*, 3> kNames = {"red", "green", "blue"};
  Eigen::Index worst = 0;
  doubt.maxCoeff(&worst);
  std::array<char, 400> text{};
  std::snprintf(text.data(),
                text.size(),
                "ranges vary too little to tell the water: how much %s light it takes away is "
                "known to %.0f %% only, and has to be to %.0f %%; nine of ten places are seen from "
                "ranges within %.1f %% of each other. Add photographs of the same surface from "
                "nearer or farther away, or leave the water in",
                kNames.at(static_cast<size_t>(worst)),
                100 * doubt.maxCoeff(),
                100 * kMostDoubt,
                100 * (found.range_ratio - 1));
  throw WithRemedy<NumericalError>(Remedy::NoWater, text.data());
}

/// The fits of all channels, in units in which the median range is 1.
struct WaterFit {
  std::array<WaterChannel, 3> best;
  std::array<Eigen::Vector3d, 3> sigma;
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
};

WaterFit fit_channels(const WaterEvidence& scaled, WaterLight light) {
  WaterFit out;
  tbb::parallel_for(size_t{0}, size_t{3}, [&](size_t c) {
    ChannelFit fit(scaled, static_cast<int>(c), light);
    out.best.at(c) = fit.best();
    out.sigma.at(c) = fit.sigma(out.best.at(c));
    out.residual[static_cast<Eigen::Index>(c)] = fit.scale();
  });
  return out;
}

size_t count_of_groups(const std::vector<WaterMatch>& matches) {
  std::set<size_t> groups;
  for (const WaterMatch& match : matches) groups.insert(match.group);
  return groups.size();
}

// Both have as many parameters: what is left decides, if it is more than chance and blur make.
bool explains_more(const WaterFit& lamp, const WaterFit& everywhere, size_t residuals) {
  constexpr double kNats = 10;
  constexpr double kSmaller = 0.05;
  const double gain = (everywhere.residual.array() / lamp.residual.array()).log().sum();
  return gain / 3 >= kSmaller && gain * static_cast<double>(residuals) >= kNats;
}

// In ranges of the matches.
Water water_of(const WaterFit& fit, double range) {
  Water out;
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<size_t>(c);
    out.attenuation[c] = fit.best.at(k).attenuation / range;
    out.backscatter[c] = fit.best.at(k).backscatter / range;
    out.veil[c] = fit.best.at(k).veil;
    out.attenuation_sigma[c] = fit.sigma.at(k).x() / range;
    out.backscatter_sigma[c] = fit.sigma.at(k).y() / range;
    out.veil_sigma[c] = fit.sigma.at(k).z();
  }
  return out;
}

}  // namespace

WaterEstimate fit_water(const WaterEvidence& evidence) {
  constexpr size_t kFewest = 300;
  WaterEstimate out;
  out.matches = evidence.matches.size();
  if (out.matches < kFewest) {
    throw WithRemedy<NumericalError>(
        Remedy::NoWater,
        "only " + std::to_string(out.matches) +
            " places are measured by two photographs, and telling the water needs " +
            std::to_string(kFewest) + "; let photographs overlap, or leave the water in");
  }
  out.range = median_range(evidence.matches);
  out.range_ratio = usual_ratio(evidence.matches);
  const WaterEvidence scaled = in_ranges_of(evidence, out.range);
  WaterFit fit = fit_channels(scaled, WaterLight::Everywhere);
  const WaterFit with_lamp = fit_channels(scaled, WaterLight::Lamp);
  const bool has_lamp = explains_more(with_lamp, fit, count_of_groups(scaled.matches));
  if (has_lamp) fit = with_lamp;
  Water water = water_of(fit, out.range);
  if (has_lamp) water.lamp_range = out.range;
  out.residual = fit.residual;
  refuse_doubt(water.attenuation_sigma * out.range, out);
  constexpr double kSure = 2;  // standard deviations
  const double least = (water.attenuation - kSure * water.attenuation_sigma).maxCoeff();
  if (has_lamp || 1 - std::exp(-least * out.range) >= kLeastLoss) out.water = water;
  return out;
}

WaterEstimate estimate_water(const Scene& scene, const std::vector<ViewPriors>& priors) {
  return fit_water(water_evidence(scene, priors));
}

void take_out_water(const ViewPriors& priors, const Water& water, View& view) {
  DepthMap depth = priors.depth;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (priors.origin.data[i] == DepthOrigin::Sky) depth.data[i] = 0;
  }
  view.image = without_water(view.image, view.camera, depth, water);
}

void take_out_water(const std::vector<ViewPriors>& priors, Scene& scene) {
  if (!scene.water) return;
  for (size_t k = 0; k < priors.size(); ++k) {
    take_out_water(priors[k], *scene.water, scene.views[static_cast<size_t>(scene.input[k])]);
  }
}

}  // namespace cgs
