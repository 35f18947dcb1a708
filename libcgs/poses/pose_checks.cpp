// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/pose_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "libcgs/core/angle_between.h"
#include "libcgs/poses/resection.h"

namespace cgs {

namespace {

std::string name_of(const std::vector<UnposedPhoto>& photos, int photo) {
  return printable(photos[static_cast<size_t>(photo)].name);
}

std::string names_of(const std::vector<UnposedPhoto>& photos, const PhotoPair& pair) {
  return name_of(photos, pair.a) + " and " + name_of(photos, pair.b);
}

const PhotoPair& strongest(const std::vector<PhotoPair>& pairs) {
  return *std::max_element(pairs.begin(), pairs.end(), [](const PhotoPair& a, const PhotoPair& b) {
    return a.matches.size() < b.matches.size();
  });
}

std::string decimals(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

// The least that turning the camera leaves unexplained, over focal lengths where none is known.
double least_parallax(const PhotoPair& pair, const LensPrior& prior_a, const LensPrior& prior_b) {
  constexpr double kShortest = 0.3;  // [larger sides]
  constexpr double kStep = 1.05;
  constexpr int kSteps = 54;  // up to 4
  const bool is_known = prior_a.focal > 0 && prior_b.focal > 0;
  double least = parallax(pair.points,
                          is_known ? prior_a.focal : kShortest * prior_a.side,
                          is_known ? prior_b.focal : kShortest * prior_b.side);
  double focal = kShortest;
  for (int i = 0; i < kSteps && !is_known; ++i) {
    focal *= kStep;
    least = std::min(least, parallax(pair.points, focal * prior_a.side, focal * prior_b.side));
  }
  return least;
}

// Share of the matches of connected pairs that lie on one plane per pair.
double share_on_planes(const std::vector<PhotoPair>& pairs) {
  size_t on_plane = 0;
  size_t all = 0;
  for (const PhotoPair& pair : pairs) {
    if (!pair.is_connected) continue;
    const std::vector<char> is_inlier = homography_inliers(pair.points, kMostError);
    on_plane += static_cast<size_t>(std::count(is_inlier.begin(), is_inlier.end(), char{1}));
    all += is_inlier.size();
  }
  return all > 0 ? double(on_plane) / double(all) : 0;
}

// Whether the axes of two placed photographs are further apart than 90 degrees and than either
// picture is wide: what faces one camera turns its back on the other.
bool look_apart(const Reconstruction& scene, const std::vector<LensPrior>& priors, int a, int b) {
  constexpr double kMost = std::numbers::pi / 2;
  const auto axis = [&](int photo) {
    return scene.pose(photo)->rotation.conjugate() * Eigen::Vector3d::UnitZ();
  };
  const auto width = [&](int photo) {
    const LensPrior& prior = priors[static_cast<size_t>(scene.lens_of[static_cast<size_t>(photo)])];
    return 2 * std::atan(prior.side / 2 / scene.lens(photo).focal);
  };
  return angle_between(axis(a), axis(b)) > std::max({kMost, width(a), width(b)});
}

// Placed photographs that look apart from all with which they share points of the solution.
std::vector<int> turned_away(const Reconstruction& scene, const std::vector<LensPrior>& priors) {
  enum : char { Alone, Apart, Beside };
  std::vector<char> placed(scene.poses.size(), Alone);
  for (const Track& track : scene.tracks) {
    if (!track.is_known) continue;
    for (const Observation& a : track.seen) {
      for (const Observation& b : track.seen) {
        if (a.photo == b.photo || !a.is_used || !b.is_used) continue;
        if (!scene.pose(a.photo) || !scene.pose(b.photo)) continue;
        char& found = placed[static_cast<size_t>(a.photo)];
        if (found != Beside) found = look_apart(scene, priors, a.photo, b.photo) ? Apart : Beside;
      }
    }
  }
  std::vector<int> out;
  for (size_t i = 0; i < placed.size(); ++i) {
    if (placed[i] == Apart) out.push_back(static_cast<int>(i));
  }
  return out;
}

}  // namespace

void refuse_unconnected(const std::vector<UnposedPhoto>& photos,
                        const std::vector<PhotoPair>& pairs) {
  const UnposedPhoto* poor = nullptr;
  size_t rich = 0;
  for (const UnposedPhoto& photo : photos) {
    if (photo.features.points.size() >= kFewestMatches) {
      ++rich;
    } else {
      poor = &photo;
    }
  }
  if (rich < 2) {
    throw NumericalError(
        "photograph " + printable(poor->name) +
        " shows too little to find again: " + std::to_string(poor->features.points.size()) +
        " distinct points, need " + std::to_string(kFewestMatches) +
        "; sharp photographs of surface with texture have thousands");
  }
  const auto is_connected = [](const PhotoPair& pair) { return pair.is_connected; };
  if (std::any_of(pairs.begin(), pairs.end(), is_connected)) return;
  const PhotoPair& best = strongest(pairs);
  throw NumericalError("the photographs overlap too little: those that share most, " +
                       names_of(photos, best) + ", have " + std::to_string(best.matches.size()) +
                       " points in common, need " + std::to_string(kFewestMatches));
}

void refuse_turned_only(const std::vector<UnposedPhoto>& photos,
                        const std::vector<LensPrior>& priors,
                        const std::vector<PhotoPair>& pairs) {
  double most = 0;
  for (const PhotoPair& pair : pairs) {
    if (!pair.is_connected) continue;
    const auto prior = [&](int photo) -> const LensPrior& {
      return priors[static_cast<size_t>(photos[static_cast<size_t>(photo)].lens)];
    };
    most = std::max(most, least_parallax(pair, prior(pair.a), prior(pair.b)));
    if (most >= kLeastParallax) return;
  }
  throw NumericalError(
      "the camera was turned but hardly moved: apart from turning, the median point moves by " +
      decimals(most, 1) + " pixels of 1/1600 of the picture, need " + decimals(kLeastParallax, 1) +
      "; take photographs from different places");
}

void refuse_unsure(const std::vector<UnposedPhoto>& photos,
                   const std::vector<LensPrior>& priors,
                   const std::vector<PhotoPair>& pairs,
                   const Reconstruction& scene,
                   const std::vector<double>& focal_sigmas) {
  size_t known = 0;
  size_t all = 0;  // of photographs that are not placed nothing can fit
  for (const Track& track : scene.tracks) {
    const auto placed =
        std::count_if(track.seen.begin(), track.seen.end(), [&](const Observation& s) -> bool {
          return scene.pose(s.photo).has_value();
        });
    if (placed < 2) continue;
    ++all;
    known += track.is_known ? 1 : 0;
  }
  constexpr double kLeastShare = 0.3;
  if (double(known) < std::max(kLeastShare * double(all), 12.0)) {
    throw NumericalError(unexplained_matches(photos, pairs) + " (" + std::to_string(known) +
                         " of " + std::to_string(all) + " points fit)");
  }
  constexpr double kMostSigma = 0.1;
  constexpr double kShortest = 0.32;  // [larger sides] phones' widest lenses have 0.36,
  constexpr double kLongest = 8;      // telephoto lenses of 300 mm 8.3
  for (size_t lens = 0; lens < priors.size(); ++lens) {
    if (priors[lens].focal > 0) continue;  // its sigma is as wide as what was known, at most
    const double focal = scene.lenses[lens].focal / priors[lens].side;
    if (!(focal >= kShortest && focal <= kLongest)) {
      constexpr double kFilm = 36;  // [mm] wide
      throw undetermined_focal(
          pairs, "they ask for a lens of " + decimals(kFilm * focal, 0) + " mm as on film");
    }
    if (focal_sigmas[lens] <= kMostSigma) continue;
    throw undetermined_focal(
        pairs,
        std::isfinite(focal_sigmas[lens])
            ? "uncertain by " + decimals(100 * kOptimism * focal_sigmas[lens], 0) + " %"
            : "");
  }
  const std::vector<int> away = turned_away(scene, priors);
  const auto placed = std::count_if(
      scene.poses.begin(), scene.poses.end(), [](const auto& pose) { return pose.has_value(); });
  if (!away.empty() && 3 * away.size() >= static_cast<size_t>(placed)) {
    throw NumericalError(unexplained_matches(photos, pairs) + " (" + name_of(photos, away.front()) +
                         " would look in quite another direction than the others)");
  }
}

WithRemedy<NumericalError> undetermined_focal(const std::vector<PhotoPair>& pairs,
                                              const std::string& detail) {
  constexpr double kPlanar = 0.9;
  const bool is_planar = share_on_planes(pairs) >= kPlanar;
  const std::string text = std::string("the focal length cannot be told from these photographs") +
                           (is_planar ? ", since what they share lies in one plane" : "") +
                           (detail.empty() ? "" : " (" + detail + ")") + "; state it, in pixels";
  return WithRemedy<NumericalError>(Remedy::FocalLength, text);
}

std::string unexplained_matches(const std::vector<UnposedPhoto>& photos,
                                const std::vector<PhotoPair>& pairs) {
  return "no placement of cameras explains what " + names_of(photos, strongest(pairs)) +
         " have in common; things may have moved, or the lens distorts too much";
}

}  // namespace cgs
