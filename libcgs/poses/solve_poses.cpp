// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/solve_poses.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include <tbb/parallel_invoke.h>

#include "libcgs/core/error.h"
#include "libcgs/poses/bundle_adjustment.h"
#include "libcgs/poses/focal_search.h"
#include "libcgs/poses/observation_refinement.h"
#include "libcgs/poses/photo_pairs.h"
#include "libcgs/poses/pose_checks.h"
#include "libcgs/poses/resection.h"

namespace cgs {

namespace {

// Where nothing tells the focal length: phones' main lenses have 0.67 to 0.78 of the larger side,
// compact cameras 0.75 to 2.4, and what is cut from their pictures more.
constexpr double kTypicalFocal = 0.85;
constexpr double kTypicalSigma = 0.25;

// Of many photographs: more would tell little more, and take long.
constexpr size_t kTracksPerPhoto = 400;

double larger_side(const UnposedPhoto& photo) {
  return std::max(photo.width, photo.height) / photo.features.pixel;
}

std::vector<LensPrior> lens_priors(const std::vector<UnposedPhoto>& photos) {
  std::vector<LensPrior> priors;
  for (const UnposedPhoto& photo : photos) {
    const auto lens = static_cast<size_t>(photo.lens);
    if (priors.size() <= lens) priors.resize(lens + 1);
    priors[lens] = {photo.focal / photo.features.pixel, photo.focal_sigma, larger_side(photo)};
  }
  return priors;
}

// Adjusts everything and looks again what agrees.
void polish_once(const std::vector<LensPrior>& priors,
                 const BundleOptions& options,
                 double most_error,
                 Reconstruction& scene) {
  adjust_bundle(scene, priors, options);
  drop_outliers(scene, most_error, least_angle(priors));
  triangulate(scene, most_error, least_angle(priors));
}

// Goes on until nothing changes any more.
// \return relative standard deviations of the focal lengths, per lens
std::vector<double> polish(const std::vector<LensPrior>& priors,
                           BundleOptions options,
                           Reconstruction& scene) {
  for (const double most_error : {3.0, 2.5}) polish_once(priors, options, most_error, scene);
  constexpr int kUntilSettled = 200;
  options.most_iterations = kUntilSettled;
  return adjust_bundle(scene, priors, options, true);
}

// Polished with the shape of the lenses, unless that pulls a focal length away from where plain
// lenses have it: then the photographs cannot tell one from the other, and plain lenses stay.
std::vector<double> polish_with_shape(const std::vector<LensPrior>& priors,
                                      const FirstPair& begun,
                                      const Progress& progress,
                                      Reconstruction& scene) {
  constexpr double kMostPull = 0.1;  // of log(focal); distortion of real lenses does less
  SharedProgress rounds(progress, 3);
  const BundleOptions as_plain{
      .first = begun.first, .second = begun.second, .solve_focal = true, .progress = [&](double) {
        rounds.tell();
      }};
  BundleOptions with_shape = as_plain;
  with_shape.solve_shape = true;
  polish_once(priors, as_plain, kMostError, scene);
  rounds.advance();
  Reconstruction plain = scene;
  std::vector<double> plain_sigmas;
  std::vector<double> sigmas;
  const auto polish_into =
      [&](const BundleOptions& options, Reconstruction& polished, std::vector<double>& out) {
        out = polish(priors, options, polished);
        rounds.advance();
      };
  tbb::parallel_invoke([&] { polish_into(as_plain, plain, plain_sigmas); },
                       [&] { polish_into(with_shape, scene, sigmas); });
  for (size_t i = 0; i < scene.lenses.size(); ++i) {
    const double pull = std::abs(std::log(scene.lenses[i].focal / plain.lenses[i].focal));
    if (pull <= kMostPull) {
      if (sigmas[i] > 0) sigmas[i] = std::hypot(sigmas[i], pull);
      continue;
    }
    scene = std::move(plain);
    return plain_sigmas;
  }
  return sigmas;
}

// Makes the first placed photograph the origin and its distance to the farthest the unit. (To the
// second it may be next to nothing: two pictures of a burst.)
void move_to_first(Reconstruction& scene) {
  std::optional<size_t> first;
  double unit = 0;
  for (size_t i = 0; i < scene.poses.size(); ++i) {
    if (!scene.poses[i]) continue;
    if (!first) first = i;
    unit = std::max(unit, (scene.poses[i]->center() - scene.poses[*first]->center()).norm());
  }
  const PhotoPose origin = *scene.poses[*first];
  for (auto& pose : scene.poses) {
    if (!pose) continue;
    const Eigen::Quaterniond rotation = (pose->rotation * origin.rotation.conjugate()).normalized();
    pose = PhotoPose{rotation, (pose->translation - rotation * origin.translation) / unit};
  }
  scene.poses[*first] = PhotoPose{};
  for (Track& track : scene.tracks) track.position = origin * track.position / unit;
}

SolvedPhoto solved_photo(const UnposedPhoto& photo, const Lens& lens, const PhotoPose& pose) {
  SolvedPhoto out;
  const double pixel = photo.features.pixel;
  out.is_placed = true;
  out.camera.width = photo.width;
  out.camera.height = photo.height;
  out.camera.fx = out.camera.fy = lens.focal * pixel;
  out.camera.cx = 0.5 * photo.width + lens.centre.x() * pixel;
  out.camera.cy = 0.5 * photo.height + lens.centre.y() * pixel;
  out.camera.world_from_cam.linear() = pose.rotation.conjugate().toRotationMatrix();
  out.camera.world_from_cam.translation() = pose.center();
  out.k1 = lens.k1;
  out.rotation = pose.rotation;
  out.translation = pose.translation;
  return out;
}

void add_points(const std::vector<UnposedPhoto>& photos,
                const Reconstruction& scene,
                PoseSolution& out) {
  double sum = 0;
  size_t count = 0;
  for (const Track& track : scene.tracks) {
    if (!track.is_known) continue;
    SolvedPoint point{track.position, {}, 0};
    for (const Observation& s : track.seen) {
      if (!s.is_used || !scene.pose(s.photo)) continue;
      const UnposedPhoto& photo = photos[static_cast<size_t>(s.photo)];
      const double pixel = photo.features.pixel;
      const double error = reprojection_error(scene, track.position, s) * pixel;
      const Eigen::Vector2d centre(0.5 * photo.width, 0.5 * photo.height);
      point.track.push_back({s.photo, s.feature, centre + pixel * s.at});
      point.error += error;
      sum += error * error;
      ++count;
    }
    point.error /= static_cast<double>(point.track.size());
    out.points.push_back(std::move(point));
  }
  out.rms = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

/// What is solved from: what photographs share.
struct Matched {
  std::vector<PhotoPair> pairs;
  std::vector<Track> tracks;
};

PoseSolution solve(const std::vector<UnposedPhoto>& photos,
                   const Matched& matched,
                   const Progress& progress) {
  const std::vector<LensPrior> priors = lens_priors(photos);
  refuse_turned_only(photos, priors, matched.pairs);
  constexpr double kPlaced = 0.6;  // of the time
  PlacedPhotos attempt = place_at_best_focal(
      photos, priors, matched.pairs, matched.tracks, part_of(progress, 0, kPlaced));
  if (!attempt.begun) throw NumericalError(unexplained_matches(photos, matched.pairs));
  Reconstruction scene = std::move(attempt.scene);
  scene.tracks = photos.size() <= kAllCompared
                     ? matched.tracks
                     : sample_tracks(matched.tracks, kTracksPerPhoto * photos.size());
  place_more(
      scene, priors, *attempt.begun, photos.size(), [&](double) { report(progress, kPlaced); });
  refine_observations(photos, scene, [&](double) { report(progress, kPlaced); });
  const std::vector<double> sigmas =
      polish_with_shape(priors, *attempt.begun, part_of(progress, kPlaced, 1), scene);
  refuse_unsure(photos, priors, matched.pairs, scene, sigmas);
  move_to_first(scene);

  PoseSolution out;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Lens lens = scene.lens(static_cast<int>(i));
    out.photos.push_back(scene.poses[i] ? solved_photo(photos[i], lens, *scene.poses[i])
                                        : SolvedPhoto{});
    out.photos.back().focal_sigma = kOptimism * sigmas[static_cast<size_t>(photos[i].lens)];
  }
  add_points(photos, scene, out);
  return out;
}

// Whether the focal length of a photograph in a solution is three sigma off what was stated.
bool is_contradicted(const UnposedPhoto& photo, const SolvedPhoto& solved, double sigma) {
  constexpr double kRefutingSigmas = 3;
  if (!solved.is_placed || !(photo.focal_sigma > 0)) return false;
  return std::abs(std::log(solved.camera.fx / photo.focal)) > kRefutingSigmas * sigma;
}

// Whether a solution that did not know the stated focal lengths contradicts one of them: one that
// hardly tells them contradicts none.
bool contradicts(const PoseSolution& solution, const std::vector<UnposedPhoto>& photos) {
  for (size_t i = 0; i < photos.size(); ++i) {
    const SolvedPhoto& solved = solution.photos[i];
    const double sigma = std::hypot(photos[i].focal_sigma, solved.focal_sigma);
    if (is_contradicted(photos[i], solved, sigma)) return true;
  }
  return false;
}

// The photographs without the focal lengths that a solution lies three sigma away from, if any.
std::optional<std::vector<UnposedPhoto>> without_refuted(const std::vector<UnposedPhoto>& photos,
                                                         const PoseSolution& solution) {
  std::vector<UnposedPhoto> out = photos;
  bool any = false;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (!is_contradicted(photos[i], solution.photos[i], photos[i].focal_sigma)) continue;
    any = true;
    for (UnposedPhoto& photo : out) {
      if (photo.lens == photos[i].lens) photo.focal = photo.focal_sigma = 0;
    }
  }
  if (!any) return std::nullopt;
  return out;
}

// The photographs without any focal length that may be wrong, if there is one.
std::optional<std::vector<UnposedPhoto>> without_stated(const std::vector<UnposedPhoto>& photos) {
  std::vector<UnposedPhoto> out = photos;
  bool any = false;
  for (UnposedPhoto& photo : out) {
    if (!(photo.focal_sigma > 0)) continue;
    photo.focal = photo.focal_sigma = 0;
    any = true;
  }
  if (!any) return std::nullopt;
  return out;
}

// The photographs with a typical focal length where nothing is known of theirs.
std::vector<UnposedPhoto> with_typical(const std::vector<UnposedPhoto>& photos) {
  std::vector<UnposedPhoto> out = photos;
  for (UnposedPhoto& photo : out) {
    if (photo.focal > 0) continue;
    photo.focal = kTypicalFocal * std::max(photo.width, photo.height);
    photo.focal_sigma = kTypicalSigma;
  }
  return out;
}

// As solve(); where that cannot tell the focal length, with one that is typical of cameras.
// \throws NumericalError as solve() if that does not help either
PoseSolution solve_or_assume(const std::vector<UnposedPhoto>& photos,
                             const Matched& matched,
                             const Progress& progress) {
  std::exception_ptr undetermined;
  try {
    return solve(photos, matched, part_of(progress, 0, 0.8));
  } catch (const WithRemedy<NumericalError>&) {
    undetermined = std::current_exception();
  }
  try {
    PoseSolution out = solve(with_typical(photos), matched, part_of(progress, 0.8, 1));
    for (size_t i = 0; i < photos.size(); ++i) {
      out.photos[i].is_assumed = out.photos[i].is_placed && photos[i].focal == 0;
    }
    return out;
  } catch (const NumericalError&) {
    std::rethrow_exception(undetermined);
  }
}

}  // namespace

PoseSolution solve_poses(const std::vector<UnposedPhoto>& photos, const Progress& progress) {
  require(photos.size() >= 2, "poses need at least 2 photographs", photos.size());
  Matched matched;
  matched.pairs = match_photos(photos, part_of(progress, 0, 0.5));
  refuse_unconnected(photos, matched.pairs);
  matched.tracks = chain_matches(photos, matched.pairs);
  report(progress, 0.5);
  PoseSolution out;
  std::optional<std::vector<UnposedPhoto>> relaxed;
  std::exception_ptr failure;
  try {
    out = solve_or_assume(photos, matched, part_of(progress, 0.5, 0.9));
    relaxed = without_refuted(photos, out);
  } catch (const NumericalError&) {
    failure = std::current_exception();
    relaxed = without_stated(photos);  // a lens far from what is stated may be why
    if (!relaxed) throw;
  }
  if (relaxed) {
    try {
      PoseSolution free = solve(*relaxed, matched, part_of(progress, 0.9, 1));
      if (!failure && !contradicts(free, photos)) {
        report(progress, 1);
        return out;  // what was stated is the better measurement of the two
      }
      out = std::move(free);
      for (size_t i = 0; i < photos.size(); ++i) {
        out.photos[i].is_refuted = photos[i].focal > 0 && (*relaxed)[i].focal == 0;
      }
    } catch (const NumericalError&) {
      if (failure) std::rethrow_exception(failure);
      // the photographs tell less than what was known of the lens: that stays
    }
  }
  report(progress, 1);
  return out;
}

}  // namespace cgs
