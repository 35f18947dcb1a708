// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "libcgs/core/triangle_mesh.h"
#include "samples/capture/bvh.h"

namespace cgs {

enum class Material : uint8_t { Ashlar, Arch, Carved, Paving, Wood, Iron, Painted, Plaster };

/// A closed solid of a scene; parts overlap where masonry would be bonded.
struct PortalPart {
  std::string name;
  Material material = Material::Ashlar;
  uint32_t first_vertex = 0;
  uint32_t vertex_count = 0;
  uint32_t first_face = 0;
  uint32_t face_count = 0;
};

/// A flat pane of glass: light passes it, and it adds the same mirrored light everywhere.
struct GlassPane {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();    ///< World [m].
  Eigen::Vector3d across = Eigen::Vector3d::UnitX();   ///< From the corner to the next one [m].
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< To the one before; at right angles [m].
  Eigen::Vector3f mirrored = Eigen::Vector3f::Zero();  ///< Linear RGB, not under exposure.
};

/// What is photographed: a carved church portal with its wall and forecourt, a font on the left and
/// machine parts on a plinth on the right; or another scene. The mesh is the scene: pictures, depth
/// and normals are cast against it.
///
/// World axes: x to the right along the wall, y into the wall (its face is y = 0), z up from the
/// ground (z = 0); [m].
struct PortalScene {
  TriangleMesh mesh;
  std::vector<PortalPart> parts;
  std::vector<uint16_t> part_of_face;  ///< Index into parts.
  Bvh bvh;
  std::vector<GlassPane> panes;  ///< No part of the mesh: the truth is what lies behind them.
  /// sRGB-coded colour, in [0, 1], of what a ray in a world direction (of any length) shows that
  /// leaves the scene; empty = black.
  std::function<Eigen::Vector3f(const Eigen::Vector3d& direction)> sky;
  float exposure = 1;  ///< Factor on the light that comes from surfaces.
};

/// Appends a closed mesh to a scene; its hierarchy must be built anew afterwards.
void add_part(PortalScene& scene,
              const std::string& name,
              Material material,
              const TriangleMesh& mesh);

/// The carved portal; always the same scene.
PortalScene portal_scene();

/// One part as a mesh of its own.
TriangleMesh part_mesh(const PortalScene& scene, const PortalPart& part);

}  // namespace cgs
