// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/solve_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/priors/bundle_adjustment.h"
#include "libcgs/priors/photo_pairs.h"
#include "libcgs/priors/resection.h"

namespace cgs {

namespace {

// Focal lengths to begin with where nothing is known, in units of the larger side: from phones'
// widest lenses (13 mm as on film) to short telephoto lenses (115 mm).
constexpr std::array<double, 8> kFocals = {0.36, 0.5, 0.7, 0.9, 1.15, 1.5, 2.2, 3.2};

struct Solved {
  Reconstruction scene;
  FirstPair begun;
  std::vector<double> focal_sigma;  // per lens
};

double larger_side(const UnposedPhoto& photo) {
  return std::max(photo.width, photo.height) / photo.features.pixel;
}

std::vector<LensPrior> lens_priors(const std::vector<UnposedPhoto>& photos) {
  std::vector<LensPrior> priors;
  for (const UnposedPhoto& photo : photos) {
    const auto lens = static_cast<size_t>(photo.lens);
    if (priors.size() <= lens) priors.resize(lens + 1);
    priors[lens] = {photo.focal / photo.features.pixel, photo.focal_sigma};
  }
  return priors;
}

Reconstruction begin(const std::vector<UnposedPhoto>& photos,
                     const std::vector<LensPrior>& priors,
                     double focal_of_side) {
  Reconstruction scene;
  scene.lenses.resize(priors.size());
  scene.poses.resize(photos.size());
  for (const UnposedPhoto& photo : photos) {
    scene.lens_of.push_back(photo.lens);
    const LensPrior& prior = priors[static_cast<size_t>(photo.lens)];
    scene.lenses[static_cast<size_t>(photo.lens)] = {
        prior.focal > 0 ? prior.focal : focal_of_side * larger_side(photo), 0};
  }
  return scene;
}

// Up to `most` of the tracks, those that most photographs show first, else evenly.
std::vector<Track> sample(const std::vector<Track>& tracks, size_t most) {
  std::vector<Track> sorted = tracks;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Track& a, const Track& b) {
    return a.seen.size() > b.seen.size();
  });
  if (sorted.size() <= most) return sorted;
  const auto is_long = [](const Track& track) { return track.seen.size() > 2; };
  const auto longer = static_cast<size_t>(std::count_if(sorted.begin(), sorted.end(), is_long));
  const size_t from = std::max(most, std::min(longer, 2 * most));
  std::vector<Track> out;
  for (size_t i = 0; i < most; ++i) out.push_back(sorted[i * from / most]);
  return out;
}

// The focal length, in units of the larger side, from which a part of the points is explained best.
double best_focal(const std::vector<UnposedPhoto>& photos,
                  const std::vector<LensPrior>& priors,
                  const std::vector<PhotoPair>& pairs,
                  const std::vector<Track>& tracks) {
  constexpr size_t kTracks = 600;
  const std::vector<Track> some = sample(tracks, kTracks);
  std::array<double, kFocals.size()> error = {};
  std::array<double, kFocals.size()> found = {};
  tbb::parallel_for(size_t{0}, kFocals.size(), [&](size_t i) {
    Reconstruction scene = begin(photos, priors, kFocals[i]);
    scene.tracks = some;
    error[i] = std::numeric_limits<double>::infinity();
    const auto begun = place_photos(scene, priors, pairs);
    if (!begun) return;
    adjust_bundle(scene,
                  priors,
                  {.first = begun->first, .second = begun->second, .solve_focal = true});
    error[i] = capped_error(scene);
    for (const UnposedPhoto& photo : photos) {
      if (priors[static_cast<size_t>(photo.lens)].focal > 0) continue;
      found[i] = scene.lenses[static_cast<size_t>(photo.lens)].focal / larger_side(photo);
      break;
    }
    if (std::getenv("CGS_DEBUG_POSES")) fprintf(stderr, "focal %.3f -> %.4f error %.4f\n", kFocals[i], found[i], error[i]);
  });
  const auto best = static_cast<size_t>(std::min_element(error.begin(), error.end()) - error.begin());
  constexpr double kWidest = 0.2;
  constexpr double kLongest = 20;
  return found[best] > kWidest && found[best] < kLongest ? found[best] : kFocals[best];
}

// Rounds of adjusting everything and looking again what agrees.
void polish(const std::vector<LensPrior>& priors, bool solve_k1, Solved& solved) {
  BundleOptions options{.first = solved.begun.first,
                        .second = solved.begun.second,
                        .solve_focal = true,
                        .solve_k1 = solve_k1};
  for (const double most_error : {4.0, 3.0, 2.5, 2.5}) {
    triangulate(solved.scene, most_error, kLeastAngle);
    adjust_bundle(solved.scene, priors, options);
    drop_outliers(solved.scene, most_error, kLeastAngle);
  }
  options.most_iterations = 200;
  solved.focal_sigma = adjust_bundle(solved.scene, priors, options, true);
}

}  // namespace

PoseSolution solve_poses(const std::vector<UnposedPhoto>& photos, const Progress& progress) {
  require(photos.size() >= 2, "poses need at least 2 photographs", photos.size());
  const std::vector<LensPrior> priors = lens_priors(photos);
  const std::vector<PhotoPair> pairs = match_photos(photos, part_of(progress, 0, 0.5));
  if (std::getenv("CGS_DEBUG_POSES")) for (auto& p : pairs) fprintf(stderr, "pair %d %d: %zu %d\n", p.a, p.b, p.matches.size(), p.is_connected);
  const std::vector<Track> tracks = chain_matches(photos, pairs);
  const bool is_known = std::all_of(
      priors.begin(), priors.end(), [](const LensPrior& prior) { return prior.focal > 0; });
  const double focal = is_known ? 1 : best_focal(photos, priors, pairs, tracks);
  Solved solved{begin(photos, priors, focal), {}, {}};
  solved.scene.tracks = tracks;
  const auto begun = place_photos(solved.scene, priors, pairs);
  if (!begun) throw NumericalError("no pair of photographs could be placed");
  solved.begun = *begun;
  polish(priors, false, solved);
  if (std::getenv("CGS_DEBUG_POSES")) {
    Solved with = solved;
    polish(priors, true, with);
    fprintf(stderr, "f %.2f sigma %.5f error %.4f | k1: f %.2f sigma %.5f k1 %.5f error %.4f\n", solved.scene.lenses[0].focal, solved.focal_sigma[0], capped_error(solved.scene),
    with.scene.lenses[0].focal, with.focal_sigma[0], with.scene.lenses[0].k1, capped_error(with.scene));
  }
  PoseSolution out;
  out.photos.resize(photos.size());
  for (size_t i = 0; i < photos.size(); ++i) {
    SolvedPhoto& p = out.photos[i];
    const double unit = photos[i].features.pixel;
    const auto lens = static_cast<size_t>(photos[i].lens);
    p.is_placed = solved.scene.poses[i].has_value();
    p.width = photos[i].width;
    p.height = photos[i].height;
    p.focal = solved.scene.lenses[lens].focal * unit;
    p.k1 = solved.scene.lenses[lens].k1;
    p.focal_sigma = solved.focal_sigma[lens];
    if (!p.is_placed) continue;
    p.rotation = solved.scene.poses[i]->rotation;
    p.translation = solved.scene.poses[i]->translation;
  }
  for (const Track& track : solved.scene.tracks) {
    if (!track.is_known) continue;
    SolvedPoint point{track.position, {}, 0};
    for (const Sighting& s : track.seen) {
      if (s.is_used && solved.scene.pose(s.photo)) point.track.emplace_back(s.photo, s.feature);
    }
    out.points.push_back(point);
  }
  return out;
}

}  // namespace cgs
