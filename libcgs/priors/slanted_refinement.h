// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/priors/sweep_geometry.h"

namespace cgs {

/// The surface at a pixel as a plane of the scene: t changes by slope per pixel [planes].
struct SlantedPlane {
  float t = 0;
  float slope_x = 0;
  float slope_y = 0;

  float at(int dx, int dy) const {
    return t + slope_x * static_cast<float>(dx) + slope_y * static_cast<float>(dy);
  }
};

/// What refinement found at a pixel.
struct RefinedPixel {
  SlantedPlane plane;
  float score = 0;  ///< Normalised correlation with the better half of the sources, in [-1, 1].
  float sigma = 0;  ///< Standard deviation of the match from image noise and texture [pixels, in
                    ///< the source that sees it move most]; > 0.
};

/// Continuous local refinement of a sweep.
///
/// Per pixel a plane (t, slope) that makes the window around it correlate with the sources, with
/// bilateral weights so that the window follows the surface of its pixel. Hypotheses come from the
/// neighbours (PatchMatch; Bleyer et al. 2011) and from Gauss-Newton steps on the correlation; a
/// truncated difference to the neighbours' planes decides where there is no texture.
/// Pixels are visited as on a chessboard, so the result does not depend on the number of threads.
class SlantedRefinement {
 public:
  SlantedRefinement(const std::vector<SweepImage>& images,
                    const SweepGeometry& geometry,
                    const Raster<float>& start);
  /// With planes to begin with; t NaN = none, and begins at the farthest.
  SlantedRefinement(const std::vector<SweepImage>& images,
                    const SweepGeometry& geometry,
                    Raster<SlantedPlane> start);

  /// Planes may be steep where they are about level: what is steep otherwise must correlate better.
  /// \param drop  of level_drop()
  void expect_level(const Eigen::RowVector3d& drop) { drop_ = drop; }

  /// One round over all pixels. `extra` (may be empty) holds one more hypothesis per pixel, from
  /// other views; t NaN = none.
  void round(const Raster<SlantedPlane>& extra, const Progress& progress = {});

  /// Tells of every pixel, NaN t at invalid ones.
  /// \param out  empty, or as an earlier call left it: pixels whose plane is still the same are kept
  void take_result(Raster<RefinedPixel>& out, const Progress& progress = {}) const;

 private:
  struct Window;
  struct Normal;
  Window window(int x, int y) const;
  float correlation(const Window& window, size_t source, const SlantedPlane& plane) const;
  void score(const Window& window, const SlantedPlane& plane, std::span<float> scores) const;
  float prior_cost(const Window& window, const SlantedPlane& plane) const;
  float steepness(const Window& window, const SlantedPlane& plane) const;
  bool normal_equations(const Window& w, size_t source, const SlantedPlane& p, Normal& total) const;
  Normal normal_equations(const Window& window,
                          const SlantedPlane& plane,
                          std::span<const float> scores) const;
  void visit(int x, int y, const Raster<SlantedPlane>& extra);
  bool is_settled(int x, int y, const Raster<SlantedPlane>& extra) const;

  const std::vector<SweepImage>& images_;
  const SweepGeometry& geometry_;
  const SweepImage& reference_;
  Raster<SlantedPlane> planes_;
  Eigen::RowVector3d drop_ = Eigen::RowVector3d::Zero();
  // A visit that finds all that it looks at as the last one did would end as that did. In halves of
  // rounds from 1 on: when a pixel was visited last, and when its plane was last changed.
  Raster<uint16_t> visited_, moved_;
  Raster<SlantedPlane> extra_before_;
  uint16_t time_ = 0;
};

}  // namespace cgs
