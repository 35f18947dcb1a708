// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/surface_colour.h"

#include <algorithm>
#include <cmath>

#include "samples/capture/arch.h"
#include "samples/capture/noise.h"

namespace cgs {

namespace {

using Eigen::Vector3f;

Vector3f mix(const Vector3f& a, const Vector3f& b, float t) { return a + t * (b - a); }

// Round spots, one per cubic cell of a turned lattice: 1 inside a spot, 0 outside.
float spots(const Vector3f& p, float cell, float footprint, uint32_t seed) {
  const Vector3f turned(0.36F * p.x() + 0.48F * p.y() - 0.80F * p.z(),
                        -0.80F * p.x() + 0.60F * p.y(),
                        0.48F * p.x() + 0.64F * p.y() + 0.60F * p.z());
  const Vector3f q = turned / cell;
  const Vector3f corner = q.array().floor();
  const uint32_t h =
      mixed(static_cast<uint32_t>(static_cast<int32_t>(corner.x())),
            mixed(static_cast<uint32_t>(static_cast<int32_t>(corner.y())),
                  mixed(static_cast<uint32_t>(static_cast<int32_t>(corner.z())), seed)));
  if (uniform(h, 5) < 0.55F) return 0;  // empty cells keep the lattice from showing
  const float size = uniform(h, 4);
  const float radius = 0.08F + 0.37F * size * size;
  const Vector3f centre(radius + (1 - 2 * radius) * uniform(h, 1),
                        radius + (1 - 2 * radius) * uniform(h, 2),
                        radius + (1 - 2 * radius) * uniform(h, 3));
  const float soft = std::max(0.15F * radius, footprint / cell);
  return smooth_step(radius, radius - soft, (q - corner - centre).norm());
}

// One dimension of masonry: which block a coordinate lies in, and how far from the next joint.
struct Course {
  uint32_t index = 0;
  float joint = 0;  // distance to the nearest joint [m]
};

Course course(float x, float pitch, float irregular, uint32_t seed) {
  const auto boundary = [&](float i) {
    const auto key = static_cast<uint32_t>(static_cast<int32_t>(i));
    return pitch * (i + irregular * (uniform(key, seed) - 0.5F));
  };
  float i = std::floor(x / pitch);
  if (x < boundary(i)) --i;
  if (x >= boundary(i + 1)) ++i;
  return {mixed(static_cast<uint32_t>(static_cast<int32_t>(i)), seed),
          std::min(x - boundary(i), boundary(i + 1) - x)};
}

struct Block {
  uint32_t id = 0;
  float joint = 0;
};

Block block_at(float across, float up, const Eigen::Vector2f& size, uint32_t seed) {
  const Course row = course(up, size.y(), 0.35F, seed);
  const float offset = size.x() * uniform(row.index, 3);
  const Course stone = course(across + offset, size.x(), 0.6F, row.index);
  return {mixed(stone.index, row.index), std::min(row.joint, stone.joint)};
}

Block masonry(const PatternPoint& s) {
  const Vector3f& p = s.position;
  const Vector3f n = s.normal.cwiseAbs();
  if (s.material == Material::Arch) {
    const float up = p.z() - static_cast<float>(kSpringing);
    const float along =
        up > 0 ? static_cast<float>(kWallRadius) * std::atan2(up, std::abs(p.x())) : up;
    const uint32_t seed = s.part * 31 + (p.x() > 0 ? 1 : 0);
    const Course stone = course(along, 0.36F, 0.4F, seed);
    return {stone.index, stone.joint};
  }
  if (s.material == Material::Carved) {
    const Course stone = course(p.z(), 0.70F, 0.5F, s.part);
    return {stone.index, stone.joint};
  }
  if (n.z() > 0.7F) return block_at(p.x(), p.y(), {0.62F, 0.44F}, 7 + s.part);
  const float across = n.y() > n.x() ? p.x() : p.y() + 0.37F;
  return block_at(across, p.z(), {0.66F, 0.37F}, 11 + s.part);
}

// Brightness pattern of all sizes from centimetres to metres, as a factor.
float grain(const PatternPoint& s, uint32_t seed, float strength) {
  const float all = band_noise(
      s.position, {.longest = 1.3F, .shortest = 0.018F, .gain = 1.08F}, s.footprint, seed);
  return std::exp(strength * all);
}

Vector3f stone_tint(const Block& block, uint32_t part, bool paving) {
  static const Vector3f kLime(0.50F, 0.42F, 0.30F);
  static const Vector3f kGrey(0.36F, 0.35F, 0.32F);
  static const Vector3f kRed(0.46F, 0.30F, 0.21F);
  const uint32_t h = mixed(block.id, part);
  Vector3f tint = mix(kLime, paving ? kGrey : kRed, 0.55F * uniform(h, 1));
  tint = mix(tint, kGrey, 0.5F * uniform(h, 2));
  return tint * (0.72F + 0.5F * uniform(h, 3));
}

Vector3f stone(const PatternPoint& s) {
  const Vector3f& p = s.position;
  const float f = s.footprint;
  const Block block = masonry(s);
  const uint32_t own = block.id;
  // The pattern of a block is its own: it was cut from another place of the quarry.
  const Vector3f quarry =
      p + Vector3f(7 * uniform(own, 4), 7 * uniform(own, 5), 7 * uniform(own, 6));
  PatternPoint cut = s;
  cut.position = quarry;
  Vector3f color =
      stone_tint(block, s.part, s.material == Material::Paving) * grain(cut, 11, 0.30F);

  const float bedding =
      gradient_noise({quarry.x() / 0.5F, quarry.y() / 0.5F, quarry.z() / 0.045F}, 61);
  color *= 1 + 0.22F * bedding * smooth_step(0.1F, 0.7F, uniform(own, 7));

  color *= 1 - 0.50F * spots(p, 0.075F, f, 1) - 0.30F * spots(p, 0.19F, f, 2);
  color += Vector3f(0.20F, 0.18F, 0.14F) *
           (0.8F * spots(p, 0.055F, f, 3) + 0.5F * spots(p, 0.13F, f, 4));

  // Rain carries soot down: streaks that are long in z.
  const Vector3f streak(p.x() / 0.16F, p.y() / 0.16F, p.z() / 1.4F);
  const float soot =
      gradient_noise(streak, 21) + 0.5F * gradient_noise(2.3F * streak, 22) +
      0.35F * band_noise(p, {.longest = 0.2F, .shortest = 0.025F, .gain = 0.8F}, f, 23);
  color *= 1 - 0.62F * smooth_step(0.22F, 0.75F, soot);

  const float patch = band_noise(p, {.longest = 1.0F, .shortest = 0.06F, .gain = 0.75F}, f, 31);
  const float ragged = band_noise(p, {.longest = 0.06F, .shortest = 0.015F, .gain = 1}, f, 32);
  static const Vector3f kPale(0.46F, 0.48F, 0.36F);
  static const Vector3f kOrange(0.50F, 0.30F, 0.07F);
  static const Vector3f kMoss(0.11F, 0.14F, 0.05F);
  color = mix(color,
              kPale * (1 + 0.5F * ragged),
              0.75F * smooth_step(0.50F, 0.62F, patch + 0.25F * ragged));
  color =
      mix(color,
          kOrange * (1 + 0.4F * ragged),
          0.8F * smooth_step(
                     0.80F, 0.92F, gradient_noise(p / 0.23F, 33) - 0.4F * patch + 0.35F * ragged));
  const float damp = smooth_step(0.9F, 0.0F, p.z()) + smooth_step(0.5F, 1.0F, s.normal.z());
  color = mix(color,
              kMoss * (1 + 0.5F * ragged),
              0.7F * smooth_step(0.55F, 0.8F, 0.25F * damp - patch + 0.3F * ragged));

  const bool jointed = s.material != Material::Carved;
  const float wobble = 0.006F * ragged;
  const float mortar = smooth_step(0.009F + f, 0.009F, block.joint + wobble);
  const Vector3f joint = Vector3f(0.20F, 0.17F, 0.13F) * (1 + 0.5F * ragged);
  return mix(color, joint, (jointed ? 0.85F : 0.5F) * mortar);
}

Vector3f wood(const PatternPoint& s) {
  const Vector3f& p = s.position;
  const Course plank = course(p.x(), 0.19F, 0.3F, 3);
  const float own = 9 * uniform(plank.index, 1);
  const float fibre = gradient_noise({p.x() / 0.022F, own, p.z() / 0.7F}, 41) +
                      0.8F * gradient_noise({p.x() / 0.05F, own + 3, p.z() / 0.35F}, 42);
  const float all = grain(s, 43, 0.30F);
  Vector3f color = mix({0.30F, 0.17F, 0.08F}, {0.22F, 0.19F, 0.16F}, uniform(plank.index, 2));
  color *= all * (1 + 0.4F * fibre) * (0.7F + 0.6F * uniform(plank.index, 3));
  color *= 1 - 0.7F * spots(p, 0.09F, s.footprint, 44);
  return color * (1 - 0.75F * smooth_step(0.008F + s.footprint, 0.006F, plank.joint));
}

Vector3f iron(const PatternPoint& s) {
  const float rust =
      band_noise(s.position, {.longest = 0.2F, .shortest = 0.02F, .gain = 0.9F}, s.footprint, 51);
  const Vector3f color =
      mix({0.10F, 0.095F, 0.09F}, {0.34F, 0.14F, 0.05F}, smooth_step(-0.2F, 0.5F, rust));
  return color * grain(s, 52, 0.25F);
}

Vector3f painted(const PatternPoint& s) {
  const Vector3f& p = s.position;
  const float wear = band_noise(
      p, {.longest = 0.30F, .shortest = 0.018F, .gain = 0.85F}, s.footprint, 55 + s.part);
  static const Vector3f kPaint(0.11F, 0.24F, 0.26F);
  static const Vector3f kPrimer(0.36F, 0.17F, 0.09F);
  static const Vector3f kMetal(0.45F, 0.44F, 0.42F);
  Vector3f color = kPaint * grain(s, 57, 0.22F);
  color = mix(color, kPrimer * grain(s, 58, 0.2F), smooth_step(0.25F, 0.35F, wear));
  color = mix(color, kMetal * grain(s, 59, 0.2F), smooth_step(0.60F, 0.68F, wear));
  return color * (1 - 0.5F * spots(p, 0.06F, s.footprint, 60)) +
         Vector3f::Constant(0.16F) * spots(p, 0.07F, s.footprint, 62);
}

}  // namespace

Vector3f albedo(const PatternPoint& point) {
  const auto color = [&]() -> Vector3f {
    switch (point.material) {
      case Material::Wood:
        return wood(point);
      case Material::Iron:
        return iron(point);
      case Material::Painted:
        return painted(point);
      case Material::Plaster:
        return Vector3f::Constant(0.85F);
      default:
        return stone(point);
    }
  }();
  return color.cwiseMax(0.01F).cwiseMin(0.95F);
}

}  // namespace cgs
