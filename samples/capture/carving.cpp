// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/carving.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "samples/capture/noise.h"

namespace cgs {

namespace {

using std::numbers::pi;

// Half an ellipsoid of height 1 with half axes rx and rz, turned by `angle`.
struct Bump {
  double x = 0;
  double z = 0;
  double rx = 1;
  double rz = 1;
  double angle = 0;

  double at(double px, double pz) const {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const double u = (c * (px - x) + s * (pz - z)) / rx;
    const double v = (-s * (px - x) + c * (pz - z)) / rz;
    return std::sqrt(std::max(0.0, 1 - u * u - v * v));
  }
};

// A ridge of height 1 and half-width w around distance 0.
double ridge(double distance, double w) {
  const double t = distance / w;
  return std::sqrt(std::max(0.0, 1 - t * t));
}

double roughness(double x, double z, uint32_t seed) {
  const Eigen::Vector3f p(static_cast<float>(x), 0.37F, static_cast<float>(z));
  return static_cast<double>(
      band_noise(p, {.longest = 0.32F, .shortest = 0.04F, .gain = 0.6F}, 0.01F, seed));
}

// Petals about (0, 0), height 1.
double rosette(double x, double z, double radius, uint32_t seed) {
  const double r = std::hypot(x, z) / radius;
  if (r > 1.1) return 0;
  const int petals = 5 + static_cast<int>(mixed(seed, 1) % 6U);
  const double turn = static_cast<double>(uniform(seed, 2)) * 2 * pi;
  const double wave = 0.5 + 0.5 * std::cos(petals * (std::atan2(z, x) + turn));
  const double petal = ridge(r - 0.52, 0.40) * (0.3 + 0.7 * wave);
  return std::max({petal, 0.9 * ridge(r, 0.22), 0.5 * ridge(r - 1.0, 0.09)});
}

// Leaves and berries that fill what is free between figures.
double foliage(double x, double z, double cell, uint32_t seed) {
  double height = 0;
  const double column = std::floor(x / cell);
  const double row = std::floor(z / cell);
  for (int i = -1; i <= 1; ++i) {
    for (int k = -1; k <= 1; ++k) {
      const auto cx = static_cast<uint32_t>(static_cast<int32_t>(column) + i);
      const auto cz = static_cast<uint32_t>(static_cast<int32_t>(row) + k);
      const uint32_t h = mixed(cx, mixed(cz, seed));
      const double size = cell * (0.3 + 0.45 * static_cast<double>(uniform(h, 1)));
      const Bump leaf{(column + i + static_cast<double>(uniform(h, 2))) * cell,
                      (row + k + static_cast<double>(uniform(h, 3))) * cell,
                      size,
                      size * (0.3 + 0.5 * static_cast<double>(uniform(h, 4))),
                      2 * pi * static_cast<double>(uniform(h, 5))};
      const double strength = 0.4 + 0.6 * static_cast<double>(uniform(h, 6));
      height = std::max(height, strength * leaf.at(x, z));
    }
  }
  return height;
}

// A standing or seated person of height 1 about x = 0, feet at z = 0; height of the relief 1.
double person(double x, double z, uint32_t seed) {
  const double lean = 0.10 * (static_cast<double>(uniform(seed, 1)) - 0.5);
  x -= lean * z;
  const double arm = 0.5 + 0.6 * static_cast<double>(uniform(seed, 2));
  const double head = Bump{0, 0.87, 0.085, 0.11}.at(x, z);
  const double halo = 0.35 * std::max(Bump{0, 0.87, 0.17, 0.17}.at(x, z) > 0 ? 0.6 : 0.0,
                                      ridge(std::hypot(x, z - 0.87) - 0.155, 0.025));
  const double torso = 0.85 * Bump{0, 0.60, 0.17, 0.20}.at(x, z);
  const double robe = 0.80 * Bump{0, 0.28, 0.20, 0.36}.at(x, z);
  const double left = 0.9 * Bump{-0.15, 0.58, 0.06, 0.17, -arm}.at(x, z);
  const double right = 0.9 * Bump{0.15, 0.56, 0.06, 0.17, 0.7 * arm}.at(x, z);
  const double book = Bump{0.06, 0.50, 0.07, 0.09, 0.3}.at(x, z) > 0.2 ? 0.95 : 0.0;
  const double body = std::max(torso, robe);
  const Eigen::Vector3f cloth(static_cast<float>(4 * x), 0.21F, static_cast<float>(3.1 * z));
  const auto drape = static_cast<double>(gradient_noise(cloth, seed));
  const double phase = 40 * x / (1.15 - 0.5 * z) + 3.5 * drape + 1.2 * std::sin(5 * z);
  const double folds = z < 0.72 ? (0.10 + 0.06 * drape) * std::sin(phase) : 0;
  return std::max({head, halo, body > 0 ? body + folds : 0.0, left, right, book});
}

}  // namespace

double tympanum_height(double x, double z, double radius) {
  constexpr uint32_t kSeed = 71;
  const double rough = 0.007 * roughness(x, z, kSeed);
  const double u = x / radius;
  const double v = z / radius;
  const double r = std::hypot(u, v);
  const double border = 0.045 * ridge(r - 0.94, 0.05);
  const double angle = std::atan2(v, u);
  const double beads =
      0.05 * ridge(std::remainder(angle * radius, 0.11), 0.045) * ridge((r - 0.84) * radius, 0.05);
  const double shape = std::hypot(u / 0.30, (v - 0.44) / 0.46);
  const double mandorla = 0.06 * ridge(shape - 1, 0.11);
  double height = std::max({border, beads, mandorla});
  if (shape < 1) height = std::max(height, 0.14 * person(u / 0.80, (v - 0.06) / 0.78, 5));
  if (shape > 1 && r < 0.78) {
    const double left = person((u + 0.52) / 0.46, (v - 0.02) / 0.50, 9);
    const double right = person((u - 0.51) / 0.44, (v - 0.02) / 0.46, 14);
    const double leaves = 0.05 * foliage(x, z, 0.13, kSeed);
    height = std::max({height, 0.11 * left, 0.11 * right, leaves});
  }
  return height + rough;
}

double frieze_height(double x, double z, double height, uint32_t seed) {
  const double pitch = 0.95 * height;
  const double cell = std::floor(x / pitch);
  const uint32_t own = mixed(static_cast<uint32_t>(static_cast<int32_t>(cell)), seed);
  const double radius = height * (0.34 + 0.08 * static_cast<double>(uniform(own, 7)));
  const double flower = rosette(x - (cell + 0.5) * pitch, z - 0.5 * height, radius, own);
  const double rims =
      std::max(ridge(z - 0.04 * height, 0.05 * height), ridge(z - 0.96 * height, 0.05 * height));
  const double leaves = 0.45 * foliage(x, z, 0.09, seed);
  return 0.055 * std::max({flower, 0.9 * rims, leaves}) + 0.006 * roughness(x, z, seed);
}

double figure_height(double x, double z, double height, uint32_t seed) {
  const double u = x / height;
  const double v = z / height;
  const double shape = 0.115 * person(u / 0.86, (v - 0.05) / 0.84, seed);
  const double leaves = v > 0.93 || v < 0.06 ? 0.05 * foliage(x, z, 0.10, seed) : 0;
  return std::max(shape, leaves) + 0.007 * roughness(x, z, seed);
}

double medallion_height(double x, double z, double radius, uint32_t seed) {
  const double dz = z - radius;
  const double flower = rosette(x, dz, 0.82 * radius, seed);
  const double ring = 0.7 * ridge(std::hypot(x, dz) - 0.93 * radius, 0.06 * radius);
  const double corner = std::hypot(x, dz) > radius ? 0.6 * foliage(x, z, 0.12, seed) : 0;
  return 0.075 * std::max({flower, ring, corner}) + 0.006 * roughness(x, z, seed);
}

double door_height(double x, double z) {
  const double leaf = std::abs(x);
  const double panel_x = std::remainder(leaf - 0.34, 0.56);
  const double panel_z = std::remainder(z - 0.36, 0.62);
  const double inside = std::min(0.20 - std::abs(panel_x), 0.24 - std::abs(panel_z));
  const double panel = 0.035 * std::clamp(inside / 0.05, 0.0, 1.0);
  const double nail_x = std::remainder(leaf - 0.06, 0.14);
  const double nail_z = std::remainder(z - 0.05, 0.62);
  const double nail = 0.035 * ridge(std::hypot(nail_x, nail_z), 0.032);
  const double gap = leaf < 0.015 ? -0.02 : 0;
  return std::max(panel, nail) + gap + 0.003 * roughness(x, z, 33);
}

}  // namespace cgs
