// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/photo_pairs.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"

namespace cgs {

namespace {

constexpr double kEpipolarError = 2.5;  // [working pixels]

Eigen::Vector2d from_centre(const UnposedPhoto& photo, int feature) {
  const Eigen::Vector2d centre(0.5 * photo.width, 0.5 * photo.height);
  return (photo.features.points[static_cast<size_t>(feature)] - centre) / photo.features.pixel;
}

bool shows_no_photo_twice(const Track& track) {
  for (size_t i = 1; i < track.seen.size(); ++i) {
    if (track.seen[i].photo == track.seen[i - 1].photo) return false;
  }
  return track.seen.size() >= 2;
}

std::vector<PhotoPair> every_pair(size_t photos) {
  std::vector<PhotoPair> out;
  for (int a = 0; a < static_cast<int>(photos); ++a) {
    for (int b = a + 1; b < static_cast<int>(photos); ++b) out.push_back({a, b, {}, {}, false});
  }
  return out;
}

// The features of the highest contrast, which come first.
PhotoFeatures strongest(const PhotoFeatures& features) {
  constexpr Eigen::Index kStrongest = 600;  // descriptors
  PhotoFeatures out;
  out.points = features.points;
  const Eigen::Index rows = std::min(kStrongest, features.descriptors.rows());
  out.descriptors = features.descriptors.topRows(rows);
  if (!features.point_of.empty()) {
    out.point_of.assign(features.point_of.begin(), features.point_of.begin() + rows);
  }
  return out;
}

// The pairs worth a search among all features: those of the most matches among the strongest, a
// few per photograph, and photographs that follow each other.
std::vector<PhotoPair> likely_pairs(const std::vector<UnposedPhoto>& photos,
                                    const Progress& progress) {
  constexpr size_t kPerPhoto = 8;
  constexpr size_t kFewest = 5;  // matches; as many come by chance
  constexpr int kFollowing = 2;
  std::vector<PhotoFeatures> features;
  features.reserve(photos.size());
  for (const UnposedPhoto& photo : photos) features.push_back(strongest(photo.features));
  std::vector<PhotoPair> all = every_pair(photos.size());
  std::vector<size_t> score(all.size(), 0);
  SharedProgress compared(progress, all.size());
  tbb::parallel_for(size_t{0}, all.size(), [&](size_t i) {
    score[i] = match_features(features[static_cast<size_t>(all[i].a)],
                              features[static_cast<size_t>(all[i].b)])
                   .size();
    compared.advance();
  });
  std::vector<char> is_likely(all.size(), 0);
  for (int photo = 0; photo < static_cast<int>(photos.size()); ++photo) {
    std::vector<size_t> own;
    for (size_t i = 0; i < all.size(); ++i) {
      const bool shows = all[i].a == photo || all[i].b == photo;
      if (shows && score[i] >= kFewest) own.push_back(i);
      if (shows && all[i].b - all[i].a <= kFollowing) is_likely[i] = 1;
    }
    std::stable_sort(
        own.begin(), own.end(), [&](size_t x, size_t y) { return score[x] > score[y]; });
    own.resize(std::min(own.size(), kPerPhoto));
    for (const size_t i : own) is_likely[i] = 1;
  }
  std::vector<PhotoPair> out;
  for (size_t i = 0; i < all.size(); ++i) {
    if (is_likely[i] != 0) out.push_back(std::move(all[i]));
  }
  return out;
}

}  // namespace

PhotoPair match_pair(const UnposedPhoto& a, const UnposedPhoto& b, const Progress& progress) {
  const std::vector<FeatureMatch> matches = match_features(a.features, b.features, progress);
  MatchedPoints points;
  for (const FeatureMatch& m : matches) {
    points.a.push_back(from_centre(a, m.a));
    points.b.push_back(from_centre(b, m.b));
  }
  const std::vector<char> is_inlier = epipolar_inliers(points, kEpipolarError);
  PhotoPair pair{0, 1, {}, {}, false};
  for (size_t i = 0; i < matches.size(); ++i) {
    if (is_inlier[i] == 0) continue;
    pair.matches.push_back(matches[i]);
    pair.points.a.push_back(points.a[i]);
    pair.points.b.push_back(points.b[i]);
  }
  // Seven matches always fit; among wrong ones, a few per cent more do.
  constexpr double kLeastShare = 0.25;
  pair.is_connected = pair.matches.size() >= kFewestMatches &&
                      double(pair.matches.size()) >= kLeastShare * double(matches.size());
  return pair;
}

std::vector<PhotoPair> match_photos(const std::vector<UnposedPhoto>& photos,
                                    const Progress& progress) {
  constexpr double kChoosing = 0.1;  // of the time
  std::vector<PhotoPair> pairs = photos.size() <= kAllCompared
                                     ? every_pair(photos.size())
                                     : likely_pairs(photos, part_of(progress, 0, kChoosing));
  const Progress matching = part_of(progress, kChoosing, 1);  // outlives what shares it
  SharedProgress matched(matching, pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(), [&](size_t i) {
    const int a = pairs[i].a;
    const int b = pairs[i].b;
    pairs[i] = match_pair(photos[static_cast<size_t>(a)],
                          photos[static_cast<size_t>(b)],
                          [&](double) { matched.tell(); });
    pairs[i].a = a;
    pairs[i].b = b;
    matched.advance();
  });
  return pairs;
}

std::vector<Track> chain_matches(const std::vector<UnposedPhoto>& photos,
                                 const std::vector<PhotoPair>& pairs) {
  std::vector<uint32_t> first(photos.size() + 1, 0);  // feature of a photograph -> place in chains
  for (size_t i = 0; i < photos.size(); ++i) {
    first[i + 1] = first[i] + static_cast<uint32_t>(photos[i].features.points.size());
  }
  DisjointSets chains(first.back());
  for (const PhotoPair& pair : pairs) {
    if (!pair.is_connected) continue;
    for (const FeatureMatch& m : pair.matches) {
      chains.join(first[static_cast<size_t>(pair.a)] + static_cast<uint32_t>(m.a),
                  first[static_cast<size_t>(pair.b)] + static_cast<uint32_t>(m.b));
    }
  }
  std::vector<Track> of_root(first.back());
  for (size_t i = 0; i < photos.size(); ++i) {
    for (uint32_t k = 0; k < photos[i].features.points.size(); ++k) {
      const int feature = static_cast<int>(k);
      of_root[chains.root(first[i] + k)].seen.push_back(
          {static_cast<int>(i), feature, from_centre(photos[i], feature), true});
    }
  }
  std::erase_if(of_root, [](const Track& track) { return !shows_no_photo_twice(track); });
  return of_root;
}

}  // namespace cgs
