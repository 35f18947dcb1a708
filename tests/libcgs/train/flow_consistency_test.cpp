// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/train/losses.h"
#include "tests/support/loss_checks.h"

namespace cgs::flow_consistency_test {
namespace {

using test::doubled;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

Camera camera(int width, int height, double x) {
  Camera out{.width = width, .height = height, .fx = 20, .fy = 21};
  out.cx = 0.45 * width;
  out.cy = 0.55 * height;
  out.world_from_cam.translation() = Eigen::Vector3d(x, 0.1 * x, 0.02);
  out.world_from_cam.rotate(Eigen::AngleAxisd(0.3 * x, Eigen::Vector3d(0.6, 0.8, 0)));
  return out;
}

// Depth with a few unknown pixels.
DepthMap holed(int width, int height, unsigned seed) {
  DepthMap out = test::noise_raster(width, height, seed, 0.5f, 1);
  for (size_t i = 5; i < out.data.size(); i += 17) out.data[i] = i % 2 == 0 ? -1 : kUnknown;
  return out;
}

// Places over the whole of the second view and beyond, some of them centres of pixels.
std::vector<PixelMatch> matches(int count, int first_pixels, const Camera& second) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
  std::vector<PixelMatch> out;
  for (int i = 0; i < count; ++i) {
    PixelMatch match;
    match.pixel = static_cast<int>(random() % first_pixels);
    match.u = uniform(random) * float(second.width);
    match.v = uniform(random) * float(second.height);
    if (i % 5 == 0) match.u = std::floor(match.u) + 0.5f;
    if (i % 3 == 0) match.v = std::floor(match.v) + 0.5f;
    out.push_back(match);
  }
  return out;
}

// From matrices: K^-1, homogeneous poses and a weight for each pixel of the second view and
// of a frame around it, where nothing is known.
double reference(const Camera& first,
                 const Raster<double>& depth_first,
                 const Camera& second,
                 const Raster<double>& depth_second,
                 const std::vector<PixelMatch>& matches) {
  const auto point = [](const Camera& camera, double u, double v, double depth) {
    const Eigen::Vector3d ray = camera.intrinsics().inverse() * Eigen::Vector3d(u, v, 1);
    const Eigen::Vector4d in_cam = (depth * ray).homogeneous();
    return Eigen::Vector3d((camera.world_from_cam.matrix() * in_cam).head<3>());
  };
  double sum = 0;
  for (const PixelMatch& match : matches) {
    const double z = depth_first.data[match.pixel];
    double inverse = 0;
    for (int y = -1; y <= second.height; ++y) {
      for (int x = -1; x <= second.width; ++x) {
        const double dx = double(match.u) - (x + 0.5);
        const double dy = double(match.v) - (y + 0.5);
        if (!(dx > -1 - 1e-9 && dx < 1 && dy > -1 - 1e-9 && dy < 1)) continue;
        const double z2 = depth_second.contains(x, y) ? depth_second(x, y) : -1;
        inverse += z2 > 0 ? (1 - std::abs(dx)) * (1 - std::abs(dy)) / z2 : NAN;
      }
    }
    if (!(z > 0) || !(inverse > 0)) continue;
    const Eigen::Vector3d difference =
        point(first, match.pixel % first.width + 0.5, match.pixel / first.width + 0.5, z) -
        point(second, double(match.u), double(match.v), 1 / inverse);
    sum += difference.cwiseAbs().sum();
  }
  return sum / double(depth_first.data.size());
}

struct Pair {
  Camera first = camera(17, 12, 0);
  Camera second = camera(15, 13, 0.1);
  DepthMap depth_first = holed(17, 12, 1);
  DepthMap depth_second = holed(15, 13, 2);
  std::vector<PixelMatch> found = matches(300, 17 * 12, second);

  double loss(double weight, Raster<float>& to_first, Raster<float>& to_second) const {
    return flow_consistency(
        first, depth_first, second, depth_second, found, weight, to_first, to_second);
  }
};

TEST(FlowConsistency, EqualsItsDefinition) {
  const Pair pair;
  Raster<float> to_first;
  Raster<float> to_second;
  const double expected = 3 * reference(pair.first,
                                        doubled(pair.depth_first),
                                        pair.second,
                                        doubled(pair.depth_second),
                                        pair.found);
  EXPECT_GT(expected, 0.1);
  EXPECT_NEAR(pair.loss(3, to_first, to_second), expected, 1e-9);
}

TEST(FlowConsistency, HasTheDerivativesOfItsDefinition) {
  const Pair pair;
  Raster<float> to_first;
  Raster<float> to_second;
  pair.loss(3, to_first, to_second);
  const Raster<double> depth_first = doubled(pair.depth_first);
  const Raster<double> depth_second = doubled(pair.depth_second);
  test::expect_gradient(to_first, depth_first, [&](const Raster<double>& moved) {
    return 3 * reference(pair.first, moved, pair.second, depth_second, pair.found);
  });
  test::expect_gradient(to_second, depth_second, [&](const Raster<double>& moved) {
    return 3 * reference(pair.first, depth_first, pair.second, moved, pair.found);
  });
}

TEST(FlowConsistency, OfAPlaneSeenTwiceIsZero) {
  // Inverse depth of a plane is linear in the image, so the interpolation makes no error.
  const Camera first = camera(40, 30, 0);
  const Camera second = camera(40, 30, 0.05);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.3, 1).normalized();
  const auto depth_on_plane = [&](const Camera& view, double u, double v) {
    const Eigen::Vector3d ray = view.world_from_cam.linear() * view.ray_in_cam(u, v);
    return (0.8 - normal.dot(view.center())) / normal.dot(ray);
  };
  DepthMap depth_first(40, 30, 0);
  DepthMap depth_second(40, 30, 0);
  std::vector<PixelMatch> found;
  for (int i = 0; i < 40 * 30; ++i) {
    const double u = i % 40 + 0.5;
    const double v = i / 40 + 0.5;
    const double z = depth_on_plane(first, u, v);
    depth_first.data[i] = float(z);
    depth_second.data[i] = float(depth_on_plane(second, u, v));
    const Eigen::Vector3d place = second.project(first.unproject(u, v, z));
    found.push_back({i, float(place.x()), float(place.y())});
  }
  Raster<float> to_first;
  Raster<float> to_second;
  const double loss =
      flow_consistency(first, depth_first, second, depth_second, found, 1, to_first, to_second);
  EXPECT_LT(loss, 1e-6);
  EXPECT_GT(loss, 0);
}

TEST(FlowConsistency, IgnoresWhatIsUnknownOrOutside) {
  Pair pair;
  pair.depth_second(3, 4) = kUnknown;
  pair.depth_first.data[0] = 0.7f;
  pair.depth_first.data[1] = kUnknown;
  pair.found = {{0, 3.1f, 4.2f},  // touches the unknown pixel
                {0, 0.4f, 5},
                {0, 5, -1},  // outside of the centres
                {0, 14.6f, 5},
                {0, NAN, 5},
                {1, 7.5f, 7.5f}};
  Raster<float> to_first;
  Raster<float> to_second;
  EXPECT_EQ(pair.loss(1, to_first, to_second), 0);
  EXPECT_EQ(to_first.data, std::vector<float>(pair.depth_first.data.size(), 0));
  EXPECT_EQ(to_second.data, std::vector<float>(pair.depth_second.data.size(), 0));
}

TEST(FlowConsistency, HasNoPlaceInAViewOfOnePixel) {
  Pair pair;
  pair.second = camera(1, 1, 0);
  pair.depth_second = DepthMap(1, 1, 1);
  pair.found = {{0, 0.5f, 0.5f}};
  Raster<float> to_first;
  Raster<float> to_second;
  EXPECT_EQ(pair.loss(1, to_first, to_second), 0);
}

TEST(FlowConsistency, AddsToTheGradients) {
  const Pair pair;
  Raster<float> to_first;
  Raster<float> to_second;
  pair.loss(1, to_first, to_second);
  Raster<float> twice_first = to_first;
  Raster<float> twice_second = to_second;
  pair.loss(1, twice_first, twice_second);
  for (size_t i = 0; i < to_first.data.size(); ++i) {
    EXPECT_NEAR(twice_first.data[i], 2 * to_first.data[i], 1e-6);
  }
  for (size_t i = 0; i < to_second.data.size(); ++i) {
    EXPECT_NEAR(twice_second.data[i], 2 * to_second.data[i], 1e-6);
  }
}

TEST(FlowConsistency, OfWeightZeroTouchesNothing) {
  Raster<float> to_first;
  Raster<float> to_second;
  EXPECT_EQ(Pair().loss(0, to_first, to_second), 0);
  EXPECT_TRUE(to_first.empty());
  EXPECT_TRUE(to_second.empty());
}

TEST(FlowConsistency, IsTheSameForAnyNumberOfThreads) {
  Pair pair;
  pair.found = matches(20000, 17 * 12, pair.second);
  Raster<float> expected_first;
  Raster<float> expected_second;
  const double value = pair.loss(1, expected_first, expected_second);
  test::for_thread_counts([&] {
    Raster<float> to_first;
    Raster<float> to_second;
    EXPECT_EQ(pair.loss(1, to_first, to_second), value);
    EXPECT_EQ(to_first.data, expected_first.data);
    EXPECT_EQ(to_second.data, expected_second.data);
  });
}

TEST(FlowConsistency, RefusesDepthThatDoesNotFitItsCamera) {
  Raster<float> to_first;
  Raster<float> to_second;
  Pair wrong_first;
  wrong_first.depth_first = DepthMap(12, 17, 1);
  EXPECT_THROW(wrong_first.loss(1, to_first, to_second), InvalidInput);
  Pair wrong_second;
  wrong_second.depth_second = {};
  EXPECT_THROW(wrong_second.loss(1, to_first, to_second), InvalidInput);
}

}  // namespace
}  // namespace cgs::flow_consistency_test
