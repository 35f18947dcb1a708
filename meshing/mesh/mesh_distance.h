// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/progress.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Points spread evenly over the area of a mesh, the same for the same mesh and count.
///
/// Every point stands for an equal share of the area; within its share it is placed by a
/// low-discrepancy sequence. Empty if the mesh has no area.
std::vector<Eigen::Vector3f> sample_surface(const TriangleMesh& mesh, size_t count);

/// Points on a mesh and the faces they lie on.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;
  std::vector<uint32_t> faces;
};

/// The points of sample_surface() with their faces.
SurfaceSamples sample_faces(const TriangleMesh& mesh, size_t count);

/// Answers how far points are from a mesh that is asked more than once.
class DistanceToMesh {
 public:
  explicit DistanceToMesh(const TriangleMesh& mesh);
  ~DistanceToMesh();
  DistanceToMesh(DistanceToMesh&& other) noexcept;
  DistanceToMesh& operator=(DistanceToMesh&& other) noexcept;

  /// Distance from each point to the nearest point of the mesh [internal units]; infinite where no
  /// face has an area, as are those of edges.
  std::vector<float> of(const std::vector<Eigen::Vector3f>& points) const;

  /// How far the edges of another mesh are away, where that is farther than something known.
  ///
  /// Between two surfaces of triangles that run side by side the distance is largest at a corner
  /// of either or where edges of both cross, so on an edge of one of them; points spread over the
  /// area miss it. Every edge is halved until no place on it can be farther than the farthest one
  /// found: the distance from one triangle is convex, so it is largest at an end of a piece, and
  /// from place to place a distance changes by no more than the way.
  /// \param enough    per face: edges that are surely no farther than this are not looked at
  ///                  closer; of an edge the least of its faces [internal units]
  /// \param accuracy  what is found is beyond the farthest place by no more than this
  ///                  [internal units]; > 0
  /// \return  per face an upper bound over its edges; 0 = not beyond what is enough
  ///          [internal units]
  /// Source: the bounds of M. Guthe, P. Borodin, R. Klein 2005, "Fast and accurate Hausdorff
  ///         distance calculation between meshes", section 3.
  std::vector<float> of_edges(const TriangleMesh& mesh,
                              const std::vector<float>& enough,
                              double accuracy,
                              const Progress& progress = {}) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The same for points that are all known at once.
/// \pre mesh has faces.
std::vector<float> distances_to(const TriangleMesh& mesh,
                                const std::vector<Eigen::Vector3f>& points);

/// Distances in one direction.
struct DistanceStatistics {
  double mean = 0;  ///< [internal units], as all.
  double rms = 0;
  double median = 0;
  double p95 = 0;  ///< 95th percentile.
  double max = 0;  ///< Of the samples; a lower bound of the one-sided Hausdorff distance.
};

DistanceStatistics statistics(std::vector<float> distances);

/// Two meshes compared by samples in both directions.
struct MeshDistance {
  DistanceStatistics accuracy;      ///< From samples of the mesh to the reference.
  DistanceStatistics completeness;  ///< From samples of the reference to the mesh.
  double hausdorff() const { return std::max(accuracy.max, completeness.max); }
};

/// Adds to sigma, where it is stated, how far a surface was moved: the larger root mean square of
/// both ways, in squares.
void widen_sigma(TriangleMesh& mesh, const MeshDistance& moved);

/// \throws InvalidInput if a mesh has no area.
MeshDistance mesh_distance(const TriangleMesh& mesh, const TriangleMesh& reference, size_t samples);

/// Where rays first meet a mesh.
///
/// \param origins, directions   one pair per ray; directions need no unit length
/// \return  per ray the factor of its direction, >= 0, that leads to the first hit; NaN = no hit.
/// \throws InvalidInput if the arrays differ in length.
std::vector<float> cast(const TriangleMesh& mesh,
                        const std::vector<Eigen::Vector3f>& origins,
                        const std::vector<Eigen::Vector3f>& directions);

}  // namespace cgs
