// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "libcgs/core/scene.h"

namespace cgs {

/// Factors on linear light that make photographs agree where they show the same surface.
struct ExposureGains {
  std::vector<Eigen::Vector3f> gain;  ///< Per view, one factor per channel.
  std::vector<size_t> samples;        ///< Per view, surface points it shares with another view.
  std::vector<size_t> group;          ///< Per view, the first of those that it is compared with.

  /// How far two views of a group lie apart in a channel at most: 0.25 = one is brighter by a
  /// quarter.
  float difference() const;
};

/// Whether an sRGB-coded colour is neither clipped nor nearly black, so that it tells how much
/// light there was.
bool tells_exposure(const Eigen::Vector3f& color);

/// Points of the surface that views `a` and `b` both show, in the frame of their cameras. Any
/// number of threads may ask at once.
using SharedSurface = std::function<std::vector<Eigen::Vector3d>(size_t a, size_t b)>;

/// Estimates the gains of views from what several of them show: for each of some pairs the median
/// of the log ratio of their colours, then least squares over the pairs, weighted by their samples.
/// The product of the gains is 1 in every connected group of views; one that shares nothing with
/// another keeps 1. Clipped and nearly black colours take no part.
/// \param compared  pairs of indices into views, the smaller first
/// \throws InvalidInput if the image of a view is not loaded
ExposureGains exposure_gains(std::span<const View* const> views,
                             const std::vector<std::pair<size_t, size_t>>& compared,
                             const SharedSurface& shared);

/// Factors on the linear light of a picture that make it agree with another one of the same pixels:
/// per channel the median ratio of those that `use` marks with 1. Clipped and nearly black ones
/// take no part; all factors are 1 where fewer than 100 are left.
Eigen::Vector3f matching_gain(const ColorImage& picture,
                              const ColorImage& wanted,
                              const MaskMap& use);

/// Applies its response to the photograph of a view, and multiplies it by its exposure. What that
/// makes brighter than white is white: no picture of the surface could show more.
void apply_exposure(View& view);

/// Multiplies the linear light of an sRGB-coded picture; a factor of exactly 1 changes no bit.
/// Values beyond 1 stay so; writers clip them.
void apply_gain(ColorImage& image, const Eigen::Vector3f& gain);

}  // namespace cgs
