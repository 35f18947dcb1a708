// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/courtyard.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/srgb.h"
#include "samples/capture/carving.h"
#include "samples/capture/mason.h"

namespace cgs {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kYardHalfWidth = 6.5;   // of facade and paving [m]
constexpr double kEaves = 2.7;           // height of the facade [m]
constexpr double kFacadeDepth = 0.25;    // its front is y = 0 [m]
constexpr double kPaneBehind = 0.1;      // y of the glass [m]
constexpr double kRoomBehindPane = 1.5;  // of the back wall of the room [m]

// The opening of the window in the facade [m].
constexpr double kWindowLeft = -2.3;
constexpr double kWindowRight = -0.9;
constexpr double kWindowSill = 1.2;
constexpr double kWindowTop = 2.4;

// Sunlit plaster comes out white without clipping, so that nothing but its evenness hides it.
constexpr float kExposure = 0.62F;

const Vector3f kAtHorizon(0.93F, 0.95F, 0.97F);  // sRGB-coded
const Vector3f kAbove(0.55F, 0.72F, 0.92F);

Vector3f sky_color(const Vector3d& direction) {
  constexpr float kBlue = 0.5F;  // sine of the elevation from which it is as blue as above
  const auto up = static_cast<float>(direction.z() / direction.norm());
  return kAtHorizon + smooth_step(0, kBlue, up) * (kAbove - kAtHorizon);
}

// One solid with a hole: a ring of four corners, each a section from the hole outward.
void add_facade(Mason& mason) {
  const std::array<std::array<double, 2>, 4> hole = {{{kWindowLeft, kWindowSill},
                                                      {kWindowRight, kWindowSill},
                                                      {kWindowRight, kWindowTop},
                                                      {kWindowLeft, kWindowTop}}};
  const std::array<std::array<double, 2>, 4> outer = {{{-kYardHalfWidth, -0.3},
                                                       {kYardHalfWidth, -0.3},
                                                       {kYardHalfWidth, kEaves},
                                                       {-kYardHalfWidth, kEaves}}};
  std::vector<Loop> loops;
  for (size_t i = 0; i < hole.size(); ++i) {
    const auto [x, z] = hole.at(i);
    const auto [far_x, far_z] = outer.at(i);
    loops.push_back(
        {{x, kFacadeDepth, z}, {x, 0, z}, {far_x, 0, far_z}, {far_x, kFacadeDepth, far_z}});
  }
  mason.add_stone("facade", Material::Ashlar, loft(loops, LoftEnds::Joined), 0.2);
  mason.add_stone("cornice",
                  Material::Ashlar,
                  box({-kYardHalfWidth, -0.10, 2.46}, {kYardHalfWidth, 0.15, 2.60}),
                  0.15);
  mason.add_stone(
      "sill", Material::Arch, box({-2.4, -0.08, 1.10}, {-0.8, 0.05, kWindowSill + 0.01}), 0.08);
  for (const double x : {-2.62, -0.58}) {
    mason.add_stone(x < -1 ? "pilaster left" : "pilaster right",
                    Material::Ashlar,
                    box({x - 0.15, -0.14, -0.1}, {x + 0.15, 0.1, 2.5}),
                    0.1);
  }
}

void add_door(Mason& mason) {
  constexpr double kMiddle = 0.45;
  add_panel(mason,
            "door",
            {{.width = 1.0, .top = 1.95, .spacing = 0.02, .height = door_height}, {kMiddle, 0, 0}},
            Material::Wood);
  for (const double side : {-1.0, 1.0}) {
    const double x = kMiddle + side * 0.56;
    mason.add_stone(side < 0 ? "jamb left" : "jamb right",
                    Material::Ashlar,
                    box({x - 0.09, -0.10, -0.1}, {x + 0.09, 0.1, 1.95}),
                    0.08);
  }
  mason.add_stone("lintel", Material::Carved, box({-0.24, -0.12, 1.9}, {1.14, 0.1, 2.1}), 0.08);
}

// Stands out by three centimetres and begins behind the cornice.
void add_gable(Mason& mason) {
  const auto triangle = [](double y) {
    return Loop{{-0.65, y, 2.5}, {1.55, y, 2.5}, {1.55, y, 2.6}, {0.45, y, 3.5}, {-0.65, y, 2.6}};
  };
  mason.add_stone(
      "gable", Material::Ashlar, loft({triangle(-0.03), triangle(0.3)}, LoftEnds::Capped), 0.1);
  const auto medallion = [](double x, double z) { return medallion_height(x, z, 0.3, 31); };
  add_panel(mason,
            "medallion",
            {{.width = 0.6, .top = 0.6, .height = medallion}, {0.45, -0.03, 2.62}},
            Material::Carved);
}

void add_lathed(Mason& mason, const std::string& name, const Lathe& lathe, const Vector3d& place) {
  const Eigen::Isometry3d pose(Eigen::Translation3d{place});
  mason.add_stone(name, Material::Carved, moved(lathed(lathe), pose), 0.06);
}

// What makes the skyline uneven.
void add_roofline(Mason& mason) {
  mason.add_stone("chimney", Material::Ashlar, box({-3.2, 0.02, 2.3}, {-2.75, 0.42, 3.45}), 0.08);
  mason.add_stone(
      "chimney cap", Material::Ashlar, box({-3.27, -0.05, 3.4}, {-2.68, 0.49, 3.53}), 0.08);
  const Lathe pinnacle{.profile = {{0.15, 0},
                                   {0.15, 0.25},
                                   {0.19, 0.28},
                                   {0.19, 0.33},
                                   {0.13, 0.37},
                                   {0.09, 0.65},
                                   {0.04, 0.90},
                                   {0.07, 0.95},
                                   {0.07, 1.00},
                                   {0.02, 1.05}},
                       .sides = 32};
  add_lathed(mason, "pinnacle", pinnacle, {1.85, 0.12, 2.55});
  const Lathe finial{.profile = {{0.09, 0},
                                 {0.06, 0.16},
                                 {0.05, 0.22},
                                 {0.11, 0.28},
                                 {0.12, 0.34},
                                 {0.09, 0.41},
                                 {0.02, 0.46}},
                     .sides = 32};
  add_lathed(mason, "finial", finial, {0.45, 0.12, 3.36});
  Lathe statue{.profile = {{0.20, 0}, {0.20, 0.10}, {0.15, 0.12}, {0.16, 0.30}, {0.13, 0.50}},
               .sides = 48};
  statue.profile.insert(statue.profile.end(),
                        {{0.16, 0.68},
                         {0.12, 0.74},
                         {0.05, 0.77},
                         {0.06, 0.80},
                         {0.08, 0.86},
                         {0.07, 0.92},
                         {0.02, 0.96}});
  statue.carving = [](double angle, double z) {  // folds of the robe, and a wider front than side
    const double folds = z > 0.12 && z < 0.68 ? 0.10 * std::cos(7 * angle + 2 * z) : 0.0;
    return 1 + folds + (z > 0.12 && z < 0.74 ? 0.15 * std::cos(2 * angle) : 0.0);
  };
  add_lathed(mason, "statue", statue, {-1.75, 0.12, kEaves - 0.03});
}

// Bars of 16 mm are one pixel wide in the input views, the pole is two to three.
void add_irons(Mason& mason) {
  const auto upright = [&](const std::string& name, double x, double radius, double top) {
    const Lathe bar{.profile = {{radius, kEaves - 0.1}, {radius, top}}, .sides = 12};
    TriangleMesh mesh = lathed(bar);
    refine(mesh, 0.3);
    const Eigen::Isometry3d pose(Eigen::Translation3d(x, 0.12, 0));
    mason.add(name, Material::Iron, moved(mesh, pose));
  };
  upright("pole", -0.85, 0.0175, 4.25);
  constexpr double kLeft = 2.15;
  constexpr double kRight = 4.75;
  constexpr double kPitch = 0.13;
  constexpr int kBars = 20;
  for (int i = 0; i <= kBars; ++i) {
    const double radius = i % 10 == 0 ? 0.0175 : 0.008;
    upright("railing bar " + std::to_string(i + 1), kLeft + kPitch * i, radius, 3.25);
  }
  for (const double z : {2.82, 3.20}) {
    TriangleMesh rail = box({kLeft, 0.105, z}, {kRight, 0.135, z + 0.03});
    refine(rail, 0.3);
    mason.add(z < 3 ? "lower rail" : "upper rail", Material::Iron, rail);
  }
}

// Open above, so that the sun reaches its back over the facade.
void add_room(Mason& mason) {
  constexpr double kFront = 0.2;  // within the facade
  constexpr double kBack = kPaneBehind + kRoomBehindPane;
  mason.add_stone(
      "room back", Material::Ashlar, box({-3.2, kBack, -0.1}, {0.0, kBack + 0.2, 2.66}), 0.15);
  mason.add_stone(
      "room floor", Material::Paving, box({-3.0, kFront, -0.1}, {-0.2, kBack + 0.1, 0.9}), 0.15);
  mason.add_stone(
      "room left", Material::Ashlar, box({-3.0, kFront, -0.1}, {-2.55, kBack + 0.1, 2.6}), 0.15);
  mason.add_stone(
      "room right", Material::Ashlar, box({-0.65, kFront, -0.1}, {-0.2, kBack + 0.1, 2.6}), 0.15);
}

GlassPane window_glass() {
  constexpr double kInStone = 0.02;  // its rim lies within the masonry
  GlassPane pane;
  pane.corner = {kWindowLeft - kInStone, kPaneBehind, kWindowSill - kInStone};
  pane.across = Vector3d::UnitX() * (kWindowRight - kWindowLeft + 2 * kInStone);
  pane.up = Vector3d::UnitZ() * (kWindowTop - kWindowSill + 2 * kInStone);
  const Vector3f coded = 0.5F * (kAtHorizon + kAbove);
  for (int c = 0; c < 3; ++c) pane.mirrored[c] = linear_from_srgb(coded[c]);
  return pane;
}

}  // namespace

PortalScene courtyard_scene() {
  PortalScene scene;
  Mason mason(scene);
  mason.add_stone(
      "ground", Material::Paving, box({-kYardHalfWidth, -9, -0.5}, {kYardHalfWidth, 2, 0}), 0.15);
  add_facade(mason);
  add_door(mason);
  add_gable(mason);
  add_roofline(mason);
  add_irons(mason);
  add_room(mason);
  mason.add_stone("bench", Material::Ashlar, box({-2.6, -1.9, -0.05}, {-1.5, -1.4, 0.45}), 0.08);
  mason.add("white wall", Material::Plaster, box({1.35, -1.25, -0.1}, {6.4, -0.95, 2.4}));
  scene.panes.push_back(window_glass());
  scene.sky = sky_color;
  scene.exposure = kExposure;
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

std::vector<CaptureView> courtyard_views(int downscale) {
  const Vector3d middle(0, 0.2, 1.85);
  uint32_t count = 0;
  const auto view = [&](const char* name, bool input, const Vector3d& eye, const Vector3d& at) {
    return CaptureView{name, input, capture_camera(eye, at, downscale), ++count};
  };
  return {
      view("view_01", true, {-1.05, -7.15, 1.75}, middle),
      view("view_02", true, {0.02, -7.30, 1.95}, middle),
      view("view_03", true, {1.08, -7.10, 1.70}, middle),
      view("view_04", false, {-0.50, -7.20, 1.62}, middle),
      view("view_05", false, {0.56, -7.25, 2.05}, middle),
      view("view_06", false, {-3.00, -6.50, 1.80}, middle + Vector3d(-0.35, 0, 0)),
      view("view_07", false, {3.05, -6.40, 2.00}, middle + Vector3d(0.35, 0, 0)),
      view("view_08", false, {0.85, -5.20, 2.55}, middle + Vector3d(0.1, 0, -0.10)),
  };
}

}  // namespace cgs
