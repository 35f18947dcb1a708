// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/depth_layers.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct Run {
  double least = 0;
  double sum = 0;
  double count = 0;

  double mean() const { return sum / count; }
};

double merge_cost(const Run& a, const Run& b) {
  const double d = a.mean() - b.mean();
  return a.count * b.count / (a.count + b.count) * d * d;
}

std::vector<Run> runs_of_equal(const DepthMap& depth, int step) {
  std::vector<double> samples;
  for (int y = 0; y < depth.height; y += step) {
    for (int x = 0; x < depth.width; x += step) {
      if (depth(x, y) > 0) samples.push_back(1 / double(depth(x, y)));
    }
  }
  std::sort(samples.begin(), samples.end());
  std::vector<Run> runs;
  for (const double s : samples) {
    if (runs.empty() || runs.back().least != s) runs.push_back({s, 0, 0});
    runs.back().sum += s;
    runs.back().count += 1;
  }
  return runs;
}

// A quadratic number of steps, which ten thousand samples can afford.
void merge_to(std::vector<Run>& runs, size_t count) {
  while (runs.size() > count) {
    size_t best = 0;
    double least = merge_cost(runs[0], runs[1]);
    for (size_t i = 1; i + 1 < runs.size(); ++i) {
      const double cost = merge_cost(runs[i], runs[i + 1]);
      if (cost < least) {
        least = cost;
        best = i;
      }
    }
    runs[best].sum += runs[best + 1].sum;
    runs[best].count += runs[best + 1].count;
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(best) + 1);
  }
}

}  // namespace

void DepthLayersOptions::validate() const {
  require(count >= 1 && count <= 255, "DepthLayersOptions.count must be in [1, 255]", count);
  require(sample_step >= 1, "DepthLayersOptions.sample_step must be >= 1", sample_step);
}

Raster<uint8_t> depth_layers(const DepthMap& depth, const DepthLayersOptions& options) {
  options.validate();
  constexpr double kMostSamples = 10'000;
  const int coarsest = static_cast<int>(std::sqrt(double(depth.data.size()) / kMostSamples));
  std::vector<Run> runs = runs_of_equal(depth, std::max(options.sample_step, coarsest));
  merge_to(runs, static_cast<size_t>(options.count));
  Raster<uint8_t> layers(depth.width, depth.height, 0);
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (!(depth.data[i] > 0)) continue;
    const double inverse = 1 / double(depth.data[i]);
    for (size_t k = 1; k < runs.size() && inverse >= runs[k].least; ++k) {
      layers.data[i] = static_cast<uint8_t>(k);
    }
  }
  return layers;
}

}  // namespace cgs
