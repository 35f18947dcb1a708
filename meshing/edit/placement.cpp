// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/placement.h"

#include <utility>
#include <vector>

#include <Eigen/SVD>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

// The frame for the moved points: canonical, but with the unit and the up direction of the old one
// (what moves is the mesh, not the axes of its file), and its file origin as long as floats can
// bear that.
Frame frame_for(const std::vector<Eigen::Vector3d>& points_in_world, const Frame& old) {
  Frame out = canonical_frame(points_in_world);
  out.file_origin = file_origin_near(out, old.file_origin);
  out.metres_per_unit = old.metres_per_unit;
  out.metres_sigma = old.metres_sigma;
  out.scale_source = old.scale_source;
  out.up = old.up;
  return out;
}

void turn_normals(TriangleMesh& mesh, const Eigen::Matrix3d& linear) {
  const Eigen::Matrix3d turned = linear.inverse().transpose();
  for (Eigen::Vector3f& n : mesh.normals) {
    const Eigen::Vector3d m = turned * n.cast<double>();
    const double length = m.norm();
    n = (length > 0 ? Eigen::Vector3d(m / length) : Eigen::Vector3d::Zero().eval()).cast<float>();
  }
  if (linear.determinant() > 0) return;
  for (auto& face : mesh.faces) std::swap(face[1], face[2]);
}

}  // namespace

void move_mesh(TriangleMesh& mesh,
               Frame& frame,
               const Eigen::Affine3d& motion,
               const Eigen::Vector3d& zero) {
  require(motion.matrix().allFinite(), "a motion must be finite, the sum of its numbers", "not");
  const Eigen::Vector3d stretches = motion.linear().jacobiSvd().singularValues();
  constexpr double kFlat = 1e-9;  // of the largest stretch: nothing is left of that direction
  require(stretches[2] > kFlat * stretches[0],
          "a motion must not flatten the mesh; its smallest stretch",
          stretches[2]);
  if (mesh.vertices.empty()) return;
  std::vector<Eigen::Vector3d> points;
  points.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) {
    const Eigen::Vector3d from = frame.world_from_internal(p.cast<double>()) - zero;
    points.emplace_back(motion * from + zero);
  }
  const Frame moved = frame_for(points, frame);
  for (size_t v = 0; v < points.size(); ++v) {
    mesh.vertices[v] = moved.internal_from_world(points[v]).cast<float>();
  }
  turn_normals(mesh, motion.linear());
  const auto growth = static_cast<float>(stretches[0] * frame.scale / moved.scale);
  for (float& s : mesh.sigma) s *= growth;
  frame = moved;
}

void move_to_frame(TriangleMesh& mesh, const Frame& from, const Frame& to) {
  const bool known = from.has_metric_scale() && to.has_metric_scale();
  const double ratio = known ? from.metres_per_unit / to.metres_per_unit : 1;
  for (Eigen::Vector3f& p : mesh.vertices) {
    const Eigen::Vector3d in_world = ratio * from.world_from_internal(p.cast<double>());
    p = to.internal_from_world(in_world).cast<float>();
  }
  for (float& s : mesh.sigma) s *= static_cast<float>(ratio * from.scale / to.scale);
}

}  // namespace cgs
