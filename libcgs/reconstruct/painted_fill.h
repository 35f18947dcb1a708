// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"
#include "libcgs/reconstruct/model.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// A picture of a model in whose holes something was painted.
struct PaintedView {
  Camera camera;       ///< [internal units]
  ColorImage picture;  ///< Of the size of the camera.
  SyntheticSource source;
  MaskMap left_open;  ///< 1 = a hole that was not painted; empty = none.
};

/// A view that is to be painted.
struct ViewToPaint {
  const Camera& camera;
  const std::vector<SupportView>& inputs;  ///< Of the model.
  const RenderBuffers& shown;  ///< The model as seen from there, with what was painted before.
  const MaskMap& open;         ///< 1 = a hole to be painted.
  const DepthMap& hidden;      ///< Where what is painted will lie; NaN = nowhere.
};

/// Paints the view at a position in the list of cameras. The camera of what it returns is not
/// looked at.
using HolePainter = std::function<PaintedView(size_t, const ViewToPaint&)>;

/// What became of the holes of a painted view [pixels].
struct ViewFill {
  size_t holes = 0;          ///< All of them.
  size_t filled_before = 0;  ///< Shown by what an earlier view painted: the first wins.
  size_t left_open = 0;      ///< Not painted.
  size_t lifted = 0;         ///< Became a Gaussian.
  size_t moved_back = 0;     ///< Of these, so that it stands in no input view's way.
  size_t unplaced = 0;       ///< Stay open: nowhere on their ray are they hidden from all inputs.
  size_t shone_through = 0;  ///< Stay open: input views would have shown what was painted.
};

struct PaintedFill {
  Gaussians gaussians;  ///< Tagged synthetic, labelled inferred; as views, row-major.
  std::vector<ViewFill> views;
};

/// Share of the holes of its views, by pixels, that stay open: not painted, or not lifted.
double open_share(const PaintedFill& fill);

/// Makes a Gaussian of every painted pixel in a hole.
///
/// Its depth is hidden_depth(): the far side of the hole goes on. Where an input view sees through
/// there, it is moved back along its ray to right behind what that view sees, so that nothing made
/// up ever stands before what a photograph shows. What an input view would show all the same,
/// through Gaussians that are not quite opaque (over a sixteenth of a pixel, or at all in its own
/// holes), is left out.
///
/// Colours go over into those of the far side at the seam, by an offset that fades out over
/// a 64th of the picture's width; within, they are as painted. Views are taken in their order: a
/// hole that shows what an earlier one painted is not painted again.
///
/// Gaussians are discs of half a pixel along the surface, of opacity 0.98 and degree 0. Same bits
/// for any number of threads.
/// \throws InvalidInput if the model has no input views, a picture is not of the size of its
///         camera, or there are more than 255
/// Source: seams: Pérez et al. 2003, "Poisson Image Editing", with an offset that fades out.
PaintedFill lift_painted(const Model& model,
                         const std::vector<PaintedView>& views,
                         const Progress& progress = {});

/// The same of views that are painted one after the other, each by one who sees what was painted
/// in those before.
PaintedFill lift_painted(const Model& model,
                         const std::vector<Camera>& cameras,
                         const HolePainter& paint,
                         const Progress& progress = {});

}  // namespace cgs
