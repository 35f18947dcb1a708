// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/reef.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <Eigen/Geometry>

#include "samples/capture/mason.h"

namespace cgs {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kWidth = 1.6;  // [m]
constexpr double kTop = 1.1;    // [m]

double coral(double x, double z) {
  const NoiseBand swell{.longest = 0.5F, .shortest = 0.25F, .gain = 0.5F};
  const NoiseBand polyps{.longest = 0.09F, .shortest = 0.03F, .gain = 0.5F};
  const Vector3f p(static_cast<float>(x), 0, static_cast<float>(z));
  return 0.05 * double(band_noise(p, swell, 0.001F, 71)) +
         0.007 * double(band_noise(p, polyps, 0.001F, 72));
}

// From one end to the other, five pixels wide where photographs are taken from.
TriangleMesh branch(const Vector3d& from, const Vector3d& to) {
  const Vector3d way = to - from;
  const double length = way.norm();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), way).toRotationMatrix();
  pose.translation() = from;
  Lathe lathe{.profile = {}, .sides = 16};
  constexpr int kRings = 24;
  for (int i = 0; i <= kRings; ++i) {
    const double t = double(i) / kRings;
    lathe.profile.emplace_back(0.0065 - 0.0015 * t, length * t);
  }
  return moved(lathed(lathe), pose);
}

template <typename Height>
double volume_under(const Height& height) {
  constexpr double kStep = 0.001;  // [m]
  double sum = 0;
  for (double x = -kWidth / 2; x < kWidth / 2; x += kStep) {
    for (double z = 0; z < kTop; z += kStep) sum += height(x, z) * kStep * kStep;
  }
  return sum;
}

}  // namespace

double grown_by(double x, double z, const ReefGrowth& growth) {
  const double r = std::hypot(x - growth.x, z - growth.z);
  constexpr double kRim = 0.02;  // [m]
  if (r >= growth.radius) return 0;
  const double t = std::min(1.0, (growth.radius - r) / kRim);
  return growth.thickness * t * t * (3 - 2 * t);
}

double knob_height(double x, double z, const ReefKnob& knob) {
  const double t = std::hypot(x - knob.x, z - knob.z) / knob.radius;
  return t >= 1 ? 0 : knob.height * (1 - t * t) * (1 - t * t);
}

double reef_gain() {
  return volume_under([](double x, double z) { return grown_by(x, z); });
}

double reef_loss() {
  return volume_under([](double x, double z) { return knob_height(x, z); });
}

PortalScene reef_scene(ReefDate date) {
  PortalScene scene;
  Mason mason(scene);
  const auto height = [date](double x, double z) {
    const double change = date == ReefDate::Earlier ? knob_height(x, z) : grown_by(x, z);
    return coral(x, z) + change;
  };
  add_panel(
      mason,
      "wall",
      {{.width = kWidth, .bottom = 0, .top = kTop, .spacing = 0.005, .height = height}, {0, 0, 0}},
      Material::Carved);
  mason.add("branch 1", Material::Arch, branch({-0.05, -0.02, 0.15}, {0.02, -0.12, 0.42}));
  mason.add("branch 2", Material::Arch, branch({0.0, -0.02, 0.62}, {-0.1, -0.14, 0.84}));
  mason.add("branch 3", Material::Arch, branch({0.45, -0.02, 0.6}, {0.36, -0.12, 0.85}));
  mason.add_stone("ground", Material::Paving, box({-3, -3, -0.3}, {3, 1, 0}), 0.1);
  scene.exposure = 0.9F;
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

std::vector<CaptureView> reef_views(ReefDate date, int downscale) {
  constexpr int kCount = 6;
  std::vector<CaptureView> out;
  const double aside = date == ReefDate::Earlier ? 0 : 0.06;  // [m]
  for (int i = 0; i < kCount; ++i) {
    const double x = 0.24 * (i - (kCount - 1) / 2.0) + aside;
    const Vector3d eye(x, -1.25 + 0.05 * (i % 2) - aside, 0.6 + 0.12 * (i % 3) + 0.5 * aside);
    char name[16];  // NOLINT(modernize-avoid-c-arrays)
    std::snprintf(name, sizeof name, "view_%02d", i + 1);
    const auto seed = static_cast<uint32_t>(i + 1 + (date == ReefDate::Later ? 20 : 0));
    out.push_back({name, true, capture_camera(eye, {0.3 * x, 0, 0.5}, downscale), seed});
  }
  return out;
}

}  // namespace cgs
