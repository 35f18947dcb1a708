// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/memory_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kMebi = 1 << 20;

/// Measured on two captures at four sizes: what a stage needs without a picture, and for a pixel.
struct StageFactors {
  const char* stage;
  double base;        ///< [bytes]
  double of_input;    ///< [bytes per pixel of all input views]
  double of_largest;  ///< [bytes per pixel of the largest view]
};
constexpr std::array<StageFactors, 6> kFactors = {{{"depth and Gaussians", 60 * kMebi, 600, 0},
                                                   {"views", 60 * kMebi, 400, 0},
                                                   {"held-out views", 60 * kMebi, 400, 0},
                                                   {"volume and mesh", 60 * kMebi, 1500, 0},
                                                   {"textured assets", 60 * kMebi, 800, 0},
                                                   {"report", 60 * kMebi, 800, 0}}};

double pixels_of(const View& view) {
  return double(view.camera.width) * double(view.camera.height);
}

std::string mebibytes(size_t bytes) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.0f MiB", double(bytes) / kMebi);
  return text.data();
}

}  // namespace

std::vector<StageMemory> memory_plan(const Scene& scene) {
  double input = 0;
  double largest = 0;
  for (const int i : scene.input) input += pixels_of(scene.views[static_cast<size_t>(i)]);
  for (const View& view : scene.views) largest = std::max(largest, pixels_of(view));
  std::vector<StageMemory> plan;
  for (const StageFactors& f : kFactors) {
    plan.push_back(
        {f.stage, static_cast<size_t>(f.base + f.of_input * input + f.of_largest * largest)});
  }
  return plan;
}

std::string memory_plan_text(const std::vector<StageMemory>& plan) {
  std::string out;
  for (const StageMemory& stage : plan) {
    out += (out.empty() ? "" : ", ") + stage.stage + " " + mebibytes(stage.bytes);
  }
  return out;
}

void check_memory_plan(const std::vector<StageMemory>& plan, size_t budget) {
  const auto most = std::max_element(
      plan.begin(), plan.end(), [](const auto& a, const auto& b) { return a.bytes < b.bytes; });
  if (most == plan.end() || most->bytes <= budget) return;
  const double factor = std::sqrt(double(most->bytes) / double(budget));
  throw LimitError(
      "'" + most->stage + "' needs about " + mebibytes(most->bytes) + " and " + mebibytes(budget) +
      " may be used; a --downscale " + std::to_string(static_cast<int>(std::ceil(factor))) +
      " times as large or fewer --views make it fit, a larger --memory-limit allows it");
}

}  // namespace cgs
