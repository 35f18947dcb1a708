// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace cgs {

/// A weighted sum of squared distances to planes, as a function of position.
///
/// Source: Garland, Heckbert 1997, "Surface Simplification Using Quadric Error Metrics".
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  ///< A; its trace is the total weight.
  double x = 0, y = 0, z = 0;                             ///< b
  double c = 0;                                           ///< of p'Ap + 2b'p + c

  /// Adds the plane through `point` with unit normal `n`.
  void add_plane(const Eigen::Vector3d& n, const Eigen::Vector3d& point, double weight) {
    const double d = -n.dot(point);
    xx += weight * n.x() * n.x();
    xy += weight * n.x() * n.y();
    xz += weight * n.x() * n.z();
    yy += weight * n.y() * n.y();
    yz += weight * n.y() * n.z();
    zz += weight * n.z() * n.z();
    x += weight * d * n.x();
    y += weight * d * n.y();
    z += weight * d * n.z();
    c += weight * d * d;
  }

  Quadric& operator+=(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    x += o.x, y += o.y, z += o.z, c += o.c;
    return *this;
  }

  double weight() const { return xx + yy + zz; }

  /// Half the gradient at p: Ap + b.
  Eigen::Vector3d slope(const Eigen::Vector3d& p) const {
    return {xx * p.x() + xy * p.y() + xz * p.z() + x,
            xy * p.x() + yy * p.y() + yz * p.z() + y,
            xz * p.x() + yz * p.y() + zz * p.z() + z};
  }

  /// The weighted sum at p; rounding may leave it slightly negative.
  double at(const Eigen::Vector3d& p) const {
    return p.dot(slope(p) + Eigen::Vector3d(x, y, z)) + c;
  }

  /// The step from `p` to the minimum of the sum + damping * weight * |step|^2. With damping > 0 it
  /// exists on planes and straight edges too, where it does not move along them.
  /// \pre weight() > 0, damping > 0
  Eigen::Vector3d step_from(const Eigen::Vector3d& p, double damping) const {
    const Eigen::Vector3d g = slope(p);
    const double extra = damping * weight();
    const double a = xx + extra;
    const double b = yy + extra;
    const double d = zz + extra;
    const double aa = b * d - yz * yz;  // cofactors of the symmetric matrix
    const double ab = xz * yz - xy * d;
    const double ad = xy * yz - xz * b;
    const double bb = a * d - xz * xz;
    const double bd = xy * xz - a * yz;
    const double dd = a * b - xy * xy;
    const double determinant = a * aa + xy * ab + xz * ad;
    return Eigen::Vector3d(aa * g.x() + ab * g.y() + ad * g.z(),
                           ab * g.x() + bb * g.y() + bd * g.z(),
                           ad * g.x() + bd * g.y() + dd * g.z()) /
           -determinant;
  }
};

}  // namespace cgs
