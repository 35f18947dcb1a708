// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "meshing/edit/edge_collapse.h"
#include "meshing/mesh/quadric.h"
#include "meshing/mesh/vertex_faces.h"

// The inside of collapse_edges(): state in one class, whose functions lie in edge_collapse.cpp
// (setup and passes), collapse_rules.cpp (what one collapse must keep) and collapse_history.cpp
// (what an earlier run did).
namespace cgs::edge_collapse {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Face = std::array<uint32_t, 3>;

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// How freely a vertex moves, in rising order of constraint.
enum class Kind : uint8_t {
  Interior,
  Border,  ///< On one border, between labels or on the rim: along it only.
  Corner,  ///< Where borders meet: absorbs neighbours, stays.
  Fixed    ///< No edge at it is collapsed.
};

inline bool has(const Face& face, uint32_t v) {
  return face[0] == v || face[1] == v || face[2] == v;
}

/// A vertex joined to another by an edge.
struct EdgeNeighbor {
  uint32_t vertex = 0;
  int faces = 0;        ///< At the edge.
  int winding = 0;      ///< Faces that run the edge one way minus those that run it the other way.
  bool border = false;  ///< One face, or two of different labels.
  Provenance label = Provenance::Inferred;  ///< Of the first face.
};

/// Where an edge collapses to.
struct Placement {
  Vector3d point = Vector3d::Zero();
  double cost = std::numeric_limits<double>::infinity();
  float t = 0;  ///< Position along the edge from the vertex that stays, in [0, 1].
};

/// A triangle by the edges at its first corner.
struct Triangle {
  Triangle() = default;
  Triangle(const Vector3f& a, const Vector3f& b, const Vector3f& c)
      : ab(b - a), ac(c - a), abab(ab.squaredNorm()), abac(ab.dot(ac)), acac(ac.squaredNorm()) {}
  Vector3f ab = Vector3f::Zero();
  Vector3f ac = Vector3f::Zero();
  float abab = 0, abac = 0, acac = 0;
};

/// A face of the star after a collapse; its first corner is the new vertex.
struct NewFace : Triangle {
  uint32_t face = 0;
  uint32_t b = 0, c = 0;  ///< Its other corners.
  Provenance label = Provenance::Inferred;
  Vector3f normal, normal_before;      ///< Unit length; 0 for a face without area.
  Vector3f color, color_ab, color_ac;  ///< At the new vertex, and differences.
};

/// One collapse as it is tried: what it would do, and room that is kept for the next one.
struct Attempt {
  enum class Outcome {
    Allowed,
    Refused,
    Later  ///< A vertex has been merged in this pass.
  };
  Outcome outcome = Outcome::Later;
  uint32_t u = kNone, v = kNone;  ///< v goes, u moves.
  Placement to;
  std::vector<uint32_t> moving, dying;  ///< Faces around; those at the edge.
  std::vector<uint32_t> points;         ///< Witnesses that change hands,
  std::vector<uint32_t> heir_of_point;  ///< and to whom: an index into `moving`.
  std::vector<NewFace> fresh;           ///< The moving faces, moved.
  std::vector<EdgeNeighbor> around_u, around_v;
};

/// One run of collapse_edges().
class Collapser {
 public:
  Collapser(const TriangleMesh& mesh, const CollapseLimits& limits);
  CollapsedMesh run(const CollapseHistory* before, const Progress& progress);

 private:
  struct Candidate {
    float cost;
    uint32_t slot;  // 3 * face + side
    bool operator<(const Candidate& o) const {
      return cost != o.cost ? cost < o.cost : slot < o.slot;
    }
  };

  void neighbors_of(uint32_t v, std::vector<EdgeNeighbor>& out) const;
  Kind kind_of(uint32_t v, const std::vector<EdgeNeighbor>& neighbors) const;
  bool one_fan(uint32_t v) const;
  void classify();
  Quadric quadric_around(uint32_t v, const std::vector<EdgeNeighbor>& neighbors) const;
  void find_candidates();
  bool may_collapse(uint32_t u, uint32_t v) const;
  Placement placement(uint32_t u, uint32_t v) const;
  float pass_cost();
  bool pass(const Progress& progress);
  size_t batch_size() const;
  void try_all(size_t first, size_t count);
  void try_collapse(uint32_t slot, Attempt& out) const;
  Attempt::Outcome outcome_of(Attempt& attempt) const;
  void gather_star(Attempt& attempt) const;
  bool link_allows(Attempt& attempt, bool& border) const;
  bool reachable(const Attempt& attempt, const Vector3f& p) const;
  bool border_allows(const Attempt& attempt, const Vector3f& p) const;
  bool faces_allow(Attempt& attempt, const Vector3f& p) const;
  bool folds(const Attempt& attempt) const;
  bool witnesses_allow(Attempt& attempt, const Vector3f& p) const;
  bool hand_over_witnesses(Attempt& attempt) const;
  bool is_near_original(const Attempt& attempt, const Vector3f& x) const;
  bool stays_near(const Attempt& attempt, const Vector3f& p) const;
  bool is_stale(const Attempt& attempt) const;
  void apply(const Attempt& attempt);
  void merge_knowledge(uint32_t u, uint32_t v, float t);
  void drop_dead_faces();
  void end_pass();
  void remember(const Attempt& attempt);
  void repeat(const CollapseHistory& before);
  void repeat_one(const CollapseHistory& before, size_t index, Attempt& attempt);
  bool gather_witnesses(Attempt& attempt) const;
  bool is_as_before(const Attempt& attempt) const;
  // Told by the corners themselves, which are looked at anyway: memory is what takes the time.
  bool is_dead(uint32_t f) const { return mesh_.faces[f][0] == kNone; }
  Vector3d vertex(uint32_t v) const { return mesh_.vertices[v].cast<double>() - center_; }
  Vector3d area_vector(const Face& f) const {
    return (vertex(f[1]) - vertex(f[0])).cross(vertex(f[2]) - vertex(f[0]));
  }

  const TriangleMesh& original_;
  const CollapseLimits& limits_;
  TriangleMesh mesh_;  // vertex numbers are those of the original
  Vector3d center_ = Vector3d::Zero();
  bool may_move_anywhere_ = false;  // all tolerances reach across the mesh, colours may change
  std::vector<uint8_t> refused_;    // per face, a bit per side
  VertexFaces around_;              // as of the beginning of the pass
  VertexFaces original_around_;     // of the input
  std::vector<Kind> kind_;
  std::vector<Quadric> quadric_;
  std::vector<uint8_t> used_;     // per vertex: merged in this pass
  std::vector<uint8_t> changed_;  // per vertex: star changed in the last pass
  std::vector<float> cost_;       // per slot
  std::vector<Candidate> candidates_;
  CollapseHistory history_;
  std::vector<uint32_t> witness_;  // per face: list of original vertices
  std::vector<uint32_t> next_witness_;
  std::vector<uint32_t> next_on_border_;  // per original border vertex: ring of those merged
  std::vector<Attempt> batch_;            // candidates that are tried at once
  std::vector<uint32_t> stamp_;           // per vertex: the batch in which its star last changed
  uint32_t batches_ = 0;
  // While an earlier run is repeated, per vertex: whether it or a face at it is not what it was
  // then, and whether its tolerance is smaller than it was.
  std::vector<uint8_t> differs_, is_tighter_;
};

}  // namespace cgs::edge_collapse
