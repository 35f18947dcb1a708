// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/view_dependence.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/render/spherical_harmonics.h"
#include "tests/support/stereo_scene.h"

namespace cgs::view_dependence_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kWall = 4;  // z of a wall across the view
constexpr double kPatchWidth = 1.2;
constexpr double kPatchHeight = 0.9;

// By how much a point lies outside of the glossy patch in the middle of the wall.
double outside_patch(const Vector3d& p) {
  return std::max({0.0, std::abs(p.x()) - kPatchWidth / 2, std::abs(p.y()) - kPatchHeight / 2});
}

// What a point of the wall shows in a direction: stone, and a lamp's reflection in the patch.
Vector3f shown(const Vector3d& p, const Vector3d& direction, double gloss) {
  const double stone = 0.1 + 0.5 * test::solid_noise(p, 0.05);
  const Vector3d mirrored(direction.x(), direction.y(), -direction.z());
  const Vector3d to_lamp = (Vector3d(0.3, -1, 0) - p).normalized();
  constexpr double kExponent = 30;
  const double lamp = std::pow(std::max(0.0, mirrored.dot(to_lamp)), kExponent);
  const double level = stone + (outside_patch(p) == 0 ? gloss * lamp : 0);
  return Vector3d(level, 0.9 * level, 0.8 * level).cast<float>();
}

Camera camera_at(double x) {
  return test::looking_at(Vector3d(x, 0, 0), Vector3d(0, 0, kWall), 160, 128, 160);
}

Vector3d wall_at(const Camera& camera, int x, int y) {
  const Vector3d ray = camera.world_from_cam.rotation() * camera.ray_in_cam(x + 0.5, y + 0.5);
  return camera.center() + (kWall - camera.center().z()) / ray.z() * ray;
}

struct Photographed {
  Scene scene;
  std::vector<ViewPriors> priors;
};

// Photographs with noise and 8 bits, and their depth, off by a factor.
Photographed photographed(const std::vector<double>& places,
                          double gloss,
                          double depth_factor = 1) {
  Photographed out;
  uint64_t draws = 0;
  for (const double place : places) {
    View view;
    view.camera = camera_at(place);
    const int w = view.camera.width;
    const int h = view.camera.height;
    view.image = ColorImage(w, h, Vector3f::Zero());
    ViewPriors priors;
    priors.depth = DepthMap(w, h, 0);
    priors.sigma = DepthMap(w, h, 0.01f);
    priors.origin = Raster<DepthOrigin>(w, h, DepthOrigin::Measured);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const Vector3d p = wall_at(view.camera, x, y);
        const Vector3d direction = (p - view.camera.center()).normalized();
        const Vector3f color = shown(p, direction, gloss);
        for (int c = 0; c < 3; ++c) {
          const double noise = double(random_number(draws++) >> 11) * 0x1p-53 - 0.5;
          view.image(x, y)[c] =
              std::round((color[c] + 0.02f * static_cast<float>(noise)) * 255) / 255;
        }
        priors.depth(x, y) = static_cast<float>(view.camera.project(p).z() * depth_factor);
      }
    }
    out.scene.input.push_back(static_cast<int>(out.scene.views.size()));
    out.scene.views.push_back(std::move(view));
    out.priors.push_back(std::move(priors));
  }
  return out;
}

struct Fitted {
  Gaussians gaussians;
  ViewDependence found;
};

Fitted fitted(const Photographed& from) {
  Fitted out;
  out.gaussians = initial_gaussians(from.scene, from.priors);
  out.found = add_view_dependence(from.scene, from.priors, out.gaussians);
  return out;
}

const std::vector<double> kThree = {-0.8, 0, 0.8};

Vector3f color_from(const Gaussians& g, size_t i, const Camera& camera) {
  const auto count = static_cast<size_t>(g.sh_count());
  const Vector3d direction = (g.position[i].cast<double>() - camera.center()).normalized();
  return sh_color({&g.sh[i * count], count}, g.sh_degree, direction.cast<float>());
}

bool depends_on_direction(const Gaussians& g, size_t i) {
  const auto count = static_cast<size_t>(g.sh_count());
  return std::any_of(g.sh.begin() + static_cast<std::ptrdiff_t>(i * count + 1),
                     g.sh.begin() + static_cast<std::ptrdiff_t>((i + 1) * count),
                     [](const Vector3f& c) { return !c.isZero(); });
}

TEST(ViewDependence, MattWallsNeedNone) {
  const Fitted matt = fitted(photographed(kThree, 0));
  EXPECT_EQ(matt.gaussians.sh_degree, 0);
  EXPECT_EQ(matt.gaussians.sh.size(), matt.gaussians.size());
  EXPECT_EQ(matt.found.share, 0);
  EXPECT_GT(matt.found.difference, 0.005);
  EXPECT_LT(matt.found.explained, 0.1);
}

TEST(ViewDependence, WrongDepthIsNotTakenForGloss) {
  const Fitted wrong = fitted(photographed(kThree, 0, 1.03));
  EXPECT_GT(wrong.found.difference, 1.5 * fitted(photographed(kThree, 0)).found.difference);
  EXPECT_EQ(wrong.gaussians.sh_degree, 0);
}

TEST(ViewDependence, OnlyTheGlossyPatchGetsIt) {
  const Fitted glossy = fitted(photographed(kThree, 0.5));
  const Gaussians& g = glossy.gaussians;
  ASSERT_EQ(g.sh_degree, 1);
  ASSERT_EQ(g.sh.size(), 4 * g.size());
  EXPECT_GT(glossy.found.explained, 0.5);
  size_t in_patch = 0;
  size_t chosen_in_patch = 0;
  size_t chosen = 0;
  for (size_t i = 0; i < g.size(); ++i) {
    const bool depends = depends_on_direction(g, i);
    const double outside = outside_patch(g.position[i].cast<double>());
    constexpr double kPiece = 16 * kWall / 160;  // side of a piece on the wall
    if (depends) EXPECT_LT(outside, 1.1 * kPiece) << i;
    in_patch += outside == 0;
    chosen_in_patch += outside == 0 && depends;
    chosen += depends;
  }
  EXPECT_GT(double(chosen_in_patch), 0.8 * double(in_patch));
  EXPECT_NEAR(glossy.found.share, double(chosen) / double(g.size()), 1e-12);
}

TEST(ViewDependence, OwnViewsKeepTheirColours) {
  const Photographed from = photographed(kThree, 0.5);
  const Gaussians g = fitted(from).gaussians;
  size_t i = 0;
  for (const View& view : from.scene.views) {
    for (const Vector3f& color : view.image.data) {
      EXPECT_NEAR((color_from(g, i, view.camera) - color).norm(), 0, 2e-5);
      ++i;
    }
  }
  // What SPZ can hold.
  for (size_t k = 0; k < g.sh.size(); ++k) {
    if (k % 4 > 0) EXPECT_LE(g.sh[k].cwiseAbs().maxCoeff(), 1 + 1e-6f);
  }
}

// Of the colours of the patch in a view that none of them was fitted to, against the truth.
double error_from(const Gaussians& g, const Camera& camera, double gloss) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < g.size(); ++i) {
    const Vector3d p = g.position[i].cast<double>();
    if (outside_patch(p) > 0) continue;
    const Vector3f truth = shown(p, (p - camera.center()).normalized(), gloss);
    sum += static_cast<double>((color_from(g, i, camera) - truth).squaredNorm());
    ++count;
  }
  return std::sqrt(sum / (3 * double(count)));
}

TEST(ViewDependence, OtherViewsSeeTheGlossWhereItIsFromThere) {
  for (const std::vector<double>& places : {kThree, {-0.8, 0.8}}) {
    const Photographed from = photographed(places, 0.5);
    const Gaussians constant = initial_gaussians(from.scene, from.priors);
    const Gaussians g = fitted(from).gaussians;
    for (const double place : {-0.4, 0.4}) {
      EXPECT_LT(error_from(g, camera_at(place), 0.5),
                0.6 * error_from(constant, camera_at(place), 0.5))
          << place << " of " << places.size();
    }
  }
}

TEST(ViewDependence, IsTheSameEachTime) {
  const Photographed from = photographed(kThree, 0.5);
  const Gaussians first = fitted(from).gaussians;
  const Gaussians second = fitted(from).gaussians;
  ASSERT_EQ(first.sh.size(), second.sh.size());
  EXPECT_TRUE(std::equal(first.sh.begin(), first.sh.end(), second.sh.begin()));
}

TEST(ViewDependence, OneViewAloneTellsNothing) {
  const Fitted alone = fitted(photographed({0}, 0.5));
  EXPECT_EQ(alone.gaussians.sh_degree, 0);
  EXPECT_EQ(alone.found.difference, 0);
}

}  // namespace
}  // namespace cgs::view_dependence_test
