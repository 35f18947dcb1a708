// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "libcgs/core/error.h"
#include "meshing/edit/edge_collapse.h"
#include "meshing/edit/stitching.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/provenance.h"
#include "meshing/mesh/self_intersections.h"

namespace cgs {

namespace {

// Of the largest error on edges, as a share of the error allowed.
constexpr double kAccuracy = 1.0 / 256;

// Distances from places of one mesh to another, by whether their face has evidence.
struct Measured {
  DistanceStatistics evidence;
  DistanceStatistics inferred;
  std::vector<uint32_t> too_far;  ///< Faces with a place beyond the limit, ascending.
};

Measured measure(const TriangleMesh& from,
                 const DistanceToMesh& distance,
                 const SimplifyOptions& options,
                 const Progress& progress) {
  constexpr size_t kLeast = 10000;
  constexpr size_t kMost = 100000;
  const SurfaceSamples samples =
      sample_faces(from, std::clamp(2 * from.faces.size(), kLeast, kMost));
  if (samples.points.empty()) return {};  // faces without area
  const std::vector<float> distances = distance.of(samples.points);
  std::array<std::vector<float>, 2> by_label;
  std::vector<float> of_face(from.faces.size(), 0);
  for (size_t i = 0; i < distances.size(); ++i) {
    const uint32_t f = samples.faces[i];
    by_label[is_unmeasured(from, f) ? 1 : 0].push_back(distances[i]);
    of_face[f] = std::max(of_face[f], distances[i]);
  }
  std::array<DistanceStatistics, 2> statistics_of = {statistics(by_label[0]),
                                                     statistics(by_label[1])};
  // Points over the area miss the farthest places, which lie on edges.
  std::vector<float> known(from.faces.size());
  for (size_t f = 0; f < known.size(); ++f) {
    known[f] = float(statistics_of.at(is_unmeasured(from, f) ? 1 : 0).max);
  }
  const std::vector<float> on_edges =
      distance.of_edges(from, known, kAccuracy * options.max_error, progress);
  Measured out;
  for (uint32_t f = 0; f < on_edges.size(); ++f) {
    const bool inferred = is_unmeasured(from, f);
    double& most = statistics_of.at(inferred ? 1 : 0).max;
    most = std::max(most, double(on_edges[f]));
    const double limit = inferred ? options.max_error_inferred : options.max_error;
    if (double(std::max(of_face[f], on_edges[f])) > limit) out.too_far.push_back(f);
  }
  out.evidence = statistics_of[0];
  out.inferred = statistics_of[1];
  return out;
}

// The engine keeps input vertices within their tolerance, faces between them reach a little
// farther.
constexpr double kMargin = 0.8;

std::vector<float> tolerances(const TriangleMesh& mesh, const SimplifyOptions& options) {
  std::vector<float> out(mesh.vertices.size(), float(kMargin * options.max_error_inferred));
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (is_unmeasured(mesh, f)) continue;
    for (const uint32_t v : mesh.faces[f]) out[v] = float(kMargin * options.max_error);
  }
  return out;
}

// Holds the borders of labels with evidence so near that the areas within them hardly change.
//
// A border that moves outwards by d all along changes the area by d times its length; collapses
// move it to both sides, so that it may move several times as far. What comes out is measured.
void hold_borders(const TriangleMesh& mesh, double most_change, std::vector<float>& tolerance) {
  constexpr double kBothSides = 14;
  if (most_change >= 1) return;
  const auto across = halfedges::adjacent_faces(mesh);
  const auto label_of = [&](size_t f) {
    return mesh.provenance.empty() ? Provenance::Inferred : mesh.provenance[f];
  };
  const auto for_each_border = [&](const auto& visit) {
    for (uint32_t f = 0; f < mesh.faces.size(); ++f) {
      if (is_unmeasured(mesh, f)) continue;
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t g = across[f].at(k);
        if (g != f && label_of(g) == label_of(f)) continue;
        visit(size_t(label_of(f)), mesh.faces[f].at(k), mesh.faces[f].at((k + 1) % 3));
      }
    }
  };
  std::array<double, kProvenanceCount> length = {};
  for_each_border([&](size_t label, uint32_t a, uint32_t b) {
    length.at(label) += double((mesh.vertices[a] - mesh.vertices[b]).norm());
  });
  const auto area = area_by_provenance(mesh);
  for_each_border([&](size_t label, uint32_t a, uint32_t b) {
    const auto most = float(kBothSides * most_change * area.at(label) / length.at(label));
    for (const uint32_t v : {a, b}) tolerance[v] = std::min(tolerance[v], most);
  });
}

// The places of the corners of two faces, whatever their numbers and order.
using PairPlaces = std::array<std::array<std::array<float, 3>, 3>, 2>;

PairPlaces places_of(const TriangleMesh& mesh, const std::pair<uint32_t, uint32_t>& pair) {
  PairPlaces out;
  for (size_t i = 0; i < 2; ++i) {
    const auto& face = mesh.faces[i == 0 ? pair.first : pair.second];
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = mesh.vertices[face.at(k)];
      out.at(i).at(k) = {p.x(), p.y(), p.z()};
    }
    std::sort(out.at(i).begin(), out.at(i).end());
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Finds what cuts itself in a result. Two faces that did so in the input and are still where they
// were are none of it: no round would part them.
class NewIntersections {
 public:
  explicit NewIntersections(const TriangleMesh& input) : input_(input) {}

  std::vector<uint32_t> faces_of(const TriangleMesh& result) {
    const auto pairs = self_intersections(result);
    std::vector<uint32_t> out;
    if (pairs.empty()) return out;
    if (!is_input_known_) find_given();
    for (const auto& pair : pairs) {
      if (std::binary_search(given_.begin(), given_.end(), places_of(result, pair))) continue;
      out.insert(out.end(), {pair.first, pair.second});
    }
    return out;
  }

 private:
  void find_given() {
    is_input_known_ = true;
    try {
      for (const auto& pair : self_intersections(input_)) given_.push_back(places_of(input_, pair));
    } catch (const LimitError&) {
      return;  // too many to be held: none of them is excused
    }
    std::sort(given_.begin(), given_.end());
  }

  const TriangleMesh& input_;
  bool is_input_known_ = false;
  std::vector<PairPlaces> given_;  // of the input, ascending
};

// Holds input vertices nearer to the result than in the last round.
class Tightening {
 public:
  Tightening(std::vector<float>& tolerance, double least)
      : tolerance_(tolerance), least_(least), marked_(tolerance.size(), 0) {}

  void input_face(const TriangleMesh& input, uint32_t f) {
    for (const uint32_t v : input.faces[f]) marked_[v] = 1;
  }
  // The input vertices near a marked face of the result, or near a neighbour of it if it has none.
  void output_faces(const CollapsedMesh& output, std::vector<uint8_t> bad) {
    std::vector<uint8_t> lone = bad;
    for (const uint32_t f : output.witness_of) {
      if (f < lone.size()) lone[f] = 0;
    }
    grow_over_vertices(output.mesh, lone);
    for (size_t f = 0; f < bad.size(); ++f) bad[f] |= lone[f];
    for (size_t v = 0; v < marked_.size(); ++v) {
      const uint32_t f = output.witness_of[v];
      if (f < bad.size() && bad[f] != 0) marked_[v] = 1;
    }
  }
  /// \return how many vertices changed.
  size_t apply() {
    size_t count = 0;
    for (size_t v = 0; v < marked_.size(); ++v) {
      if (marked_[v] == 0 || !(tolerance_[v] > 0)) continue;
      constexpr float kNearer = 1.0f / 16;
      tolerance_[v] *= kNearer;
      if (double(tolerance_[v]) < least_) tolerance_[v] = 0;
      ++count;
    }
    return count;
  }

 private:
  std::vector<float>& tolerance_;
  double least_;
  std::vector<uint8_t> marked_;
};

// Input vertices on faces of labels with evidence whose area has changed too much.
bool tighten_for_area(const TriangleMesh& mesh,
                      const SimplifyResult& result,
                      double most_change,
                      std::vector<float>& tolerance) {
  std::array<bool, kProvenanceCount> changed{};
  for (size_t label = 0; label < changed.size(); ++label) {
    const bool counts = mesh.provenance.empty() || has_evidence(Provenance(label));
    const double change = std::abs(result.area_after[label] - result.area_before[label]);
    changed[label] = counts && change > most_change * result.area_before[label];
  }
  std::vector<uint8_t> marked(tolerance.size(), 0);
  bool any = false;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!changed[mesh.provenance.empty() ? 0 : size_t(mesh.provenance[f])]) continue;
    any = true;
    for (const uint32_t v : mesh.faces[f]) marked[v] = 1;
  }
  for (size_t v = 0; v < marked.size(); ++v) {
    if (marked[v] != 0) tolerance[v] *= 0.25f;
  }
  return any;
}

SimplifyResult unchanged(const TriangleMesh& mesh) {
  SimplifyResult result;
  result.mesh = mesh;
  result.faces_before = result.faces_after = mesh.faces.size();
  result.area_before = result.area_after = area_by_provenance(mesh);
  return result;
}

// \param options  valid, and complete
SimplifyResult simplify_connected(const TriangleMesh& mesh,
                                  const SimplifyOptions& options,
                                  const Progress& progress) {
  SimplifyResult result = unchanged(mesh);
  CollapseLimits limits{
      tolerances(mesh, options), float(options.max_color_error), options.target_faces, 0};
  hold_borders(mesh, options.max_area_change, limits.tolerance);
  CollapseHistory history;
  NewIntersections intersections(mesh);
  std::optional<DistanceToMesh> to_input;
  constexpr int kRounds = 10;
  for (int round = 1; round <= kRounds; ++round) {
    const auto part = [&](double begin, double end) {
      return part_of(progress, (round - 1 + begin) / kRounds, (round - 1 + end) / kRounds);
    };
    CollapsedMesh out = collapse_edges(mesh, limits, round > 1 ? &history : nullptr, part(0, 0.6));
    history = std::move(out.history);
    result.rounds = round;
    result.area_after = area_by_provenance(out.mesh);
    if (tighten_for_area(mesh, result, options.max_area_change, limits.tolerance)) continue;
    Tightening tightening(limits.tolerance, options.max_error / 32);
    // What cuts itself may do so for what its neighbours did.
    std::vector<uint8_t> bad(out.mesh.faces.size(), 0);
    for (const uint32_t f : intersections.faces_of(out.mesh)) bad[f] = 1;
    grow_over_vertices(out.mesh, bad);
    if (!to_input) to_input.emplace(mesh);
    const Measured forth = measure(out.mesh, *to_input, options, part(0.7, 0.8));
    const Measured back = measure(mesh, DistanceToMesh(out.mesh), options, part(0.8, 1));
    for (const uint32_t f : forth.too_far) bad[f] = 1;
    const bool is_bad = std::find(bad.begin(), bad.end(), uint8_t{1}) != bad.end();
    if (is_bad) tightening.output_faces(out, std::move(bad));
    for (const uint32_t f : back.too_far) tightening.input_face(mesh, f);
    if (!is_bad && back.too_far.empty()) {
      result.mesh = std::move(out.mesh);
      result.faces_after = result.mesh.faces.size();
      result.evidence = {forth.evidence, back.evidence};
      result.inferred = {forth.inferred, back.inferred};
      widen_sigma(result.mesh, result.evidence);
      report(progress, 1);
      return result;
    }
    if (tightening.apply() == 0) break;  // the next round would be the same
  }
  const int rounds = result.rounds;
  result = unchanged(mesh);
  result.rounds = rounds;
  return result;
}

}  // namespace

void SimplifyOptions::validate() const {
  require(max_error > 0, "SimplifyOptions.max_error must be > 0", max_error);
  require(max_error_inferred == 0 || max_error_inferred >= max_error,
          "SimplifyOptions.max_error_inferred must be 0 or >= max_error",
          max_error_inferred);
  require(max_color_error > 0 && max_color_error <= 1,
          "SimplifyOptions.max_color_error must be in (0, 1]",
          max_color_error);
  require(max_area_change > 0 && max_area_change <= 1,
          "SimplifyOptions.max_area_change must be in (0, 1]",
          max_area_change);
}

SimplifyResult simplify(const TriangleMesh& mesh,
                        const SimplifyOptions& given,
                        const Progress& progress) {
  given.validate();
  SimplifyOptions options = given;
  if (options.max_error_inferred == 0) options.max_error_inferred = options.max_error;
  for (const auto& p : mesh.vertices) {
    require(p.allFinite(), "simplify needs finite vertices, a coordinate", p.sum());
  }
  if (mesh.faces.empty()) return unchanged(mesh);
  const std::optional<StitchedMesh> stitched = with_joined_seams(mesh);
  if (!stitched) return simplify_connected(mesh, options, progress);
  SimplifyResult result = simplify_connected(stitched->mesh, options, progress);
  if (result.faces_after == result.faces_before) return unchanged(mesh);
  result.joined_vertices = stitched->vertices;
  return result;
}

}  // namespace cgs
