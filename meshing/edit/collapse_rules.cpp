// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <utility>

#include "meshing/edit/collapser.h"

namespace cgs::edge_collapse {

namespace {

/// Where a point lies nearest on a face.
struct Foot {
  float squared_distance;
  float v, w;  ///< Barycentric weights of the second and third corner.
};

// Nearest point of a triangle with its first corner at the origin (Ericson 2005, 5.1.5).
Foot foot_on(const Triangle& f, const Vector3f& x) {
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

/// The new face that a witness lies nearest to.
struct Heir {
  uint32_t face = kNone;  ///< Index into the new faces; none where no one has its label.
  Foot foot{std::numeric_limits<float>::infinity(), 0, 0};
};

/// \param x  of the witness, from the new vertex
Heir heir_of(const std::vector<NewFace>& fresh, Provenance label, const Vector3f& x) {
  Heir out;
  for (uint32_t i = 0; i < fresh.size(); ++i) {
    if (fresh[i].label != label) continue;
    const Foot foot = foot_on(fresh[i], x);
    if (foot.squared_distance < out.foot.squared_distance) out = {i, foot};
  }
  return out;
}

float squared_distance_to_segment(const Vector3f& x, const Vector3f& a, const Vector3f& b) {
  const Vector3f ab = b - a;
  const float length = ab.squaredNorm();
  const float t = length > 0 ? std::clamp(ab.dot(x - a) / length, 0.0f, 1.0f) : 0.0f;
  return (x - a - t * ab).squaredNorm();
}

}  // namespace

void Collapser::gather_star(Attempt& attempt) const {
  attempt.moving.clear();
  attempt.dying.clear();
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  for (const uint32_t a : {u, v}) {
    for (const uint32_t f : around_.of(a)) {
      if (is_dead(f)) continue;
      if (!has(mesh_.faces[f], u + v - a)) {
        attempt.moving.push_back(f);
      } else if (a == u) {
        attempt.dying.push_back(f);
      }
    }
  }
}

void Collapser::try_collapse(uint32_t slot, Attempt& out) const {
  const Face& face = mesh_.faces[slot / 3];
  out.u = face[slot % 3];
  out.v = face[(slot % 3 + 1) % 3];
  if (out.u == kNone || used_[out.u] != 0 || used_[out.v] != 0) {
    out.outcome = Attempt::Outcome::Later;
    out.moving.clear();  // what an earlier candidate left
    return;
  }
  if (kind_[out.v] > kind_[out.u]) std::swap(out.u, out.v);
  out.outcome = outcome_of(out);
}

Attempt::Outcome Collapser::outcome_of(Attempt& attempt) const {
  gather_star(attempt);
  bool border = false;
  if (!link_allows(attempt, border)) return Attempt::Outcome::Refused;
  const bool both_on_border = kind_[attempt.v] == Kind::Border;
  if (both_on_border != border) return Attempt::Outcome::Refused;
  attempt.to = placement(attempt.u, attempt.v);
  const Vector3f p = (attempt.to.point + center_).cast<float>();
  bool is_allowed = false;
  if (may_move_anywhere_) {
    is_allowed = faces_allow(attempt, p) && hand_over_witnesses(attempt);
  } else {
    is_allowed = reachable(attempt, p) && (!border || border_allows(attempt, p)) &&
                 faces_allow(attempt, p) && witnesses_allow(attempt, p) && stays_near(attempt, p);
  }
  return is_allowed ? Attempt::Outcome::Allowed : Attempt::Outcome::Refused;
}

// Whether anything that an attempt looked at has changed in this batch. A collapse stamps all
// corners of the faces it changes: where neither u nor v is stamped, their faces are what they
// were.
bool Collapser::is_stale(const Attempt& attempt) const {
  const auto is_stamped = [&](uint32_t v) { return stamp_[v] == batches_; };
  if (is_stamped(attempt.u) || is_stamped(attempt.v)) return true;
  return std::any_of(attempt.moving.begin(), attempt.moving.end(), [&](uint32_t f) {
    const Face& face = mesh_.faces[f];
    return std::any_of(face.begin(), face.end(), is_stamped);
  });
}

// The link condition for the surface, and for the borders drawn on it.
bool Collapser::link_allows(Attempt& attempt, bool& border) const {
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  const std::vector<uint32_t>& dying = attempt.dying;
  neighbors_of(u, attempt.around_u);
  neighbors_of(v, attempt.around_v);
  if (dying.empty() || dying.size() > 2) return false;
  size_t shared = 0;
  for (const EdgeNeighbor& n : attempt.around_u) {
    if (n.vertex == v) border = n.border;
    const auto at = std::find_if(attempt.around_v.begin(),
                                 attempt.around_v.end(),
                                 [&](const auto& m) { return m.vertex == n.vertex; });
    if (at == attempt.around_v.end()) continue;
    ++shared;
    // Two borders would become one: the label between them would vanish.
    if (n.border && at->border) return false;
  }
  if (shared != dying.size()) return false;
  if (dying.size() == 1) return true;
  // A tetrahedron would become two faces on each other.
  std::array<uint32_t, 2> apex{};
  for (size_t i = 0; i < 2; ++i) {
    for (const uint32_t w : mesh_.faces[dying[i]]) {
      if (w != u && w != v) apex.at(i) = w;
    }
  }
  return std::count_if(attempt.moving.begin(), attempt.moving.end(), [&](uint32_t f) {
           return has(mesh_.faces[f], apex[0]) && has(mesh_.faces[f], apex[1]);
         }) < 2;
}

// The new vertex must lie near the old star: witnesses keep the old surface near the new one, this
// keeps the new one near the old.
bool Collapser::reachable(const Attempt& attempt, const Vector3f& p) const {
  const float reach = 0.5f * std::max(limits_.tolerance[attempt.u], limits_.tolerance[attempt.v]);
  const auto near = [&](uint32_t f) {
    const Face& face = mesh_.faces[f];
    const Triangle old(mesh_.vertices[face[0]], mesh_.vertices[face[1]], mesh_.vertices[face[2]]);
    return foot_on(old, p - mesh_.vertices[face[0]]).squared_distance <= reach * reach;
  };
  return std::any_of(attempt.dying.begin(), attempt.dying.end(), near) ||
         std::any_of(attempt.moving.begin(), attempt.moving.end(), near);
}

// Original border vertices stay near the border.
bool Collapser::border_allows(const Attempt& attempt, const Vector3f& p) const {
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  std::array<uint32_t, 2> ends = {kNone, kNone};
  for (const EdgeNeighbor& n : attempt.around_u) {
    if (n.border && n.vertex != v && kind_[u] == Kind::Border) ends[0] = n.vertex;
  }
  for (const EdgeNeighbor& n : attempt.around_v) {
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

// No new face may be turned or thin. Leaves the new faces in attempt.fresh.
bool Collapser::faces_allow(Attempt& attempt, const Vector3f& p) const {
  constexpr double kLeastCosine = 0.5;
  constexpr double kLeastQuality = 0.05;  // 1 = equilateral
  const auto quality = [](double area, const Vector3d& ab, const Vector3d& ac) {
    const double edges = ab.squaredNorm() + ac.squaredNorm() + (ac - ab).squaredNorm();
    return edges > 0 ? 2 * std::sqrt(3.0) * area / edges : 0;
  };
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  const float t = attempt.to.t;
  const bool colored = !mesh_.colors.empty();
  Vector3f color = Vector3f::Zero();
  if (colored) color = (1 - t) * mesh_.colors[u] + t * mesh_.colors[v];
  attempt.fresh.clear();
  double worst_old = 1;
  double worst_new = 1;
  for (const uint32_t f : attempt.moving) {
    const Face& face = mesh_.faces[f];
    const size_t k = face[0] == u || face[0] == v ? 0 : face[1] == u || face[1] == v ? 1 : 2;
    const uint32_t b = face[(k + 1) % 3];
    const uint32_t c = face[(k + 2) % 3];
    NewFace fresh;
    static_cast<Triangle&>(fresh) = {p, mesh_.vertices[b], mesh_.vertices[c]};
    fresh.face = f;
    fresh.b = b;
    fresh.c = c;
    fresh.label = mesh_.provenance[f];
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
    attempt.fresh.push_back(fresh);
    worst_new = std::min(worst_new, quality(size, ab, ac));
    worst_old = std::min(
        worst_old, quality(size_before, vertex(b) - vertex(face[k]), vertex(c) - vertex(face[k])));
  }
  return !attempt.fresh.empty() && worst_new >= std::min(kLeastQuality, worst_old) &&
         !folds(attempt);
}

// Whether neighbours come to lie nearly back to back that did not before: a flap of which no
// witness knows.
bool Collapser::folds(const Attempt& attempt) const {
  constexpr float kLeastCosine = -0.5f;
  for (const NewFace& f : attempt.fresh) {
    for (const NewFace& g : attempt.fresh) {
      if (f.c != g.b) continue;
      const float now = f.normal.dot(g.normal);
      if (now < kLeastCosine && now < f.normal_before.dot(g.normal_before)) return true;
    }
    for (const uint32_t g : around_.of(f.b)) {
      if (g == f.face || !has(mesh_.faces[g], f.c)) continue;
      const Vector3f n = area_vector(mesh_.faces[g]).cast<float>();
      const float now = f.normal.dot(n);
      if (now < kLeastCosine * n.norm() && now < f.normal_before.dot(n)) return true;
    }
  }
  return false;
}

// Every witness of the old star must be near a new face of its label, in place and colour.
bool Collapser::witnesses_allow(Attempt& attempt, const Vector3f& p) const {
  attempt.points.clear();
  attempt.heir_of_point.clear();
  const auto find = [&](uint32_t f) {
    const Provenance label = mesh_.provenance[f];
    const bool compare_colors = !mesh_.colors.empty() && label != Provenance::Inferred;
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) {
      const Vector3f x = original_.vertices[w] - p;
      const auto [nearest, foot] = heir_of(attempt.fresh, label, x);
      if (!(foot.squared_distance <= limits_.tolerance[w] * limits_.tolerance[w])) return false;
      if (compare_colors) {
        const NewFace& heir = attempt.fresh[nearest];
        const Vector3f color = heir.color + foot.v * heir.color_ab + foot.w * heir.color_ac;
        const float change = (color - original_.colors[w]).cwiseAbs().maxCoeff();
        if (!(change <= limits_.color)) return false;
      }
      attempt.points.push_back(w);
      attempt.heir_of_point.push_back(nearest);
    }
    return true;
  };
  return std::all_of(attempt.dying.begin(), attempt.dying.end(), find) &&
         std::all_of(attempt.moving.begin(), attempt.moving.end(), find);
}

// Gives the witnesses of faces that vanish to the nearest other one of their label; there must be
// one. Those of faces that move stay with them.
bool Collapser::hand_over_witnesses(Attempt& attempt) const {
  attempt.points.clear();
  attempt.heir_of_point.clear();
  const Vector3f p = (attempt.to.point + center_).cast<float>();
  for (const uint32_t f : attempt.dying) {
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) {
      const Heir heir = heir_of(attempt.fresh, mesh_.provenance[f], original_.vertices[w] - p);
      if (heir.face == kNone) return false;
      attempt.points.push_back(w);
      attempt.heir_of_point.push_back(heir.face);
    }
  }
  return true;
}

// Whether a point lies near the input around its nearest witness of the star.
bool Collapser::is_near_original(const Attempt& attempt, const Vector3f& x) const {
  uint32_t nearest = kNone;
  float least = std::numeric_limits<float>::infinity();
  for (const uint32_t w : attempt.points) {
    const float squared_distance = (original_.vertices[w] - x).squaredNorm();
    if (squared_distance >= least) continue;
    least = squared_distance;
    nearest = w;
  }
  if (nearest == kNone) return true;  // nothing is left to compare with
  constexpr float kBetween = 0.75f;   // a face may be farther off between what is looked at
  const float reach = kBetween * limits_.tolerance[nearest];
  if (least <= reach * reach) return true;
  for (const uint32_t f : original_around_.of(nearest)) {
    const Face& face = original_.faces[f];
    const Triangle triangle(
        original_.vertices[face[0]], original_.vertices[face[1]], original_.vertices[face[2]]);
    if (foot_on(triangle, x - original_.vertices[face[0]]).squared_distance <= reach * reach) {
      return true;
    }
  }
  return false;
}

// Witnesses keep the input near the new faces; this keeps the new faces near the input, between
// their corners, too.
bool Collapser::stays_near(const Attempt& attempt, const Vector3f& p) const {
  return std::all_of(attempt.fresh.begin(), attempt.fresh.end(), [&](const NewFace& f) {
    return is_near_original(attempt, p + (f.ab + f.ac) / 3) &&
           is_near_original(attempt, p + f.ab / 2);
  });
}

// A vertex between two has the smaller support and a sigma between theirs; at one of them, its own.
void Collapser::merge_knowledge(uint32_t u, uint32_t v, float t) {
  if (t <= 0) return;
  if (!mesh_.support.empty()) {
    const float least = std::min(mesh_.support[u], mesh_.support[v]);
    mesh_.support[u] = t >= 1 ? mesh_.support[v] : least;
  }
  if (mesh_.sigma.empty()) return;
  const float mixed = (1 - t) * mesh_.sigma[u] + t * mesh_.sigma[v];  // NaN where either is
  mesh_.sigma[u] = t >= 1 ? mesh_.sigma[v] : mixed;
}

void Collapser::apply(const Attempt& attempt) {
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  const Placement& to = attempt.to;
  mesh_.vertices[u] = (to.point + center_).cast<float>();
  if (!mesh_.colors.empty()) {
    mesh_.colors[u] = (1 - to.t) * mesh_.colors[u] + to.t * mesh_.colors[v];
  }
  merge_knowledge(u, v, to.t);
  if (kind_[v] == Kind::Border && kind_[u] == Kind::Border) {
    std::swap(next_on_border_[u], next_on_border_[v]);  // joins the two rings
  }
  quadric_[u] += quadric_[v];
  used_[u] = used_[v] = 1;
  stamp_[u] = stamp_[v] = batches_;
  for (const uint32_t f : attempt.dying) {
    for (const uint32_t w : mesh_.faces[f]) {
      changed_[w] = 1;
      stamp_[w] = batches_;
    }
    mesh_.faces[f].fill(kNone);
  }
  for (const uint32_t f : attempt.moving) {
    if (!may_move_anywhere_) witness_[f] = kNone;  // all of them are in attempt.points
    for (uint32_t& w : mesh_.faces[f]) {
      if (w == v) w = u;
      changed_[w] = 1;
      stamp_[w] = batches_;
    }
  }
  for (size_t i = 0; i < attempt.points.size(); ++i) {
    uint32_t& head = witness_[attempt.moving[attempt.heir_of_point[i]]];
    next_witness_[attempt.points[i]] = head;
    head = attempt.points[i];
  }
  remember(attempt);
}

}  // namespace cgs::edge_collapse
