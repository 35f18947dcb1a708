// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/closed_isosurface.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "meshing/mesh/components.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/surface/isosurface.h"

namespace cgs {

namespace {

using openvdb::Coord;

// Voxels within two of the faces, each once.
std::vector<Coord> voxels_around(const TriangleMesh& mesh,
                                 const std::vector<std::pair<uint32_t, uint32_t>>& pairs,
                                 double voxel) {
  std::vector<Coord> voxels;
  const auto add = [&](uint32_t f) {
    for (const uint32_t v : mesh.faces[f]) {
      const Eigen::Vector3i at =
          (mesh.vertices[v].cast<double>() / voxel).array().floor().cast<int>();
      for (int k = 0; k < 64; ++k) {
        voxels.emplace_back(at.x() + k % 4 - 1, at.y() + k / 4 % 4 - 1, at.z() + k / 16 - 1);
      }
    }
  };
  for (const auto& [f, g] : pairs) {
    add(f);
    add(g);
  }
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  return voxels;
}

// Replaces the given voxels by the mean of their 3 x 3 x 3 neighbourhood.
void average(openvdb::FloatGrid& grid, const std::vector<Coord>& voxels) {
  std::vector<float> means;
  means.reserve(voxels.size());
  auto values = grid.getAccessor();
  for (const Coord& at : voxels) {
    float sum = 0;
    for (int k = 0; k < 27; ++k) {
      sum += values.getValue(at.offsetBy(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    }
    means.push_back(sum / 27);
  }
  for (size_t i = 0; i < voxels.size(); ++i) {
    if (values.isValueOn(voxels[i])) values.setValueOnly(voxels[i], means[i]);
  }
}

// Adds the blocks that hold the voxels; false where they are there already, whole.
bool make_fine(openvdb::BoolTree& fine, const std::vector<Coord>& voxels) {
  bool any = false;
  for (const Coord& at : voxels) {
    auto* block = fine.touchLeaf(at);
    if (block->isDense()) continue;
    block->setValuesOn();
    any = true;
  }
  return any;
}

// Shells of closed surface that smoothing has cut off: fewer faces than around a few voxels.
TriangleMesh without_crumbs(const TriangleMesh& mesh, double voxel) {
  constexpr double kSide = 3;  // [voxels]
  const MeshComponents parts = components(mesh);
  const double smallest = 6 * std::pow(kSide * voxel, 2);
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = parts.area[parts.of_face[f]] >= smallest;
  return with_faces(mesh, keep);
}

}  // namespace

ClosedIsosurface closed_isosurface(openvdb::FloatGrid& surface, openvdb::BoolTree::Ptr fine) {
  const double voxel = surface.voxelSize()[0];
  ClosedIsosurface out;
  out.method = "level set";
  constexpr int kRefined = 4;  // times; what then still cuts itself had better be fine at once
  constexpr int kRounds = 8;
  int refined = 0;
  for (int round = 0; round < kRounds;) {
    out.mesh = without_crumbs(zero_surface(surface, fine), voxel);
    out.certificate = certify(out.mesh);
    if (out.certificate.self_intersections == 0) {
      if (out.certificate.passed() || out.mesh.faces.empty()) return out;
      if (!fine) break;  // Smoothing helps against nothing else.
      fine = nullptr;
      continue;
    }
    const auto voxels = voxels_around(out.mesh, self_intersections(out.mesh), voxel);
    if (fine && make_fine(*fine, voxels)) {
      if (++refined == kRefined) fine = nullptr;
      continue;
    }
    average(surface, voxels);
    out.voxels_smoothed += voxels.size();
    out.method = "level set, locally smoothed";
    ++round;
  }
  out.method = "level set, marching tetrahedra";
  out.mesh = without_crumbs(zero_surface_by_tetrahedra(surface), voxel);
  out.certificate = certify(out.mesh);
  return out;
}

}  // namespace cgs
