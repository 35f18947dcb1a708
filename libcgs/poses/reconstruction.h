// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace cgs {

/// What photographs of one camera share. Distorted = (1 + k1 r²) undistorted, both in units of the
/// focal length.
struct Lens {
  double focal = 0;  ///< [working pixels]
  double k1 = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Principal point [working pixels].
};

/// cam_from_world of a photograph.
struct PhotoPose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& world) const {
    return rotation * world + translation;
  }
  Eigen::Vector3d center() const { return -(rotation.conjugate() * translation); }
};

inline constexpr double kFeatureSigma = 0.3;   ///< Of the place of a feature [working pixels].
inline constexpr double kRefinedSigma = 0.07;  ///< At best, refined by refine_observations().

/// A feature that shows the point of its track.
struct Observation {
  int photo = 0;
  int feature = 0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< From the image centre [working pixels].
  bool is_used = true;                           ///< False once found to be a wrong match.
  double sigma = kFeatureSigma;                  ///< Of `at` in each coordinate [working pixels].
};

/// One point of the scene, in at most one place of each photograph.
struct Track {
  std::vector<Observation> seen;  ///< In the order of photographs.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  bool is_known = false;  ///< position is triangulated.
};

/// A place from the centre of a picture after quarter turns of the picture, clockwise as seen.
template <typename T>
Eigen::Matrix<T, 2, 1> turned(const Eigen::Matrix<T, 2, 1>& at, int quarters) {
  switch (quarters & 3) {
    case 1:
      return {-at.y(), at.x()};
    case 2:
      return {-at.x(), -at.y()};
    case 3:
      return {at.y(), -at.x()};
    default:
      return at;
  }
}

/// Cameras and points while they are being solved. A working pixel is the pixel of the picture in
/// which features were found, so that errors of all photographs are comparable.
struct Reconstruction {
  std::vector<Lens> lenses;                     ///< As their sensors lie.
  std::vector<int> lens_of;                     ///< Per photograph.
  std::vector<int> turns;                       ///< As UnposedPhoto::turns; empty = none is turned.
  std::vector<std::optional<PhotoPose>> poses;  ///< Per photograph; nothing = not yet placed.
  std::vector<Track> tracks;

  int turns_of(int photo) const { return turns.empty() ? 0 : turns[static_cast<size_t>(photo)]; }
  /// The lens of a photograph, turned as it is.
  Lens lens(int photo) const {
    Lens out = lenses[static_cast<size_t>(lens_of[static_cast<size_t>(photo)])];
    out.centre = turned(out.centre, turns_of(photo));
    return out;
  }
  const std::optional<PhotoPose>& pose(int photo) const {
    return poses[static_cast<size_t>(photo)];
  }
};

/// Where a lens puts a direction x/z, y/z, from the image centre [working pixels].
template <typename T>
Eigen::Matrix<T, 2, 1> through_lens(const T& focal,
                                    const T& k1,
                                    const Eigen::Matrix<T, 2, 1>& centre,
                                    const Eigen::Matrix<T, 2, 1>& direction) {
  return centre + direction * (focal * (T(1) + k1 * direction.squaredNorm()));
}

/// The direction x/z, y/z that a lens shows at a place; the inverse of through_lens().
Eigen::Vector2d direction_at(const Lens& lens, const Eigen::Vector2d& at);

/// Distance between an observation and its point's image [working pixels]; infinite behind the
/// camera.
/// \pre the photograph is placed
double reprojection_error(const Reconstruction& scene,
                          const Eigen::Vector3d& position,
                          const Observation& observation);

/// Gives a position to every track that has none and can have one: two placed photographs see it
/// under an angle of at least `least_angle` [rad], and it projects to within `most_error` of where
/// they see it; of several such pairs those under the widest angles are tried. Observations further
/// off are no longer used.
void triangulate(Reconstruction& scene, double most_error, double least_angle);

/// Stops using observations further than `most_error` from their point, and forgets the positions
/// of tracks that two photographs no longer vouch for.
void drop_outliers(Reconstruction& scene, double most_error, double least_angle);

/// Largest angle [rad] between the rays of the used observations in placed photographs.
double ray_angle(const Reconstruction& scene, const Track& track);

}  // namespace cgs
