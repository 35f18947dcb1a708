// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/input_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/error.h"
#include "libcgs/core/thinned.h"

namespace cgs {

namespace {

/// A place of the scene and which of the candidates see it, as positions among them.
struct Sight {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<size_t> seen_by;
};

// The first of each place: a tripod's photographs, or copies of one.
std::vector<int> in_different_places(const Scene& scene, const std::vector<int>& candidates) {
  const auto before = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::set<Eigen::Vector3d, decltype(before)> places(before);
  std::vector<int> out;
  for (const int view : candidates) {
    if (places.insert(scene.views[size_t(view)].camera.center()).second) out.push_back(view);
  }
  return out;
}

// Points that at least two candidates are known to see.
std::vector<Sight> known_sights(const Scene& scene, const std::vector<int>& candidates) {
  constexpr size_t kMost = 5000;
  constexpr size_t kNone = std::numeric_limits<size_t>::max();
  std::vector<size_t> place_of(scene.views.size(), kNone);
  for (size_t i = 0; i < candidates.size(); ++i) place_of[size_t(candidates[i])] = i;
  const auto is_candidate = [&](int view) { return place_of[size_t(view)] != kNone; };
  std::vector<const SparsePoint*> shared;
  for (const SparsePoint& point : scene.points) {
    if (std::count_if(point.views.begin(), point.views.end(), is_candidate) >= 2) {
      shared.push_back(&point);
    }
  }
  std::vector<Sight> out;
  for (const SparsePoint* const point : thinned(shared, kMost)) {
    Sight& sight = out.emplace_back();
    sight.position = point->position;
    for (const int view : point->views) {
      if (is_candidate(view)) sight.seen_by.push_back(place_of[size_t(view)]);
    }
    std::sort(sight.seen_by.begin(), sight.seen_by.end());
  }
  return out;
}

// Places all over each picture, as far as what the cameras look at, and who has them in the
// picture, from the same side: what hides them is not known, but surface that looks at one camera
// is the rear for another that looks from far aside.
std::vector<Sight> guessed_sights(const Scene& scene, const std::vector<int>& candidates) {
  constexpr int kGrid = 4;  // places per side of a picture
  constexpr size_t kMostPoints = 20000;
  constexpr double kSameSide = 60 * std::numbers::pi / 180;
  Scene all;
  all.folder = scene.folder;
  all.views = scene.views;
  all.points = thinned(scene.points, kMostPoints);
  all.input = candidates;
  const std::vector<Eigen::Vector3d> subject = subject_points(all);  // camera, subject, camera, …
  std::vector<Sight> out;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const Camera& camera = scene.views[static_cast<size_t>(candidates[i])].camera;
    const double depth = (subject[2 * i + 1] - subject[2 * i]).norm();
    for (int k = 0; k < kGrid * kGrid; ++k) {
      const double u = (k % kGrid + 0.5) / kGrid * camera.width;
      const double v = (k / kGrid + 0.5) / kGrid * camera.height;
      Sight sight{camera.unproject(u, v, depth), {}};
      for (size_t j = 0; j < candidates.size(); ++j) {
        const Camera& other = scene.views[static_cast<size_t>(candidates[j])].camera;
        const double aside = i == j ? 0
                                    : angle_between(camera.center() - sight.position,
                                                    other.center() - sight.position);
        if (aside <= kSameSide && other.sees(other.project(sight.position))) {
          sight.seen_by.push_back(j);
        }
      }
      out.push_back(std::move(sight));
    }
  }
  return out;
}

/// What pairs of candidates tell of each place.
class Worth {
 public:
  Worth(const Scene& scene, const std::vector<int>& candidates, const std::vector<Sight>& sights)
      : sights_(sights) {
    for (const int i : candidates) {
      centers_.push_back(scene.views[static_cast<size_t>(i)].camera.center());
    }
  }

  double of_pair(const Sight& sight, size_t a, size_t b) const {
    const Eigen::Vector3d to_a = centers_[a] - sight.position;
    const Eigen::Vector3d to_b = centers_[b] - sight.position;
    return worth_of_angle(angle_between(to_a, to_b));
  }

  /// Two candidates, and what they add to what is told; equal if no two add anything.
  struct Pair {
    size_t a = 0, b = 0;
    double gain = 0;
  };
  // \param told  of each place so far
  Pair best_pair(const std::vector<double>& told) const {
    const auto n = static_cast<Eigen::Index>(centers_.size());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
    for (size_t i = 0; i < sights_.size(); ++i) {
      const Sight& sight = sights_[i];
      for (size_t k = 0; k < sight.seen_by.size(); ++k) {
        for (size_t l = k + 1; l < sight.seen_by.size(); ++l) {
          const size_t a = sight.seen_by[k];
          const size_t b = sight.seen_by[l];
          const double gain = of_pair(sight, a, b) - told[i];
          if (gain > 0) sum(Eigen::Index(a), Eigen::Index(b)) += gain;  // NaN is not
        }
      }
    }
    Eigen::Index a = 0;
    Eigen::Index b = 0;
    const double most = sum.maxCoeff(&a, &b);
    return most > 0 ? Pair{size_t(a), size_t(b), most} : Pair{};
  }

  // What is known of a place from some views, and one more.
  double with(const Sight& sight, const std::vector<size_t>& chosen, size_t more) const {
    const auto sees = [&](size_t view) {
      return std::binary_search(sight.seen_by.begin(), sight.seen_by.end(), view);
    };
    double best = 0;
    if (!sees(more)) return best;
    for (const size_t view : chosen) {
      if (sees(view)) best = std::max(best, of_pair(sight, view, more));
    }
    return best;
  }

  // Adds the view that adds the most to what the chosen ones tell, or, where none adds anything to
  // speak of, two of another side that tell something together.
  // \param most  to add
  // \return false if nothing does
  bool add_best(size_t most, std::vector<size_t>& chosen, std::vector<double>& told) const {
    constexpr double kLeast = 0.01;
    const double least = kLeast * std::accumulate(told.begin(), told.end(), 0.0);
    double gained = 0;
    size_t best = 0;
    for (size_t view = 0; view < centers_.size(); ++view) {
      if (std::find(chosen.begin(), chosen.end(), view) != chosen.end()) continue;
      double gain = 0;
      for (size_t i = 0; i < sights_.size(); ++i) {
        gain += std::max(0.0, with(sights_[i], chosen, view) - told[i]);
      }
      if (gain > gained) std::tie(gained, best) = std::pair(gain, view);
    }
    if (gained > least) {
      add(best, chosen, told);
      return true;
    }
    const Pair pair = most >= 2 ? best_pair(told) : Pair{};
    if (!(pair.gain > 2 * least)) return false;
    for (const size_t view : {pair.a, pair.b}) {
      const bool is_new = std::find(chosen.begin(), chosen.end(), view) == chosen.end();
      if (is_new) add(view, chosen, told);
    }
    return true;
  }

  void add(size_t view, std::vector<size_t>& chosen, std::vector<double>& told) const {
    for (size_t i = 0; i < sights_.size(); ++i) {
      told[i] = std::max(told[i], with(sights_[i], chosen, view));
    }
    chosen.push_back(view);
  }

 private:
  const std::vector<Sight>& sights_;
  std::vector<Eigen::Vector3d> centers_;
};

}  // namespace

double worth_of_angle(double radians) {
  constexpr double kBest = 10;  // [degrees]
  constexpr double kNarrower = 4;
  constexpr double kWider = 12;
  const auto bell = [](double off, double sigma) {
    return std::exp(-off * off / (2 * sigma * sigma));
  };
  const double off = radians * 180 / std::numbers::pi - kBest;
  if (off >= 0) return bell(off, kWider);
  const double at_none = bell(kBest, kNarrower);  // views from one place tell nothing
  return std::max(0.0, (bell(off, kNarrower) - at_none) / (1 - at_none));
}

std::vector<int> choose_input_views(const Scene& scene,
                                    const std::vector<int>& candidates,
                                    size_t count) {
  require(candidates.size() >= 2, "views to choose among", candidates.size());
  require(count >= 2, "views to choose", count);
  constexpr size_t kMostCandidates = 100;
  const std::vector<int> some = thinned(in_different_places(scene, candidates), kMostCandidates);
  if (some.size() < 2) return {};
  std::vector<Sight> sights = known_sights(scene, some);
  constexpr size_t kEnough = 50;
  if (sights.size() < kEnough) sights = guessed_sights(scene, some);

  const Worth worth(scene, some, sights);
  std::vector<double> told(sights.size(), 0.0);
  const Worth::Pair first = worth.best_pair(told);
  if (first.a == first.b) return {};
  std::vector<size_t> chosen;
  worth.add(first.a, chosen, told);
  worth.add(first.b, chosen, told);
  while (chosen.size() < count && worth.add_best(count - chosen.size(), chosen, told)) {
  }
  std::vector<int> out;
  for (const size_t i : chosen) out.push_back(some[i]);
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace cgs
