// SPDX-License-Identifier: GPL-3.0-or-later
// How far off completed depth is, by its way to the nearest measured pixel: measured pixels are
// hidden and completed. AdjoiningOptions::way rests on this.
//
// usage: completion_accuracy MODEL [MODEL...]
//
// A MODEL is a folder that `cgs train` or `cgs run` wrote. Hidden are squares of 2 to 34 pixels, a
// tenth of each view. Prints, per way, how many of the hidden pixels fall under it, quantiles of
// their relative error and of the error in standard deviations, and the share within three of them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <vector>

#include "convert/model/model.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/priors/depth_completion.h"
#include "libcgs/priors/estimated_depth.h"

namespace {

using cgs::DepthOrigin;
using cgs::MaskMap;
using cgs::ViewPriors;

constexpr std::array<float, 9> kWays = {1, 2, 3, 4, 6, 8, 12, 16, 24};

// Hides squares of measured pixels until a tenth of the view is hidden. 1 = hidden
MaskMap hide_squares(ViewPriors& priors, uint64_t seed) {
  const int w = priors.depth.width;
  const int h = priors.depth.height;
  MaskMap hidden(w, h, 0);
  constexpr std::array<int, 5> kSides = {2, 4, 8, 16, 34};
  const size_t wanted = hidden.data.size() / 10;
  size_t count = 0;
  for (uint64_t n = 0; count < wanted && n < 100000; ++n) {
    const int side = kSides.at(n % kSides.size());
    const int x0 = static_cast<int>(cgs::random_number(seed + 2 * n) % static_cast<uint64_t>(w));
    const int y0 =
        static_cast<int>(cgs::random_number(seed + 2 * n + 1) % static_cast<uint64_t>(h));
    for (int y = y0; y < std::min(h, y0 + side); ++y) {
      for (int x = x0; x < std::min(w, x0 + side); ++x) {
        if (priors.origin(x, y) != DepthOrigin::Measured) continue;
        priors.origin(x, y) = DepthOrigin::Unknown;
        hidden(x, y) = 1;
        ++count;
      }
    }
  }
  return hidden;
}

struct Errors {
  std::vector<float> relative;
  std::vector<float> in_sigmas;
};

void print_row(const char* way, Errors& errors) {
  if (errors.relative.empty()) return;
  const auto within = std::count_if(
      errors.in_sigmas.begin(), errors.in_sigmas.end(), [](float e) { return e <= 3; });
  std::printf("%6s %8zu | %6.3f %6.3f %6.3f %6.3f | %5.2f %5.2f | %5.1f\n",
              way,
              errors.relative.size(),
              100 * double(cgs::quantile(errors.relative, 0.5)),
              100 * double(cgs::quantile(errors.relative, 0.68)),
              100 * double(cgs::quantile(errors.relative, 0.95)),
              100 * double(cgs::quantile(errors.relative, 0.98)),
              double(cgs::quantile(errors.in_sigmas, 0.68)),
              double(cgs::quantile(errors.in_sigmas, 0.95)),
              100 * double(within) / double(errors.in_sigmas.size()));
}

// What was filled in forgets it, sky stays.
void forget_filled(ViewPriors& priors) {
  for (DepthOrigin& origin : priors.origin.data) {
    if (origin != DepthOrigin::Measured && origin != DepthOrigin::Sky)
      origin = DepthOrigin::Unknown;
  }
}

void run(const char* folder) {
  cgs::Model model = cgs::read_model(folder);
  cgs::load_images(model.scene, model.scene.input);
  std::array<Errors, kWays.size() + 1> by_way;
  const auto view = [&](size_t k) -> const cgs::View& {
    return model.scene.views[static_cast<size_t>(model.scene.input[k])];
  };
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const ViewPriors& truth = model.priors[k];
    ViewPriors known = truth;
    forget_filled(known);
    const MaskMap hidden = hide_squares(known, 1000003 * k);
    std::vector<cgs::CompletionWitness> witnesses;
    for (size_t j = 0; j < model.priors.size(); ++j) {
      if (j != k) witnesses.push_back({&view(j).camera, &model.priors[j]});
    }
    cgs::complete_depth(known, view(k), {}, witnesses);
    std::vector<uint8_t> is_told(hidden.data.size(), 0);
    for (size_t way = 0; way <= kWays.size(); ++way) {
      ViewPriors marked = known;
      const bool is_last = way == kWays.size();
      if (!is_last) cgs::mark_estimated(marked, view(k), {.way = kWays.at(way)});
      for (size_t i = 0; i < hidden.data.size(); ++i) {
        const bool adjoins = is_last || marked.origin.data[i] == DepthOrigin::Completed;
        if (hidden.data[i] == 0 || is_told[i] != 0 || !adjoins) continue;
        is_told[i] = 1;
        const float off = std::abs(known.depth.data[i] - truth.depth.data[i]);
        if (!std::isfinite(off)) continue;
        by_way.at(way).relative.push_back(off / truth.depth.data[i]);
        by_way.at(way).in_sigmas.push_back(off / known.sigma.data[i]);
      }
    }
  }
  std::printf(
      "%s\n  way <=  pixels | %% off: 50 %%  68 %%  95 %%  98 %% | sigmas 68 %%, 95 %% | %% < 3\n",
      folder);
  for (size_t way = 0; way < kWays.size(); ++way) {
    print_row(std::to_string(static_cast<int>(kWays.at(way))).c_str(), by_way.at(way));
  }
  print_row("more", by_way.back());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: completion_accuracy MODEL [MODEL...]\n");
    return 2;
  }
  try {
    for (int i = 1; i < argc; ++i) run(argv[i]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "completion_accuracy: %s\n", error.what());
    return 1;
  }
}
