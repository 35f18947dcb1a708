// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/focal_search.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/remedy_of_refusal.h"
#include "tests/support/unposed_photos.h"

namespace cgs::focal_search_test {
namespace {

constexpr double kWidth = 1200;

// Three photographs of a box full of points, each with a lens of its own.
test::PointScene three_lenses(const std::vector<double>& focals) {
  test::PointScene scene;
  const std::vector<Eigen::Vector3d> places = {
      {-1.5, 0.2, -6}, {0.1, -0.4, -6.5}, {1.6, 0.3, -5.8}};
  for (size_t i = 0; i < places.size(); ++i) {
    Eigen::Vector3d place = places[i];
    place.z() *= focals[i] / 900;  // fills the picture
    scene.cameras.push_back(
        test::looking_at(place, {0.1 * place.x(), 0.05, 0}, int(kWidth), 900, focals[i]));
  }
  scene.points = test::scattered_points(500, {2.5, 1.8, 1.5});
  return scene;
}

std::vector<UnposedPhoto> photos_of(const test::PointScene& scene) {
  std::vector<UnposedPhoto> photos = test::unposed_photos(scene);
  for (size_t i = 0; i < photos.size(); ++i) photos[i].lens = static_cast<int>(i);
  return photos;
}

PlacedPhotos placed(const std::vector<UnposedPhoto>& photos) {
  std::vector<LensPrior> priors;
  for (const UnposedPhoto& photo : photos) {
    priors.push_back({0, 0, kWidth / photo.features.pixel});
  }
  const std::vector<PhotoPair> pairs = match_photos(photos, {});
  return place_at_best_focal(photos, priors, pairs, chain_matches(photos, pairs), {});
}

// As of photographs by three people, or of postcards. What begins at one focal length for all must
// not end at a wrong one of each.
TEST(FocalSearch, FindsThoseOfSeveralLenses) {
  const std::vector<double> focals = {620, 1500, 950};
  const std::vector<UnposedPhoto> photos = photos_of(three_lenses(focals));
  const PlacedPhotos best = placed(photos);
  ASSERT_TRUE(best.begun);
  for (size_t i = 0; i < focals.size(); ++i) {
    ASSERT_TRUE(best.scene.poses[i]) << i;
    const double focal = best.scene.lenses[i].focal * photos[i].features.pixel;
    EXPECT_LT(std::abs(std::log(focal / focals[i])), 0.1) << i;
  }
  EXPECT_LT(best.error, 1);
}

TEST(FocalSearch, RefusesWhereAPlaneTellsNone) {
  test::PointScene scene = three_lenses({900, 900, 900});
  for (Eigen::Vector3d& p : scene.points) p.z() = 0.2 * p.x();
  scene.cameras.pop_back();
  std::vector<UnposedPhoto> photos = photos_of(scene);
  EXPECT_EQ(test::remedy_of_refusal([&] { placed(photos); }), Remedy::FocalLength);
}

TEST(FocalSearch, SamplesTheLongestTracksAndAllOthersEvenly) {
  std::vector<Track> tracks(100);
  for (size_t i = 0; i < tracks.size(); ++i) {
    tracks[i].position.x() = double(i);
    tracks[i].seen.resize(i < 10 ? 3 : 2);
  }
  const std::vector<Track> some = sample_tracks(tracks, 20);
  ASSERT_EQ(some.size(), 20u);
  EXPECT_EQ(
      std::count_if(
          some.begin(), some.end(), [](const Track& track) { return track.seen.size() == 3; }),
      10);
  std::set<double> places;
  for (const Track& track : some) places.insert(track.position.x());
  EXPECT_EQ(places.size(), 20u) << "none twice";
  EXPECT_GT(*places.rbegin(), 85) << "up to the end";
  EXPECT_EQ(sample_tracks(tracks, 1000).size(), 100u);
}

}  // namespace
}  // namespace cgs::focal_search_test
