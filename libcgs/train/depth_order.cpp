// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

constexpr int kOrderPatch = 32;      // edge [pixels]
constexpr int kPairsPerPatch = 128;  // that are drawn, of which some are kept

struct DrawnPair {
  size_t a, b;
  size_t patch;
};

// Differences of given depth below this are noise: a twentieth of most of its range.
float least_gap(const DepthMap& given) {
  std::vector<float> values;
  std::copy_if(given.data.begin(), given.data.end(), std::back_inserter(values), [](float g) {
    return std::isfinite(g);
  });
  if (values.empty()) return 0;
  const float high = quantile(values, 0.9);
  return 0.05f * (high - quantile(values, 0.1));
}

// Pairs within patches whose given depths differ, the same ones every time.
std::vector<DrawnPair> drawn_pairs(const DepthMap& given) {
  const float gap = least_gap(given);
  const int columns = (given.width + kOrderPatch - 1) / kOrderPatch;
  const int rows = (given.height + kOrderPatch - 1) / kOrderPatch;
  std::vector<DrawnPair> out;
  for (int p = 0; p < columns * rows; ++p) {
    const int left = p % columns * kOrderPatch;
    const int top = p / columns * kOrderPatch;
    const auto width = static_cast<uint64_t>(std::min(kOrderPatch, given.width - left));
    const auto height = static_cast<uint64_t>(std::min(kOrderPatch, given.height - top));
    for (int k = 0; k < kPairsPerPatch; ++k) {
      const auto draw = static_cast<uint64_t>(p) * kPairsPerPatch + static_cast<uint64_t>(k);
      const auto pixel = [&](uint64_t bits) {
        return given.index(left + static_cast<int>(bits % width),
                           top + static_cast<int>((bits >> 16) % height));
      };
      const uint64_t bits = random_number(draw);
      const size_t a = pixel(bits & 0xffffffff);
      const size_t b = pixel(bits >> 32);
      // Not for NaN either.
      if (!(std::abs(given.data[a] - given.data[b]) > gap)) continue;
      out.push_back({a, b, static_cast<size_t>(p)});
    }
  }
  return out;
}

// How many pairs of a patch, or of all, are measured in the order of their given depth.
struct Votes {
  int same = 0, opposite = 0;
  int all() const { return same + opposite; }
};

int sign_of_order(const DepthMap& given, const DrawnPair& pair) {
  return given.data[pair.a] < given.data[pair.b] ? 1 : -1;
}

}  // namespace

DepthOrders depth_orders(const DepthMap& given, const DepthMap& measured) {
  constexpr int kLeastVotes = 8;
  constexpr double kLeastAgreement = 0.7;
  constexpr double kLeastStep = 0.005;  // of log depth, for a measured order that is no noise
  require(!given.empty() && same_size(given, measured),
          "depth_orders: given and measured depth must have one size",
          measured.width);
  const std::vector<DrawnPair> drawn = drawn_pairs(given);
  std::vector<Votes> votes(drawn.empty() ? 0 : drawn.back().patch + 1);
  Votes total;
  for (const DrawnPair& pair : drawn) {
    const double step = std::log(double(measured.data[pair.b]) / double(measured.data[pair.a]));
    if (!(std::abs(step) > kLeastStep)) continue;
    const bool same = (step > 0) == (sign_of_order(given, pair) > 0);
    for (Votes* v : {&votes[pair.patch], &total}) ++(same ? v->same : v->opposite);
  }
  DepthOrders out;
  out.is_disparity = total.opposite > total.same;
  for (const DrawnPair& pair : drawn) {
    const bool a_measured = std::isfinite(measured.data[pair.a]);
    if (a_measured && std::isfinite(measured.data[pair.b])) continue;  // nothing to be told
    const Votes& patch = votes[pair.patch];
    const int agreeing = out.is_disparity ? patch.opposite : patch.same;
    if (patch.all() >= kLeastVotes && agreeing < kLeastAgreement * patch.all()) continue;
    const bool a_nearer = (sign_of_order(given, pair) > 0) != out.is_disparity;
    out.pairs.push_back({static_cast<uint32_t>(a_nearer ? pair.a : pair.b),
                         static_cast<uint32_t>(a_nearer ? pair.b : pair.a)});
  }
  return out;
}

double depth_order(const DepthMap& depth,
                   std::span<const DepthOrder> order,
                   double weight,
                   Raster<float>& gradient) {
  constexpr double kMargin = 1e-4;  // of log depth
  if (weight == 0 || order.empty()) return 0;
  Raster<float>& to_depth = gradient_like(depth, gradient);
  const double scale = weight / double(order.size());
  double sum = 0;
  // One after the other: several pairs may have a pixel in common.
  for (const DepthOrder& pair : order) {
    const auto near = double(depth.data.at(pair.nearer));
    const auto far = double(depth.data.at(pair.farther));
    const double excess = std::log(near / far) + kMargin;
    if (!(excess > 0)) continue;  // nor where one is unknown
    sum += excess;
    to_depth.data[pair.nearer] += float(scale / near);
    to_depth.data[pair.farther] -= float(scale / far);
  }
  return scale * sum;
}

}  // namespace cgs
