// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace cgs {

/// The point of a triangle nearest to `point`, as weights of its corners a, b and c.
/// Source: C. Ericson 2004, "Real-Time Collision Detection", section 5.1.5.
Eigen::Vector3d nearest_weights(const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c,
                                const Eigen::Vector3d& point);

/// Answers which of many triangles is nearest to a point. Queries may run in parallel; the same
/// triangles give the same answers for any number of threads.
///
/// A hierarchy of boxes split where the surface area heuristic is least, so that long thin
/// triangles, of which surfaces fused along rays have many, cost little.
/// Source: I. Wald 2007, "On fast construction of SAH-based bounding volume hierarchies".
class TriangleTree {
 public:
  using Triangle = std::array<Eigen::Vector3d, 3>;

  struct Nearest {
    uint32_t triangle = 0;                              ///< Index as given.
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< Of its corners; >= 0, sum 1.
    double squared_distance = 0;
  };

  /// \pre corners are finite; no triangle has its corners on a line
  explicit TriangleTree(std::vector<Triangle> triangles);

  /// \return nothing if no triangle is nearer than `within`
  std::optional<Nearest> nearest(const Eigen::Vector3d& point,
                                 double within = std::numeric_limits<double>::infinity()) const;

 private:
  /// Of a leaf: `count` triangles from `first` on; else the first child follows the node and
  /// `first` is the second.
  struct Node {
    Eigen::AlignedBox3f box;
    uint32_t first = 0;
    uint32_t count = 0;
  };
  struct Builder;

  std::vector<Triangle> triangles_;  // in the order of the leaves
  std::vector<uint32_t> numbers_;    // as given
  std::vector<Node> nodes_;
};

}  // namespace cgs
