// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/flat_base.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/mesh/components.h"

namespace cgs {

namespace {

double hindmost(const TriangleMesh& mesh, const Eigen::Vector3d& front) {
  double seen = std::numeric_limits<double>::infinity();
  double any = seen;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const uint32_t v : mesh.faces[f]) {
      const double depth = front.dot(mesh.vertices[v].cast<double>());
      any = std::min(any, depth);
      if (!mesh.provenance.empty() && was_seen(mesh.provenance[f])) seen = std::min(seen, depth);
    }
  }
  return std::isfinite(seen) ? seen : any;
}

// A box around all of a mesh that lies before the plane front * p = depth.
TriangleMesh box_before(const TriangleMesh& mesh, const Eigen::Vector3d& front, double depth) {
  Eigen::Matrix3d axes;
  axes.col(2) = front;
  axes.col(0) = front.unitOrthogonal();
  axes.col(1) = front.cross(axes.col(0));
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    bounds.extend(Eigen::Vector3d(axes.transpose() * p.cast<double>()));
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.1 * bounds.diagonal().norm());
  Eigen::Vector3d low = bounds.min() - margin;
  const Eigen::Vector3d high = bounds.max() + margin;
  low.z() = depth;
  TriangleMesh out;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p((corner & 1) != 0 ? high.x() : low.x(),
                            (corner & 2) != 0 ? high.y() : low.y(),
                            (corner & 4) != 0 ? high.z() : low.z());
    out.vertices.emplace_back((axes * p).cast<float>());
  }
  out.faces = {{0, 2, 3},
               {0, 3, 1},
               {4, 5, 7},
               {4, 7, 6},
               {0, 1, 5},
               {0, 5, 4},
               {2, 6, 7},
               {2, 7, 3},
               {0, 4, 6},
               {0, 6, 2},
               {1, 3, 7},
               {1, 7, 5}};
  return out;
}

// Of a closed mesh, signed.
double enclosed(const TriangleMesh& mesh) {
  const MeshComponents parts = components(mesh);
  return std::accumulate(parts.volume.begin(), parts.volume.end(), 0.0);
}

}  // namespace

Eigen::Vector3d seen_side(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0;
  for (size_t f = 0; f < mesh.provenance.size(); ++f) {
    if (!was_seen(mesh.provenance[f])) continue;
    const Eigen::Vector3d of_face = area_vector(mesh, mesh.faces[f]);
    sum += of_face;
    area += of_face.norm();
  }
  constexpr double kAlike = 0.05;
  return sum.norm() > kAlike * area ? sum : Eigen::Vector3d::Zero();
}

FlatBase with_flat_base(const TriangleMesh& mesh, const Eigen::Vector3d& front, double thickness) {
  require(thickness > 0, "the thickness of a base must be > 0", thickness);
  require(front.norm() > 0, "the front of a base must not be 0", front.norm());
  const Eigen::Vector3d towards = front.normalized();
  const TriangleMesh box = box_before(mesh, towards, hindmost(mesh, towards) - thickness);
  FlatBase out;
  out.solid = boolean(mesh, box, BooleanOperation::Intersection);
  out.cut_off = 1 - enclosed(out.solid.mesh) / enclosed(mesh);
  return out;
}

}  // namespace cgs
