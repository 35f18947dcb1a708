// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/layered_lattice.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/loss_checks.h"

namespace cgs::layered_lattice_test {
namespace {

// Slanted bands, a lone pixel of a layer of its own, and a layer number that is never used.
Raster<uint8_t> bands(int width, int height) {
  Raster<uint8_t> out(width, height, 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out(x, y) = static_cast<uint8_t>((x + y / 2) / 9 % 3);
  }
  out(width / 2, height / 2) = 4;
  return out;
}

std::vector<float> noise(size_t count, unsigned seed) {
  std::vector<float> out;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (size_t i = 0; i < count; ++i) out.push_back(uniform(random));
  return out;
}

// The uniform cubic B-spline from its recursion.
double b_spline(double x, int degree = 3) {
  const double half = 0.5 * (degree + 1);
  if (degree == 0) return x >= -0.5 && x < 0.5 ? 1 : 0;
  return ((half + x) * b_spline(x + 0.5, degree - 1) + (half - x) * b_spline(x - 0.5, degree - 1)) /
         degree;
}

struct Knot {
  int layer, row, column;  // of a knot at (column, row) spacing
};

// Knots that have a parameter, in order, by looking at every knot and every pixel.
std::vector<Knot> knots_of(const Raster<uint8_t>& layer, int spacing) {
  std::vector<Knot> out;
  for (int l = 0; l < 256; ++l) {
    if (std::count(layer.data.begin(), layer.data.end(), l) == 0) continue;
    for (int row = -3; row <= layer.height / spacing + 3; ++row) {
      for (int column = -3; column <= layer.width / spacing + 3; ++column) {
        bool meets = false;
        for (int y = 0; y < layer.height; ++y) {
          for (int x = 0; x < layer.width; ++x) {
            meets =
                meets || (layer(x, y) == l && std::abs(x + 0.5 - column * spacing) < 2 * spacing &&
                          std::abs(y + 0.5 - row * spacing) < 2 * spacing);
          }
        }
        if (meets) out.push_back({l, row, column});
      }
    }
  }
  return out;
}

TEST(LayeredLattice, EqualsTheSumOverKnotsOfItsDefinition) {
  const std::vector<int> spacing = {16, 7, 2};
  for (const auto& [width, height] : {std::pair{31, 22}, {5, 40}, {1, 1}}) {
    const Raster<uint8_t> layer = bands(width, height);
    const LayeredLattice lattice(layer, {spacing});
    const std::vector<float> parameters = noise(lattice.parameter_count(), 1);
    Raster<double> expected(width, height, 0);
    size_t parameter = 0;
    for (size_t level = 0; level < spacing.size(); ++level) {
      const double h = spacing[level];
      EXPECT_EQ(lattice.level(level).first, parameter);
      for (const Knot& knot : knots_of(layer, spacing[level])) {
        ASSERT_LT(parameter, parameters.size());
        const double value = double(parameters[parameter++]);
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            if (layer(x, y) != knot.layer) continue;
            expected(x, y) +=
                value * b_spline((x + 0.5) / h - knot.column) * b_spline((y + 0.5) / h - knot.row);
          }
        }
      }
      EXPECT_EQ(lattice.level(level).last, parameter);
    }
    EXPECT_EQ(lattice.level_count(), spacing.size());
    EXPECT_EQ(lattice.parameter_count(), parameter);
    Raster<float> value;
    lattice.evaluate(parameters, value);
    for (size_t i = 0; i < expected.data.size(); ++i) {
      EXPECT_NEAR(value.data[i], expected.data[i], 1e-6) << "at pixel " << i;
    }
  }
}

TEST(LayeredLattice, ReproducesConstantsAndLines) {
  // A cubic spline with coefficients on a plane is that plane.
  const Raster<uint8_t> layer(50, 33, 0);
  const LayeredLattice lattice(layer, {{8}});
  std::vector<float> parameters;
  for (const Knot& knot : knots_of(layer, 8)) {
    parameters.push_back(float(1 + 0.25 * 8 * knot.column - 0.5 * 8 * knot.row));
  }
  Raster<float> value;
  lattice.evaluate(parameters, value);
  for (int y = 0; y < layer.height; ++y) {
    for (int x = 0; x < layer.width; ++x) {
      EXPECT_NEAR(value(x, y), 1 + 0.25 * (x + 0.5) - 0.5 * (y + 0.5), 2e-5);
    }
  }
}

TEST(LayeredLattice, LevelOfOnesIsOneEverywhere) {
  const LayeredLattice lattice(bands(61, 44), {});
  for (size_t level = 0; level < lattice.level_count(); ++level) {
    std::vector<float> parameters(lattice.parameter_count(), 0);
    const auto [first, last] = lattice.level(level);
    std::fill(parameters.begin() + long(first), parameters.begin() + long(last), 1.0f);
    Raster<float> value;
    lattice.evaluate(parameters, value);
    for (const float v : value.data) EXPECT_NEAR(v, 1, 1e-6);
  }
}

TEST(LayeredLattice, KeepsLayersApart) {
  const Raster<uint8_t> layer = bands(61, 44);
  const LayeredLattice lattice(layer, {{16}});
  Raster<float> one(61, 44, 0);
  for (size_t i = 0; i < layer.data.size(); ++i) one.data[i] = layer.data[i] == 1 ? 1.0f : 0.0f;
  std::vector<float> parameters(lattice.parameter_count(), 0);
  lattice.add_gradient(one, parameters);
  Raster<float> value;
  lattice.evaluate(parameters, value);
  for (size_t i = 0; i < layer.data.size(); ++i) {
    EXPECT_EQ(value.data[i] > 0, layer.data[i] == 1) << "at pixel " << i;
  }
}

TEST(LayeredLattice, GradientIsTheTransposeOfEvaluation) {
  for (const auto& [width, height] : {std::pair{130, 77}, {5, 40}, {1, 1}}) {
    const LayeredLattice lattice(bands(width, height), {{32, 16, 4, 2}});
    const std::vector<float> x = noise(lattice.parameter_count(), 1);
    const Raster<float> y = test::noise_raster(width, height, 2, -1, 1);
    Raster<float> Ax;
    lattice.evaluate(x, Ax);
    std::vector<float> Aty(x.size(), 0);
    lattice.add_gradient(y, Aty);
    double left = 0;
    double right = 0;
    double scale = 0;
    for (size_t i = 0; i < y.data.size(); ++i) {
      left += double(Ax.data[i]) * double(y.data[i]);
      scale += std::abs(double(Ax.data[i]) * double(y.data[i]));
    }
    for (size_t i = 0; i < x.size(); ++i) right += double(x[i]) * double(Aty[i]);
    EXPECT_NEAR(left, right, 1e-6 * scale);
    EXPECT_GT(std::abs(left), 1e-4 * scale);
  }
}

TEST(LayeredLattice, GradientOfEachPixelIsItsWeights) {
  // Column by column, so that an error in one weight cannot hide in a sum.
  const Raster<uint8_t> layer = bands(12, 9);
  const LayeredLattice lattice(layer, {{5, 2}});
  for (size_t p = 0; p < lattice.parameter_count(); ++p) {
    std::vector<float> unit(lattice.parameter_count(), 0);
    unit[p] = 1;
    Raster<float> column;
    lattice.evaluate(unit, column);
    EXPECT_GT(*std::max_element(column.data.begin(), column.data.end()), 0) << "parameter " << p;
    for (size_t i = 0; i < layer.data.size(); ++i) {
      Raster<float> pixel(12, 9, 0);
      pixel.data[i] = 1;
      std::vector<float> row(unit.size(), 0);
      lattice.add_gradient(pixel, row);
      ASSERT_NEAR(row[p], column.data[i], 1e-7);
    }
  }
}

TEST(LayeredLattice, GradientAddsToTheSum) {
  const LayeredLattice lattice(bands(31, 22), {{16, 4}});
  const Raster<float> gradient = test::noise_raster(31, 22, 2, -1, 1);
  std::vector<float> sum(lattice.parameter_count(), 0);
  lattice.add_gradient(gradient, sum);
  const std::vector<float> once = sum;
  lattice.add_gradient(gradient, sum);
  for (size_t i = 0; i < sum.size(); ++i) EXPECT_EQ(sum[i], 2 * once[i]);
}

TEST(LayeredLattice, PlanesDoNotBend) {
  const Raster<uint8_t> layer = bands(40, 30);
  const LayeredLattice lattice(layer, {{8}});
  std::vector<float> parameters;
  for (const Knot& knot : knots_of(layer, 8)) {
    parameters.push_back(float(knot.layer + 2 * knot.column - 3 * knot.row));
  }
  std::vector<float> sum(parameters.size(), 0);
  EXPECT_EQ(lattice.add_bending(parameters, 1, sum), 0);
  EXPECT_EQ(sum, std::vector<float>(sum.size(), 0));
  parameters[parameters.size() / 2] += 1;
  EXPECT_GT(lattice.add_bending(parameters, 1, sum), 0);
}

TEST(LayeredLattice, BendingIsTheIntegralOfSquaredSecondDerivativesAtAnySpacing) {
  // f = x^2 / 2 + 2 x y - y^2: f_xx^2 + 2 f_xy^2 + f_yy^2 = 1 + 8 + 4 everywhere. Differences
  // are taken where all knots exist, which is a frame of about one spacing more than the view.
  const Raster<uint8_t> layer(800, 600, 0);
  for (const int h : {16, 8, 4, 2}) {
    const LayeredLattice lattice(layer, {{h}});
    std::vector<float> parameters;
    for (int row = -1; row <= (600 - 1) / h + 2; ++row) {
      for (int column = -1; column <= (800 - 1) / h + 2; ++column) {
        const double x = column * h * 0.01;
        const double y = row * h * 0.01;
        parameters.push_back(float(x * x / 2 + 2 * x * y - y * y));
      }
    }
    ASSERT_EQ(parameters.size(), lattice.parameter_count());
    std::vector<float> sum(parameters.size(), 0);
    const double energy = lattice.add_bending(parameters, 3, sum);
    const double expected = 3 * 13 * std::pow(0.01, 4);
    EXPECT_GT(energy, expected * 0.99) << h;
    EXPECT_LT(energy, expected * (1 + 6.0 * h / 600)) << h;
  }
}

TEST(LayeredLattice, BendingHasTheDerivativeOfItsValue) {
  // The energy is quadratic, so central differences are exact: steps may be large.
  const LayeredLattice lattice(bands(23, 17), {{9, 4}});
  std::vector<float> parameters = noise(lattice.parameter_count(), 1);
  std::vector<float> sum(parameters.size(), 0);
  lattice.add_bending(parameters, 50, sum);
  std::vector<float> unused(parameters.size(), 0);
  for (size_t i = 0; i < parameters.size(); ++i) {
    const float here = parameters[i];
    parameters[i] = here + 0.5f;
    const double step_up = double(parameters[i]) - double(here);
    const double above = lattice.add_bending(parameters, 50, unused);
    parameters[i] = here - 0.5f;
    const double step_down = double(here) - double(parameters[i]);
    const double below = lattice.add_bending(parameters, 50, unused);
    parameters[i] = here;
    EXPECT_NEAR(sum[i], (above - below) / (step_up + step_down), 1e-5) << "parameter " << i;
  }
}

TEST(LayeredLattice, BendingOfWeightZeroTouchesNothing) {
  const LayeredLattice lattice(bands(23, 17), {{9, 4}});
  std::vector<float> sum = noise(lattice.parameter_count(), 1);
  const std::vector<float> before = sum;
  EXPECT_EQ(lattice.add_bending(noise(sum.size(), 2), 0, sum), 0);
  EXPECT_EQ(sum, before);
}

TEST(LayeredLattice, IsTheSameForAnyNumberOfThreads) {
  const LayeredLattice lattice(bands(201, 155), {{32, 8, 2}});
  const std::vector<float> parameters = noise(lattice.parameter_count(), 1);
  const Raster<float> gradient = test::noise_raster(201, 155, 2, -1, 1);
  const auto results = [&] {
    std::tuple<Raster<float>, std::vector<float>, double> out;
    auto& [value, sum, energy] = out;
    lattice.evaluate(parameters, value);
    sum.assign(parameters.size(), 0);
    lattice.add_gradient(gradient, sum);
    energy = lattice.add_bending(parameters, 0.1, sum);
    return out;
  };
  const auto expected = results();
  test::for_thread_counts([&] {
    const auto [value, sum, energy] = results();
    EXPECT_EQ(value.data, std::get<0>(expected).data);
    EXPECT_EQ(sum, std::get<1>(expected));
    EXPECT_EQ(energy, std::get<2>(expected));
  });
}

TEST(LayeredLatticeOptions, RefuseEachFieldOutOfRange) {
  EXPECT_NO_THROW(LayeredLatticeOptions().validate());
  EXPECT_THROW(LayeredLatticeOptions{.spacing = {}}.validate(), InvalidInput);
  EXPECT_THROW(LayeredLatticeOptions{{1}}.validate(), InvalidInput);
  EXPECT_THROW((LayeredLatticeOptions{{8, 8}}.validate()), InvalidInput);
  EXPECT_THROW((LayeredLatticeOptions{{8, 16}}.validate()), InvalidInput);
}

TEST(LayeredLattice, RefusesWhatDoesNotFit) {
  const LayeredLattice lattice(bands(23, 17), {{9, 4}});
  std::vector<float> few(lattice.parameter_count() - 1, 0);
  std::vector<float> right(lattice.parameter_count(), 0);
  Raster<float> value;
  EXPECT_THROW(lattice.evaluate(few, value), InvalidInput);
  EXPECT_THROW(lattice.add_gradient(Raster<float>(23, 17, 0), few), InvalidInput);
  EXPECT_THROW(lattice.add_gradient(Raster<float>(17, 23, 0), right), InvalidInput);
  EXPECT_THROW(lattice.add_bending(right, 1, few), InvalidInput);
  EXPECT_THROW(lattice.add_bending(few, 1, right), InvalidInput);
  EXPECT_THROW(LayeredLattice({}, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::layered_lattice_test
