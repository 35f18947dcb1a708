// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/resection.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/unposed_photos.h"

namespace cgs::resection_test {
namespace {

constexpr int kPhotos = 5;
constexpr double kFocal = 900;

// What five cameras in an arc see of points, without noise, and their poses.
struct Arc {
  Reconstruction scene;  // without poses
  std::vector<PhotoPose> truth;
  std::vector<PhotoPair> pairs;
  std::vector<LensPrior> priors = {{kFocal, 0, 1200}};
};

Arc arc() {
  Arc out;
  out.scene.lenses = {{kFocal, 0, {0, 0}}};
  for (int i = 0; i < kPhotos; ++i) {
    const double x = i - 2.0;
    const Camera camera = test::looking_at({x, 0.2 * x * x, -7}, {0, 0, 0}, 1200, 900, kFocal);
    const Eigen::Isometry3d pose = camera.cam_from_world();
    out.truth.push_back({Eigen::Quaterniond(pose.rotation()), pose.translation()});
    out.scene.lens_of.push_back(0);
  }
  out.scene.poses.resize(kPhotos);
  for (const Eigen::Vector3d& point : test::scattered_points(120, {2, 1.5, 1.5})) {
    Track track;
    for (int i = 0; i < kPhotos; ++i) {
      track.seen.push_back({i, 0, kFocal * (out.truth[size_t(i)] * point).hnormalized(), true});
    }
    out.scene.tracks.push_back(track);
  }
  for (int a = 0; a < kPhotos; ++a) {
    for (int b = a + 1; b < kPhotos; ++b) {
      PhotoPair pair{a, b, {}, {}, true};
      pair.matches.resize(out.scene.tracks.size());
      for (const Track& track : out.scene.tracks) {
        pair.points.a.push_back(track.seen[size_t(a)].at);
        pair.points.b.push_back(track.seen[size_t(b)].at);
      }
      out.pairs.push_back(pair);
    }
  }
  return out;
}

// Rotation from one camera to another, which no choice of the world changes.
double turn_off(const Arc& arc, const Reconstruction& scene, size_t a, size_t b) {
  const Eigen::Quaterniond is = scene.poses[b]->rotation * scene.poses[a]->rotation.conjugate();
  return is.angularDistance(arc.truth[b].rotation * arc.truth[a].rotation.conjugate());
}

TEST(PlacePhotos, PlacesAllOfThemFromAnyPair) {
  Arc arc = resection_test::arc();
  const PlacedPhotos placed = place_photos(arc.scene, arc.priors, arc.pairs, kPhotos);
  ASSERT_TRUE(placed.begun);
  arc.scene = placed.scene;
  EXPECT_EQ(placed.error, capped_error(arc.scene));
  EXPECT_LT(placed.error, 1e-6);
  for (size_t i = 0; i < kPhotos; ++i) {
    ASSERT_TRUE(arc.scene.poses[i]) << i;
    EXPECT_LT(turn_off(arc, arc.scene, 0, i), 1e-5) << i;
    EXPECT_EQ(points_in(arc.scene, int(i)), int(arc.scene.tracks.size()));
  }
}

TEST(PlacePhotos, StopsWhereEnoughArePlacedAndGoesOnFromThere) {
  Arc arc = resection_test::arc();
  const PlacedPhotos three = place_photos(arc.scene, arc.priors, arc.pairs, 3);
  ASSERT_TRUE(three.begun);
  arc.scene = three.scene;
  const auto placed = [&] {
    return std::count_if(arc.scene.poses.begin(), arc.scene.poses.end(), [](const auto& pose) {
      return pose.has_value();
    });
  };
  EXPECT_EQ(placed(), 3);
  place_more(arc.scene, arc.priors, *three.begun, kPhotos);
  EXPECT_EQ(placed(), kPhotos);
  EXPECT_LT(capped_error(arc.scene), 1e-6);
}

TEST(PlacePhotos, LeavesOutAPhotographThatFitsNowhere) {
  Arc arc = resection_test::arc();
  const std::vector<Eigen::Vector3d> elsewhere =
      test::scattered_points(2 * int(arc.scene.tracks.size()), {400, 400, 400});
  for (size_t k = 0; k < arc.scene.tracks.size(); ++k) {
    arc.scene.tracks[k].seen[4].at = elsewhere[2 * k + 1].head<2>();
  }
  std::erase_if(arc.pairs, [](const PhotoPair& pair) { return pair.b == 4; });
  const PlacedPhotos placed = place_photos(arc.scene, arc.priors, arc.pairs, kPhotos);
  EXPECT_FALSE(placed.scene.poses[4]);
  EXPECT_TRUE(placed.scene.poses[3]);
}

TEST(PlacePhotos, PlacesNothingWithoutAPairThatMoved) {
  Arc arc = resection_test::arc();
  for (PhotoPair& pair : arc.pairs) pair.points.b = pair.points.a;
  const PlacedPhotos placed = place_photos(arc.scene, arc.priors, arc.pairs, kPhotos);
  EXPECT_FALSE(placed.begun);
  for (const auto& pose : placed.scene.poses) EXPECT_FALSE(pose);
}

TEST(PlacePhotos, GivesTheSameForAnyNumberOfThreads) {
  const Arc arc = resection_test::arc();
  const PlacedPhotos several = place_photos(arc.scene, arc.priors, arc.pairs, kPhotos);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const PlacedPhotos single = place_photos(arc.scene, arc.priors, arc.pairs, kPhotos);
  ASSERT_TRUE(several.begun && single.begun);
  EXPECT_EQ(several.begun->first, single.begun->first);
  EXPECT_EQ(several.begun->second, single.begun->second);
  for (size_t i = 0; i < kPhotos; ++i) {
    EXPECT_EQ(several.scene.poses[i]->translation, single.scene.poses[i]->translation) << i;
  }
}

}  // namespace
}  // namespace cgs::resection_test
