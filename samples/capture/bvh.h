// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// origin + t * direction for t in (t_min, t_max); the direction need not have unit length.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double t_min = 0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// Where a ray meets a mesh.
struct RayHit {
  double t = 0;       ///< In units of the length of the ray's direction.
  uint32_t face = 0;  ///< Index into TriangleMesh::faces.
  double b1 = 0;      ///< Barycentric weight of the second corner of the face.
  double b2 = 0;      ///< Of the third.
};

/// Bounding volume hierarchy over the faces of a mesh; holds a copy of what it needs of it.
struct Bvh {
  struct Node {  // its box is a little larger than what it holds
    Eigen::Vector3f lower = Eigen::Vector3f::Zero();
    Eigen::Vector3f upper = Eigen::Vector3f::Zero();
    uint32_t first = 0;  ///< First triangle of a leaf, or first of the two children.
    uint32_t count = 0;  ///< Triangles of a leaf; 0 = inner node.
  };
  struct Triangle {
    Eigen::Vector3f a = Eigen::Vector3f::Zero();
    Eigen::Vector3f b = Eigen::Vector3f::Zero();
    Eigen::Vector3f c = Eigen::Vector3f::Zero();
    uint32_t face = 0;
  };
  std::vector<Node> nodes;  ///< nodes[0] is the root; empty for an empty mesh.
  std::vector<Triangle> triangles;
};

/// Hierarchy by the surface area heuristic over binned centroids.
/// Source: I. Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
Bvh build_bvh(const TriangleMesh& mesh);

/// Nearest intersection; both sides of a face count, edges belong to their faces.
/// Source: T. Moeller, B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
std::optional<RayHit> first_hit(const Bvh& bvh, const Ray& ray);

/// True if anything lies on the ray.
bool any_hit(const Bvh& bvh, const Ray& ray);

/// Intersection with one triangle, in double. Its face index is taken over.
std::optional<RayHit> hit_triangle(const Bvh::Triangle& triangle, const Ray& ray);

/// Unit normal of a face, to the side from which its corners run counter-clockwise.
Eigen::Vector3d face_normal(const TriangleMesh& mesh, uint32_t face);

}  // namespace cgs
