// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/under_water.h"

#include <algorithm>
#include <cmath>

namespace cgs {

namespace {

// IEC 61966-2-1, apart from that of the program, which is to be tested.
double decoded(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

double encoded(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

}  // namespace

ColorImage under_water(const ColorImage& picture,
                       const Camera& camera,
                       const DepthMap& depth,
                       const PlantedWater& water) {
  ColorImage out = picture;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double across = (x + 0.5 - camera.cx) / camera.fx;
      const double down = (y + 0.5 - camera.cy) / camera.fy;
      const double range = double{depth(x, y)} * std::sqrt(1 + across * across + down * down);
      for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<size_t>(c);
        double light = water.veil.at(k);
        if (std::isfinite(range)) {
          const double falloff = water.lamp_range > 0 ? water.lamp_range / range : 1;
          light = decoded(double{picture(x, y)[c]}) * falloff * falloff *
                      std::exp(-water.attenuation.at(k) * range) +
                  light * (1 - std::exp(-water.backscatter.at(k) * range));
        }
        const double code = std::round(255 * encoded(std::min(light, 1.0))) / 255;
        out(x, y)[c] = static_cast<float>(code);
      }
    }
  }
  return out;
}

}  // namespace cgs
