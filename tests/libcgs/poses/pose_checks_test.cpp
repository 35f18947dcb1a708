// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/pose_checks.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"

namespace cgs::pose_checks_test {
namespace {

using test::message_of;

std::vector<UnposedPhoto> photos(const std::vector<size_t>& features) {
  std::vector<UnposedPhoto> out;
  for (size_t i = 0; i < features.size(); ++i) {
    UnposedPhoto photo;
    photo.name = "photo_" + std::to_string(i);
    photo.width = 1200;
    photo.height = 900;
    photo.features.points.resize(features[i]);
    out.push_back(photo);
  }
  return out;
}

PhotoPair pair_of(int a, int b, size_t matches, bool is_connected) {
  PhotoPair out{a, b, {}, {}, is_connected};
  out.matches.resize(matches);
  return out;
}

TEST(RefuseUnconnected, NamesAPhotographThatShowsTooLittle) {
  const std::string message = message_of([] {
    refuse_unconnected(photos({500, 7}), {pair_of(0, 1, 3, false)});
  });
  EXPECT_NE(message.find("photo_1 shows too little"), std::string::npos) << message;
  EXPECT_NE(message.find("7 distinct points, need 24"), std::string::npos) << message;
}

TEST(RefuseUnconnected, NamesThePairThatSharesMost) {
  const std::vector<PhotoPair> pairs = {
      pair_of(0, 1, 5, false), pair_of(0, 2, 19, false), pair_of(1, 2, 0, false)};
  const std::string message = message_of([&] { refuse_unconnected(photos({99, 99, 99}), pairs); });
  EXPECT_NE(message.find("photo_0 and photo_2"), std::string::npos) << message;
  EXPECT_NE(message.find("19 points in common"), std::string::npos) << message;
  EXPECT_NO_THROW(refuse_unconnected(photos({99, 99, 3}), {pair_of(0, 1, 60, true)}));
}

// So many tracks of photographs 0 and 1, of which so many are known, and others of 2 and 3.
Reconstruction solved(size_t known, size_t unknown, size_t of_others) {
  Reconstruction out;
  out.lenses = {{1000, 0, {0, 0}}};
  out.lens_of = {0, 0, 0, 0};
  out.poses = {PhotoPose{}, PhotoPose{}, std::nullopt, std::nullopt};
  const auto add = [&](int a, int b, bool is_known) {
    Track track;
    track.seen = {{a, 0, {0, 0}, true}, {b, 0, {0, 0}, true}};
    track.is_known = is_known;
    out.tracks.push_back(track);
  };
  for (size_t i = 0; i < known; ++i) add(0, 1, true);
  for (size_t i = 0; i < unknown; ++i) add(0, 1, false);
  for (size_t i = 0; i < of_others; ++i) add(2, 3, false);
  return out;
}

const std::vector<LensPrior> kAnyLens = {{0, 0, 1200}};
const std::vector<PhotoPair> kPairs = {pair_of(0, 1, 100, true)};

TEST(RefuseUnsure, CountsOnlyWhatPlacedPhotographsHaveInCommon) {
  const auto check = [](const Reconstruction& scene) {
    refuse_unsure(photos({99, 99, 99, 99}), kAnyLens, kPairs, scene, {0.01});
  };
  EXPECT_NO_THROW(check(solved(80, 20, 0)));
  EXPECT_NO_THROW(check(solved(80, 20, 900)));  // another room, of which no photograph was placed
  const std::string message = message_of([&] { check(solved(20, 80, 0)); });
  EXPECT_NE(message.find("20 of 100 points fit"), std::string::npos) << message;
  EXPECT_THROW(check(solved(11, 0, 0)), NumericalError);
}

TEST(RefuseUnsure, RefusesCamerasThatCouldNotShowTheSame) {
  const auto check = [](double degrees, double focal, int beside) {
    Reconstruction scene = solved(80, 20, 0);
    scene.lenses[0].focal = focal;
    const double angle = degrees * std::numbers::pi / 180;
    scene.poses[0]->rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY());
    for (int k = 0; k < beside; ++k) {  // look as photograph 1 does, and share a point with it
      scene.poses[static_cast<size_t>(2 + k)] = PhotoPose{};
      Track track;
      track.seen = {{1, 0, {0, 0}, true}, {2 + k, 0, {0, 0}, true}};
      track.is_known = true;
      scene.tracks.push_back(track);
    }
    refuse_unsure(photos({99, 99, 99, 99}), kAnyLens, kPairs, scene, {0.01});
  };
  EXPECT_NO_THROW(check(71, 1100, 0));
  EXPECT_THROW(check(95, 1100, 0), NumericalError);
  EXPECT_NO_THROW(check(95, 500, 0));  // 100 degrees wide
  const std::string message = message_of([&] { check(95, 1100, 1); });
  EXPECT_NE(message.find("photo_0 would look in quite another direction"), std::string::npos)
      << message;
  EXPECT_NO_THROW(check(95, 1100, 2));  // one of four
}

TEST(RefuseUnsure, AsksForAFocalLengthThatIsNotDetermined) {
  const auto check = [](double focal, double sigma, const std::vector<LensPrior>& priors) {
    Reconstruction scene = solved(80, 20, 0);
    scene.lenses[0].focal = focal;
    refuse_unsure(photos({99, 99, 99, 99}), priors, kPairs, scene, {sigma});
  };
  EXPECT_NO_THROW(check(1000, 0.02, kAnyLens));
  for (const double focal : {300.0, 12000.0}) {  // 9 and 360 mm as on film
    EXPECT_THROW(check(focal, 0.02, kAnyLens), WithRemedy<NumericalError>) << focal;
    EXPECT_NO_THROW(check(focal, 0.02, {{focal, 0.01, 1200}})) << focal;  // as stated
  }
  const std::string message = message_of([&] { check(1000, 0.2, kAnyLens); });
  EXPECT_NE(message.find("uncertain by 60 %"), std::string::npos) << message;
  EXPECT_NE(message.find("state it, in pixels"), std::string::npos) << message;
}

}  // namespace
}  // namespace cgs::pose_checks_test
