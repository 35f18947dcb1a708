// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/photo_pairs.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/unposed_photos.h"

namespace cgs::photo_pairs_test {
namespace {

// Photographs of points on a wall, each of which shows a part that goes on in the next ones.
std::vector<UnposedPhoto> along_a_wall(int count) {
  test::PointScene scene;
  for (int i = 0; i < count; ++i) {
    scene.cameras.push_back(
        test::looking_at({double(i), 0.1 * (i % 2), -6}, {double(i), 0, 0}, 800, 600, 900));
  }
  scene.points = test::scattered_points(120 * count, {0.5 * count + 3, 2, 0.8});
  for (Eigen::Vector3d& point : scene.points) point.x() += 0.5 * (count - 1);
  return test::unposed_photos(scene);
}

bool is_among(const std::vector<PhotoPair>& pairs, int a, int b) {
  return std::any_of(pairs.begin(), pairs.end(), [&](const PhotoPair& pair) {
    return pair.a == a && pair.b == b && pair.is_connected;
  });
}

TEST(MatchPhotos, ComparesEveryPairOfFew) {
  const int count = static_cast<int>(kAllCompared);
  EXPECT_EQ(match_photos(along_a_wall(count), {}).size(), size_t(count) * (count - 1) / 2);
}

TEST(MatchPhotos, ComparesThoseOfManyThatShowTheSame) {
  constexpr int kCount = 24;
  const std::vector<PhotoPair> pairs = match_photos(along_a_wall(kCount), {});
  EXPECT_LT(pairs.size(), size_t{kCount} * (kCount - 1) / 4);
  for (int i = 0; i + 2 < kCount; ++i) {
    EXPECT_TRUE(is_among(pairs, i, i + 1)) << i;
    EXPECT_TRUE(is_among(pairs, i, i + 2)) << i;
  }
  for (const PhotoPair& pair : pairs) EXPECT_LT(pair.a, pair.b);
}

// A walk around ends where it began: what lies apart by name may show the same.
TEST(MatchPhotos, FindsWhatIsFarApartByName) {
  constexpr int kCount = 24;
  std::vector<UnposedPhoto> photos = along_a_wall(kCount);
  std::swap(photos[1], photos[20]);
  const std::vector<PhotoPair> pairs = match_photos(photos, {});
  EXPECT_TRUE(is_among(pairs, 0, 20));
  EXPECT_TRUE(is_among(pairs, 1, 19));
}

}  // namespace
}  // namespace cgs::photo_pairs_test
