// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "libcgs/core/gaussians.h"

namespace cgs {

/// When free Gaussians become more, and which go. Defaults are the published values.
struct DensityOptions {
  float gradient = 2e-4f;  ///< Mean gradient of the place in the image, in halves of its sides,
                           ///< from which a Gaussian becomes two; > 0.
  float split_above = 0;   ///< Largest scale from which it is split, not cloned [internal units].
  float opacity = 0.005f;  ///< Less opaque ones go.
  float largest = std::numeric_limits<float>::infinity();  ///< Wider ones go [internal units].
  size_t most = std::numeric_limits<size_t>::max();  ///< Gaussians, above which none is added:
                                                     ///< those of the largest gradient come first.
};

/// What becomes of a Gaussian.
enum class DensityChange : uint8_t { Keep, Clone, Split, Prune };

/// Judges every Gaussian: those that pull at the picture most become two.
/// \param gradient  per Gaussian, as DensityOptions::gradient
/// \throws InvalidInput if there is not one gradient per Gaussian
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting", section 5.2 and 7.1.
std::vector<DensityChange> density_changes(const Gaussians& gaussians,
                                           const std::vector<float>& gradient,
                                           const DensityOptions& options);

/// Gaussians after a round of density control.
struct ChangedDensity {
  static constexpr uint32_t kNone = 0xFFFFFFFFu;
  Gaussians gaussians;
  std::vector<uint32_t> came_from;  ///< Index of what each was before; kNone = it is new.
};

/// Carries the changes out. First those that stay, in their order and with their bits, then the
/// copies of cloned ones, then two for each that was split: placed at random by its own
/// distribution, 1.6 times smaller, everything else the same. Labels of provenance go: nobody
/// vouches for what was moved there.
/// \param seed  of the places; the same gives the same bits
/// Source: as density_changes(). The paper moves copies along the gradient by a length that it
///         does not state; here the first steps of the optimiser, whose means are new for them, do.
ChangedDensity changed_density(const Gaussians& gaussians,
                               const std::vector<DensityChange>& changes,
                               uint64_t seed);

}  // namespace cgs
