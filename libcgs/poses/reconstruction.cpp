// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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

struct Ray {
  const Observation* of;
  Eigen::Vector3d direction;  // in the world, of unit length
};

std::vector<Ray> rays_of(const Reconstruction& scene, const Track& track) {
  std::vector<Ray> out;
  for (const Observation& s : track.seen) {
    if (counts(scene, s)) out.push_back({&s, ray_in_world(scene, s)});
  }
  return out;
}

// Two rays, and the angle under which they meet [rad].
struct RayPair {
  size_t a = 0;
  size_t b = 0;
  double angle = 0;
};

template <typename Visit>
void for_each_pair(const std::vector<Ray>& rays, const Visit& visit) {
  for (size_t i = 0; i < rays.size(); ++i) {
    for (size_t j = i + 1; j < rays.size(); ++j) {
      visit(RayPair{i, j, angle_between(rays[i].direction, rays[j].direction)});
    }
  }
}

RayPair widest_pair(const std::vector<Ray>& rays) {
  RayPair widest;
  for_each_pair(rays, [&](const RayPair& pair) {
    if (pair.angle > widest.angle) widest = pair;
  });
  return widest;
}

// As many as are worth trying after the widest, in that order.
std::vector<RayPair> next_widest(const std::vector<Ray>& rays, double least_angle) {
  std::vector<RayPair> out;
  for_each_pair(rays, [&](const RayPair& pair) {
    if (pair.angle >= least_angle) out.push_back(pair);
  });
  std::stable_sort(
      out.begin(), out.end(), [](const RayPair& x, const RayPair& y) { return x.angle > y.angle; });
  constexpr size_t kMost = 8;  // with the widest
  if (out.size() > kMost) out.resize(kMost);
  if (!out.empty()) out.erase(out.begin());
  return out;
}

// The point nearest to two rays.
Eigen::Vector3d meeting_point(const Reconstruction& scene, const Ray& a, const Ray& b) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const Ray* ray : {&a, &b}) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - ray->direction * ray->direction.transpose();
    A += across;
    rhs += across * scene.pose(ray->of->photo)->center();
  }
  return A.ldlt().solve(rhs);
}

// Puts a track where two of its rays meet. \return whether both observations agree with it
bool is_met(const Reconstruction& scene,
            const std::vector<Ray>& rays,
            const RayPair& pair,
            double most_error,
            Track& track) {
  track.position = meeting_point(scene, rays[pair.a], rays[pair.b]);
  return reprojection_error(scene, track.position, *rays[pair.a].of) <= most_error &&
         reprojection_error(scene, track.position, *rays[pair.b].of) <= most_error;
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
  const Lens lens = scene.lens(observation.photo);
  const Eigen::Vector2d direction = p.hnormalized();
  return (through_lens(lens.focal, lens.k1, lens.centre, direction) - observation.at).norm();
}

void triangulate(Reconstruction& scene, double most_error, double least_angle) {
  for (Track& track : scene.tracks) {
    if (track.is_known) continue;
    const std::vector<Ray> rays = rays_of(scene, track);
    const RayPair widest = widest_pair(rays);
    if (!(widest.angle >= least_angle)) continue;
    bool is_found = is_met(scene, rays, widest, most_error, track);
    if (!is_found && rays.size() > 2) {  // a wrong observation is likely to be one of the widest
      const std::vector<RayPair> pairs = next_widest(rays, least_angle);
      is_found = std::any_of(pairs.begin(), pairs.end(), [&](const RayPair& pair) {
        return is_met(scene, rays, pair, most_error, track);
      });
    }
    if (is_found) track.is_known = use_what_agrees(scene, most_error, track) >= 2;
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
  return widest_pair(rays_of(scene, track)).angle;
}

}  // namespace cgs
