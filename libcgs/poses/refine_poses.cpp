// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/refine_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/order_statistics.h"
#include "libcgs/poses/photo_pairs.h"
#include "libcgs/poses/resection.h"

namespace cgs {

namespace {

// How far an observation may be off in each round [working pixels]: poses that are off by a degree
// or two show points where they are not.
constexpr std::array<double, 4> kRounds = {80, 16, 4, 2.5};
constexpr double kLossShare = 0.25;  // of that: scale of the loss

// Poses by phones and by structure from motion are better; photographs outweigh it by far where
// they say anything.
constexpr double kRotationSigma = 0.02;  // [rad]
constexpr double kCenterSigma = 0.03;    // [baselines]

// Poses that many photographs agreed on are better than what a few say of them, though those few
// can be fitted a little better: what lenses do that no model states goes into the poses then.
constexpr double kClearly = 0.5;

PhotoPose pose_in(const Frame& frame, const Eigen::Isometry3d& world_from_cam) {
  const Eigen::Quaterniond rotation(Eigen::Matrix3d(world_from_cam.linear().transpose()));
  const Eigen::Vector3d center = frame.internal_from_world(world_from_cam.translation());
  return {rotation.normalized(), -(rotation.normalized() * center)};
}

Eigen::Isometry3d pose_in_world(const Frame& frame, const PhotoPose& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = pose.rotation.conjugate().toRotationMatrix();
  out.translation() = frame.world_from_internal(pose.center());
  return out;
}

PosePrior prior_of(const PhotoPose& pose, double baseline) {
  return {pose, kRotationSigma, kCenterSigma * baseline};
}

LensPrior exact_lens(const PosedPhoto& photo) { return {working_focal(photo), 0, 0}; }

/// Photographs that share points, and those of them that hold the world in place.
struct Gauge {
  int first = -1;
  int farthest = -1;
  double baseline = 0;  // [scene units]
};

// \param matches  per photograph
Gauge gauge_of(const std::vector<PosedPhoto>& photos, const std::vector<size_t>& matches) {
  Gauge out;
  for (int i = 0; i < static_cast<int>(photos.size()); ++i) {
    if (matches[static_cast<size_t>(i)] == 0) continue;
    if (out.first < 0) out.first = i;
    const double distance = (photos[static_cast<size_t>(i)].camera.center() -
                             photos[static_cast<size_t>(out.first)].camera.center())
                                .norm();
    if (distance <= out.baseline) continue;
    out.farthest = i;
    out.baseline = distance;
  }
  return out;
}

// Per photograph.
std::vector<size_t> matches_of(size_t photos, const std::vector<PhotoPair>& pairs) {
  std::vector<size_t> out(photos, 0);
  for (const PhotoPair& pair : pairs) {
    if (!pair.is_connected) continue;
    for (const int i : {pair.a, pair.b}) out[static_cast<size_t>(i)] += pair.matches.size();
  }
  return out;
}

// The first camera is the origin, the baseline 1/2 ... 1. Scaled by a power of two, the same scene
// in other units has the same bits.
Frame frame_of(const std::vector<PosedPhoto>& photos, const Gauge& gauge) {
  Frame frame;
  frame.origin = photos[static_cast<size_t>(gauge.first)].camera.center();
  int exponent = 0;
  (void)std::frexp(gauge.baseline, &exponent);
  frame.scale = std::ldexp(1.0, exponent);
  return frame;
}

// Points from the poses as they are now; every observation may count again.
void triangulate_anew(const std::vector<LensPrior>& lenses,
                      double most_error,
                      Reconstruction& scene) {
  for (Track& track : scene.tracks) {
    track.is_known = false;
    for (Observation& s : track.seen) s.is_used = true;
  }
  triangulate(scene, most_error, least_angle(lenses));
}

void adjust(const std::vector<LensPrior>& lenses,
            BundleOptions options,
            Reconstruction& scene,
            const Progress& progress) {
  double done = 0;
  for (const double most_error : kRounds) {
    options.progress = part_of(progress, done / kRounds.size(), (done + 1) / kRounds.size());
    ++done;
    triangulate_anew(lenses, most_error, scene);
    options.loss_scale = kLossShare * most_error;
    adjust_bundle(scene, lenses, options);
  }
  drop_outliers(scene, kRounds.back(), least_angle(lenses));
}

// Distances of the used observations of a photograph [working pixels].
std::vector<double> errors_in(const Reconstruction& scene, int photo) {
  std::vector<double> out;
  for (const Track& track : scene.tracks) {
    if (!track.is_known) continue;
    for (const Observation& s : track.seen) {
      if (!s.is_used || s.photo != photo) continue;
      out.push_back(reprojection_error(scene, track.position, s));
    }
  }
  return out;
}

// The same points, put where the poses given have them.
Reconstruction as_given(const Reconstruction& refined,
                        const std::vector<std::optional<PhotoPose>>& given,
                        const std::vector<LensPrior>& lenses,
                        const Progress& progress) {
  Reconstruction out = refined;
  out.poses = given;
  // Every observation counts: a loss that forgives would find points that two of three agree on.
  const BundleOptions options{
      .hold_poses = true, .loss_scale = kRounds.front(), .progress = progress};
  adjust_bundle(out, lenses, options);
  return out;
}

RefinedPose fit_of(const PosedPhoto& photo,
                   size_t matches,
                   const std::vector<double>& before,
                   const std::vector<double>& after) {
  RefinedPose out;
  out.world_from_cam = photo.camera.world_from_cam;
  out.matches = static_cast<int>(matches);
  if (after.size() < kFewestMatches) return out;
  out.points = static_cast<int>(after.size());
  out.error_before = photo.features.pixel * median_of(before);
  out.error_after = photo.features.pixel * median_of(after);
  return out;
}

bool is_clearly_better(const RefinedPose& fit) {
  return fit.points > 0 && fit.error_after < kClearly * fit.error_before;
}

Reconstruction roughly_known(const std::vector<PosedPhoto>& photos,
                             const Frame& frame,
                             std::vector<Track> tracks) {
  Reconstruction scene;
  scene.tracks = std::move(tracks);
  for (const PosedPhoto& photo : photos) {
    scene.lens_of.push_back(static_cast<int>(scene.lenses.size()));
    scene.lenses.push_back({working_focal(photo)});
    scene.poses.emplace_back(pose_in(frame, photo.camera.world_from_cam));
  }
  return scene;
}

/// What the photograph to be placed shares with others, and the places where it shows known points.
struct Shown {
  size_t matches = 0;
  std::map<size_t, int> feature_of;  // track -> feature
};

// The known point that each feature of a photograph shows; -1 = none.
std::vector<std::ptrdiff_t> tracks_of(const KnownPoints& points, int photo) {
  const auto& features = points.photos[static_cast<size_t>(photo)].features;
  std::vector<std::ptrdiff_t> out(features.points.size(), -1);
  for (size_t k = 0; k < points.scene.tracks.size(); ++k) {
    const Track& track = points.scene.tracks[k];
    if (!track.is_known) continue;
    for (const Observation& s : track.seen) {
      if (s.is_used && s.photo == photo) out[static_cast<size_t>(s.feature)] = std::ptrdiff_t(k);
    }
  }
  return out;
}

// By its matches with all others. Points found in two places are left out.
Shown shown_points(const UnposedPhoto& photo, const KnownPoints& points, const Progress& progress) {
  std::vector<PhotoPair> pairs(points.photos.size());
  SharedProgress matched(progress, pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
    pairs[i] = match_pair(points.photos[i], photo, [&](double) { matched.tell(); });
    matched.advance();
  });
  Shown out;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].is_connected) continue;
    out.matches += pairs[i].matches.size();
    const std::vector<std::ptrdiff_t> tracks = tracks_of(points, static_cast<int>(i));
    for (const FeatureMatch& m : pairs[i].matches) {
      const std::ptrdiff_t track = tracks[static_cast<size_t>(m.a)];
      if (track < 0) continue;
      const auto known = out.feature_of.emplace(static_cast<size_t>(track), m.b).first;
      if (known->second != m.b) known->second = -1;
    }
  }
  std::erase_if(out.feature_of, [](const auto& shown) { return shown.second < 0; });
  return out;
}

// One photograph and the points it shows, which are known.
Reconstruction resection_of(const PosedPhoto& photo,
                            const UnposedPhoto& unposed,
                            const Shown& shown,
                            const KnownPoints& points) {
  Reconstruction scene;
  scene.lenses = {{working_focal(photo)}};
  scene.lens_of = {0};
  scene.poses = {pose_in(points.frame, photo.camera.world_from_cam)};
  for (const auto& [track, feature] : shown.feature_of) {
    const Eigen::Vector2d& at = unposed.features.points[static_cast<size_t>(feature)];
    scene.tracks.push_back({{{0, feature, at / unposed.features.pixel, true}},
                            points.scene.tracks[track].position,
                            true});
  }
  return scene;
}

void use_what_is_within(Reconstruction& scene, double most_error) {
  for (Track& track : scene.tracks) {
    Observation& s = track.seen.front();
    s.is_used = reprojection_error(scene, track.position, s) <= most_error;
  }
}

}  // namespace

PoseRefinement refine_poses(const std::vector<PosedPhoto>& photos, const Progress& progress) {
  PoseRefinement out;
  for (const PosedPhoto& photo : photos) {
    out.points.photos.push_back(as_unposed(photo));
  }
  const std::vector<PhotoPair> pairs = match_photos(out.points.photos, part_of(progress, 0, 0.7));
  const std::vector<size_t> matches = matches_of(photos.size(), pairs);
  for (size_t i = 0; i < photos.size(); ++i) {
    out.photos.push_back(fit_of(photos[i], matches[i], {}, {}));
  }
  const Gauge gauge = gauge_of(photos, matches);
  if (!(gauge.baseline > 0)) return out;
  const Frame frame = frame_of(photos, gauge);
  Reconstruction scene = roughly_known(photos, frame, chain_matches(out.points.photos, pairs));
  const std::vector<std::optional<PhotoPose>> given = scene.poses;
  std::vector<LensPrior> lenses;
  BundleOptions options{.first = gauge.first, .second = gauge.farthest};
  for (size_t i = 0; i < photos.size(); ++i) {
    lenses.push_back(exact_lens(photos[i]));
    options.pose_priors.push_back(prior_of(*given[i], gauge.baseline / frame.scale));
  }
  adjust(lenses, options, scene, part_of(progress, 0.7, 0.95));
  const Reconstruction before = as_given(scene, given, lenses, part_of(progress, 0.95, 1));
  report(progress, 1);
  for (size_t i = 0; i < photos.size(); ++i) {
    const int photo = static_cast<int>(i);
    out.photos[i] =
        fit_of(photos[i], matches[i], errors_in(before, photo), errors_in(scene, photo));
  }
  out.points.frame = frame;
  if (std::none_of(out.photos.begin(), out.photos.end(), is_clearly_better)) {
    out.points.scene = before;
    for (RefinedPose& pose : out.photos) pose.error_after = pose.error_before;
    return out;
  }
  for (size_t i = 0; i < photos.size(); ++i) {
    RefinedPose& refined = out.photos[i];
    refined.is_refined = refined.points > 0 && static_cast<int>(i) != gauge.first;
    if (refined.is_refined) refined.world_from_cam = pose_in_world(frame, *scene.poses[i]);
  }
  out.points.scene = std::move(scene);
  out.points.is_moved = true;
  return out;
}

RefinedPose refine_pose(const PosedPhoto& photo,
                        const KnownPoints& points,
                        const Progress& progress) {
  const UnposedPhoto unposed = as_unposed(photo);
  const Shown shown = shown_points(unposed, points, progress);
  if (shown.feature_of.empty()) return fit_of(photo, shown.matches, {}, {});
  Reconstruction scene = resection_of(photo, unposed, shown, points);
  const PhotoPose given = *scene.poses[0];
  const double baseline = 0.75;  // 1/2 ... 1 in the frame
  BundleOptions options{.first = -1, .second = -1, .hold_points = true};
  options.pose_priors = {prior_of(given, baseline)};
  for (const double most_error : kRounds) {
    use_what_is_within(scene, most_error);
    options.loss_scale = kLossShare * most_error;
    adjust_bundle(scene, {exact_lens(photo)}, options);
  }
  use_what_is_within(scene, kRounds.back());
  Reconstruction before = scene;
  before.poses[0] = given;
  RefinedPose out = fit_of(photo, shown.matches, errors_in(before, 0), errors_in(scene, 0));
  // Where the others moved, the pose given says where they were.
  const bool is_better = out.points > 0 && out.error_after < out.error_before;
  out.is_refined = points.is_moved ? is_better : is_clearly_better(out);
  if (out.is_refined) {
    out.world_from_cam = pose_in_world(points.frame, *scene.poses[0]);
  } else {
    out.error_after = out.error_before;
  }
  return out;
}

}  // namespace cgs
