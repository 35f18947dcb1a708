// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "libcgs/core/camera.h"
#include "libcgs/core/depth_evidence.h"
#include "libcgs/render/render_buffers.h"
#include "libcgs/render/seen_surface.h"

namespace cgs {

/// Views that can support a pixel, at most: their number is kept in a byte.
inline constexpr size_t kMostInputs = 255;

/// An input view as a witness: what it saw, how far away, how sure.
struct SupportView {
  Camera camera;
  DepthMap depth;  ///< Of the size of the camera [internal units]; NaN = saw nothing here.
  DepthMap sigma;  ///< Standard deviation of depth [internal units]; NaN, or empty, = no statement.
  EvidenceMap evidence;  ///< What vouches for the depth.
  SurfaceLinks links;    ///< As link_pixels() fills it; empty = found anew for each rendered view.
};

/// When an input view counts as having seen a rendered pixel.
struct SupportOptions {
  float min_alpha = 0.5f;            ///< Pixels less opaque than this show no surface; in (0, 1].
  float sigma_factor = 3;            ///< Measured depths agree within this many sigmas; >= 0.
  float relative_tolerance = 0.01f;  ///< They always agree within this part of the depth; > 0.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Finds out which pixels of a view lie on one surface, once for all rendered views. Depth that is
/// uncertain by more than relative_tolerance is not taken to be torn by its own noise.
/// \param options  those that annotate_support() will get
void link_pixels(SupportView& view, const SupportOptions& options = {});

/// Fills support and hole of a rendered view.
///
/// The surface of a pixel is its median depth (its mean depth where that is unknown). An input view
/// supports the pixel if the surface that the view saw (seen_surface()) lands on the centre of that
/// very pixel, nearest first, at the same depth: within max(relative_tolerance * depth,
/// sigma_factor * sigma), plus what a slanted surface changes over 1.5 pixels of the view. Of depth
/// that was filled in, this is at most 25 * relative_tolerance * depth: its sigma says that it may
/// be anywhere, not that anything drawn is right. What is drawn nearer than half of the backdrop is
/// no sky. What the view hides or never had in its picture lands nowhere.
///
/// Blended Gaussians have soft rims, so that a pixel beside a silhouette may show what is not quite
/// there. Where no view agrees at the very pixel but one does within three pixels, the pixel is
/// therefore judged by the best of the depths drawn within three pixels. In pictures that show more
/// than the views do, by the focal lengths, these are pixels of the view that shows the most.
///
/// Views of which the depth is Measured count one each, those of which it is Adjoining one
/// together. A pixel that views show with no more than an estimate, or as sky, has support 0 and is
/// no hole; every other pixel without support is one. `hole` says which.
///
/// \param buffers  as rasterize() gives them for `camera`
/// \param views    the input views only: a virtual camera is no witness
/// \throws InvalidInput if sizes disagree, an option is out of range or there are more than 255
///         views.
void annotate_support(RenderBuffers& buffers,
                      const Camera& camera,
                      std::span<const SupportView> views,
                      const SupportOptions& options = {});

}  // namespace cgs
