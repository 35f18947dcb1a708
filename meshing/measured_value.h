// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How much evidence a label stands for: the more, the higher. Inferred surface has none, virtual
/// surface at least splats.
inline int evidence_rank(Provenance label) {
  constexpr std::array<int, kProvenanceCount> kRank = {0, 3, 4, 2, 1};  // index = label
  return kRank.at(static_cast<size_t>(label));
}

inline Provenance weaker_evidence(Provenance a, Provenance b) {
  return evidence_rank(a) < evidence_rank(b) ? a : b;
}

/// Whether a photograph vouches for surface of this label.
inline bool was_seen(Provenance label) {
  return label == Provenance::Observed || label == Provenance::SingleView;
}

/// A figure taken from a mesh, with what it rests on.
struct MeasuredValue {
  double value = 0;   ///< [internal units to the power of `dimension`], as sigma and the parts.
  int dimension = 1;  ///< 1 for a length, 2 for an area, 3 for a volume.
  double sigma = std::numeric_limits<double>::quiet_NaN();  ///< Standard deviation of the part
                                                            ///< with statement; NaN = none has one.
  double stated = 0;  ///< Share of what the figure rests on whose vertices state a sigma.
  std::array<double, kProvenanceCount> by_provenance =
      {};  ///< Index = label; 0 if the mesh states none.
};

}  // namespace cgs
