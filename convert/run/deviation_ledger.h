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

/// What one step moves [internal units]. Of a pair of meshes samples of both are taken, and of each
/// figure the larger of the two ways.
struct DeviationStep {
  std::string step;
  std::string against;                    ///< The step before.
  DistanceStatistics with_evidence = {};  ///< Of seen surface.
  DistanceStatistics inferred = {};       ///< Of inferred and estimated surface.
  bool has_evidence = false;              ///< There are samples of it.
  bool has_inferred = false;
  DistanceStatistics from_measured = {};  ///< Of the measured points.
  double outside = 0;                     ///< Share of these that cannot be told.
  size_t samples = 0;
};

/// [{"step", "against", "with_evidence": {"max", "rms", "p95"}, "inferred", "from_measured":
/// {"max", "rms", "p95", "outside"}, "samples"}] in file units; null for what has no samples.
nlohmann::ordered_json deviations_to_json(const std::vector<DeviationStep>& steps,
                                          const Frame& frame);

/// What every step on the way from measured depth to a delivered mesh moves: distances of each step
/// to the one before and of the measured points to each step, by samples. Steps are added in their
/// order; only the last one is kept in memory.
class DeviationLedger {
 public:
  static constexpr size_t kSamples = 10'000;  ///< Of each surface.

  /// \param measured  the first step, from measured_points()
  explicit DeviationLedger(std::vector<Eigen::Vector3f> measured);

  /// The observed surface of a volume.
  /// \pre the first of the steps
  void add(const std::string& step, const Volume& volume);
  /// \pre the mesh has a face with area
  void add(const std::string& step, const TriangleMesh& mesh);
  /// What the next step is held against, where it has been added to another ledger.
  void go_on_from(const std::string& step, const TriangleMesh& mesh);

  const std::vector<DeviationStep>& steps() const { return steps_; }

 private:
  struct Surface {
    SurfaceSamples samples;
    std::vector<Provenance> labels;  // of the samples; empty = none
    DistanceToMesh distance;
  };
  void go_on_from(const std::string& step, Surface surface);
  static Surface surface_of(const TriangleMesh& mesh);
  static void take(const std::vector<Provenance>& labels,
                   const std::vector<float>& distances,
                   DeviationStep& out);
  void take_measured(std::vector<float> distances, DeviationStep& step) const;

  std::vector<Eigen::Vector3f> measured_;
  std::string last_ = "measured depth";
  const Volume* volume_ = nullptr;  // the last step, where it is a volume
  std::optional<Surface> surface_;  // the last step, where it is a mesh
  std::vector<DeviationStep> steps_;
};

}  // namespace cgs
