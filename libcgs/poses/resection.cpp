// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/resection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

constexpr int kFewestPoints = 12;  // to place a photograph by

// Pairs to begin with, the most promising first.
std::vector<const PhotoPair*> ranked_pairs(const Reconstruction& scene,
                                           const std::vector<PhotoPair>& pairs) {
  struct Ranked {
    const PhotoPair* pair;
    double score;
  };
  std::vector<Ranked> ranked;
  for (const PhotoPair& pair : pairs) {
    if (!pair.is_connected) continue;
    const double focal_a = scene.lens(pair.a).focal;
    const double focal_b = scene.lens(pair.b).focal;
    const double moved = parallax(pair.points, focal_a, focal_b);
    if (!(moved >= kLeastParallax)) continue;
    constexpr double kEnough = 0.15;  // [rad]; beyond, only the number of points counts
    ranked.push_back({&pair, double(pair.matches.size()) * std::min(moved / focal_b, kEnough)});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& x, const Ranked& y) {
    return x.score > y.score;
  });
  std::vector<const PhotoPair*> out;
  out.reserve(ranked.size());
  for (const Ranked& r : ranked) out.push_back(r.pair);
  return out;
}

int known_points(const Reconstruction& scene) {
  return static_cast<int>(std::count_if(
      scene.tracks.begin(), scene.tracks.end(), [](const Track& track) { return track.is_known; }));
}

void forget(Reconstruction& scene) {
  for (auto& pose : scene.poses) pose.reset();
  for (Track& track : scene.tracks) {
    track.is_known = false;
    for (Observation& s : track.seen) s.is_used = true;
  }
}

void settle(Reconstruction& scene,
            const std::vector<LensPrior>& priors,
            const BundleOptions& options) {
  triangulate(scene, kMostError, least_angle(priors));
  adjust_bundle(scene, priors, options);
  drop_outliers(scene, kMostError, least_angle(priors));
}

// Of the poses that the pair may mean, the one from which adjusting explains most.
bool begin_with(const PhotoPair& pair,
                const std::vector<LensPrior>& priors,
                const Progress& progress,
                Reconstruction& scene) {
  forget(scene);
  std::optional<Reconstruction> best;
  double least = std::numeric_limits<double>::infinity();
  for (const PhotoPose& pose : relative_poses(
           pair.points, scene.lens(pair.a).focal, scene.lens(pair.b).focal, 0.5 * kMostError)) {
    Reconstruction candidate = scene;
    candidate.poses[static_cast<size_t>(pair.a)] = PhotoPose{};
    candidate.poses[static_cast<size_t>(pair.b)] = pose;
    settle(candidate, priors, {.first = pair.a, .second = pair.b, .progress = progress});
    const double error = capped_error(candidate);
    if (known_points(candidate) < kFewestPoints || !(error < least)) continue;
    least = error;
    best = std::move(candidate);
  }
  if (!best) return false;
  scene = std::move(*best);
  return true;
}

// The photograph not yet placed that shows the most known points; -1 if none shows enough.
int next_photo(const Reconstruction& scene, const std::vector<char>& has_failed) {
  int best = -1;
  int most = kFewestPoints - 1;
  for (int i = 0; i < static_cast<int>(scene.poses.size()); ++i) {
    if (scene.pose(i) || has_failed[static_cast<size_t>(i)] != 0) continue;
    const int count = points_in(scene, i);
    if (count <= most) continue;
    most = count;
    best = i;
  }
  return best;
}

// Places a photograph by the known points it shows. \return false if they do not fit
bool resect(Reconstruction& scene, int photo) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> places;
  std::vector<Observation*> observations;
  const double focal = scene.lens(photo).focal;
  for (Track& track : scene.tracks) {
    if (!track.is_known) continue;
    for (Observation& s : track.seen) {
      if (s.photo != photo) continue;
      points.emplace_back(track.position.x(), track.position.y(), track.position.z());
      places.emplace_back(s.at.x() / focal, s.at.y() / focal);
      observations.push_back(&s);
    }
  }
  cv::Mat rotation;
  cv::Mat translation;
  cv::Mat inliers;
  constexpr int kTrials = 1000;  // enough where three observations of ten are right
  const bool is_found = cv::solvePnPRansac(points,
                                           places,
                                           cv::Mat::eye(3, 3, CV_64F),
                                           cv::noArray(),
                                           rotation,
                                           translation,
                                           false,
                                           kTrials,
                                           static_cast<float>(kMostError / focal),
                                           0.9999,
                                           inliers,
                                           cv::SOLVEPNP_AP3P);
  if (!is_found || inliers.total() < static_cast<size_t>(kFewestPoints)) return false;
  cv::Mat matrix;
  cv::Rodrigues(rotation, matrix);
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  cv::cv2eigen(matrix, R);
  cv::cv2eigen(translation, t);
  if (!R.allFinite() || !t.allFinite()) return false;
  scene.poses[static_cast<size_t>(photo)] = PhotoPose{Eigen::Quaterniond(R).normalized(), t};
  for (Observation* s : observations) s->is_used = false;
  for (size_t i = 0; i < inliers.total(); ++i) {
    observations[static_cast<size_t>(inliers.at<int>(static_cast<int>(i)))]->is_used = true;
  }
  return true;
}

}  // namespace

double least_angle(const std::vector<LensPrior>& priors) {
  constexpr double kLeast = 0.01;
  constexpr double kPixels = 12.5;
  double out = 0;
  for (const LensPrior& prior : priors) {
    out = std::max(out, prior.focal > 0 ? kPixels / prior.focal : kLeast);
  }
  return std::min(out, kLeast);
}

int points_in(const Reconstruction& scene, int photo) {
  int count = 0;
  for (const Track& track : scene.tracks) {
    if (!track.is_known) continue;
    for (const Observation& s : track.seen) count += s.photo == photo && s.is_used ? 1 : 0;
  }
  return count;
}

bool explains_more(const PlacedPhotos& a, const PlacedPhotos& b) { return a.error < b.error; }

double capped_error(const Reconstruction& scene) {
  constexpr double kCap = kMostError * kMostError;
  double sum = 0;
  size_t count = 0;
  for (const Track& track : scene.tracks) {
    for (const Observation& s : track.seen) {
      ++count;
      const bool is_comparable = track.is_known && scene.pose(s.photo);
      const double error =
          is_comparable ? reprojection_error(scene, track.position, s) : kMostError;
      sum += std::min(error * error, kCap);
    }
  }
  return count > 0 ? sum / double(count) : kCap;
}

PlacedPhotos place_photos(const Reconstruction& start,
                          const std::vector<LensPrior>& priors,
                          const std::vector<PhotoPair>& pairs,
                          size_t most,
                          const Progress& progress) {
  constexpr size_t kMostTries = 3;
  std::vector<PlacedPhotos> tries;
  for (const PhotoPair* pair : ranked_pairs(start, pairs)) {
    if (tries.size() == kMostTries) break;
    Reconstruction candidate = start;
    if (!begin_with(*pair, priors, progress, candidate)) continue;
    tries.push_back({std::move(candidate), FirstPair{pair->a, pair->b}});
  }
  if (tries.empty()) {
    PlacedPhotos none{start, std::nullopt};
    forget(none.scene);
    return none;
  }
  tbb::parallel_for(size_t{0}, tries.size(), [&](size_t i) {
    place_more(tries[i].scene, priors, *tries[i].begun, most, progress);
    tries[i].error = capped_error(tries[i].scene);
  });
  return std::move(*std::min_element(tries.begin(), tries.end(), explains_more));
}

void place_more(Reconstruction& scene,
                const std::vector<LensPrior>& priors,
                const FirstPair& begun,
                size_t most,
                const Progress& progress) {
  triangulate(scene, kMostError, least_angle(priors));
  std::vector<char> has_failed(scene.poses.size(), 0);
  auto placed = static_cast<int>(
      std::count_if(scene.poses.begin(), scene.poses.end(), [](const auto& pose) { return pose; }));
  int unsettled = 0;
  while (static_cast<size_t>(placed) < most) {
    const int photo = next_photo(scene, has_failed);
    if (photo < 0) break;
    has_failed[static_cast<size_t>(photo)] = 1;
    if (!resect(scene, photo)) continue;
    ++placed;
    ++unsettled;
    // Of few photographs each is adjusted with all others at once; of many, once some are new.
    constexpr int kNew = 12;  // one in so many
    if (kNew * unsettled >= placed) {
      settle(scene, priors, {.first = begun.first, .second = begun.second, .progress = progress});
      unsettled = 0;
    } else {
      triangulate(scene, kMostError, least_angle(priors));
    }
    if (points_in(scene, photo) < kFewestPoints) scene.poses[static_cast<size_t>(photo)].reset();
  }
  if (unsettled > 0) {
    settle(scene, priors, {.first = begun.first, .second = begun.second, .progress = progress});
  }
}

}  // namespace cgs
