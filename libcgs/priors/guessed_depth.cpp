// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/guessed_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/split_mix.h"
#include "libcgs/priors/depth_fit.h"
#include "libcgs/priors/directions.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

constexpr float kNoGuess = std::numeric_limits<float>::quiet_NaN();
constexpr double kFloor = 0.005;   // relative sigma that no guess goes below
constexpr double kDeviations = 3;  // of the fit: beyond, given or measured depth is wrong

// A guess and how far the next measured pixel is.
struct Bent {
  float depth = kNoGuess;  // [internal units]
  float distance = 0;      // [pixels]
};

// Fitted depth at one pixel, corrected by what is measured around it.
Bent bent_at(const FittedDepth& given, const ViewPriors& priors, int x, int y) {
  const DepthMap& fitted = given.depth;
  // Deviations beyond are no bend of the given depth: one of the two is wrong there.
  const double largest = kDeviations * std::max(kFloor, given.scatter);
  constexpr double kSameSurface = 0.1;  // relative change of the given depth
  constexpr double kReach = 0.25;       // of the diagonal: farther off, a deviation says little
  const auto rho = 1 / double(fitted(x, y));
  const double diagonal = std::hypot(fitted.width, fitted.height);
  double sum = 0;
  double weight = 1 / std::pow(kReach * diagonal, 2);  // of no deviation
  double nearest = diagonal;
  for (const auto& [dx, dy] : kDirections) {
    int u = x + dx;
    int v = y + dy;
    while (fitted.contains(u, v) && priors.origin(u, v) != DepthOrigin::Measured) {
      u += dx;
      v += dy;
    }
    if (!fitted.contains(u, v)) continue;
    const double distance = std::hypot(u - x, v - y);
    nearest = std::min(nearest, distance);
    if (!(fitted(u, v) > 0)) continue;
    const auto there = 1 / double(fitted(u, v));
    // Relative, so that a deviation by a factor stays one.
    const double deviation = 1 / double(priors.depth(u, v)) / there - 1;
    if (!(std::abs(deviation) < largest)) continue;
    const double trust = 1 - std::pow(deviation / largest, 2);
    const double change = std::log(there / rho) / kSameSurface;
    const double w = trust * trust * std::exp(-change * change) / (distance * distance);
    sum += w * deviation;
    weight += w;
  }
  const double corrected = rho * (1 + sum / weight);
  if (!(corrected > 0)) return {};
  return {static_cast<float>(1 / corrected), static_cast<float>(nearest)};
}

Raster<Bent> bend(const FittedDepth& fitted, const View& view, const ViewPriors& priors) {
  Raster<Bent> out(fitted.depth.width, fitted.depth.height, Bent{});
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      const bool wanted = view.is_usable(x, y) && fitted.depth(x, y) > 0 &&
                          priors.origin(x, y) != DepthOrigin::Measured;
      if (wanted) out(x, y) = bent_at(fitted, priors, x, y);
    }
  });
  return out;
}

// Errors of a way to fill pixels, by distance to what is known: bin k holds 2^k to 2^(k + 1).
class ErrorByDistance {
 public:
  static size_t bin(float distance) {
    const double log = std::log2(std::max(1.0, double(distance)));
    return std::min(kBins - 1, static_cast<size_t>(log));
  }
  void add(float distance, double error) { errors_[bin(distance)].push_back(error); }

  // Relative standard deviation per bin: from the median and, as tails count, from the 80th
  // percentile; beyond, it is more often what was hidden that errs. Bins with too few errors are as
  // bad as the one before, grown as a random walk.
  void settle() {
    constexpr size_t kFewestPixels = 200;
    constexpr double kGrowth = 1.41;
    double last = 0;
    for (size_t k = 0; k < kBins; ++k) {
      std::vector<double>& e = errors_[k];
      if (e.size() >= kFewestPixels) {
        std::sort(e.begin(), e.end());
        last = std::max(last, std::max(1.4826 * e[e.size() / 2], e[e.size() * 4 / 5] / 1.2816));
      } else {
        last *= kGrowth;
      }
      sigma_[k] = last;
    }
    // What comes before the first known bin is no better than that.
    for (size_t k = kBins - 1; k-- > 0;) {
      if (sigma_[k] == 0) sigma_[k] = sigma_[k + 1];
    }
  }
  double sigma(float distance) const { return sigma_[bin(distance)]; }

 private:
  static constexpr size_t kBins = 14;
  std::array<std::vector<double>, kBins> errors_;
  std::array<double, kBins> sigma_ = {};
};

// Large and small patches, in all somewhat more than a third of the picture.
bool is_in_patch(int x, int y, int width, int height) {
  constexpr uint64_t kOneIn = 5;
  for (const int parts : {6, 32}) {
    const int side = std::max(4, std::min(width, height) / parts);
    const uint64_t cell = static_cast<uint64_t>(y / side) * 4096 + static_cast<uint64_t>(x / side);
    if (random_number(cell * 64 + static_cast<uint64_t>(parts)) % kOneIn == 0) return true;
  }
  return false;
}

// How steep given depth is: the largest relative step to a neighbour [1 / pixel].
double steepness(const DepthMap& depth, int x, int y) {
  double out = 0;
  for (const auto& [dx, dy] : kNeighbors) {
    if (!depth.contains(x + dx, y + dy)) continue;
    const float there = depth(x + dx, y + dy);
    if (there > 0) out = std::max(out, std::abs(std::log(double(there / depth(x, y)))));
  }
  return out;
}

// How far guesses are off.
struct GuessErrors {
  ErrorByDistance by_distance;
  double edge_shift = 0;  // standard deviation of the places of depth edges [pixels]
};

// Hides measured pixels and looks how well guesses find them again.
GuessErrors try_out(const FittedDepth& fitted, const View& view, const ViewPriors& priors) {
  ViewPriors hidden = priors;
  for (int y = 0; y < priors.depth.height; ++y) {
    for (int x = 0; x < priors.depth.width; ++x) {
      if (!is_in_patch(x, y, priors.depth.width, priors.depth.height)) continue;
      hidden.origin(x, y) = DepthOrigin::Unknown;
    }
  }
  const Raster<Bent> bent = bend(fitted, view, hidden);
  const auto error_at = [&](size_t i) {
    const bool is_known = priors.origin.data[i] == DepthOrigin::Measured && bent.data[i].depth > 0;
    return is_known ? std::abs(std::log(double(bent.data[i].depth / priors.depth.data[i]))) : -1;
  };
  GuessErrors out;
  for (size_t i = 0; i < bent.data.size(); ++i) {
    if (error_at(i) >= 0) out.by_distance.add(bent.data[i].distance, error_at(i));
  }
  out.by_distance.settle();
  // What is left near depth edges, over their steepness, is how far they are out of place.
  constexpr double kSteep = 0.01;
  constexpr size_t kFewestPixels = 100;
  std::vector<double> shifts;
  for (int y = 0; y < bent.height; ++y) {
    for (int x = 0; x < bent.width; ++x) {
      const size_t i = bent.index(x, y);
      const double error = error_at(i);
      if (error < 0) continue;
      const double steep = steepness(fitted.depth, x, y);
      if (steep < kSteep) continue;
      const double expected = out.by_distance.sigma(bent.data[i].distance);
      shifts.push_back(std::sqrt(std::max(0.0, error * error - expected * expected)) / steep);
    }
  }
  if (shifts.size() >= kFewestPixels) {
    std::sort(shifts.begin(), shifts.end());
    out.edge_shift = shifts[shifts.size() * 4 / 5] / 1.2816;
  }
  return out;
}

// What a view shows at a pixel, measured or guessed.
struct Shown {
  float depth = kNoGuess;
  float sigma = kNoGuess;
  bool is_guess = false;
};

// True where measured and given depth contradict each other by more than the fit leaves.
bool is_disputed(const FittedDepth& fitted, const ViewPriors& priors, int x, int y) {
  if (fitted.depth.empty() || !(fitted.depth(x, y) > 0)) return false;
  const double off = std::log(double(fitted.depth(x, y) / priors.depth(x, y)));
  return std::abs(off) > kDeviations * std::max(kFloor, fitted.scatter);
}

Shown shown_at(
    const FittedDepth& fitted, const ViewPriors& priors, const DepthGuess& guess, int x, int y) {
  if (priors.origin(x, y) == DepthOrigin::Measured) {
    if (is_disputed(fitted, priors, x, y)) return {};
    return {priors.depth(x, y), priors.sigma(x, y), false};
  }
  if (guess.depth.empty()) return {};
  return {guess.depth(x, y), guess.sigma(x, y), true};
}

// True if a point at depth z would float before what a pixel shows.
bool floats(double z, double sigma, const Shown& shown) {
  constexpr double kMargin = 0.01;  // of the depth
  constexpr double kSigmas = 2;
  const double margin = kMargin * z + kSigmas * std::hypot(sigma, double(shown.sigma));
  return double(shown.depth) > z + margin;  // not if nothing is shown
}

/// An input view and all that is known of what it shows.
struct GuessingView {
  const Camera& camera;
  const FittedDepth& fitted;
  const ViewPriors& priors;
  const DepthGuess& guess;
};

// Marks the guesses of one view that would float before what another shows, and those of the other
// that they contradict.
void mark_contradicted(const GuessingView& here,
                       const GuessingView& there,
                       MaskMap& of_here,
                       MaskMap& of_there) {
  const DepthMap& depth = here.guess.depth;
  const Eigen::Isometry3d there_from_here =
      there.camera.cam_from_world() * here.camera.world_from_cam;
  std::vector<std::vector<size_t>> met(static_cast<size_t>(depth.height));  // by row
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      if (!(depth(x, y) > 0)) continue;
      const Eigen::Vector3d uvz = there.camera.project_in_cam(
          there_from_here * (double(depth(x, y)) * here.camera.ray_in_cam(x + 0.5, y + 0.5)));
      if (!there.camera.sees(uvz)) continue;
      const auto u = static_cast<int>(uvz.x());
      const auto v = static_cast<int>(uvz.y());
      const Shown shown = shown_at(there.fitted, there.priors, there.guess, u, v);
      if (!floats(uvz.z(), double(here.guess.sigma(x, y)), shown)) continue;
      of_here(x, y) = 1;
      if (shown.is_guess) met[static_cast<size_t>(y)].push_back(of_there.index(u, v));
    }
  });
  for (const std::vector<size_t>& row : met) {
    for (const size_t pixel : row) of_there.data[pixel] = 1;
  }
}

}  // namespace

DepthGuess guess_depth(const FittedDepth& fitted, const View& view, const ViewPriors& priors) {
  DepthGuess out{DepthMap(fitted.depth.width, fitted.depth.height, kNoGuess),
                 DepthMap(fitted.depth.width, fitted.depth.height, kNoGuess)};
  const GuessErrors errors = try_out(fitted, view, priors);
  const Raster<Bent> bent = bend(fitted, view, priors);
  // What measured pixels around correct is theirs to correct; soon after, the fit is all there is.
  constexpr double kCorrected = 0.01;  // of the diagonal
  const double reach = kCorrected * std::hypot(fitted.depth.width, fitted.depth.height);
  for (size_t i = 0; i < bent.data.size(); ++i) {
    const auto& [depth, distance] = bent.data[i];
    const double found = errors.by_distance.sigma(distance);
    if (!(depth > 0) || !(found > 0)) continue;
    const int x = static_cast<int>(i) % bent.width;
    const int y = static_cast<int>(i) / bent.width;
    const double sigma = std::hypot(found,
                                    fitted.scatter * (1 - std::exp(-double(distance) / reach)),
                                    errors.edge_shift * steepness(fitted.depth, x, y));
    out.depth.data[i] = depth;
    out.sigma.data[i] = static_cast<float>(std::max(kFloor, sigma) * double(depth));
  }
  return out;
}

void remove_contradictions(const Scene& scene,
                           const std::vector<FittedDepth>& fitted,
                           const std::vector<ViewPriors>& priors,
                           std::vector<DepthGuess>& guesses) {
  std::vector<MaskMap> contradicted;
  for (const DepthGuess& guess : guesses) {
    contradicted.emplace_back(guess.depth.width, guess.depth.height, uint8_t{0});
  }
  const auto view = [&](size_t i) {
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[i])].camera;
    return GuessingView{camera, fitted[i], priors[i], guesses[i]};
  };
  for (size_t i = 0; i < guesses.size(); ++i) {
    if (guesses[i].depth.empty()) continue;
    for (const size_t j : neighbours(scene, i, kMostCompared)) {
      mark_contradicted(view(i), view(j), contradicted[i], contradicted[j]);
    }
  }
  for (size_t i = 0; i < guesses.size(); ++i) {
    for (size_t k = 0; k < contradicted[i].data.size(); ++k) {
      if (contradicted[i].data[k] == 0) continue;
      guesses[i].depth.data[k] = guesses[i].sigma.data[k] = kNoGuess;
    }
  }
}

size_t enter_guess(const DepthGuess& guess, ViewPriors& priors) {
  size_t count = 0;
  for (size_t i = 0; i < guess.depth.data.size(); ++i) {
    const bool is_better = guess.sigma.data[i] / guess.depth.data[i] <
                           priors.sigma.data[i] / priors.depth.data[i];  // not where there is none
    if (priors.origin.data[i] != DepthOrigin::Completed || !is_better) continue;
    priors.depth.data[i] = guess.depth.data[i];
    priors.sigma.data[i] = guess.sigma.data[i];
    priors.origin.data[i] = DepthOrigin::Guessed;
    ++count;
  }
  return count;
}

}  // namespace cgs
