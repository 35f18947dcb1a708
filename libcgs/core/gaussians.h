// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "libcgs/core/frame.h"
#include "libcgs/core/provenance.h"

namespace cgs {

/// Value of the constant spherical harmonic Y_00; colour = kShC0 * coefficient + 0.5.
inline constexpr float kShC0 = 0.28209479177387814f;
/// That of the linear ones: Y_1 = kShC1 * (-y, z, -x).
inline constexpr float kShC1 = 0.4886025119029199f;

/// What is added to both variances of a splat in a picture [pixels^2]. The value of 3DGS makes
/// every splat at least about a pixel wide.
inline constexpr float kSplatDilation = 0.3f;

/// A picture from elsewhere of which Gaussians were made up; empty texts = nobody says which.
struct SyntheticSource {
  std::string file;  ///< Its name, without folder unless it lies beside the file of the Gaussians.
  std::string sha256;  ///< Of its bytes, 64 hexadecimal digits.
  bool operator==(const SyntheticSource&) const = default;
};

/// A set of 3D Gaussians, one entry per Gaussian in every array, as values (no log, no logit); only
/// provenance and synthetic may be empty.
/// Positions and scales are in internal units of the canonical frame that comes with it.
struct Gaussians {
  std::vector<Eigen::Vector3f> position;  ///< [internal units]
  std::vector<Eigen::Vector3f> scale;     ///< Standard deviation along the local axes; > 0.
  std::vector<Eigen::Vector4f> rotation;  ///< Local-to-world unit quaternion (w, x, y, z).
  std::vector<float> opacity;             ///< In (0, 1).
  int sh_degree = 0;                      ///< 0 … 3
  std::vector<Eigen::Vector3f> sh;        ///< size() * sh_count() RGB coefficients, Gaussian-major.
  std::vector<Provenance> provenance;     ///< What vouches for each; empty = nobody states it.
  /// k = made up from synthetic_sources[k - 1], no photograph; 0 = not. Empty = none is.
  std::vector<uint8_t> synthetic;
  std::vector<SyntheticSource> synthetic_sources;  ///< 255 at most.

  size_t size() const { return position.size(); }
  int sh_count() const { return (sh_degree + 1) * (sh_degree + 1); }
};

/// How many are made up.
size_t synthetic_count(const Gaussians& gaussians);

/// Appends Gaussians; harmonics that they lack are 0. Labels that either set lacks, both lose; a
/// set without Gaussians lacks none.
/// \throws InvalidInput if `more` has harmonics of a higher degree, or there are more than 255
///         sources together
void append(Gaussians& gaussians, const Gaussians& more);

/// Covariance of a Gaussian from its scale and rotation, Sigma = R S S^T R^T.
///
/// Symmetric and positive semi-definite for any input, which a free 3x3 matrix under gradient
/// descent is not. Kerbl et al. 2023, "3D Gaussian Splatting", Eq. 6.
///
/// \param scale     standard deviation along each local axis [internal units]
/// \param rotation  local-to-world (w, x, y, z); normalised here, zero counts as identity
Eigen::Matrix3f covariance(const Eigen::Vector3f& scale, const Eigen::Vector4f& rotation);

/// Rotation matrix of a quaternion (w, x, y, z) of any length; zero counts as identity.
Eigen::Matrix3f rotation_matrix(const Eigen::Vector4f& rotation);

}  // namespace cgs
