// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/priors/sweep_geometry.h"

namespace cgs {

/// A cost per pixel and plane; the planes of a pixel lie together.
struct CostVolume {
  int width = 0;
  int height = 0;
  int planes = 0;
  std::vector<uint8_t> cost;  ///< [0, kLargestCost]

  const uint8_t* at(int x, int y) const {
    return &cost[(static_cast<size_t>(y) * width + static_cast<size_t>(x)) * planes];
  }
};
inline constexpr int kLargestCost = 120;

/// One cost from those of several sources: the better half counts fully and the rest little, so
/// that a surface hidden from half of the sources is still found.
/// \tparam Cost  a float, or several of them in lanes
/// \pre `sorted` is ascending and not empty. Inline: called per pixel and plane.
template <typename Cost>
Cost combined_cost(std::span<const Cost> sorted) {
  constexpr float kSecondWeight = 0.15f;  // of the worse half of the sources
  const size_t full = (sorted.size() + 1) / 2;
  Cost sum{};
  float weight = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    const float w = i < full ? 1.0f : kSecondWeight;
    sum += w * sorted[i];
    weight += w;
  }
  return sum / weight;
}

/// Planes of the scene to compare the views on: plane k is t(u, v) = (base + k step) (u, v, 1).
struct PlaneFamily {
  Eigen::RowVector3d base = Eigen::RowVector3d::Zero();
  Eigen::RowVector3d step = Eigen::RowVector3d::UnitZ();
  int count = 0;

  Eigen::RowVector3d plane(double k) const { return base + k * step; }
};

/// Dissimilarity of a reference view and its sources, warped over every plane of a family. What
/// lies nearer than the nearest plane of the geometry, or behind the farthest, counts as unseen.
///
/// Per source a census transform (7 x 7, robust to lighting, outliers and foreground fattening;
/// Zabih and Woodfill 1994), to which, where the reference varies by 0.1 to 3 of 255 levels,
/// only what is more than 1.75 levels brighter is brighter, plus normalised cross-correlation
/// (5 x 5, sharper where there is texture). Sources that see a pixel are combined so that one of
/// them may be occluded.
CostVolume matching_cost(const std::vector<SweepImage>& images,
                         const SweepGeometry& geometry,
                         const PlaneFamily& family,
                         const Progress& progress = {});

/// The same on the planes of the geometry, which are square to the view.
CostVolume matching_cost(const std::vector<SweepImage>& images,
                         const SweepGeometry& geometry,
                         const Progress& progress = {});

}  // namespace cgs
