// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

namespace cgs {

/// Colour that a Gaussian shows in one direction, max(0, 0.5 + sum of coefficient * basis).
///
/// Signs and order of the real basis are those of 3DGS files: Y_00; then -y, z, -x; and so on.
/// The result has no upper bound; NaN coefficients give NaN.
///
/// \param coefficients  (degree + 1)^2 RGB coefficients
/// \param degree        0 ... 3
/// \param direction     from the camera centre to the Gaussian, world axes, unit length; a zero or
///                      non-finite one leaves the constant term alone
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting"; basis of Ramamoorthi and Hanrahan 2001 with
///         the Condon-Shortley phase.
Eigen::Vector3f sh_color(std::span<const Eigen::Vector3f> coefficients,
                         int degree,
                         const Eigen::Vector3f& direction);

/// Values of the basis in one direction and their derivatives with respect to its coordinates, as
/// polynomials: a derivative along the unit sphere is the part orthogonal to the direction.
struct ShBasis {
  std::array<float, 16> value{};
  std::array<Eigen::Vector3f, 16> slope;  ///< Of the (degree + 1)^2 first.
};

/// The basis of sh_color(): colour before the cut = 0.5 + sum of coefficient * value. Above degree
/// 0 a zero or non-finite direction has values and slopes of zero.
ShBasis sh_basis(int degree, const Eigen::Vector3f& direction);

}  // namespace cgs
