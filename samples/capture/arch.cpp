// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/arch.h"

#include <algorithm>

#include "samples/capture/noise.h"
#include "samples/capture/solids.h"

namespace cgs {

namespace {

using Eigen::Vector2d;
using std::numbers::pi;

double triangle_wave(double t) { return 4 * std::abs(t - std::floor(t + 0.5)) - 1; }

// Shaft patterns: twisted, diapered, fluted, plain; with the leaves of the capital on top.
double shaft_carving(uint32_t kind, double angle, double z) {
  const double capital = kSpringing - 0.12 - 0.42;
  if (z > capital) {
    const double t = (z - capital) / 0.42;
    const double leaves = std::abs(std::cos((2.0 + kind % 3U) * angle + (t > 0.5 ? 0.8 : 0.0)));
    return 1 + 0.22 * (leaves - 0.5) * std::sin(pi * std::min(1.0, 2 * std::fmod(t, 0.5) + 0.1));
  }
  if (z < kThreshold + 0.28) return 1;
  switch (kind % 4U) {
    case 0:
      return 1 + 0.09 * std::sin(3 * angle + 11 * z);
    case 1:
      return 1 + 0.08 * triangle_wave(0.6366 * angle + 2.6 * z) *
                     triangle_wave(0.6366 * angle - 2.6 * z);
    case 2:
      return 1 + 0.06 * std::cos(10 * angle);
    default:
      return 1;
  }
}

}  // namespace

std::vector<Station> arch_path(double bottom, double radius, double spacing) {
  std::vector<Station> path;
  const int jamb = bottom < kSpringing ? static_cast<int>((kSpringing - bottom) / 0.06) : 0;
  const int steps = static_cast<int>(pi * radius / spacing);
  const auto height = [&](int i) { return bottom + (kSpringing - bottom) * i / jamb; };
  const int count = 2 * jamb + steps + 1;
  path.reserve(static_cast<size_t>(count));
  for (int i = 0; i < jamb; ++i) path.push_back({height(i), pi, -1});
  for (int i = 0; i <= steps; ++i) {
    path.push_back({kSpringing, pi - pi * i / steps, pi * radius * i / steps});
  }
  for (int i = jamb - 1; i >= 0; --i) path.push_back({height(i), 0, -1});
  return path;
}

TriangleMesh swept(const std::vector<Station>& path, const Section& section) {
  std::vector<Loop> loops;
  loops.reserve(path.size());
  for (const auto& station : path) {
    Loop loop;
    for (const auto& p : section(station.along)) loop.push_back(station.at(p));
    loops.push_back(loop);
  }
  return loft(loops, LoftEnds::Capped);
}

std::vector<Vector2d> order_section(int order, double along) {
  const double carved_arch = along >= 0 ? 1 : 0;
  const double pitch = 0.17 + 0.02 * order;
  const double cell = std::floor(along / pitch + 0.5);
  const double jitter =
      0.75 + 0.5 * static_cast<double>(
                       uniform(static_cast<uint32_t>(static_cast<int32_t>(cell)), 40U + order));
  const double wave = carved_arch * jitter * triangle_wave(along / pitch);
  const double roll = 0.06 * (1 + (order == 3 ? 0.22 * wave : 0.0));
  const double zigzag = order == 1 ? 0.035 * wave : 0;
  const double block = order == 2 ? 0.03 * std::clamp(4 * wave, -1.0, 1.0) : 0;
  const double r = order_radius(order);
  const double y = order_front(order);
  std::vector<Vector2d> out{{r + 0.34, y}, {r + 0.26, y}, {r + 0.21 + zigzag, y - block}};
  for (int i = 1; i < 5; ++i) {  // the hollow
    const double a = pi * i / 5;
    out.emplace_back(r + 0.165 + zigzag + 0.035 * std::cos(a),
                     y + 0.045 * std::sin(a) * (order == 2 ? -0.2 : 1.0) - block);
  }
  for (int i = 0; i <= 9; ++i) {  // the roll
    const double a = pi * (0.12 + 0.95 * i / 9);
    out.emplace_back(r + 0.062 + 0.5 * zigzag + roll * std::cos(a),
                     y + 0.055 - roll * std::sin(a) - (order == 1 ? 0.02 * wave : 0.0));
  }
  for (const double depth : {0.13, 0.2, 0.3, 0.6, kOrderBack - y}) out.emplace_back(r, y + depth);
  out.emplace_back(r + 0.34, kOrderBack);
  return out;
}

TriangleMesh column(uint32_t kind) {
  Lathe lathe{.profile = {}, .sides = 64, .carving = [kind](double angle, double z) {
                return shaft_carving(kind, angle, z);
              }};
  const double foot = kThreshold;
  lathe.profile = {{0.150, foot - 0.1},
                   {0.150, foot + 0.08},
                   {0.165, foot + 0.10},
                   {0.170, foot + 0.13},
                   {0.160, foot + 0.16},
                   {0.130, foot + 0.18},
                   {0.125, foot + 0.20},
                   {0.135, foot + 0.22},
                   {0.130, foot + 0.245},
                   {0.105, foot + 0.26}};
  const double neck = kSpringing - 0.12 - 0.42;
  for (double z = foot + 0.29; z < neck - 0.06; z += 0.025) lathe.profile.emplace_back(0.098, z);
  lathe.profile.insert(
      lathe.profile.end(),
      {{0.098, neck - 0.05}, {0.120, neck - 0.035}, {0.120, neck - 0.01}, {0.100, neck}});
  for (int i = 1; i <= 20; ++i) {
    const double t = i / 20.0;
    lathe.profile.emplace_back(0.10 + 0.075 * t * t + 0.02 * std::sin(pi * t), neck + 0.44 * t);
  }
  return lathed(lathe);
}

}  // namespace cgs
