// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/carving.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

namespace cgs::carving_test {
namespace {

struct Range {
  double low = 9;
  double high = -9;
};

Range range(const std::function<double(double, double)>& height, double half, double top) {
  Range out;
  for (double x = -half; x <= half; x += 0.01) {
    for (double z = 0; z <= top; z += 0.01) {
      const double h = height(x, z);
      EXPECT_TRUE(std::isfinite(h)) << x << " " << z;
      out.low = std::min(out.low, h);
      out.high = std::max(out.high, h);
    }
  }
  return out;
}

TEST(Carving, StandsOutByCentimetresAndNeverCutsThroughItsSlab) {
  const auto check =
      [](const std::function<double(double, double)>& height, double half, double top) {
        const Range found = range(height, half, top);
        EXPECT_GT(found.low, -0.05);
        EXPECT_GT(found.high, 0.03);
        EXPECT_LT(found.high, 0.2);
      };
  check([](double x, double z) { return tympanum_height(x, z, 1.3); }, 1.45, 1.45);
  check([](double x, double z) { return frieze_height(x, z, 0.4, 3); }, 1.45, 0.4);
  check([](double x, double z) { return figure_height(x, z, 1.25, 21); }, 0.25, 1.25);
  check([](double x, double z) { return medallion_height(x, z, 0.42, 57); }, 0.42, 0.84);
  check(door_height, 1.45, 1.7);
}

TEST(FriezeHeight, DoesNotRepeat) {
  double difference = 0;
  for (double x = 0; x < 0.38; x += 0.01) {
    difference += std::abs(frieze_height(x, 0.2, 0.4, 3) - frieze_height(x + 0.38, 0.2, 0.4, 3));
  }
  EXPECT_GT(difference / 38, 0.005);
}

}  // namespace
}  // namespace cgs::carving_test
