// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/mesh_level_set.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/MeshToVolume.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr float kBandHalfWidth = 3;  // [voxels]

void check_size(const TriangleMesh& mesh, double voxel) {
  double area = 0;
  for (const double a : area_by_provenance(mesh)) area += a;
  const double voxels = 2 * double(kBandHalfWidth) * area / (voxel * voxel);
  constexpr double kMost = 1 << 27;
  if (voxels <= kMost) return;
  throw LimitError("a level set of this surface would have " +
                   std::to_string(static_cast<uint64_t>(std::min(voxels, 1e18))) +
                   " voxels, allowed are 134217728");
}

}  // namespace

openvdb::FloatGrid::Ptr enclosing_level_set(const TriangleMesh& mesh, double voxel) {
  check_size(mesh, voxel);
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  points.reserve(mesh.vertices.size());
  triangles.reserve(mesh.faces.size());
  for (const auto& p : mesh.vertices) points.emplace_back(p.x(), p.y(), p.z());
  for (const auto& [a, b, c] : mesh.faces) triangles.emplace_back(a, b, c);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(
      *transform, points, triangles, kBandHalfWidth);
}

double enclosed_by_level_set(const openvdb::FloatGrid& surface) {
  return surface.empty() ? 0 : openvdb::tools::levelSetVolume(surface);
}

}  // namespace cgs
