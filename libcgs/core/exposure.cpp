// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/QR>
#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

constexpr size_t kFewestSamples = 100;  // below, a pair of views says nothing

/// Colour where a view shows a point, bilinear; NaN where it is clipped or nearly black.
Eigen::Vector3f color_at(const View& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d uvz = view.camera.project(point);
  const float u =
      std::clamp(static_cast<float>(uvz.x() - 0.5), 0.0f, static_cast<float>(view.image.width - 1));
  const float v = std::clamp(
      static_cast<float>(uvz.y() - 0.5), 0.0f, static_cast<float>(view.image.height - 1));
  const int x = std::min(static_cast<int>(u), std::max(0, view.image.width - 2));
  const int y = std::min(static_cast<int>(v), std::max(0, view.image.height - 2));
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int k = 0; k < 4; ++k) {
    const int i = std::min(x + (k & 1), view.image.width - 1);
    const int j = std::min(y + (k >> 1), view.image.height - 1);
    const Eigen::Vector3f& color = view.image(i, j);
    if (!tells_exposure(color)) return Eigen::Vector3f::Constant(std::nanf(""));
    const float weight =
        (1 - std::abs(u - static_cast<float>(i))) * (1 - std::abs(v - static_cast<float>(j)));
    sum += weight * color.unaryExpr([](float c) { return linear_from_srgb(c); });
  }
  return sum;
}

/// How the linear light of two pictures of the same places compares.
class LightRatios {
 public:
  void add(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    for (size_t c = 0; c < 3; ++c) {
      const auto channel = static_cast<Eigen::Index>(c);
      logs_.at(c).push_back(std::log(a[channel] / b[channel]));
    }
  }
  size_t size() const { return logs_[0].size(); }
  /// Of ln(a / b), per channel; the order is another one afterwards. \pre size() > 0
  std::array<float, 3> medians() { return {median(logs_[0]), median(logs_[1]), median(logs_[2])}; }

 private:
  std::array<std::vector<float>, 3> logs_;
};

/// What two views say about each other.
struct Pair {
  size_t a = 0;
  size_t b = 0;
  std::array<float, 3> log_ratio = {};  ///< Median of ln(colour in a / colour in b), per channel.
  size_t samples = 0;
};

Pair compare(std::span<const View* const> views,
             const SharedSurface& shared,
             std::pair<size_t, size_t> which) {
  Pair out{which.first, which.second};
  LightRatios ratios;
  for (const Eigen::Vector3d& point : shared(out.a, out.b)) {
    const Eigen::Vector3f of_a = color_at(*views[out.a], point);
    const Eigen::Vector3f of_b = color_at(*views[out.b], point);
    if (of_a.cwiseQuotient(of_b).minCoeff() > 0) ratios.add(of_a, of_b);
  }
  out.samples = ratios.size();
  if (out.samples > 0) out.log_ratio = ratios.medians();
  return out;
}

/// Least squares with the smallest norm, which makes the sum in each connected group 0.
Eigen::VectorXd log_gains(const std::vector<Pair>& pairs, size_t views, size_t channel) {
  const auto n = static_cast<Eigen::Index>(views);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const Pair& pair : pairs) {
    const auto a = static_cast<Eigen::Index>(pair.a);
    const auto b = static_cast<Eigen::Index>(pair.b);
    const auto weight = static_cast<double>(pair.samples);
    const double difference = -weight * double{pair.log_ratio.at(channel)};  // gain a - gain b
    normal(a, a) += weight;
    normal(b, b) += weight;
    normal(a, b) -= weight;
    normal(b, a) -= weight;
    right[a] += difference;
    right[b] -= difference;
  }
  return normal.completeOrthogonalDecomposition().solve(right);
}

}  // namespace

bool tells_exposure(const Eigen::Vector3f& color) {
  constexpr float kDarkest = 0.04f;
  constexpr float kBrightest = 0.98f;
  return color.minCoeff() > kDarkest && color.maxCoeff() < kBrightest;
}

ExposureGains exposure_gains(std::span<const View* const> views,
                             const std::vector<std::pair<size_t, size_t>>& compared,
                             const SharedSurface& shared) {
  for (const View* view : views) {
    require(!view->image.empty(), "exposure_gains: every view must have its image", view->name);
  }
  ExposureGains out;
  out.gain.assign(views.size(), Eigen::Vector3f::Ones());
  out.samples.assign(views.size(), 0);
  std::vector<Pair> pairs(compared.size());
  tbb::parallel_for(size_t(0), compared.size(), [&](size_t i) {
    pairs[i] = compare(views, shared, compared[i]);
  });
  std::erase_if(pairs, [](const Pair& p) { return p.samples < kFewestSamples; });
  DisjointSets groups(views.size());
  for (const Pair& pair : pairs) {
    out.samples[pair.a] += pair.samples;
    out.samples[pair.b] += pair.samples;
    groups.join(static_cast<uint32_t>(pair.a), static_cast<uint32_t>(pair.b));
  }
  for (size_t v = 0; v < views.size(); ++v) {
    out.group.push_back(groups.root(static_cast<uint32_t>(v)));
  }
  if (pairs.empty()) return out;
  for (size_t c = 0; c < 3; ++c) {
    const Eigen::VectorXd logs = log_gains(pairs, views.size(), c);
    for (size_t v = 0; v < views.size(); ++v) {
      out.gain[v][static_cast<Eigen::Index>(c)] =
          static_cast<float>(std::exp(logs[static_cast<Eigen::Index>(v)]));
    }
  }
  return out;
}

float ExposureGains::difference() const {
  float most = 1;
  for (size_t a = 0; a < gain.size(); ++a) {
    for (size_t b = 0; b < gain.size(); ++b) {
      if (group[a] == group[b]) most = std::max(most, gain[a].cwiseQuotient(gain[b]).maxCoeff());
    }
  }
  return most - 1;
}

Eigen::Vector3f matching_gain(const ColorImage& picture,
                              const ColorImage& wanted,
                              const MaskMap& use) {
  LightRatios ratios;
  for (size_t i = 0; i < picture.data.size(); ++i) {
    const Eigen::Vector3f& from = picture.data[i];
    const Eigen::Vector3f& to = wanted.data[i];
    if (use.data[i] != 1 || !tells_exposure(from) || !tells_exposure(to)) continue;
    ratios.add(to.unaryExpr(&linear_from_srgb), from.unaryExpr(&linear_from_srgb));
  }
  if (ratios.size() < kFewestSamples) return Eigen::Vector3f::Ones();
  const std::array<float, 3> logs = ratios.medians();
  return {std::exp(logs[0]), std::exp(logs[1]), std::exp(logs[2])};
}

void apply_exposure(View& view) {
  if (view.exposure == Eigen::Vector3f::Ones() && view.response == PhotoResponse{}) return;
  apply_response(view.image, view.response);
  apply_gain(view.image, view.exposure);
  for (Eigen::Vector3f& color : view.image.data) color = color.cwiseMin(1.0f);
}

void apply_gain(ColorImage& image, const Eigen::Vector3f& gain) {
  for (int c = 0; c < 3; ++c) {
    if (gain[c] == 1) continue;
    tbb::parallel_for(size_t(0), image.data.size(), [&](size_t i) {
      image.data[i][c] = srgb_from_linear(gain[c] * linear_from_srgb(image.data[i][c]));
    });
  }
}

}  // namespace cgs
