// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/focal_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/poses/pose_checks.h"

namespace cgs {

namespace {

// Focal lengths to begin with where nothing is known, in units of the larger side: from phones'
// widest lenses (13 mm as on film) to short telephoto lenses (115 mm).
constexpr std::array<double, 8> kFocals = {0.36, 0.5, 0.7, 0.9, 1.15, 1.5, 2.2, 3.2};

// Whether focal lengths of several lenses may be quite others than known: then the starts, which
// are the same for all, are wrong for some.
bool are_vague(const std::vector<LensPrior>& priors) {
  constexpr double kVague = 0.1;  // sigma of log(focal)
  return std::count_if(priors.begin(), priors.end(), [](const LensPrior& prior) {
           return prior.focal == 0 || prior.sigma > kVague;
         }) > 1;
}

// \pre it has begun
void adjust_focal(const std::vector<LensPrior>& priors,
                  const Progress& progress,
                  PlacedPhotos& attempt) {
  const BundleOptions options{.first = attempt.begun->first,
                              .second = attempt.begun->second,
                              .solve_focal = true,
                              .progress = progress};
  if (are_vague(priors)) {
    // What does not fit at the focal lengths to begin with is needed to find the right ones.
    adjust_bundle(attempt.scene, priors, options);
    triangulate(attempt.scene, kMostError, least_angle(priors));
  }
  adjust_bundle(attempt.scene, priors, options);
  drop_outliers(attempt.scene, kMostError, least_angle(priors));
  attempt.error = capped_error(attempt.scene);
}

// \param start  without places
PlacedPhotos attempt_from(const Reconstruction& start,
                          const std::vector<LensPrior>& priors,
                          const std::vector<PhotoPair>& pairs,
                          size_t most_placed,
                          const Progress& progress) {
  PlacedPhotos out = place_photos(start, priors, pairs, most_placed, progress);
  if (out.begun) adjust_focal(priors, progress, out);
  return out;
}

// Where focal lengths are vague, begun again at those that were found.
// \param start  without lenses and places
PlacedPhotos attempt_at(double focal_of_side,
                        Reconstruction start,
                        const std::vector<LensPrior>& priors,
                        const std::vector<PhotoPair>& pairs,
                        size_t most_placed,
                        const Progress& progress) {
  for (const LensPrior& prior : priors) {
    start.lenses.push_back({prior.focal > 0 ? prior.focal : focal_of_side * prior.side, 0});
  }
  PlacedPhotos best = attempt_from(start, priors, pairs, most_placed, progress);
  constexpr int kMostAgain = 3;
  for (int again = 0; again < kMostAgain && best.begun && are_vague(priors); ++again) {
    start.lenses = best.scene.lenses;
    PlacedPhotos next = attempt_from(start, priors, pairs, most_placed, progress);
    if (next.error >= best.error) break;
    best = std::move(next);
  }
  return best;
}

// Share of the observations that a reconstruction has no point or no pose for.
double unexplained_share(const Reconstruction& scene) {
  size_t unexplained = 0;
  size_t all = 0;
  for (const Track& track : scene.tracks) {
    for (const Observation& s : track.seen) {
      ++all;
      unexplained += track.is_known && scene.pose(s.photo) ? 0 : 1;
    }
  }
  return all > 0 ? double(unexplained) / double(all) : 0;
}

// Whether a photograph of that lens has a pose; its focal length means nothing otherwise.
bool places_lens(const Reconstruction& scene, size_t lens) {
  for (size_t i = 0; i < scene.poses.size(); ++i) {
    if (scene.poses[i] && static_cast<size_t>(scene.lens_of[i]) == lens) return true;
  }
  return false;
}

// Whether the points are explained about as well at quite another focal length. What the best
// attempt explains counts: what nothing explains would make all look alike.
bool has_rival(const PlacedPhotos& best,
               const std::vector<PlacedPhotos>& attempts,
               const std::vector<LensPrior>& priors) {
  constexpr double kAsWell = 1.2;  // times the error; right solutions win by more
  const double kOther = std::log(1.2);
  const double common = kMostError * kMostError * unexplained_share(best.scene);
  const double most = common + kAsWell * (best.error - common);
  return std::any_of(attempts.begin(), attempts.end(), [&](const PlacedPhotos& attempt) {
    if (!attempt.begun || attempt.error > most) return false;
    for (size_t i = 0; i < priors.size(); ++i) {
      if (!places_lens(best.scene, i) || !places_lens(attempt.scene, i)) continue;
      const double ratio = attempt.scene.lenses[i].focal / best.scene.lenses[i].focal;
      if (priors[i].focal == 0 && std::abs(std::log(ratio)) > kOther) return true;
    }
    return false;
  });
}

}  // namespace

std::vector<Track> sample_tracks(const std::vector<Track>& tracks, size_t most) {
  std::vector<Track> sorted = tracks;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Track& a, const Track& b) {
    return a.seen.size() > b.seen.size();
  });
  if (sorted.size() <= most) return sorted;
  std::vector<Track> out;
  // Half of them the longest, which tie photographs together; half from all the rest.
  const size_t longest = most / 2;
  out.assign(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(longest));
  for (size_t i = 0; i < most - longest; ++i) {
    out.push_back(sorted[longest + i * (sorted.size() - longest) / (most - longest)]);
  }
  return out;
}

PlacedPhotos place_at_best_focal(const std::vector<UnposedPhoto>& photos,
                                 const std::vector<LensPrior>& priors,
                                 const std::vector<PhotoPair>& pairs,
                                 const std::vector<Track>& tracks,
                                 const Progress& progress) {
  constexpr size_t kTracks = 600;   // enough for few photographs
  constexpr size_t kPerPhoto = 50;  // of many
  Reconstruction start;
  start.tracks = sample_tracks(tracks, std::max(kTracks, kPerPhoto * photos.size()));
  for (const UnposedPhoto& photo : photos) {
    start.lens_of.push_back(photo.lens);
    start.turns.push_back(photo.turns);
  }
  start.poses.resize(photos.size());
  const bool is_known = std::all_of(
      priors.begin(), priors.end(), [](const LensPrior& prior) { return prior.focal > 0; });
  std::vector<PlacedPhotos> attempts(is_known ? 1 : kFocals.size());
  // A dozen photographs tell the focal length, and with whom to begin, as well as hundreds.
  const size_t all = photos.size();
  const size_t enough = std::min(all, kAllCompared);
  SharedProgress tried(progress, attempts.size() + (enough < all ? 1 : 0));
  const Progress tell = [&](double) { tried.tell(); };
  tbb::parallel_for(size_t{0}, attempts.size(), [&](size_t i) {
    attempts[i] = attempt_at(kFocals[i], start, priors, pairs, enough, tell);
    tried.advance();
  });
  PlacedPhotos& best = *std::min_element(attempts.begin(), attempts.end(), explains_more);
  if (best.begun && has_rival(best, attempts, priors)) {
    throw undetermined_focal(pairs, "several explain them equally well");
  }
  if (best.begun && enough < all) {
    place_more(best.scene, priors, *best.begun, all, tell);
    adjust_focal(priors, tell, best);
  }
  return std::move(best);
}

}  // namespace cgs
