// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edge_collapse.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "meshing/components.h"
#include "meshing/quadric.h"

namespace cgs {

namespace {

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

bool has(const Face& face, uint32_t v) { return face[0] == v || face[1] == v || face[2] == v; }

/// A vertex joined to another by an edge.
struct Neighbor {
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

/// A face of the star after a collapse, relative to its new vertex.
struct NewFace {
  uint32_t face;
  uint32_t b, c;  ///< Its other corners.
  Provenance label;
  Vector3f normal, normal_before;  ///< Unit length; 0 for a face without area.
  Vector3f ab, ac;                 ///< To the other corners.
  float abab, abac, acac;
  Vector3f color, color_ab, color_ac;  ///< At the new vertex, and differences.
};

/// Where a point lies nearest on a face.
struct Foot {
  float squared_distance;
  float v, w;  ///< Barycentric weights of the second and third corner.
};

// Nearest point of a triangle with its first corner at the origin (Ericson 2005, 5.1.5).
Foot foot_on(const NewFace& f, const Vector3f& x) {
  const float d1 = f.ab.dot(x);
  const float d2 = f.ac.dot(x);
  const float d3 = d1 - f.abab;
  const float d4 = d2 - f.abac;
  const float d5 = d1 - f.abac;
  const float d6 = d2 - f.acac;
  float v = 0;
  float w = 0;
  const float vc = d1 * d4 - d3 * d2;
  const float vb = d5 * d2 - d1 * d6;
  const float va = d3 * d6 - d5 * d4;
  if (d1 <= 0 && d2 <= 0) {
    // the new vertex itself
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1;
  } else if (d6 >= 0 && d5 <= d6) {
    w = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = d1 / (d1 - d3);
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    w = d2 / (d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    v = 1 - w;
  } else {
    v = vb / (va + vb + vc);
    w = vc / (va + vb + vc);
  }
  return {(x - v * f.ab - w * f.ac).squaredNorm(), v, w};
}

float squared_distance_to_segment(const Vector3f& x, const Vector3f& a, const Vector3f& b) {
  const Vector3f ab = b - a;
  const float length = ab.squaredNorm();
  const float t = length > 0 ? std::clamp(ab.dot(x - a) / length, 0.0f, 1.0f) : 0.0f;
  return (x - a - t * ab).squaredNorm();
}

class Collapser {
 public:
  Collapser(const TriangleMesh& mesh, const CollapseLimits& limits);
  CollapsedMesh run();

 private:
  struct Candidate {
    float cost;
    uint32_t slot;  // 3 * face + side
    bool operator<(const Candidate& o) const {
      return cost != o.cost ? cost < o.cost : slot < o.slot;
    }
  };
  enum class Outcome { Done, Refused, Later };

  void index_faces();
  void neighbors_of(uint32_t v, std::vector<Neighbor>& out) const;
  Kind kind_of(uint32_t v, const std::vector<Neighbor>& neighbors) const;
  bool one_fan(uint32_t v) const;
  void classify();
  Quadric quadric_around(uint32_t v, const std::vector<Neighbor>& neighbors) const;
  void find_candidates();
  bool may_collapse(uint32_t u, uint32_t v) const;
  Placement placement(uint32_t u, uint32_t v) const;
  size_t pass();
  Outcome collapse(uint32_t a, uint32_t b);
  void gather_star(uint32_t u, uint32_t v);
  bool link_allows(uint32_t u, uint32_t v, bool& border);
  bool reachable(uint32_t u, uint32_t v, const Vector3f& p) const;
  bool border_allows(uint32_t u, uint32_t v, const Vector3f& p);
  bool faces_allow(uint32_t u, uint32_t v, const Vector3f& p, float t);
  bool folds() const;
  bool witnesses_allow(const Vector3f& p);
  void apply(uint32_t u, uint32_t v, const Placement& to);
  void drop_dead_faces();
  Vector3d vertex(uint32_t v) const { return mesh_.vertices[v].cast<double>() - center_; }
  Vector3d area_vector(const Face& f) const {
    return (vertex(f[1]) - vertex(f[0])).cross(vertex(f[2]) - vertex(f[0]));
  }

  const TriangleMesh& original_;
  const CollapseLimits& limits_;
  TriangleMesh mesh_;  // vertex numbers are those of the original
  Vector3d center_ = Vector3d::Zero();
  std::vector<uint8_t> dead_;     // per face
  std::vector<uint8_t> refused_;  // per face, a bit per side
  std::vector<uint32_t> first_;   // faces around vertex v: around_[first_[v] ... first_[v + 1])
  std::vector<uint32_t> around_;  // as of the beginning of the pass
  std::vector<Kind> kind_;
  std::vector<Quadric> quadric_;
  std::vector<uint8_t> used_;     // per vertex: merged in this pass
  std::vector<uint8_t> changed_;  // per vertex: star changed in the last pass
  std::vector<float> cost_;       // per slot
  std::vector<Candidate> candidates_;
  std::vector<uint32_t> cursor_;   // per vertex: where its next face goes in around_
  std::vector<uint32_t> witness_;  // per face: list of original vertices
  std::vector<uint32_t> next_witness_;
  std::vector<uint32_t> next_on_border_;  // per original border vertex: ring of those merged
  // Of the collapse at hand.
  std::vector<uint32_t> moving_, dying_, points_, face_of_point_;
  std::vector<NewFace> fresh_;
  std::vector<Neighbor> around_u_, around_v_;
};

Collapser::Collapser(const TriangleMesh& mesh, const CollapseLimits& limits)
    : original_(mesh), limits_(limits), mesh_(mesh) {
  assert(limits.tolerance.size() == mesh.vertices.size());
  if (mesh_.provenance.empty()) mesh_.provenance.assign(mesh.faces.size(), Provenance::Observed);
  Eigen::AlignedBox3d box;
  for (const Vector3f& p : mesh.vertices) box.extend(p.cast<double>());
  if (!box.isEmpty()) center_ = box.center();
  const size_t n = mesh.vertices.size();
  dead_.assign(mesh.faces.size(), 0);
  refused_.assign(mesh.faces.size(), 0);
  changed_.assign(n, 0);
  kind_.assign(n, Kind::Fixed);
  quadric_.resize(n);
  index_faces();
  classify();
  witness_.assign(mesh.faces.size(), kNone);
  next_witness_.assign(n, kNone);
  next_on_border_.resize(n);
  for (uint32_t v = 0; v < n; ++v) {
    next_on_border_[v] = v;
    if (first_[v] == first_[v + 1]) continue;
    // Where labels meet, the surface with evidence is the one to stay near to.
    const uint32_t f = *std::max_element(
        around_.begin() + first_[v], around_.begin() + first_[v + 1], [&](uint32_t a, uint32_t b) {
          return (mesh_.provenance[a] != Provenance::Inferred) <
                 (mesh_.provenance[b] != Provenance::Inferred);
        });
    next_witness_[v] = witness_[f];
    witness_[f] = v;
  }
}

void Collapser::index_faces() {
  first_.assign(mesh_.vertices.size() + 1, 0);
  for (const Face& f : mesh_.faces) {
    for (const uint32_t v : f) ++first_[v + 1];
  }
  for (size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
  around_.resize(3 * mesh_.faces.size());
  cursor_.assign(first_.begin(), first_.end() - 1);
  for (uint32_t f = 0; f < mesh_.faces.size(); ++f) {
    for (const uint32_t v : mesh_.faces[f]) around_[cursor_[v]++] = f;
  }
}

void Collapser::neighbors_of(uint32_t v, std::vector<Neighbor>& out) const {
  out.clear();
  for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
    const uint32_t f = around_[i];
    if (dead_[f] != 0) continue;
    const Face& face = mesh_.faces[f];
    const Provenance label = mesh_.provenance[f];
    const int k = face[0] == v ? 0 : face[1] == v ? 1 : 2;
    for (const int turn : {1, 2}) {
      const uint32_t w = face[size_t((k + turn) % 3)];
      auto at = std::find_if(out.begin(), out.end(), [w](const auto& n) { return n.vertex == w; });
      if (at == out.end()) {
        out.push_back({w, 0, 0, true, label});
        at = out.end() - 1;
      }
      ++at->faces;
      at->winding += turn == 1 ? 1 : -1;
      if (at->faces == 2) at->border = at->label != label;
    }
  }
}

// Walks from face to face over shared edges; all faces around the vertex must be met.
bool Collapser::one_fan(uint32_t v) const {
  std::vector<uint32_t> rest(around_.begin() + first_[v], around_.begin() + first_[v + 1]);
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

Kind Collapser::kind_of(uint32_t v, const std::vector<Neighbor>& neighbors) const {
  if (neighbors.empty() || !(limits_.tolerance[v] > 0) || !one_fan(v)) return Kind::Fixed;
  size_t borders = 0;
  for (const Neighbor& n : neighbors) {
    const bool consistent = n.faces == 1 || (n.faces == 2 && n.winding == 0);
    if (n.vertex == v || !consistent) return Kind::Fixed;
    borders += size_t(n.border);
  }
  if (borders == 0) return Kind::Interior;
  return borders == 2 ? Kind::Border : Kind::Corner;
}

void Collapser::classify() {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, uint32_t(kind_.size())), [&](const auto& r) {
    std::vector<Neighbor> neighbors;
    for (uint32_t v = r.begin(); v != r.end(); ++v) {
      neighbors_of(v, neighbors);
      kind_[v] = kind_of(v, neighbors);
      quadric_[v] = quadric_around(v, neighbors);
    }
  });
}

// The planes of the faces around a vertex, weighted by area, and planes that hold its borders.
Quadric Collapser::quadric_around(uint32_t v, const std::vector<Neighbor>& neighbors) const {
  Quadric sum;
  for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
    const Face& face = mesh_.faces[around_[i]];
    const Vector3d n = area_vector(face);
    const double length = n.norm();
    if (!(length > 0)) continue;
    sum.add_plane(n / length, vertex(v), 0.5 * length);
    for (const Neighbor& to : neighbors) {
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

// Collapses the cheapest part of what may be collapsed.
size_t Collapser::pass() {
  constexpr double kPart = 0.35;
  constexpr size_t kAtLeast = 1000;
  find_candidates();
  const auto wanted = ptrdiff_t(
      std::min(candidates_.size(), std::max(kAtLeast, size_t(kPart * double(candidates_.size())))));
  std::nth_element(candidates_.begin(), candidates_.begin() + wanted, candidates_.end());
  tbb::parallel_sort(candidates_.begin(), candidates_.begin() + wanted);
  used_.assign(mesh_.vertices.size(), 0);
  changed_.assign(changed_.size(), 0);
  size_t left = mesh_.faces.size();
  for (auto at = candidates_.begin(); at != candidates_.begin() + wanted; ++at) {
    if (left <= limits_.target_faces) break;
    const uint32_t f = at->slot / 3;
    const uint32_t k = at->slot % 3;
    if (dead_[f] != 0) continue;
    const Outcome outcome = collapse(mesh_.faces[f][k], mesh_.faces[f][(k + 1) % 3]);
    if (outcome == Outcome::Refused) refused_[f] |= static_cast<uint8_t>(1U << k);
    if (outcome == Outcome::Done) left -= dying_.size();
  }
  drop_dead_faces();
  index_faces();
  return size_t(wanted);
}

void Collapser::gather_star(uint32_t u, uint32_t v) {
  moving_.clear();
  dying_.clear();
  for (const uint32_t a : {u, v}) {
    for (uint32_t i = first_[a]; i < first_[a + 1]; ++i) {
      const uint32_t f = around_[i];
      if (dead_[f] != 0) continue;
      if (!has(mesh_.faces[f], u + v - a)) {
        moving_.push_back(f);
      } else if (a == u) {
        dying_.push_back(f);
      }
    }
  }
}

Collapser::Outcome Collapser::collapse(uint32_t a, uint32_t b) {
  if (used_[a] != 0 || used_[b] != 0) return Outcome::Later;
  const auto [u, v] = kind_[b] > kind_[a] ? std::pair(b, a) : std::pair(a, b);
  gather_star(u, v);
  bool border = false;
  if (!link_allows(u, v, border)) return Outcome::Refused;
  const bool both_on_border = kind_[v] == Kind::Border;
  if (both_on_border != border) return Outcome::Refused;
  const Placement to = placement(u, v);
  const Vector3f p = (to.point + center_).cast<float>();
  if (!reachable(u, v, p)) return Outcome::Refused;
  if (border && !border_allows(u, v, p)) return Outcome::Refused;
  if (!faces_allow(u, v, p, to.t) || !witnesses_allow(p)) return Outcome::Refused;
  apply(u, v, to);
  return Outcome::Done;
}

// The link condition for the surface, and for the borders drawn on it.
bool Collapser::link_allows(uint32_t u, uint32_t v, bool& border) {
  neighbors_of(u, around_u_);
  neighbors_of(v, around_v_);
  if (dying_.empty() || dying_.size() > 2) return false;
  size_t shared = 0;
  for (const Neighbor& n : around_u_) {
    if (n.vertex == v) border = n.border;
    const auto at = std::find_if(
        around_v_.begin(), around_v_.end(), [&](const auto& m) { return m.vertex == n.vertex; });
    if (at == around_v_.end()) continue;
    ++shared;
    // Two borders would become one: the label between them would vanish.
    if (n.border && at->border) return false;
  }
  if (shared != dying_.size()) return false;
  if (dying_.size() == 1) return true;
  // A tetrahedron would become two faces on each other.
  std::array<uint32_t, 2> apex{};
  for (size_t i = 0; i < 2; ++i) {
    for (const uint32_t w : mesh_.faces[dying_[i]]) {
      if (w != u && w != v) apex.at(i) = w;
    }
  }
  return std::count_if(moving_.begin(), moving_.end(), [&](uint32_t f) {
           return has(mesh_.faces[f], apex[0]) && has(mesh_.faces[f], apex[1]);
         }) < 2;
}

// The new vertex must lie near the old star: witnesses keep the old surface near the new one, this
// keeps the new one near the old.
bool Collapser::reachable(uint32_t u, uint32_t v, const Vector3f& p) const {
  const float reach = 0.5f * std::max(limits_.tolerance[u], limits_.tolerance[v]);
  const auto near = [&](uint32_t f) {
    const Face& face = mesh_.faces[f];
    NewFace old{};
    old.ab = mesh_.vertices[face[1]] - mesh_.vertices[face[0]];
    old.ac = mesh_.vertices[face[2]] - mesh_.vertices[face[0]];
    old.abab = old.ab.squaredNorm();
    old.abac = old.ab.dot(old.ac);
    old.acac = old.ac.squaredNorm();
    return foot_on(old, p - mesh_.vertices[face[0]]).squared_distance <= reach * reach;
  };
  return std::any_of(dying_.begin(), dying_.end(), near) ||
         std::any_of(moving_.begin(), moving_.end(), near);
}

// Original border vertices stay near the border.
bool Collapser::border_allows(uint32_t u, uint32_t v, const Vector3f& p) {
  std::array<uint32_t, 2> ends = {kNone, kNone};
  for (const Neighbor& n : around_u_) {
    if (n.border && n.vertex != v && kind_[u] == Kind::Border) ends[0] = n.vertex;
  }
  for (const Neighbor& n : around_v_) {
    if (n.border && n.vertex != u) ends[1] = n.vertex;
  }
  const auto near = [&](uint32_t of) {
    uint32_t w = of;
    do {
      const Vector3f& x = original_.vertices[w];
      float nearest = std::numeric_limits<float>::infinity();
      for (const uint32_t end : ends) {
        if (end == kNone) continue;
        nearest = std::min(nearest, squared_distance_to_segment(x, p, mesh_.vertices[end]));
      }
      if (!(nearest <= limits_.tolerance[w] * limits_.tolerance[w])) return false;
      w = next_on_border_[w];
    } while (w != of);
    return true;
  };
  return near(v) && (kind_[u] == Kind::Corner || near(u));
}

// No new face may be turned or thin. Leaves the new faces in fresh_.
bool Collapser::faces_allow(uint32_t u, uint32_t v, const Vector3f& p, float t) {
  constexpr double kLeastCosine = 0.5;
  constexpr double kLeastQuality = 0.05;  // 1 = equilateral
  const auto quality = [](double area, const Vector3d& ab, const Vector3d& ac) {
    const double edges = ab.squaredNorm() + ac.squaredNorm() + (ac - ab).squaredNorm();
    return edges > 0 ? 2 * std::sqrt(3.0) * area / edges : 0;
  };
  const bool colored = !mesh_.colors.empty();
  Vector3f color = Vector3f::Zero();
  if (colored) color = (1 - t) * mesh_.colors[u] + t * mesh_.colors[v];
  fresh_.clear();
  double worst_old = 1;
  double worst_new = 1;
  for (const uint32_t f : moving_) {
    const Face& face = mesh_.faces[f];
    const size_t k = face[0] == u || face[0] == v ? 0 : face[1] == u || face[1] == v ? 1 : 2;
    const uint32_t b = face[(k + 1) % 3];
    const uint32_t c = face[(k + 2) % 3];
    NewFace fresh;
    fresh.face = f;
    fresh.b = b;
    fresh.c = c;
    fresh.label = mesh_.provenance[f];
    fresh.ab = mesh_.vertices[b] - p;
    fresh.ac = mesh_.vertices[c] - p;
    fresh.abab = fresh.ab.squaredNorm();
    fresh.abac = fresh.ab.dot(fresh.ac);
    fresh.acac = fresh.ac.squaredNorm();
    if (colored) {
      fresh.color = color;
      fresh.color_ab = mesh_.colors[b] - color;
      fresh.color_ac = mesh_.colors[c] - color;
    }
    const Vector3d ab = fresh.ab.cast<double>();
    const Vector3d ac = fresh.ac.cast<double>();
    const Vector3d n = ab.cross(ac);
    const Vector3d before = area_vector(face);
    const double size = n.norm();
    const double size_before = before.norm();
    if (!(size > 0) || n.dot(before) < kLeastCosine * size * size_before) return false;
    fresh.normal = (n / size).cast<float>();
    fresh.normal_before = size_before > 0 ? Vector3f((before / size_before).cast<float>())
                                          : Vector3f(Vector3f::Zero());
    fresh_.push_back(fresh);
    worst_new = std::min(worst_new, quality(size, ab, ac));
    worst_old = std::min(
        worst_old, quality(size_before, vertex(b) - vertex(face[k]), vertex(c) - vertex(face[k])));
  }
  return !fresh_.empty() && worst_new >= std::min(kLeastQuality, worst_old) && !folds();
}

// Whether neighbours come to lie nearly back to back that did not before: a flap of which no
// witness knows.
bool Collapser::folds() const {
  constexpr float kLeastCosine = -0.5f;
  for (const NewFace& f : fresh_) {
    for (const NewFace& g : fresh_) {
      if (f.c != g.b) continue;
      const float now = f.normal.dot(g.normal);
      if (now < kLeastCosine && now < f.normal_before.dot(g.normal_before)) return true;
    }
    for (uint32_t i = first_[f.b]; i < first_[f.b + 1]; ++i) {
      const uint32_t g = around_[i];
      if (dead_[g] != 0 || g == f.face || !has(mesh_.faces[g], f.c)) continue;
      const Vector3f n = area_vector(mesh_.faces[g]).cast<float>();
      const float now = f.normal.dot(n);
      if (now < kLeastCosine * n.norm() && now < f.normal_before.dot(n)) return true;
    }
  }
  return false;
}

// Every witness of the old star must be near a new face of its label, in place and colour.
bool Collapser::witnesses_allow(const Vector3f& p) {
  points_.clear();
  face_of_point_.clear();
  const auto find = [&](uint32_t f) {
    const Provenance label = mesh_.provenance[f];
    const bool compare_colors = !mesh_.colors.empty() && label != Provenance::Inferred;
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) {
      const Vector3f x = original_.vertices[w] - p;
      const NewFace* nearest = nullptr;
      Foot foot{std::numeric_limits<float>::infinity(), 0, 0};
      for (const NewFace& fresh : fresh_) {
        if (fresh.label != label) continue;
        const Foot other = foot_on(fresh, x);
        if (!(other.squared_distance < foot.squared_distance)) continue;
        foot = other;
        nearest = &fresh;
      }
      if (!(foot.squared_distance <= limits_.tolerance[w] * limits_.tolerance[w])) return false;
      if (compare_colors) {
        const Vector3f color =
            nearest->color + foot.v * nearest->color_ab + foot.w * nearest->color_ac;
        const float change = (color - original_.colors[w]).cwiseAbs().maxCoeff();
        if (!(change <= limits_.color)) return false;
      }
      points_.push_back(w);
      face_of_point_.push_back(nearest->face);
    }
    return true;
  };
  return std::all_of(dying_.begin(), dying_.end(), find) &&
         std::all_of(moving_.begin(), moving_.end(), find);
}

void Collapser::apply(uint32_t u, uint32_t v, const Placement& to) {
  mesh_.vertices[u] = (to.point + center_).cast<float>();
  if (!mesh_.colors.empty()) {
    mesh_.colors[u] = (1 - to.t) * mesh_.colors[u] + to.t * mesh_.colors[v];
  }
  if (!mesh_.support.empty() && to.t > 0.5f) mesh_.support[u] = mesh_.support[v];
  if (!mesh_.sigma.empty()) {
    const float mixed = (1 - to.t) * mesh_.sigma[u] + to.t * mesh_.sigma[v];
    mesh_.sigma[u] = !std::isnan(mixed) ? mixed : to.t > 0.5f ? mesh_.sigma[v] : mesh_.sigma[u];
  }
  if (kind_[v] == Kind::Border && kind_[u] == Kind::Border) {
    std::swap(next_on_border_[u], next_on_border_[v]);  // joins the two rings
  }
  quadric_[u] += quadric_[v];
  used_[u] = used_[v] = 1;
  for (const uint32_t f : dying_) {
    dead_[f] = 1;
    for (const uint32_t w : mesh_.faces[f]) changed_[w] = 1;
  }
  for (const uint32_t f : moving_) {
    witness_[f] = kNone;
    for (uint32_t& w : mesh_.faces[f]) {
      if (w == v) w = u;
      changed_[w] = 1;
    }
  }
  for (size_t i = 0; i < points_.size(); ++i) {
    uint32_t& head = witness_[face_of_point_[i]];
    next_witness_[points_[i]] = head;
    head = points_[i];
  }
}

void Collapser::drop_dead_faces() {
  size_t n = 0;
  for (size_t f = 0; f < mesh_.faces.size(); ++f) {
    if (dead_[f] != 0) continue;
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
  dead_.assign(n, 0);
}

CollapsedMesh Collapser::run() {
  while (mesh_.faces.size() > limits_.target_faces && pass() > 0) {
  }
  CollapsedMesh out;
  out.witness_of.assign(original_.vertices.size(), kNone);
  for (uint32_t f = 0; f < witness_.size(); ++f) {
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) out.witness_of[w] = f;
  }
  if (original_.provenance.empty()) mesh_.provenance.clear();
  out.mesh = with_faces(mesh_, std::vector<uint8_t>(mesh_.faces.size(), 1));
  if (!original_.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

}  // namespace

CollapsedMesh collapse_edges(const TriangleMesh& mesh, const CollapseLimits& limits) {
  return Collapser(mesh, limits).run();
}

}  // namespace cgs
