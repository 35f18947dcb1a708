// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/core/progress.h"
#include "libcgs/poses/reconstruction.h"
#include "libcgs/poses/two_view.h"
#include "libcgs/poses/unposed_photo.h"

namespace cgs {

/// Two photographs and the matches that one epipolar geometry explains.
struct PhotoPair {
  int a = 0;
  int b = 0;
  std::vector<FeatureMatch> matches;
  MatchedPoints points;       ///< Of the matches.
  bool is_connected = false;  ///< More matches than chance brings.
};

/// Fewest matches that say that two photographs show the same.
inline constexpr size_t kFewestMatches = 24;

/// Matches one pair, which is then (0, 1).
PhotoPair match_pair(const UnposedPhoto& a, const UnposedPhoto& b, const Progress& progress = {});

/// Most photographs of which every pair is matched.
inline constexpr size_t kAllCompared = 12;

/// Matches pairs a < b: all of them, or, of more than kAllCompared photographs, those whose
/// strongest features match best, a few for each photograph.
/// Source: Wu 2013, "Towards Linear-Time Incremental Structure from Motion", section 3 (preemptive
///         matching; there by features of the largest scale).
std::vector<PhotoPair> match_photos(const std::vector<UnposedPhoto>& photos,
                                    const Progress& progress);

/// Chains the matches of connected pairs into tracks. Those with two places in one photograph are
/// left out.
std::vector<Track> chain_matches(const std::vector<UnposedPhoto>& photos,
                                 const std::vector<PhotoPair>& pairs);

}  // namespace cgs
