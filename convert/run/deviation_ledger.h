// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/volume/volume.h"

namespace cgs {

/// At most `count` of the points that input views measured (matched or by a sensor; where none is,
/// any depth), evenly over all their pixels and the same for the same model [internal units].
std::vector<Eigen::Vector3f> measured_points(const Model& model, size_t count);

/// What every step on the way from measured depth to a delivered mesh moves: distances of each step
/// to the one before and of the measured points to each step, by samples. Steps are added in their
/// order; only the last one is kept in memory.
class DeviationLedger {
 public:
  static constexpr size_t kSamples = 10'000;  ///< Of each surface.

  /// \param measured  the first step, from measured_points()
  explicit DeviationLedger(std::vector<Eigen::Vector3f> measured);

  /// The observed surface of a volume. \pre the first of the steps
  void add(const std::string& step, const Volume& volume);
  /// \pre the mesh has a face with area
  void add(const std::string& step, const TriangleMesh& mesh);
  /// What the next step is held against, where it has been added to another ledger.
  void go_on_from(const std::string& step, const TriangleMesh& mesh);

  /// [{"step", "against": the step before, "with_evidence": {"max", "rms", "p95"}, "inferred": the
  /// same of inferred and estimated surface, "from_measured": {"max", "rms", "p95", "outside":
  /// share of the points that cannot be told}, "samples"}] in file units; null for what has no
  /// samples. Of a pair of meshes samples of both are taken, and of each figure the larger of the
  /// two ways.
  nlohmann::ordered_json json(const Frame& frame) const;

 private:
  struct Distances {
    DistanceStatistics with_evidence;
    DistanceStatistics inferred;
    bool has_evidence = false;
    bool has_inferred = false;
  };
  struct Row {
    std::string step;
    std::string against;
    Distances distances;
    DistanceStatistics from_measured;
    double outside = 0;
    size_t samples = 0;
  };
  struct Surface {
    SurfaceSamples samples;
    std::vector<Provenance> labels;  // of the samples; empty = none
    DistanceToMesh distance;
  };
  void go_on_from(const std::string& step, Surface surface);
  static Surface surface_of(const TriangleMesh& mesh);
  static void take(const std::vector<Provenance>& labels,
                   const std::vector<float>& distances,
                   Distances& out);
  void take_measured(std::vector<float> distances, Row& row) const;

  std::vector<Eigen::Vector3f> measured_;
  std::string last_ = "measured depth";
  const Volume* volume_ = nullptr;  // the last step, where it is a volume
  std::optional<Surface> surface_;  // the last step, where it is a mesh
  std::vector<Row> rows_;
};

}  // namespace cgs
