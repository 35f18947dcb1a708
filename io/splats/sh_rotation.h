// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

namespace cgs {

/// What becomes of spherical harmonics when the splat that carries them is turned: afterwards it
/// shows in direction R d what it showed in direction d.
///
/// Order and signs are those of 3DGS files (degree 1 is -y, z, -x). The degrees do not mix, and
/// degree 0 stays.
/// Source: Ivanic and Ruedenberg 1996, "Rotation Matrices for Real Spherical Harmonics", with the
///         corrections of 1998.
class ShRotation {
 public:
  /// \param rotation  orthogonal; may mirror
  explicit ShRotation(const Eigen::Matrix3d& rotation);

  /// \param coefficients  of one splat, 1, 4, 9 or 16 RGB values; turned in place
  void apply(std::span<Eigen::Vector3f> coefficients) const;

 private:
  std::array<Eigen::MatrixXd, 4> degrees_;  // (2 l + 1) x (2 l + 1) for degree l
};

}  // namespace cgs
