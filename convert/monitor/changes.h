// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "convert/measure/m3c2_comparison.h"

namespace cgs {

/// A connected piece of surface that stands out over that of the other date.
struct ChangePatch {
  double area = 0;      ///< [internal units squared]
  double distance = 0;  ///< Mean by which it stands out [internal units].
  /// Between the two surfaces [internal units cubed]. Empty of a piece that stands out by more than
  /// it is wide, such as a branch: of its back nothing is known.
  std::optional<double> volume = {};
  /// Of the volume: errors within a piece are taken to be alike, as they are in one reconstruction.
  double volume_sigma = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Mean of its places by area.
};

/// What one date's surface has over the other's.
struct Changes {
  std::vector<ChangePatch> patches;  ///< The largest area first.
  std::vector<int> patch_of_face;    ///< Of that surface; -1 = in none.
  double noise = 1;                  ///< By how much distances scatter more than was stated; >= 1.
  double comparable = 0;             ///< Share of the vertices at which the two can be compared.
  M3c2Comparison found;
};

/// Sums over patches, in quadrature for sigma.
struct ChangeTotal {
  double area = 0;
  double volume = 0;
  double volume_sigma = 0;
  size_t without_volume = 0;  ///< Patches of which none is known.
};
ChangeTotal total_of(const std::vector<ChangePatch>& patches);

/// Pieces of a surface that stand out over another, both in one frame.
///
/// Distances are those of M3C2. They count as beyond uncertainty above its level of detection, made
/// wider by `noise` where most of the surface, which is taken not to have changed, scatters more
/// than sigma and roughness say: by their median. Nor do they count where the nearest place of the
/// other surface is within that level. A patch is what such places join, with one among them of
/// twice the level, and no smaller than three of M3C2's cylinders.
/// \param request  what else is uncertain, such as the scale of one against the other's
/// \throws Error as compare_m3c2()
Changes standing_out(const MeasurableMesh& surface,
                     const MeasurableMesh& other,
                     const M3c2Request& request = {});

}  // namespace cgs
