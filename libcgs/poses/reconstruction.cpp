// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "libcgs/core/angle_between.h"

namespace cgs {

namespace {

bool counts(const Reconstruction& scene, const Observation& s) {
  return s.is_used && scene.pose(s.photo).has_value();
}

Eigen::Vector3d ray_in_world(const Reconstruction& scene, const Observation& s) {
  const Eigen::Vector2d direction = direction_at(scene.lens(s.photo), s.at);
  return scene.pose(s.photo)->rotation.conjugate() * direction.homogeneous().normalized();
}

// The two observations whose rays meet under the largest angle.
struct WidestPair {
  const Observation* a = nullptr;
  const Observation* b = nullptr;
  double angle = 0;  // [rad]
};

WidestPair widest_pair(const Reconstruction& scene, const Track& track) {
  WidestPair widest;
  for (size_t i = 0; i < track.seen.size(); ++i) {
    if (!counts(scene, track.seen[i])) continue;
    for (size_t j = i + 1; j < track.seen.size(); ++j) {
      if (!counts(scene, track.seen[j])) continue;
      const double angle =
          angle_between(ray_in_world(scene, track.seen[i]), ray_in_world(scene, track.seen[j]));
      if (angle > widest.angle) widest = {&track.seen[i], &track.seen[j], angle};
    }
  }
  return widest;
}

// The point nearest to two rays.
Eigen::Vector3d meeting_point(const Reconstruction& scene,
                              const Observation& a,
                              const Observation& b) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const Observation* s : {&a, &b}) {
    const Eigen::Vector3d ray = ray_in_world(scene, *s);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    A += across;
    rhs += across * scene.pose(s->photo)->center();
  }
  return A.ldlt().solve(rhs);
}

// \return observations that agree with the position
int use_what_agrees(const Reconstruction& scene, double most_error, Track& track) {
  int agreeing = 0;
  for (Observation& s : track.seen) {
    if (!counts(scene, s)) continue;
    s.is_used = reprojection_error(scene, track.position, s) <= most_error;
    agreeing += s.is_used ? 1 : 0;
  }
  return agreeing;
}

}  // namespace

Eigen::Vector2d direction_at(const Lens& lens, const Eigen::Vector2d& at) {
  const Eigen::Vector2d distorted = (at - lens.centre) / lens.focal;
  Eigen::Vector2d direction = distorted;
  constexpr int kSteps = 20;  // each gains a factor of about k1 r²
  for (int i = 0; i < kSteps && lens.k1 != 0; ++i) {
    direction = distorted / (1 + lens.k1 * direction.squaredNorm());
  }
  return direction;
}

double reprojection_error(const Reconstruction& scene,
                          const Eigen::Vector3d& position,
                          const Observation& observation) {
  const Eigen::Vector3d p = *scene.pose(observation.photo) * position;
  if (!(p.z() > 0)) return std::numeric_limits<double>::infinity();
  const Lens& lens = scene.lens(observation.photo);
  const Eigen::Vector2d direction = p.hnormalized();
  return (through_lens(lens.focal, lens.k1, lens.centre, direction) - observation.at).norm();
}

void triangulate(Reconstruction& scene, double most_error, double least_angle) {
  for (Track& track : scene.tracks) {
    if (track.is_known) continue;
    const WidestPair widest = widest_pair(scene, track);
    if (!(widest.angle >= least_angle)) continue;
    track.position = meeting_point(scene, *widest.a, *widest.b);
    const bool is_met = reprojection_error(scene, track.position, *widest.a) <= most_error &&
                        reprojection_error(scene, track.position, *widest.b) <= most_error;
    if (is_met) track.is_known = use_what_agrees(scene, most_error, track) >= 2;
  }
}

void drop_outliers(Reconstruction& scene, double most_error, double least_angle) {
  for (Track& track : scene.tracks) {
    if (!track.is_known) continue;
    track.is_known =
        use_what_agrees(scene, most_error, track) >= 2 && ray_angle(scene, track) >= least_angle;
  }
}

double ray_angle(const Reconstruction& scene, const Track& track) {
  return widest_pair(scene, track).angle;
}

}  // namespace cgs
