// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/changes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

namespace {

constexpr double kSigmas = 1.96;  // in a level of detection

// Of a normal distribution, half lies within 0.6745 sigma.
double noise_of(const std::vector<M3c2Place>& places) {
  std::vector<double> ratios;
  for (const M3c2Place& place : places) {
    if (std::isfinite(place.distance) && place.detection > 0) {
      ratios.push_back(std::abs(place.distance) * kSigmas / place.detection);
    }
  }
  if (ratios.empty()) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  constexpr double kOfMedian = 1 / 0.6745;
  return std::max(1.0, *middle * kOfMedian);
}

// Faces whose corners all stand out, and what they add to their patch.
class Patches {
 public:
  Patches(const MeasurableMesh& surface, const MeasurableMesh& other, const Changes& changes)
      : surface_(surface),
        other_(other),
        places_(changes.found.places),
        noise_(changes.noise),
        joined_(surface.points.size()),
        levels_(surface.points.size()) {
    tbb::parallel_for(size_t{0}, levels_.size(), [&](size_t v) {
      levels_[v] = levels_of(static_cast<uint32_t>(v));
    });
    for (size_t f = 0; f < surface.mesh.faces.size(); ++f) {
      const auto& face = surface.mesh.faces[f];
      if (!std::all_of(face.begin(), face.end(), [&](uint32_t v) { return levels_[v] > 1; })) {
        continue;
      }
      faces_.push_back(f);
      joined_.join(face[0], face[1]);
      joined_.join(face[1], face[2]);
    }
  }

  // Into `out`: the patches that are large and sure enough.
  void collect(double least_area, Changes& out) {
    constexpr double kSure = 2;  // levels
    std::map<uint32_t, Sum> sums;
    for (const size_t f : faces_) add(f, sums[joined_.root(surface_.mesh.faces[f][0])]);
    std::vector<std::pair<uint32_t, ChangePatch>> kept;
    for (const auto& [root, sum] : sums) {
      if (sum.patch.area >= least_area && sum.most_levels >= kSure) {
        kept.emplace_back(root, finished(sum));
      }
    }
    std::stable_sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) {
      return a.second.area > b.second.area;
    });
    std::map<uint32_t, int> number_of;
    for (const auto& [root, patch] : kept) {
      number_of[root] = static_cast<int>(out.patches.size());
      out.patches.push_back(patch);
    }
    out.patch_of_face.assign(surface_.mesh.faces.size(), -1);
    for (const size_t f : faces_) {
      const auto number = number_of.find(joined_.root(surface_.mesh.faces[f][0]));
      if (number != number_of.end()) out.patch_of_face[f] = number->second;
    }
  }

 private:
  struct Sum {
    ChangePatch patch;  // weighted by area
    double volume = 0;
    double distance = 0;
    double most_levels = 0;
  };

  // How many widened levels of detection a vertex stands out by; 0 where that cannot be told. A
  // thin thing in front of it, of the other date, is in the cylinder, too: the nearest surface is
  // then nearer.
  double levels_of(uint32_t vertex) const {
    const M3c2Place& place = places_[vertex];
    if (place.change != Change::Farther || !(place.detection > 0)) return 0;
    const Eigen::Vector3d& point = surface_.points[vertex];
    const double nearest = (point - other_.nearest(point).position).norm();
    return std::min(place.distance, nearest) / (noise_ * place.detection);
  }

  void add(size_t f, Sum& sum) const {
    const auto& face = surface_.mesh.faces[f];
    const Eigen::Vector3d& a = surface_.points[face[0]];
    const Eigen::Vector3d& b = surface_.points[face[1]];
    const Eigen::Vector3d& c = surface_.points[face[2]];
    const Eigen::Vector3d across = 0.5 * (b - a).cross(c - a);  // as long as the area
    const double area = across.norm();
    const Eigen::Vector3d middle = (a + b + c) / 3;
    double distance = 0;
    double sigma = 0;
    for (const uint32_t v : face) {
      distance += places_[v].distance / 3;
      sigma += noise_ * places_[v].detection / kSigmas / 3;
      sum.most_levels = std::max(sum.most_levels, levels_[v]);
    }
    sum.patch.area += area;
    sum.patch.center += area * middle;
    sum.distance += area * distance;
    // A prism from the nearest place of the other surface: also right where the face is slanted.
    sum.volume += (middle - other_.nearest(middle).position).dot(across);
    sum.patch.volume_sigma += area * sigma;
  }

  static ChangePatch finished(const Sum& sum) {
    ChangePatch out = sum.patch;
    out.center /= out.area;
    out.distance = sum.distance / out.area;
    if (out.distance <= std::sqrt(out.area)) {
      out.volume = sum.volume;
    } else {
      out.volume_sigma = 0;
    }
    return out;
  }

  const MeasurableMesh& surface_;
  NearestSurface other_;
  const std::vector<M3c2Place>& places_;
  double noise_;
  DisjointSets joined_;
  std::vector<double> levels_;  // of the vertices
  std::vector<size_t> faces_;
};

}  // namespace

ChangeTotal total_of(const std::vector<ChangePatch>& patches) {
  ChangeTotal out;
  for (const ChangePatch& patch : patches) {
    out.area += patch.area;
    out.volume += patch.volume.value_or(0);
    out.volume_sigma = std::hypot(out.volume_sigma, patch.volume_sigma);
    if (!patch.volume) ++out.without_volume;
  }
  return out;
}

Changes standing_out(const MeasurableMesh& surface,
                     const MeasurableMesh& other,
                     const M3c2Request& request) {
  constexpr double kLeastCylinders = 3;
  Changes out;
  out.found = compare_m3c2(request, surface, other);
  const std::vector<M3c2Place>& places = out.found.places;
  out.noise = noise_of(places);
  const auto comparable = std::count_if(places.begin(), places.end(), [](const M3c2Place& place) {
    return place.change != Change::Unknown;
  });
  out.comparable = double(comparable) / double(std::max<size_t>(1, places.size()));
  const double radius = 0.5 * out.found.options.cylinder;
  Patches(surface, other, out).collect(kLeastCylinders * std::numbers::pi * radius * radius, out);
  return out;
}

}  // namespace cgs
