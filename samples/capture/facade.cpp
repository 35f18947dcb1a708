// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/facade.h"

#include <cstdio>
#include <string>

#include <Eigen/Geometry>

#include "samples/capture/carving.h"
#include "samples/capture/mason.h"

namespace cgs {

namespace {

using Eigen::Vector3d;

constexpr double kHalfWidth = 7;  // [m]
constexpr double kHeight = 3.4;   // [m]
constexpr double kBay = 2;        // from pilaster to pilaster [m]
constexpr int kBays = 6;

// A panel with a figure or a medallion, in turn, no two alike.
void add_bay(Mason& mason, int bay) {
  const double x = kBay * (bay - (kBays - 1) / 2.0);
  const auto seed = static_cast<uint32_t>(17 + 11 * bay);
  const std::string name = "bay " + std::to_string(bay + 1);
  if (bay % 2 == 0) {
    const auto figure = [=](double u, double z) { return figure_height(u, z, 1.7, seed); };
    add_panel(mason,
              name + ", figure",
              {{.width = 1.1, .top = 1.7, .spacing = 0.02, .height = figure}, {x, 0, 0.7}},
              Material::Carved);
  } else {
    const auto flower = [=](double u, double z) { return medallion_height(u, z, 0.6, seed); };
    add_panel(mason,
              name + ", medallion",
              {{.width = 1.2, .top = 1.2, .spacing = 0.02, .height = flower}, {x, 0, 0.95}},
              Material::Carved);
  }
}

}  // namespace

PortalScene facade_scene() {
  PortalScene scene;
  Mason mason(scene);
  mason.add_stone("ground", Material::Paving, box({-9, -9, -0.5}, {9, 1, 0}), 0.2);
  mason.add_stone(
      "wall", Material::Ashlar, box({-kHalfWidth, 0, -0.2}, {kHalfWidth, 0.4, kHeight}), 0.15);
  mason.add_stone(
      "plinth", Material::Ashlar, box({-kHalfWidth, -0.14, -0.1}, {kHalfWidth, 0.1, 0.4}), 0.12);
  mason.add_stone(
      "cornice", Material::Arch, box({-kHalfWidth, -0.2, 2.75}, {kHalfWidth, 0.1, 2.95}), 0.12);
  for (int i = 0; i <= kBays; ++i) {
    const double x = kBay * (i - kBays / 2.0);
    mason.add_stone("pilaster " + std::to_string(i + 1),
                    Material::Ashlar,
                    box({x - 0.14, -0.12, 0.3}, {x + 0.14, 0.1, 2.8}),
                    0.1);
  }
  for (int bay = 0; bay < kBays; ++bay) add_bay(mason, bay);
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

std::vector<CaptureView> facade_views(int downscale) {
  constexpr int kCount = 25;
  constexpr double kStep = 0.5;  // [m]
  std::vector<CaptureView> out;
  for (int i = 0; i < kCount; ++i) {
    const double x = kStep * (i - (kCount - 1) / 2.0);
    // Nobody walks along a ruler.
    const Vector3d eye(x, -4.2 + 0.15 * (i % 3), 1.6 + 0.1 * (i % 4));
    char name[16];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(name, sizeof name, "view_%02d", i + 1);
    out.push_back(
        {name, true, capture_camera(eye, {x, 0, 1.5}, downscale), static_cast<uint32_t>(i + 1)});
  }
  return out;
}

}  // namespace cgs
