// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libcgs/core/triangle_mesh.h"
#include "samples/capture/bvh.h"

namespace cgs {

enum class Material : uint8_t { Ashlar, Arch, Carved, Paving, Wood, Iron, Painted };

/// A closed solid of the portal; parts overlap where masonry would be bonded.
struct PortalPart {
  std::string name;
  Material material = Material::Ashlar;
  uint32_t first_vertex = 0;
  uint32_t vertex_count = 0;
  uint32_t first_face = 0;
  uint32_t face_count = 0;
};

/// A carved church portal with its wall and forecourt, a font on the left and machine parts on a
/// plinth on the right. The mesh is the scene: pictures, depth and normals are cast against it.
///
/// World axes: x to the right along the wall, y into the wall (its face is y = 0), z up from the
/// ground (z = 0); [m].
struct PortalScene {
  TriangleMesh mesh;
  std::vector<PortalPart> parts;
  std::vector<uint16_t> part_of_face;  ///< Index into parts.
  Bvh bvh;
};

/// Appends a closed mesh to a scene; its hierarchy must be built anew afterwards.
void add_part(PortalScene& scene,
              const std::string& name,
              Material material,
              const TriangleMesh& mesh);

/// Always the same scene.
PortalScene portal_scene();

/// One part as a mesh of its own.
TriangleMesh part_mesh(const PortalScene& scene, const PortalPart& part);

}  // namespace cgs
