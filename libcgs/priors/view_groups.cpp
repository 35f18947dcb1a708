// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/view_groups.h"

#include <algorithm>
#include <map>

#include <Eigen/Eigenvalues>

#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

using Places = Eigen::Matrix<double, 6, Eigen::Dynamic>;  // of cameras and of what they look at

Places places_of_input(const Scene& scene) {
  const std::vector<Eigen::Vector3d> points = subject_points(scene);  // two of each view
  Places out(6, static_cast<Eigen::Index>(scene.input.size()));
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    const auto at = static_cast<size_t>(2 * k);
    out.col(k) << points[at], points[at + 1];
  }
  return out;
}

Eigen::Matrix<double, 6, 1> longest_axis(const Places& places, const std::vector<int>& members) {
  const Places own = places(Eigen::all, members);
  const Places centred = own.colwise() - own.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(centred *
                                                                         centred.transpose());
  return eigen.eigenvectors().col(5);
}

// Halves of equal size, however the views are spread: groups then cost alike.
void bisect(const Places& places,
            std::vector<int> members,
            size_t most,
            std::vector<std::vector<int>>& out) {
  if (members.size() <= most) {
    std::sort(members.begin(), members.end());
    out.push_back(std::move(members));
    return;
  }
  const Eigen::Matrix<double, 6, 1> axis = longest_axis(places, members);
  std::stable_sort(members.begin(), members.end(), [&](int a, int b) {
    return axis.dot(places.col(a)) < axis.dot(places.col(b));
  });
  const auto middle = members.begin() + static_cast<std::ptrdiff_t>(members.size() / 2);
  bisect(places, {members.begin(), middle}, most, out);
  bisect(places, {middle, members.end()}, most, out);
}

// Views of others, those first that are compared with the most own ones.
std::vector<int> company_of(const Scene& scene, const std::vector<int>& own) {
  std::map<int, int> votes;
  for (const int k : own) {
    for (const size_t other : neighbours(scene, static_cast<size_t>(k), kMostCompared)) {
      const auto j = static_cast<int>(other);
      if (!std::binary_search(own.begin(), own.end(), j)) ++votes[j];
    }
  }
  std::vector<std::pair<int, int>> ranked;
  for (const auto& [view, count] : votes) ranked.emplace_back(-count, view);
  std::sort(ranked.begin(), ranked.end());
  std::vector<int> out;
  for (const auto& [count, view] : ranked) out.push_back(view);
  return out;
}

}  // namespace

std::vector<ViewGroup> group_views(const Scene& scene, size_t size) {
  require(size >= 3, "the size of groups must be 3 or more", size);
  const size_t most = scene.input.size() <= size ? size : std::max(size_t{2}, size * 3 / 4);
  std::vector<int> all(scene.input.size());
  for (size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
  std::vector<std::vector<int>> parts;
  bisect(places_of_input(scene), all, most, parts);
  std::vector<ViewGroup> out;
  for (const std::vector<int>& own : parts) {
    ViewGroup& group = out.emplace_back();
    for (const int k : own) group.own.push_back(scene.input[static_cast<size_t>(k)]);
    group.all = group.own;
    for (const int k : company_of(scene, own)) {
      if (group.all.size() == size) break;
      group.all.push_back(scene.input[static_cast<size_t>(k)]);
    }
    std::sort(group.own.begin(), group.own.end());
    std::sort(group.all.begin(), group.all.end());
  }
  return out;
}

}  // namespace cgs
