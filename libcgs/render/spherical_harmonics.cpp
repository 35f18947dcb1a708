// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/spherical_harmonics.h"

#include <cassert>
#include <cmath>

#include "libcgs/core/gaussians.h"

namespace cgs {

namespace {

// Normalisation of the real basis, sqrt of rational multiples of 1/pi.
constexpr float kXY = 1.0925484305920792f;      // sqrt(15 / 4pi)
constexpr float kZZ = 0.31539156525252005f;     // sqrt(5 / 16pi)
constexpr float kXXYY = 0.5462742152960396f;    // sqrt(15 / 16pi)
constexpr float kCubic = 0.5900435899266435f;   // sqrt(35 / 32pi)
constexpr float kXYZ = 2.890611442640554f;      // sqrt(105 / 4pi)
constexpr float kLinear = 0.4570457994644658f;  // sqrt(21 / 32pi)
constexpr float kZZZ = 0.3731763325901154f;     // sqrt(7 / 16pi)
constexpr float kZXXYY = 1.445305721320277f;    // sqrt(105 / 16pi)

Eigen::Vector3f bands_above_0(std::span<const Eigen::Vector3f> c,
                              int degree,
                              const Eigen::Vector3f& direction) {
  const float x = direction.x();
  const float y = direction.y();
  const float z = direction.z();
  Eigen::Vector3f sum = kShC1 * (z * c[2] - y * c[1] - x * c[3]);
  if (degree == 1) return sum;
  const float xx = x * x;
  const float yy = y * y;
  const float zz = z * z;
  sum += kXY * (x * y * c[4] - y * z * c[5] - x * z * c[7]) + kZZ * (2 * zz - xx - yy) * c[6] +
         kXXYY * (xx - yy) * c[8];
  if (degree == 2) return sum;
  sum += kXYZ * x * y * z * c[10] + kZXXYY * z * (xx - yy) * c[14] -
         kCubic * (y * (3 * xx - yy) * c[9] + x * (xx - 3 * yy) * c[15]) -
         kLinear * (4 * zz - xx - yy) * (y * c[11] + x * c[13]) +
         kZZZ * z * (2 * zz - 3 * xx - 3 * yy) * c[12];
  return sum;
}

}  // namespace

Eigen::Vector3f sh_color(std::span<const Eigen::Vector3f> coefficients,
                         int degree,
                         const Eigen::Vector3f& direction) {
  assert(degree >= 0 && degree <= 3);
  assert(coefficients.size() >= static_cast<size_t>((degree + 1) * (degree + 1)));
  Eigen::Vector3f sum = kShC0 * coefficients[0];
  if (degree > 0 && std::isfinite(direction.sum())) {
    // At a zero direction the even bands are not zero by themselves.
    if (!direction.isZero(0)) sum += bands_above_0(coefficients, degree, direction);
  }
  // Written so that NaN stays visible instead of turning black.
  return sum.unaryExpr([](float value) { return value < -0.5f ? 0.0f : value + 0.5f; });
}

ShBasis sh_basis(int degree, const Eigen::Vector3f& direction) {
  assert(degree >= 0 && degree <= 3);
  ShBasis out;
  out.slope.fill(Eigen::Vector3f::Zero());
  out.value[0] = kShC0;
  if (degree == 0 || !std::isfinite(direction.sum()) || direction.isZero(0)) return out;
  const float x = direction.x();
  const float y = direction.y();
  const float z = direction.z();
  const auto set = [&](int k, float value, float of_x, float of_y, float of_z) {
    out.value[k] = value;
    out.slope[k] = {of_x, of_y, of_z};
  };
  set(1, -kShC1 * y, 0, -kShC1, 0);
  set(2, kShC1 * z, 0, 0, kShC1);
  set(3, -kShC1 * x, -kShC1, 0, 0);
  if (degree == 1) return out;
  const float xx = x * x;
  const float yy = y * y;
  const float zz = z * z;
  set(4, kXY * x * y, kXY * y, kXY * x, 0);
  set(5, -kXY * y * z, 0, -kXY * z, -kXY * y);
  set(6, kZZ * (2 * zz - xx - yy), -2 * kZZ * x, -2 * kZZ * y, 4 * kZZ * z);
  set(7, -kXY * x * z, -kXY * z, 0, -kXY * x);
  set(8, kXXYY * (xx - yy), 2 * kXXYY * x, -2 * kXXYY * y, 0);
  if (degree == 2) return out;
  const float c = kCubic;
  const float l = kLinear;
  set(9, -c * y * (3 * xx - yy), -6 * c * x * y, -3 * c * (xx - yy), 0);
  set(10, kXYZ * x * y * z, kXYZ * y * z, kXYZ * x * z, kXYZ * x * y);
  set(11, -l * y * (4 * zz - xx - yy), 2 * l * x * y, -l * (4 * zz - xx - 3 * yy), -8 * l * y * z);
  set(12,
      kZZZ * z * (2 * zz - 3 * xx - 3 * yy),
      -6 * kZZZ * x * z,
      -6 * kZZZ * y * z,
      kZZZ * (6 * zz - 3 * xx - 3 * yy));
  set(13, -l * x * (4 * zz - xx - yy), -l * (4 * zz - 3 * xx - yy), 2 * l * x * y, -8 * l * x * z);
  set(14, kZXXYY * z * (xx - yy), 2 * kZXXYY * x * z, -2 * kZXXYY * y * z, kZXXYY * (xx - yy));
  set(15, -c * x * (xx - 3 * yy), -3 * c * (xx - yy), 6 * c * x * y, 0);
  return out;
}

}  // namespace cgs
