// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include <Eigen/Core>

#include "io/scenes/camera_checks.h"
#include "libcgs/core/fisheye.h"

namespace cgs {

/// A point of a picture, and how many times the angle of a pixel of the picture, across the radius,
/// a pixel of the photograph covers there.
struct PicturePoint {
  Eigen::Vector2d at;  ///< [pixels]
  double stretch = 1;  ///< Along the radius or across it, whichever is more.
};

/// Between a fisheye photograph and the picture that a pinhole camera of the same focal lengths
/// would have recorded. That picture reaches as far as the photograph does on its two axes, but no
/// more than 60 degrees to any side: towards 90 degrees a pinhole has no end.
class FisheyeMap {
 public:
  explicit FisheyeMap(const Fisheye& fisheye);

  /// The same lens and the same picture, of a photograph of another size.
  FisheyeMap resized(int width, int height) const;

  /// Size and intrinsics of the photograph.
  const Camera& photograph() const { return lens_.photograph; }
  /// Size and intrinsics of the picture, without pose.
  const Camera& picture() const { return picture_; }
  /// Whether the photograph shows more than the picture on an axis.
  bool is_cropped() const { return is_cropped_; }
  /// Whether the photograph shows anything at one of its points, as far as Fisheye::radius says.
  bool shows(const Eigen::Vector2d& in_photograph) const;
  /// Where a point of the picture lies in the photograph [pixels]; NaN where the lens folds.
  Eigen::Vector2d in_photograph(const Eigen::Vector2d& in_picture) const;
  /// Where a point of the photograph lies in the picture or, up to 89 degrees off the axis, beside
  /// it; nothing for points that no ray falls on.
  std::optional<PicturePoint> in_picture(const Eigen::Vector2d& in_photograph) const;

 private:
  double angle_at(double radius) const;

  Fisheye lens_;
  double fold_;  // [radians], at most pi / 2
  Camera picture_;
  bool is_cropped_ = false;
};

/// Calls refuse(Value) if a number is not finite or out of range, as check_intrinsics(), if the
/// lens cannot be undone inside the largest circle around the principal point that the photograph
/// holds, within 60 degrees of the axis, or if the photograph shows nothing there.
void check_fisheye(const Fisheye& fisheye, const Refuse& refuse);

}  // namespace cgs
