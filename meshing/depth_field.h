// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "meshing/tsdf.h"

namespace cgs {

/// What a depth map says about a box or a point of space.
enum class Sight : uint8_t {
  Nothing,  ///< Outside the frustum, or no depth there.
  Free,     ///< In front of the surface.
  Band,     ///< Near the surface.
  Hidden,   ///< Behind the surface.
  Mixed,    ///< Boxes only: has to be looked at voxel by voxel.
};

/// A depth map seen from one point of space.
struct Sighting {
  Sight sight = Sight::Nothing;
  float distance = 0;       ///< To the surface, + in front [internal units].
  float weight = 0;         ///< In (0, 1].
  float sigma = 0;          ///< Of distance [internal units]; 0 = not known.
  bool is_assumed = false;  ///< So far behind the surface that there is only assumed to be matter.
  int x = 0;                ///< Nearest pixel.
  int y = 0;
};

/// A depth map prepared for fusion: answers what it says about points and boxes.
class DepthField {
 public:
  /// \param voxel       voxel edge [internal units]
  DepthField(const TsdfView& view, const TsdfOptions& options, double voxel);

  /// What the view says about a point [internal units].
  Sighting at(const Eigen::Vector3f& point) const;

  /// What it says about all points within `box`, or Mixed if that differs or is not cheap to tell.
  Sight over(const Eigen::AlignedBox3f& box) const;

 private:
  // Extremes over 2^k x 2^k pixels.
  struct Extremes {
    float nearest;   // smallest depth
    float farthest;  // largest depth
    float slack;     // largest z-distance at which a point is still not free or hidden
    bool any_known;
    bool any_unknown;
  };
  using Level = Raster<Extremes>;

  bool shows_one_surface(float u, float v) const;
  float interpolated(float u, float v) const;
  Extremes over_pixels(int x0, int y0, int x1, int y1) const;

  Eigen::Matrix3f R_;  // cam_from_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  float truncation_;            // [internal units]
  float voxel_;                 // [internal units]
  DepthMap depth_;              // NaN where not usable
  DepthMap hides_;              // depth_ with its small gaps filled
  Raster<float> slope_;         // distance to the surface per z-distance
  Raster<float> facing_;        // cosine of incidence
  DepthMap sigma_;              // 0 = not known
  Raster<uint8_t> continuous_;  // 1 where the 2 x 2 pixels from (x, y) on show one surface
  std::vector<Level> pyramid_;
};

/// 1 at (x, y) where the 2 x 2 pixels from there on lie on one surface: every step of depth between
/// neighbours is either small against the pixel footprint or continues the step beside it.
Raster<uint8_t> continuous_quads(const DepthMap& depth, const Camera& camera);

/// Depth with enclosed patches of NaN of at most `max_area` pixels filled by a membrane in 1/z.
DepthMap with_gaps_filled(const DepthMap& depth, int max_area);

}  // namespace cgs
