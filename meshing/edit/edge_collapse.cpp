// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/edge_collapse.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "meshing/edit/collapser.h"
#include "meshing/mesh/components.h"

namespace cgs {

namespace edge_collapse {

namespace {

// One more face at an edge.
void join(EdgeNeighbor& at, const EdgeNeighbor& one) {
  ++at.faces;
  at.winding += one.winding;
  if (at.faces == 2) at.border = at.label != one.label;
}

// Leaves one neighbour per vertex.
void join_same(std::vector<EdgeNeighbor>& all) {
  std::stable_sort(all.begin(), all.end(), [](auto& a, auto& b) { return a.vertex < b.vertex; });
  std::vector<EdgeNeighbor> out;
  for (const EdgeNeighbor& one : all) {
    if (!out.empty() && out.back().vertex == one.vertex) {
      join(out.back(), one);
    } else {
      out.push_back(one);
    }
  }
  all = std::move(out);
}

}  // namespace

Collapser::Collapser(const TriangleMesh& mesh, const CollapseLimits& limits)
    : original_(mesh), limits_(limits), mesh_(mesh) {
  assert(limits.tolerance.size() == mesh.vertices.size());
  if (mesh_.provenance.empty()) mesh_.provenance.assign(mesh.faces.size(), Provenance::Observed);
  Eigen::AlignedBox3d box;
  for (const Vector3f& p : mesh.vertices) box.extend(p.cast<double>());
  if (!box.isEmpty()) center_ = box.center();
  may_move_anywhere_ =
      limits.color >= 1 &&
      std::all_of(limits.tolerance.begin(), limits.tolerance.end(), [&](float tolerance) {
        return !box.isEmpty() && double{tolerance} > box.diagonal().norm();
      });
  const size_t n = mesh.vertices.size();
  refused_.assign(mesh.faces.size(), 0);
  changed_.assign(n, 0);
  stamp_.assign(n, 0);
  kind_.assign(n, Kind::Fixed);
  quadric_.resize(n);
  around_ = original_around_ = faces_of_vertices(n, mesh_.faces);
  classify();
  witness_.assign(mesh.faces.size(), kNone);
  next_witness_.assign(n, kNone);
  next_on_border_.resize(n);
  for (uint32_t v = 0; v < n; ++v) {
    next_on_border_[v] = v;
    const std::span<const uint32_t> around = around_.of(v);
    if (around.empty()) continue;
    // Where labels meet, the surface with evidence is the one to stay near to.
    const uint32_t f = *std::max_element(around.begin(), around.end(), [&](uint32_t a, uint32_t b) {
      return has_evidence(mesh_.provenance[a]) < has_evidence(mesh_.provenance[b]);
    });
    next_witness_[v] = witness_[f];
    witness_[f] = v;
  }
}

void Collapser::neighbors_of(uint32_t v, std::vector<EdgeNeighbor>& out) const {
  out.clear();
  constexpr uint32_t kMany = 64;  // faces: searching among them costs more than sorting
  const bool many = around_.of(v).size() > kMany;
  for (const uint32_t f : around_.of(v)) {
    if (is_dead(f)) continue;
    const Face& face = mesh_.faces[f];
    const Provenance label = mesh_.provenance[f];
    const int k = face[0] == v ? 0 : face[1] == v ? 1 : 2;
    for (const int turn : {1, 2}) {
      const uint32_t w = face[size_t((k + turn) % 3)];
      const EdgeNeighbor one{w, 1, turn == 1 ? 1 : -1, true, label};
      auto at = out.end();
      if (!many) at = std::find_if(out.begin(), out.end(), [w](auto& n) { return n.vertex == w; });
      if (at == out.end()) {
        out.push_back(one);
      } else {
        join(*at, one);
      }
    }
  }
  if (many) join_same(out);
}

// Walks from face to face over shared edges; all faces around the vertex must be met.
bool Collapser::one_fan(uint32_t v) const {
  const std::span<const uint32_t> around = around_.of(v);
  std::vector<uint32_t> rest(around.begin(), around.end());
  std::vector<uint32_t> open = {rest.back()};
  rest.pop_back();
  while (!open.empty()) {
    const Face from = mesh_.faces[open.back()];
    open.pop_back();
    for (size_t i = rest.size(); i-- > 0;) {
      const Face& to = mesh_.faces[rest[i]];
      const auto shared =
          std::count_if(from.begin(), from.end(), [&](uint32_t w) { return w != v && has(to, w); });
      if (shared == 0) continue;
      open.push_back(rest[i]);
      rest.erase(rest.begin() + static_cast<ptrdiff_t>(i));
    }
  }
  return rest.empty();
}

Kind Collapser::kind_of(uint32_t v, const std::vector<EdgeNeighbor>& neighbors) const {
  // What is asked of the faces around a vertex takes their square.
  constexpr uint32_t kMostFaces = 1000;
  const bool is_hub = around_.of(v).size() > kMostFaces;
  if (neighbors.empty() || is_hub || !(limits_.tolerance[v] > 0) || !one_fan(v)) {
    return Kind::Fixed;
  }
  size_t borders = 0;
  for (const EdgeNeighbor& n : neighbors) {
    const bool consistent = n.faces == 1 || (n.faces == 2 && n.winding == 0);
    if (n.vertex == v || !consistent) return Kind::Fixed;
    borders += size_t(n.border);
  }
  if (borders == 0) return Kind::Interior;
  return borders == 2 ? Kind::Border : Kind::Corner;
}

void Collapser::classify() {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, uint32_t(kind_.size())), [&](const auto& r) {
    std::vector<EdgeNeighbor> neighbors;
    for (uint32_t v = r.begin(); v != r.end(); ++v) {
      neighbors_of(v, neighbors);
      kind_[v] = kind_of(v, neighbors);
      quadric_[v] = quadric_around(v, neighbors);
    }
  });
}

// The planes of the faces around a vertex, weighted by area, and planes that hold its borders.
Quadric Collapser::quadric_around(uint32_t v, const std::vector<EdgeNeighbor>& neighbors) const {
  Quadric sum;
  for (const uint32_t f : around_.of(v)) {
    const Face& face = mesh_.faces[f];
    const Vector3d n = area_vector(face);
    const double length = n.norm();
    if (!(length > 0)) continue;
    sum.add_plane(n / length, vertex(v), 0.5 * length);
    for (const EdgeNeighbor& to : neighbors) {
      if (!to.border || !has(face, to.vertex)) continue;
      const Vector3d along = vertex(to.vertex) - vertex(v);
      const Vector3d across = along.cross(n);
      const double size = across.norm();
      if (size > 0) sum.add_plane(across / size, vertex(v), 0.5 * along.squaredNorm());
    }
  }
  return sum;
}

bool Collapser::may_collapse(uint32_t u, uint32_t v) const {
  const Kind low = std::min(kind_[u], kind_[v]);
  const Kind high = std::max(kind_[u], kind_[v]);
  return high != Kind::Fixed && low != Kind::Corner;
}

Placement Collapser::placement(uint32_t u, uint32_t v) const {
  constexpr double kDamping = 1e-3;
  Quadric sum = quadric_[u];
  sum += quadric_[v];
  const Vector3d a = vertex(u);
  const Vector3d b = vertex(v);
  const Vector3d along = b - a;
  const double length = along.squaredNorm();
  Placement best;
  const auto consider = [&](const Vector3d& p) {
    const double cost = std::max(0.0, sum.at(p));
    if (cost < best.cost) best = {p, cost, 0};
  };
  if (kind_[u] != kind_[v]) {
    consider(a);  // the more constrained vertex stays where it is
  } else {
    const Vector3d middle = 0.5 * (a + b);
    const Vector3d step =
        sum.weight() > 0 ? sum.step_from(middle, kDamping) : Vector3d(Vector3d::Zero());
    consider(step.squaredNorm() <= length ? Vector3d(middle + step) : middle);
    // Damping keeps the optimum a little off sharp corners, where an end may be.
    const double most = 0.5 * best.cost;
    for (const Vector3d& end : {a, b}) {
      const double cost = std::max(0.0, sum.at(end));
      if (cost < most && cost < best.cost) best = {end, cost, 0};
    }
    if (length > 0) {
      best.t = float(std::clamp((best.point - a).dot(along) / length, 0.0, 1.0));
    }
  }
  // Among collapses that cost next to nothing, short edges first: that keeps triangles compact.
  constexpr double kTie = 1e-6;
  best.cost += kTie * sum.weight() * length;
  return best;
}

void Collapser::find_candidates() {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  cost_.assign(3 * mesh_.faces.size(), kNever);
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, uint32_t(mesh_.faces.size()), 1024),
                    [&](const auto& r) {
                      for (uint32_t f = r.begin(); f != r.end(); ++f) {
                        for (uint32_t k = 0; k < 3; ++k) {
                          uint32_t u = mesh_.faces[f][k];
                          uint32_t v = mesh_.faces[f][(k + 1) % 3];
                          // An edge inside is met from both of its faces.
                          if (u > v && (kind_[u] == Kind::Interior || kind_[v] == Kind::Interior))
                            continue;
                          if (!may_collapse(u, v)) continue;
                          const auto bit = static_cast<uint8_t>(1U << k);
                          if (changed_[u] != 0 || changed_[v] != 0)
                            refused_[f] &= static_cast<uint8_t>(~bit);
                          if ((refused_[f] & bit) != 0) continue;
                          if (kind_[v] > kind_[u]) std::swap(u, v);
                          cost_[3 * f + k] = float(placement(u, v).cost);
                        }
                      }
                    });
  candidates_.clear();
  for (uint32_t i = 0; i < cost_.size(); ++i) {
    if (cost_[i] < kNever) candidates_.push_back({cost_[i], i});
  }
}

// The cost up to which this pass goes: that of the cheapest third.
float Collapser::pass_cost() {
  constexpr double kPart = 0.35;
  constexpr size_t kAtLeast = 1000;
  const size_t wanted = std::max(kAtLeast, size_t(kPart * double(candidates_.size())));
  if (wanted >= candidates_.size()) return std::numeric_limits<float>::infinity();
  std::nth_element(candidates_.begin(), candidates_.begin() + ptrdiff_t(wanted), candidates_.end());
  return candidates_[wanted].cost;
}

// So few that hardly any of them looks at what another one changes, and is tried in vain.
size_t Collapser::batch_size() const {
  if (limits_.batch > 0) return limits_.batch;
  return std::clamp<size_t>(mesh_.faces.size() / 2000, 32, 4096);
}

// Tries candidates as if each were the first: independent of each other, so at once. They are
// carried out in their order, after another try where an earlier one has changed something.
void Collapser::try_all(size_t first, size_t count) {
  ++batches_;
  if (batch_.size() < count) batch_.resize(count);
  constexpr size_t kGrain = 8;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kGrain), [&](const auto& r) {
    for (size_t i = r.begin(); i != r.end(); ++i) {
      try_collapse(candidates_[first + i].slot, batch_[i]);
    }
  });
}

// Collapses the cheapest part of what may be collapsed. False if there is nothing.
bool Collapser::pass(const Progress& progress) {
  find_candidates();
  if (candidates_.empty()) return false;
  const float most = pass_cost();
  const auto wanted = std::partition(candidates_.begin(),
                                     candidates_.end(),
                                     [most](const Candidate& c) { return c.cost <= most; });
  tbb::parallel_sort(candidates_.begin(), wanted);
  used_.assign(mesh_.vertices.size(), 0);
  changed_.assign(changed_.size(), 0);
  size_t left = mesh_.faces.size();
  const auto count = static_cast<size_t>(wanted - candidates_.begin());
  for (size_t first = 0; first < count && left > limits_.target_faces;) {
    const size_t tried = std::min(count - first, batch_size());
    try_all(first, tried);
    for (size_t i = 0; i < tried && left > limits_.target_faces; ++i) {
      const uint32_t slot = candidates_[first + i].slot;
      Attempt& attempt = batch_[i];
      if (is_dead(slot / 3)) continue;
      if (is_stale(attempt)) try_collapse(slot, attempt);
      if (attempt.outcome == Attempt::Outcome::Refused) {
        refused_[slot / 3] |= static_cast<uint8_t>(1U << slot % 3);
      }
      if (attempt.outcome != Attempt::Outcome::Allowed) continue;
      apply(attempt);
      left -= attempt.dying.size();
    }
    first += tried;
    report(progress, 1 - double(left) / double(original_.faces.size()));
  }
  end_pass();
  return true;
}

void Collapser::end_pass() {
  drop_dead_faces();
  around_ = faces_of_vertices(mesh_.vertices.size(), mesh_.faces);
  history_.passes.push_back(history_.collapses.size());
}

void Collapser::drop_dead_faces() {
  size_t n = 0;
  for (uint32_t f = 0; f < mesh_.faces.size(); ++f) {
    if (is_dead(f)) continue;
    mesh_.faces[n] = mesh_.faces[f];
    mesh_.provenance[n] = mesh_.provenance[f];
    refused_[n] = refused_[f];
    witness_[n] = witness_[f];
    ++n;
  }
  mesh_.faces.resize(n);
  mesh_.provenance.resize(n);
  refused_.resize(n);
  witness_.resize(n);
}

CollapsedMesh Collapser::run(const CollapseHistory* before, const Progress& progress) {
  if (before != nullptr) repeat(*before);
  while (mesh_.faces.size() > limits_.target_faces && pass(progress)) {
  }
  CollapsedMesh out;
  out.history = std::move(history_);
  out.history.tolerance = limits_.tolerance;
  out.witness_of.assign(original_.vertices.size(), kNone);
  for (uint32_t f = 0; f < witness_.size(); ++f) {
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) out.witness_of[w] = f;
  }
  if (original_.provenance.empty()) mesh_.provenance.clear();
  out.mesh = without_unused_vertices(mesh_);
  if (!original_.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

}  // namespace edge_collapse

CollapsedMesh collapse_edges(const TriangleMesh& mesh,
                             const CollapseLimits& limits,
                             const CollapseHistory* before,
                             const Progress& progress) {
  return edge_collapse::Collapser(mesh, limits).run(before, progress);
}

}  // namespace cgs
