// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "io/scenes/fisheye_map.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Whether the photograph of a view differs from its undistorted picture.
bool has_lens_distortion(const View& view);

/// The camera of the undistorted picture of a view before it is made smaller: for a fisheye that of
/// its FisheyeMap, at the size of the photograph.
/// \throws Error as photograph_size()
Camera picture_camera(const View& view);

/// Where points of the photograph of a view lie in its undistorted picture of full size, and back.
class LensMap {
 public:
  /// \param camera  picture_camera(view)
  /// \throws Error as photograph_size()
  LensMap(const View& view, const Camera& camera);

  /// \param in_photograph  [pixels], the first centre at 0.5
  /// \return nothing where the lens cannot be undone
  std::optional<PicturePoint> operator()(const Eigen::Vector2d& in_photograph) const;
  /// \return nothing where the lens folds
  std::optional<Eigen::Vector2d> in_photograph(const Eigen::Vector2d& in_picture) const;

 private:
  Camera camera_;
  std::array<double, 5> distortion_;
  std::optional<FisheyeMap> fisheye_;
};

/// What describes the lens of a view, for hashes.
std::vector<double> lens_numbers(const View& view);

}  // namespace cgs
