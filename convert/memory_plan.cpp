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

/// What a stage needs without a picture, and for each pixel of the input views. Measured on the
/// portal capture and on LLFF's fern at 36,000 to 570,000 pixels.
struct StageFactors {
  const char* stage;
  double base;      ///< [bytes]
  double of_pixel;  ///< [bytes]
  double of_voxel;  ///< [bytes per pixel], up to kMostPixels
};
constexpr std::array<StageFactors, 6> kFactors = {{{"depth and Gaussians", 150 * kMebi, 520, 0},
                                                   {"views", 103 * kMebi, 200, 0},
                                                   {"held-out views", 103 * kMebi, 200, 0},
                                                   {"volume and mesh", 160 * kMebi, 100, 1700},
                                                   {"textured assets", 95 * kMebi, 100, 570},
                                                   {"report", 131 * kMebi, 130, 0}}};

// Above, voxels grow with the pixels: TsdfOptions::max_voxels.
constexpr double kMostPixels = 570e3;

double pixels_of(const View& view) {
  return double(view.camera.width) * double(view.camera.height);
}

std::string mebibytes(size_t bytes) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.0f MiB", double(bytes) / kMebi);
  return text.data();
}

}  // namespace

std::vector<StageMemory> memory_plan(const Scene& scene, bool chooses_voxels) {
  double pixels = 0;
  for (const int i : scene.input) pixels += pixels_of(scene.views[static_cast<size_t>(i)]);
  std::vector<StageMemory> plan;
  plan.reserve(kFactors.size());
  for (const StageFactors& f : kFactors) {
    const std::string stage = f.stage;
    if (stage == "held-out views" && scene.held_out.empty()) continue;
    if (f.of_voxel > 0 && !chooses_voxels) continue;
    const double bytes = f.base + f.of_pixel * pixels + f.of_voxel * std::min(pixels, kMostPixels);
    plan.push_back({stage, static_cast<size_t>(bytes)});
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
