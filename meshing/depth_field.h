// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <limits>
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

/// Sightings of eight points in a row; a bit per point says what it is.
struct SightingRow {
  unsigned free = 0;  ///< Where the weight is above 0.
  unsigned band = 0, hidden = 0;
  unsigned assumed = 0;    ///< Of the band, as in Sighting.
  bool has_sigma = false;  ///< False where sigma is 0 throughout.
  alignas(32) std::array<float, 8> weight;
  alignas(32) std::array<float, 8> weight_in_band;    ///< 0 where the point is not.
  alignas(32) std::array<float, 8> distance_in_band;  ///< 0 where the point is not.
  alignas(32) std::array<float, 8> sigma;             ///< 0 where not known or not in the band.
  alignas(32) std::array<int32_t, 8> x, y;
};

/// A depth map prepared for fusion: answers what it says about points and boxes.
class DepthField {
 public:
  /// \param voxel       voxel edge [internal units]
  DepthField(const TsdfView& view, const TsdfOptions& options, double voxel);

  /// What the view says about a point [internal units].
  Sighting at(const Eigen::Vector3f& point) const;

  /// The same, to the bit, about the points (x, y, z[0]), (x, y, z[1]) … [internal units].
  SightingRow row(float x, float y, const std::array<float, 8>& z) const;

  /// What it says about all points within a box.
  struct Look {
    Sight sight = Sight::Mixed;  ///< Mixed if that differs or is not cheap to tell.
    bool may_touch = true;       ///< False if no point within the box is in the band.
    bool may_free = true;        ///< False if none is free.
  };
  Look look(const Eigen::AlignedBox3f& box) const;

  /// Memory per pixel of its depth map [bytes].
  static constexpr size_t kPixelBytes = 32;

 private:
  // Extremes over 2^k x 2^k pixels.
  struct Extremes {
    float nearest;   // smallest depth; infinity if there is none
    float farthest;  // largest depth; -infinity if there is none
    float slack;     // largest z-distance at which a point is still not free or hidden
    bool any_known;
    bool any_unknown;

    void add(const Extremes& other);
  };
  using Level = Raster<Extremes>;
  static constexpr Extremes kNoExtremes = {std::numeric_limits<float>::infinity(),
                                           -std::numeric_limits<float>::infinity(),
                                           0,
                                           false,
                                           false};

  // What is asked of a pixel, in one place of memory.
  struct Pixel {
    float depth;   // NaN where not usable; negative where the 2 x 2 pixels from here on show one
                   // surface
    float slope;   // distance to the surface per z-distance
    float weight;  // of one surface, not behind it
    float hides;   // depth with its small gaps filled
  };

  // Sets slope, weight and sigma. \return the slack of Extremes of every pixel
  Raster<float> look_along(const TsdfView& view, const DepthMap& depth);
  void build_pyramid(const DepthMap& depth, const DepthMap& hides, const Raster<float>& slack);

  bool shows_one_surface(float u, float v) const;
  float interpolated(float u, float v) const;
  Extremes over_pixels(int x0, int y0, int x1, int y1) const;

  Eigen::Matrix3f R_;  // cam_from_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  float truncation_;  // [internal units]
  float voxel_;       // [internal units]
  Raster<Pixel> pixels_;
  DepthMap sigma_;  // of distance [internal units], 0 = not known; empty = nowhere known
  std::vector<Level> pyramid_;  // from 2 x 2 pixels on
};

/// 1 at (x, y) where the 2 x 2 pixels from there on lie on one surface: every step of depth between
/// neighbours is either small against the pixel footprint or continues the step beside it.
Raster<uint8_t> continuous_quads(const DepthMap& depth, const Camera& camera);

/// Depth with enclosed patches of NaN of at most `max_area` pixels filled by a membrane in 1/z.
DepthMap with_gaps_filled(const DepthMap& depth, int max_area);

}  // namespace cgs
