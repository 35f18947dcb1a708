// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/isosurface.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/provenance.h"

namespace cgs {

namespace {

// Fraction of a voxel that every value keeps from zero.
constexpr double kClearance = 0.02;

openvdb::FloatGrid::Ptr off_the_corners(const openvdb::FloatGrid& distance) {
  const auto clearance = static_cast<float>(kClearance * distance.voxelSize()[0]);
  openvdb::FloatGrid::Ptr grid = distance.deepCopy();
  grid->setGridClass(openvdb::GRID_LEVEL_SET);  // The winding of the faces depends on it.
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid->tree());
  leaves.foreach ([&](auto& leaf, size_t) {
    for (auto it = leaf.beginValueAll(); it; ++it) {
      const float v = *it;
      if (std::abs(v) < clearance) it.setValue(v < 0 ? -clearance : clearance);
    }
  });
  return grid;
}

// OpenVDB winds faces clockwise seen from outside.
void add_faces(const openvdb::tools::PolygonPool& pool, TriangleMesh& mesh) {
  const auto squared = [&](uint32_t a, uint32_t b) {
    return (mesh.vertices[a] - mesh.vertices[b]).squaredNorm();
  };
  for (size_t i = 0; i < pool.numTriangles(); ++i) {
    const openvdb::Vec3I& t = pool.triangle(i);
    mesh.faces.push_back({t[0], t[2], t[1]});
  }
  for (size_t i = 0; i < pool.numQuads(); ++i) {
    const openvdb::Vec4I& q = pool.quad(i);
    if (squared(q[0], q[2]) <= squared(q[1], q[3])) {
      mesh.faces.push_back({q[0], q[2], q[1]});
      mesh.faces.push_back({q[0], q[3], q[2]});
    } else {
      mesh.faces.push_back({q[1], q[3], q[2]});
      mesh.faces.push_back({q[1], q[0], q[3]});
    }
  }
}

}  // namespace

TriangleMesh zero_surface(const openvdb::FloatGrid& distance,
                          const openvdb::BoolTree::ConstPtr& fine) {
  constexpr double kFlat = 0.2;  // 1 - the cosine between normals within a block: 37 degrees
  openvdb::tools::VolumeToMesh mesher(0, fine ? kFlat : 0);
  if (fine) mesher.setAdaptivityMask(fine);
  mesher(*off_the_corners(distance));
  TriangleMesh mesh;
  mesh.vertices.reserve(mesher.pointListSize());
  for (size_t i = 0; i < mesher.pointListSize(); ++i) {
    const openvdb::Vec3s& p = mesher.pointList()[i];
    mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (size_t i = 0; i < mesher.polygonPoolListSize(); ++i) {
    add_faces(mesher.polygonPoolList()[i], mesh);
  }
  return mesh;
}

void OpenSurfaceOptions::validate() const {
  require(min_component >= 0 && min_component <= 1,
          "OpenSurfaceOptions.min_component must be in [0, 1]",
          min_component);
}

TriangleMesh open_surface(const Volume& volume, const OpenSurfaceOptions& options) {
  options.validate();
  TriangleMesh mesh = zero_surface(*volume.tsdf);
  const VertexEvidence evidence = annotate_vertices(mesh, volume);
  label_faces(mesh, evidence, 0);
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) {
    const auto& face = mesh.faces[f];
    keep[f] = std::all_of(face.begin(), face.end(), [&](uint32_t v) {
      return evidence.of_vertex[v] == Evidence::Full;
    });
  }
  mesh = without_small_components(with_faces(mesh, keep), options.min_component);
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

}  // namespace cgs
