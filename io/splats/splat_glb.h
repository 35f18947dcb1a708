// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// The attribute of the label of a splat, a number of Provenance: our own, so it begins with _.
inline constexpr const char* kSplatProvenance = "_PROVENANCE";
/// The attribute of the picture that a splat was made up from, as Gaussians::synthetic; the
/// pictures are listed in asset.extras.synthetic_sources.
inline constexpr const char* kSplatSynthetic = "_SYNTHETIC";

/// The attribute of a spherical harmonic: degree 0 to 3, order 0 to 2 degree.
std::string splat_harmonic_name(int degree, int order);

struct SplatGlbOptions {
  Eigen::Matrix3d y_up = Eigen::Matrix3d::Identity();  ///< World to glTF axes; y_up_from(up).
  std::string evidence = {};  ///< As write_gaussian_ply(); for asset.extras.
  bool local_origin = false;  ///< As GlbPlace::has_local_origin.

  /// \throws InvalidInput if y_up is no rotation.
  void validate() const;
};

/// Writes splats as .glb with KHR_gaussian_splatting: points with rotation (x, y, z, w), scale,
/// opacity and spherical harmonics as float attributes, and COLOR_0 (linear, with opacity) for
/// readers that only know points; also _PROVENANCE, the number of the label, where splats state it,
/// and _SYNTHETIC where some are made up.
///
/// In metres where the scale is known, else in world units; positions are relative to their median.
/// The node turns them +Y up and moves them, in double, to where GlbPlace has them, so that they
/// lie on meshes that write_glb() wrote with the same options. asset.extras say how the world
/// follows from that, which leads parse_splat_glb() back there.
/// \return bytes of the file
/// \throws InvalidInput as write_gaussian_ply(), or if a scale or place leaves the range of float;
///         LimitError above 4 GiB; IoError
/// Source: Khronos Group, KHR_gaussian_splatting, 2026.
size_t write_splat_glb(const std::filesystem::path& path,
                       const Gaussians& gaussians,
                       const Frame& frame,
                       const SplatGlbOptions& options = {});

}  // namespace cgs
