// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>

#include "meshing/edit/collapser.h"

namespace cgs::edge_collapse {

void Collapser::remember(const Attempt& attempt) {
  const Vector3d& p = attempt.to.point;
  history_.collapses.push_back(
      {attempt.v, attempt.u, {p.x(), p.y(), p.z()}, attempt.to.t, history_.heirs.size()});
  if (attempt.moving.size() > std::numeric_limits<uint8_t>::max()) return;
  for (const uint32_t heir : attempt.heir_of_point) {
    history_.heirs.push_back(static_cast<uint8_t>(heir));
  }
}

// Repeats what an earlier run did as far as nothing that it looked at has changed, and judges the
// rest of its collapses anew, in their order. Afterwards only edges near a difference are left to
// try: elsewhere all others were refused then, and are again.
void Collapser::repeat(const CollapseHistory& before) {
  const size_t n = mesh_.vertices.size();
  differs_.assign(n, 0);
  is_tighter_.resize(n);
  for (size_t v = 0; v < n; ++v) is_tighter_[v] = limits_.tolerance[v] < before.tolerance[v];
  Attempt attempt;
  size_t left = mesh_.faces.size();
  size_t index = 0;
  for (const size_t end : before.passes) {
    used_.assign(n, 0);
    for (; index < end && left > limits_.target_faces; ++index) {
      repeat_one(before, index, attempt);
      if (attempt.outcome == Attempt::Outcome::Allowed) left -= attempt.dying.size();
    }
    end_pass();
  }
  const bool all_were_tried = limits_.target_faces == 0;
  constexpr uint8_t kAllSides = 7;
  refused_.assign(mesh_.faces.size(), all_were_tried ? kAllSides : 0);
  changed_.assign(n, 0);
  for (const Face& face : mesh_.faces) {
    if (std::none_of(face.begin(), face.end(), [&](uint32_t v) { return differs_[v] != 0; })) {
      continue;
    }
    for (const uint32_t v : face) changed_[v] = 1;
  }
}

void Collapser::repeat_one(const CollapseHistory& before, size_t index, Attempt& attempt) {
  const CollapseHistory::Collapse& then = before.collapses[index];
  const bool is_last = index + 1 == before.collapses.size();
  const auto first = before.heirs.begin() + static_cast<ptrdiff_t>(then.first_heir);
  const auto last = is_last ? before.heirs.end()
                            : before.heirs.begin() +
                                  static_cast<ptrdiff_t>(before.collapses[index + 1].first_heir);
  attempt.u = then.into;
  attempt.v = then.from;
  const Vector3d point(then.point[0], then.point[1], then.point[2]);
  gather_star(attempt);
  const bool is_known = gather_witnesses(attempt) && is_as_before(attempt) &&
                        attempt.points.size() == static_cast<size_t>(last - first);
  attempt.outcome = Attempt::Outcome::Allowed;
  if (is_known) {
    attempt.to = {point, 0, then.t};
    attempt.heir_of_point.assign(first, last);
    apply(attempt);
    return;
  }
  const auto [u, v] = std::pair(attempt.u, attempt.v);
  const bool may = !attempt.dying.empty() && may_collapse(u, v);
  attempt.outcome = may ? outcome_of(attempt) : Attempt::Outcome::Refused;
  if (attempt.outcome != Attempt::Outcome::Allowed) {
    differs_[u] = differs_[v] = 1;
    return;
  }
  if (differs_[v] != 0 || attempt.to.point != point || attempt.to.t != then.t) differs_[u] = 1;
  apply(attempt);
  if (std::equal(attempt.heir_of_point.begin(), attempt.heir_of_point.end(), first, last)) return;
  differs_[u] = 1;
  for (const uint32_t f : attempt.moving) {
    for (const uint32_t w : mesh_.faces[f]) differs_[w] = 1;
  }
}

// The witnesses of the star that change hands, in the order in which they are judged. False where
// one is tighter than it was.
bool Collapser::gather_witnesses(Attempt& attempt) const {
  attempt.points.clear();
  bool is_same = true;
  const auto gather = [&](uint32_t f) {
    for (uint32_t w = witness_[f]; w != kNone; w = next_witness_[w]) {
      attempt.points.push_back(w);
      is_same = is_same && is_tighter_[w] == 0;
    }
  };
  std::for_each(attempt.dying.begin(), attempt.dying.end(), gather);
  if (may_move_anywhere_) return is_same;
  std::for_each(attempt.moving.begin(), attempt.moving.end(), gather);
  return is_same;
}

// Whether the star is what it was, and no vertex on its border is tighter.
bool Collapser::is_as_before(const Attempt& attempt) const {
  if (attempt.dying.empty()) return false;
  const auto differs = [&](uint32_t f) {
    const Face& face = mesh_.faces[f];
    return std::any_of(face.begin(), face.end(), [&](uint32_t w) { return differs_[w] != 0; });
  };
  if (std::any_of(attempt.dying.begin(), attempt.dying.end(), differs) ||
      std::any_of(attempt.moving.begin(), attempt.moving.end(), differs)) {
    return false;
  }
  for (const uint32_t of : {attempt.u, attempt.v}) {
    uint32_t w = of;
    do {
      if (is_tighter_[w] != 0) return false;
      w = next_on_border_[w];
    } while (w != of);
  }
  return true;
}

}  // namespace cgs::edge_collapse
