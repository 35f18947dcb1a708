// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/core/triangle_mesh.h"
#include "meshing/face_views.h"

namespace cgs {

/// Factors on linear light that make photographs agree where they show the same surface.
struct ExposureGains {
  std::vector<Eigen::Vector3f> gain;  ///< Per view, one factor per channel.
  std::vector<size_t> samples;        ///< Per view, surface points it shares with another view.
};

/// Estimates the gains from faces that several views show: for each pair of views the median of
/// the log ratio of their colours, then least squares over the pairs, weighted by their samples.
/// The product of the gains is 1 in every connected group of views; one that shares nothing with
/// another keeps 1. Clipped and nearly black colours take no part.
/// \pre the images of the views are loaded
ExposureGains exposure_gains(const TriangleMesh& mesh,
                             const FaceScores& scores,
                             const std::vector<View>& views);

/// Multiplies the linear light of an sRGB-coded picture; a factor of exactly 1 changes no bit.
/// Values beyond 1 stay so; writers clip them.
void apply_gain(ColorImage& image, const Eigen::Vector3f& gain);

}  // namespace cgs
