// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/camera.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/lanes.h"
#include "libcgs/core/padded_raster.h"

namespace cgs {

Eigen::Isometry3d Camera::cam_from_world() const { return world_from_cam.inverse(); }

Eigen::Matrix3d Camera::intrinsics() const {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = fx;
  K(1, 1) = fy;
  K(0, 2) = cx;
  K(1, 2) = cy;
  return K;
}

Camera resized(const Camera& camera, int width, int height) {
  const double sx = static_cast<double>(width) / camera.width;
  const double sy = static_cast<double>(height) / camera.height;
  Camera out = camera;
  out.width = width;
  out.height = height;
  out.fx *= sx;
  out.cx *= sx;
  out.fy *= sy;
  out.cy *= sy;
  return out;
}

Camera resized_to_fit(const Camera& camera, int side) {
  const double factor = double(std::max(camera.width, camera.height)) / side;
  if (factor <= 1) return camera;
  const auto fitting = [&](int pixels) {
    return std::max(1, static_cast<int>(std::lround(pixels / factor)));
  };
  return resized(camera, fitting(camera.width), fitting(camera.height));
}

namespace {

// Directions as ray_in_cam() gives them, of every column and row of pixels and a margin of one.
struct Rays {
  explicit Rays(const Camera& camera)
      : across(size_t(camera.width) + 2 + size_t{kLanes}), down(size_t(camera.height) + 2) {
    for (int x = -1; x <= camera.width; ++x) {
      across[size_t(x + 1)] = camera.ray_in_cam(x + 0.5, 0).x();
    }
    for (int y = -1; y <= camera.height; ++y) {
      down[size_t(y + 1)] = camera.ray_in_cam(0, y + 0.5).y();
    }
  }
  std::vector<double> across, down;
};

constexpr int kHalf = kLanes / 2;
using Doubles = double __attribute__((vector_size(sizeof(double) * kHalf)));
using Vectors = std::array<Doubles, 3>;

// Half of eight floats, from lane `first` on.
Doubles as_doubles(Floats values, int first) {
  const __m256 all = values;
  return _mm256_cvtps_pd(first == 0 ? _mm256_castps256_ps128(all) : _mm256_extractf128_ps(all, 1));
}

Doubles select_half(Ints mask, int first, Doubles yes, Doubles no) {
  const auto all = std::bit_cast<__m256i>(mask);
  const __m256i wide = _mm256_cvtepi32_epi64(first == 0 ? _mm256_castsi256_si128(all)
                                                        : _mm256_extracti128_si256(all, 1));
  return _mm256_blendv_pd(no, yes, _mm256_castsi256_pd(wide));
}

// Between which two of a pixel, the one before and the one after along an axis a surface is
// differentiated, for eight pixels. Of a one-sided and a central difference the one with the
// smaller depth step is taken, so that normals at an occlusion edge belong to the surface of the
// pixel and not to the jump.
struct Stencil {
  Ints to_after, from_before;  // else the pixel itself
  Floats to, from;             // depths; equal where there is no neighbour
};

Stencil stencil(Floats before, Floats here, Floats after) {
  constexpr float kEdgeRatio = 3.0f;
  const Floats step_before = magnitude(before - here);
  const Floats step_after = magnitude(after - here);
  const Ints has_before = step_before - step_before == 0.0f;
  const Ints has_after = step_after - step_after == 0.0f;
  const Ints is_central = has_before & has_after &
                          (step_before <= kEdgeRatio * step_after + 1e-6f * here) &
                          (step_after <= kEdgeRatio * step_before + 1e-6f * here);
  const Ints is_backward = ~is_central & (~has_after | (has_before & (step_before < step_after)));
  Stencil out;
  out.to_after = has_after & ~is_backward;
  out.from_before = has_before & (is_central | is_backward);
  out.to = select(out.to_after, after, here);
  out.from = select(out.from_before, before, here);
  return out;
}

// Differences of unprojected points, for the pixels from `first` of eight on.
Vectors across_tangents(const Stencil& s, const double* across, double down, int first) {
  const Doubles here = load<Doubles>(across + 1);
  const Doubles to_ray = select_half(s.to_after, first, load<Doubles>(across + 2), here);
  const Doubles from_ray = select_half(s.from_before, first, load<Doubles>(across), here);
  const Doubles to = as_doubles(s.to, first);
  const Doubles from = as_doubles(s.from, first);
  return {to * to_ray - from * from_ray, to * down - from * down, to - from};
}

Vectors down_tangents(const Stencil& s, const double* across, const double* down, int first) {
  const Doubles rays = load<Doubles>(across + 1);
  const Doubles none = {};
  const Doubles to_ray = select_half(s.to_after, first, none + down[2], none + down[1]);
  const Doubles from_ray = select_half(s.from_before, first, none + down[0], none + down[1]);
  const Doubles to = as_doubles(s.to, first);
  const Doubles from = as_doubles(s.from, first);
  return {to * rays - from * rays, to * to_ray - from * from_ray, to - from};
}

// In world axes; 0 where there are none.
Vectors unit_normals(const Vectors& a, const Vectors& b, const Eigen::Matrix3d& R) {
  const Vectors n = {
      a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  // Sums in the order of Eigen's.
  const Doubles length = _mm256_sqrt_pd(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const Vectors unit = {n[0] / length, n[1] / length, n[2] / length};
  Vectors out;
  for (int k = 0; k < 3; ++k) {
    const Doubles turned = R(k, 0) * unit[0] + (R(k, 1) * unit[1] + R(k, 2) * unit[2]);
    out[size_t(k)] =
        _mm256_blendv_pd(Doubles{}, turned, _mm256_cmp_pd(length, Doubles{}, _CMP_GT_OQ));
  }
  return out;
}

}  // namespace

NormalMap normals_from_depth(const DepthMap& depth, const Camera& camera) {
  NormalMap normals(depth.width, depth.height, Eigen::Vector3f::Zero());
  const Eigen::Matrix3d R = camera.world_from_cam.rotation();
  const Rays rays(camera);
  const Raster<float> padded = with_margin(depth, 1);
  tbb::parallel_for(0, depth.height, [&](int y) {
    const auto row = [&](int x, int dx, int dy) {
      return load<Floats>(&padded(x + 1 + dx, y + 1 + dy));
    };
    for (int x = 0; x < depth.width; x += kLanes) {
      const Floats here = row(x, 0, 0);
      const unsigned known = bits(here - here == 0.0f);
      if (known == 0) continue;
      const Stencil across = stencil(row(x, -1, 0), here, row(x, 1, 0));
      const Stencil down = stencil(row(x, 0, -1), here, row(x, 0, 1));
      for (int first = 0; first < kLanes; first += kHalf) {
        const double* const columns = &rays.across[size_t(x + first)];
        const Vectors unit =
            unit_normals(down_tangents(down, columns, &rays.down[size_t(y)], first),
                         across_tangents(across, columns, rays.down[size_t(y + 1)], first),
                         R);
        for (int k = 0; k < kHalf && x + first + k < depth.width; ++k) {
          if ((known >> (first + k) & 1) == 0) continue;
          normals(x + first + k, y) =
              Eigen::Vector3d(unit[0][k], unit[1][k], unit[2][k]).cast<float>();
        }
      }
    }
  });
  return normals;
}

}  // namespace cgs
