// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_inputs.h"

#include "libcgs/core/split_mix.h"

namespace cgs {

ColorPlanes planes_of(const ColorImage& image) {
  ColorPlanes out;
  for (int c = 0; c < 3; ++c) {
    out[c] = Raster<float>(image.width, image.height, 0);
    for (size_t i = 0; i < image.data.size(); ++i) out[c].data[i] = image.data[i][c];
  }
  return out;
}

uint64_t mixed(uint64_t a, uint64_t b, uint64_t c) {
  return split_mix(a * kSplitMixStep ^ (b + 1) * 0xC2B2AE3D27D4EB4FULL ^
                   (c + 1) * 0x165667B19E3779F9ULL);
}

Eigen::Vector3f random_background(uint64_t step, size_t view) {
  const uint64_t bits = mixed(step, view, 0xBACC);
  constexpr uint64_t kMask = (1U << 21) - 1;
  const auto channel = [&](int shift) {
    return static_cast<float>(bits >> shift & kMask) / static_cast<float>(kMask);
  };
  return {channel(0), channel(21), channel(42)};
}

}  // namespace cgs
