// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/training_rasterizer.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "tests/support/reference_training_rasterizer.h"

namespace cgs {
namespace {

// Neither the image nor the principal point is a multiple of anything.
Camera oblique_camera() {
  Camera camera{.width = 37, .height = 26, .fx = 41, .fy = 38, .cx = 17.3, .cy = 14.1};
  camera.world_from_cam.translation() << 0.3, -0.2, -0.4;
  camera.world_from_cam.linear() = (Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
  return camera;
}

struct Spread {
  int count = 40;
  float sigma_px = 2;    // of the longest axis
  float anisotropy = 1;  // longest axis over the two others
  float min_opacity = 0.05f;
  float max_opacity = 0.9f;
  int sh_degree = 0;
};

Gaussians random_gaussians(const Camera& camera, const Spread& spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<float> normal;
  Gaussians g;
  g.sh_degree = spread.sh_degree;
  for (int i = 0; i < spread.count; ++i) {
    const double z = 0.4 + 0.8 * uniform(random);
    const double u = camera.width * (1.5 * uniform(random) - 0.25);
    const double v = camera.height * (1.5 * uniform(random) - 0.25);
    g.position.push_back(camera.unproject(u, v, z).cast<float>());
    const float longest = spread.sigma_px * float(z / camera.fx) * float(0.5 + uniform(random));
    const float middle = longest * std::pow(spread.anisotropy, -0.3f);
    g.scale.emplace_back(longest / spread.anisotropy, longest, middle);
    g.rotation.emplace_back(normal(random), normal(random), normal(random), normal(random));
    g.opacity.push_back(spread.min_opacity +
                        (spread.max_opacity - spread.min_opacity) * float(uniform(random)));
    for (int k = 0; k < g.sh_count(); ++k) {
      g.sh.emplace_back(normal(random), normal(random), normal(random));
    }
  }
  return g;
}

std::array<Raster<float>*, 6> planes(TrainingBuffers& b) {
  return {&b.color[0], &b.color[1], &b.color[2], &b.alpha, &b.depth_sum, &b.depth_square_sum};
}

// Random derivatives for the planes whose bit is set, nothing for the others.
TrainingBuffers random_loss(const Camera& camera, unsigned channels, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  TrainingBuffers out;
  unsigned bit = 1;
  for (Raster<float>* plane : planes(out)) {
    if ((channels & bit) != 0) {
      *plane = {camera.width, camera.height, 0};
      for (float& value : plane->data) value = normal(random);
    }
    bit *= 2;
  }
  return out;
}

constexpr unsigned kEveryChannel = 63;

// Every derivative of a set as one list, and how to reach the entry in the reference scene.
struct Entry {
  const char* kind;
  double got;
  std::function<void(std::vector<test::ReferenceGaussian>&, double)> add;
};

std::vector<Entry> entries_of(const Gaussians& g, const GaussianGradients& d) {
  std::vector<Entry> out;
  const auto count = static_cast<size_t>(g.sh_count());
  for (size_t i = 0; i < g.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      out.push_back({"position", double(d.position[i][k]), [=](auto& s, double h) {
                       s[i].position[k] += h;
                     }});
      if (!d.scale.empty()) {
        out.push_back(
            {"scale", double(d.scale[i][k]), [=](auto& s, double h) { s[i].scale[k] += h; }});
      }
      for (size_t c = 0; c < (d.sh.empty() ? 0 : count); ++c) {
        out.push_back(
            {"sh", double(d.sh[i * count + c][k]), [=](auto& s, double h) { s[i].sh[c][k] += h; }});
      }
    }
    for (int k = 0; k < (d.rotation.empty() ? 0 : 4); ++k) {
      out.push_back({"rotation", double(d.rotation[i][k]), [=](auto& s, double h) {
                       s[i].rotation[k] += h;
                     }});
    }
    if (!d.radius.empty()) {
      out.push_back(
          {"radius", double(d.radius[i]), [=](auto& s, double h) { s[i].scale.array() += h; }});
    }
    out.push_back({"opacity", double(d.opacity[i]), [=](auto& s, double h) { s[i].opacity += h; }});
  }
  return out;
}

double loss_of(const test::ReferencePlanes& planes_of_scene, TrainingBuffers& weights) {
  double sum = 0;
  size_t k = 0;
  for (const Raster<float>* plane : planes(weights)) {
    for (size_t p = 0; p < plane->data.size(); ++p) {
      sum += double(plane->data[p]) * planes_of_scene[k][p];
    }
    ++k;
  }
  return sum;
}

// Compares every derivative with central differences of the reference, for each channel by itself
// and for all together.
void expect_differences(const Gaussians& g, const TrainingRasterizerOptions& options) {
  const Camera camera = oblique_camera();
  TrainingRasterizer rasterizer(options);
  std::vector<TrainingBuffers> losses;
  std::vector<std::vector<Entry>> entries;
  for (const unsigned channels : {1U, 2U, 4U, 8U, 16U, 32U, kEveryChannel}) {
    losses.push_back(random_loss(camera, channels, 7));
    GaussianGradients sum;
    rasterizer.forward(g, camera);
    rasterizer.backward(losses.back(), sum);
    entries.push_back(entries_of(g, sum));
  }
  std::vector<std::vector<double>> truth(losses.size());
  const Eigen::Vector3d background = options.background.cast<double>();
  for (const Entry& entry : entries[0]) {
    constexpr double kStep = 1e-6;
    auto scene = test::reference_gaussians(g);
    entry.add(scene, kStep);
    const auto plus = test::draw_reference(scene, camera, background);
    entry.add(scene, -2 * kStep);
    const auto minus = test::draw_reference(scene, camera, background);
    for (size_t l = 0; l < losses.size(); ++l) {
      truth[l].push_back((loss_of(plus, losses[l]) - loss_of(minus, losses[l])) / (2 * kStep));
    }
  }
  for (size_t l = 0; l < losses.size(); ++l) {
    std::map<std::string, double> largest;
    for (size_t e = 0; e < truth[l].size(); ++e) {
      double& most = largest[entries[l][e].kind];
      most = std::max(most, std::abs(truth[l][e]));
    }
    for (size_t e = 0; e < truth[l].size(); ++e) {
      const double room = 1e-4 * std::abs(truth[l][e]) + 2e-6 * largest[entries[l][e].kind];
      EXPECT_NEAR(entries[l][e].got, truth[l][e], room)
          << entries[l][e].kind << ", entry " << e << ", loss " << l;
    }
  }
}

TEST(TrainingRasterizer, DifferentiatesBalls) {
  expect_differences(random_gaussians(oblique_camera(), {}, 1),
                     {.background = {0.3f, 0.6f, 0.9f}, .sh_gradients = true});
}

TEST(TrainingRasterizer, DifferentiatesEllipsoids) {
  expect_differences(random_gaussians(oblique_camera(), {.sigma_px = 3, .anisotropy = 4}, 2),
                     {.shape = GaussianShape::Ellipsoids, .sh_gradients = true});
}

TEST(TrainingRasterizer, DifferentiatesDirectionalColour) {
  for (const int degree : {1, 2, 3}) {
    expect_differences(random_gaussians(oblique_camera(), {.count = 15, .sh_degree = degree}, 3),
                       {.sh_gradients = true});
  }
}

}  // namespace
}  // namespace cgs
