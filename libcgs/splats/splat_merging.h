// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// Splats with what each of them brings to pictures.
struct WeighedSplats {
  Gaussians splats;
  /// Sum of the blending weights over the pixels of the picture where it is largest [pixels].
  std::vector<float> weight;
  /// Edge of a pixel at the splat, in the camera that resolves it best [internal units]; > 0.
  std::vector<float> pixel;
  /// From that camera to the splat, of length 1; zero = no camera sees it.
  std::vector<Eigen::Vector3f> ray;
};

/// Weighs splats by what they show in any of the cameras.
/// \throws InvalidInput if there is no camera; as project_gaussians(); LimitError as rasterize()
WeighedSplats weigh_splats(const Gaussians& gaussians, std::span<const Camera> cameras);

/// When splats are left out or merged.
struct MergeOptions {
  float least_weight = 0.05f;  ///< Splats that show less are left out [pixels]; >= 0.
  float most_cost = 0.001f;    ///< Of a merge, see merge_splats() [pixels]; >= 0.
  float depth_cost = 0.01f;    ///< Of a squared pixel between two along their normals; >= 0.
  float spread_cost = 0.001f;  ///< Of a squared pixel between two beyond neighbours; >= 0.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Merges splats that look alike into fewer, wherever they come from: the same surface in several
/// photographs, and neighbours of one photograph.
///
/// In each round every splat looks for the one of its neighbours that it would cost least to merge
/// with, and those that choose each other become one, until hardly any do. A merge costs what it
/// adds to the squared errors of a picture:
///   w_i w_j / (w_i + w_j) * (|c_i - c_j|^2 + depth_cost n^2 + spread_cost max(0, d^2 - 3/2)),
/// with weights w, colours c, distance d and the part n of it along the normals, both in pixels.
/// A normal is the shortest axis; where several are as short, as of balls, it is the part of the
/// viewing ray along these.
///
/// The merged splat has the moments of the two (centre, covariance, colour). Its opacity keeps
/// their optical depth -ln(1 - alpha), added up over the picture, a pixel's blur included: that of
/// layers adds up, alpha does not. What no opacity of one splat reaches, it gains in size. Its
/// label is that of the weaker evidence, and it is made up if one of the two is. Same bits for any
/// number of threads.
///
/// Sources: Ward 1963, "Hierarchical grouping to optimize an objective function"; Kerbl et al.
/// 2024, "A Hierarchical 3D Gaussian Representation", for opacities.
/// \throws InvalidInput if an option is out of range or arrays disagree in length
WeighedSplats merge_splats(WeighedSplats splats, const MergeOptions& options);

}  // namespace cgs
