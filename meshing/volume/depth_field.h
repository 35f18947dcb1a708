// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "meshing/volume/depth_bounds.h"
#include "meshing/volume/tsdf_options.h"
#include "meshing/volume/tsdf_view.h"

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
struct PointObservation {
  Sight sight = Sight::Nothing;
  float distance = 0;       ///< To the surface, + in front [internal units].
  float weight = 0;         ///< In (0, 1].
  float sigma = 0;          ///< Of distance [internal units]; 0 = not known.
  bool is_assumed = false;  ///< So far behind the surface that there is only assumed to be matter.
  int x = 0;                ///< Nearest pixel.
  int y = 0;
};

/// Eight points of space [internal units].
struct EightPoints {
  alignas(32) std::array<float, 8> x, y, z;
};

/// Observations of eight points; a bit per point says what it is.
struct Observations {
  unsigned free = 0;  ///< Where the weight is above 0.
  unsigned band = 0, hidden = 0;
  unsigned assumed = 0;                               ///< Of the band, as in PointObservation.
  bool has_sigma = false;                             ///< False where sigma is 0 throughout.
  alignas(32) std::array<float, 8> free_weight;       ///< 0 where the point is not.
  alignas(32) std::array<float, 8> weight_in_band;    ///< 0 where the point is not.
  alignas(32) std::array<float, 8> distance_in_band;  ///< 0 where the point is not.
  alignas(32) std::array<float, 8> sigma;             ///< 0 where not known or not in the band.
  alignas(32) std::array<int32_t, 8> pixel;           ///< Nearest, as in Raster::data.
};

/// Eight boxes of one size [internal units].
struct EightBoxes {
  alignas(32) std::array<float, 8> x, y, z;  ///< Of their centres.
  Eigen::Vector3f half;                      ///< Half of their edges.
};

/// What a depth map says about all points within a box.
struct Look {
  Sight sight = Sight::Mixed;  ///< Mixed if that differs or is not cheap to tell.
  bool may_touch = true;       ///< False if no point within the box is in the band.
  bool may_free = true;        ///< False if none is free.
};

/// Of eight boxes, a bit per box; where no sight is set it is mixed.
struct Looks {
  unsigned nothing = 0, free = 0, hidden = 0;
  unsigned may_touch = 0, may_free = 0;

  Look operator[](size_t box) const {
    const auto is = [&](unsigned all) { return (all >> box & 1) != 0; };
    const Sight sight = is(nothing)  ? Sight::Nothing
                        : is(free)   ? Sight::Free
                        : is(hidden) ? Sight::Hidden
                                     : Sight::Mixed;
    return {sight, is(may_touch), is(may_free)};
  }
};

/// A depth map prepared for fusion: answers what it says about points and boxes.
class DepthField {
 public:
  /// What a field will be asked about: boxes alone need less preparation and memory.
  enum class Asked : uint8_t { Boxes, Points };
  /// \param voxel       voxel edge [internal units]
  DepthField(const TsdfView& view,
             const TsdfOptions& options,
             double voxel,
             Asked asked = Asked::Points);

  /// What the view says about a point [internal units].
  PointObservation at(const Eigen::Vector3f& point) const;

  /// The same, to the bit, about many points.
  /// \param out  one for each eight points
  void at(std::span<const EightPoints> points, Observations* out) const;

  /// What it says about all points within boxes.
  Looks look(const EightBoxes& boxes) const;
  Look look(const Eigen::AlignedBox3f& box) const;

  /// Memory per pixel of its depth map [bytes].
  static constexpr size_t kPixelBytes = 32;

 private:
  // What is asked of a pixel, in one place of memory.
  struct Pixel {
    float depth;   // NaN where not usable; negative where the 2 x 2 pixels from here on show one
                   // surface
    float slope;   // distance to the surface per z-distance
    float weight;  // of one surface, not behind it
    float hides;   // depth with its small gaps filled
  };

  void put_depth(const DepthMap& depth, const Raster<uint8_t>& continuous, const DepthMap& hides);
  // Sets slope, weight and sigma.
  // \return the slack of DepthBounds of every pixel
  Raster<float> look_along(const TsdfView& view, const DepthMap& depth);

  const Pixel& pixel_at(int x, int y) const {
    return pixels_[size_t(y) * size_t(width_) + size_t(x)];
  }
  bool shows_one_surface(float u, float v) const;
  float interpolated(float u, float v) const;

  Eigen::Matrix3f R_;  // cam_from_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  float truncation_;                 // [internal units]
  float voxel_;                      // [internal units]
  std::unique_ptr<Pixel[]> pixels_;  // Null where only boxes are asked about.
  DepthMap sigma_;  // of distance [internal units], 0 = not known; empty = nowhere known
  std::optional<DepthBounds> bounds_;
};

/// 1 at (x, y) where the 2 x 2 pixels from there on lie on one surface: every step of depth between
/// neighbours is either small against the pixel footprint or continues the step beside it.
Raster<uint8_t> continuous_quads(const DepthMap& depth, const Camera& camera);

/// Depth with enclosed patches of NaN of at most `max_area` pixels filled by a membrane in 1/z.
DepthMap with_gaps_filled(const DepthMap& depth, int max_area);

}  // namespace cgs
