// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "libcgs/core/triangle_mesh.h"

namespace cgs::test {

/// What can be wrong with a mesh.
enum class Damage {
  Holes,              ///< Patches of faces are missing.
  FlippedFaces,       ///< A third of the faces look the other way, in patches and alone.
  DoubledShells,      ///< The surface lies there twice: exactly, below or moved.
  SelfIntersections,  ///< A ball sticks in the surface, and vertices are pushed through it.
  NonManifold,        ///< Faces hang on edges of the surface, and vertices far apart are one.
  DegenerateFaces,    ///< Faces without area, twice the same, split edges, vertices nobody uses.
  Everything,         ///< A little of all but doubled shells.
};
inline constexpr std::array<Damage, 7> kDamages = {Damage::Holes,
                                                   Damage::FlippedFaces,
                                                   Damage::DoubledShells,
                                                   Damage::SelfIntersections,
                                                   Damage::NonManifold,
                                                   Damage::DegenerateFaces,
                                                   Damage::Everything};

std::string_view damage_name(Damage damage);

/// A closed mesh with that damage; the same seed gives the same mesh anywhere.
/// \pre the mesh has vertices and faces only
TriangleMesh damaged(const TriangleMesh& mesh, Damage damage, uint32_t seed);

}  // namespace cgs::test
