// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/vase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <Eigen/Geometry>

#include "samples/capture/mason.h"

namespace cgs {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using std::numbers::pi;

constexpr double kHeight = 0.9;  // [m]
constexpr double kTable = 0.06;  // thickness of its top [m]

Vector3f overcast(const Vector3d& direction) {
  const auto up = static_cast<float>(direction.z() / direction.norm());
  return Vector3f(0.80F, 0.83F, 0.87F) + smooth_step(0, 0.8F, up) * Vector3f::Constant(0.1F);
}

// 1 in the middle of a band of heights, 0 outside it.
double within(double z, double low, double high) {
  const double t = (z - low) / (high - low);
  return t <= 0 || t >= 1 ? 0 : std::sin(pi * t);
}

// Gadroons on the belly, a frieze of bosses around the shoulder, flutes on the neck.
double relief(double angle, double z) {
  const double gadroons = 0.05 * std::abs(std::sin(9 * angle)) * within(z, 0.10, 0.36);
  const double bosses = std::max(0.0, std::cos(12 * angle)) * std::max(0.0, within(z, 0.40, 0.50));
  const double vine = 0.03 * std::cos(5 * angle + 40 * z) * within(z, 0.36, 0.54);
  const double flutes = 0.04 * std::cos(16 * angle) * within(z, 0.60, 0.72);
  return 1 + gadroons + 0.06 * bosses + vine + flutes;
}

// Points between the stations of a profile, for what is carved on it.
std::vector<Vector2d> smooth(const std::vector<Vector2d>& stations, double step) {
  std::vector<Vector2d> out;
  for (size_t i = 0; i + 1 < stations.size(); ++i) {
    const Vector2d way = stations[i + 1] - stations[i];
    const int count = std::max(1, static_cast<int>(std::ceil(way.norm() / step)));
    for (int k = 0; k < count; ++k) out.emplace_back(stations[i] + way * k / count);
  }
  out.push_back(stations.back());
  return out;
}

TriangleMesh carved_vase() {
  Lathe lathe{
      .profile = smooth(
          {{0.13, 0},     {0.13, 0.03},  {0.10, 0.05},   {0.08, 0.09},   {0.13, 0.13}, {0.20, 0.22},
           {0.245, 0.32}, {0.26, 0.42},  {0.24, 0.50},   {0.18, 0.57},   {0.13, 0.61}, {0.12, 0.66},
           {0.13, 0.71},  {0.17, 0.735}, {0.17, 0.755},  {0.14, 0.765},  {0.12, 0.79}, {0.07, 0.82},
           {0.035, 0.83}, {0.045, 0.86}, {0.035, 0.885}, {0.01, kHeight}},
          0.01),
      .sides = 256};
  lathe.carving = relief;
  return lathed(lathe);
}

}  // namespace

PortalScene vase_scene() {
  PortalScene scene;
  Mason mason(scene);
  mason.add(kVase, Material::Carved, carved_vase());
  const auto lathe = [&](const char* name, Material material, std::vector<Vector2d> profile) {
    mason.add_stone(name, material, lathed({.profile = std::move(profile), .sides = 96}), 0.06);
  };
  lathe("table", Material::Arch, {{0.50, -kTable}, {0.53, -0.03}, {0.53, -0.01}, {0.52, 0}});
  lathe(
      "leg", Material::Ashlar, {{0.22, -0.75}, {0.12, -0.65}, {0.12, -0.2}, {0.2, -kTable + 0.01}});
  mason.add_stone("ground", Material::Paving, box({-5, -5, -1}, {5, 5, -0.72}), 0.15);
  scene.sky = overcast;
  scene.exposure = 0.85F;
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

std::vector<CaptureView> vase_views(int downscale) {
  struct Ring {
    int count;
    double elevation, distance, first;  // [degrees], [m], [degrees]
  };
  constexpr std::array<Ring, 3> kRings = {
      {{14, -12, 1.45, 0}, {7, 28, 1.45, 10}, {3, 58, 1.4, 25}}};
  const Vector3d middle(0, 0, 0.44);
  std::vector<CaptureView> out;
  for (const Ring& ring : kRings) {
    for (int i = 0; i < ring.count; ++i) {
      const double azimuth = (ring.first + 360.0 * i / ring.count) * pi / 180;
      const double elevation = ring.elevation * pi / 180;
      const Vector3d eye =
          middle + ring.distance * Vector3d(std::cos(elevation) * std::sin(azimuth),
                                            -std::cos(elevation) * std::cos(azimuth),
                                            std::sin(elevation));
      char name[16];  // NOLINT(modernize-avoid-c-arrays)
      std::snprintf(name, sizeof name, "view_%02zu", out.size() + 1);
      out.push_back({name,
                     true,
                     capture_camera(eye, middle, downscale),
                     static_cast<uint32_t>(out.size() + 1)});
    }
  }
  return out;
}

}  // namespace cgs
