// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/markers.h"

#include <gtest/gtest.h>

#include "tests/support/marker_photo.h"

namespace cgs::markers_test {
namespace {

using test::PrintedMarker;

const Camera kCamera = {480, 360, 450, 450, 240, 180, Eigen::Isometry3d::Identity()};

PrintedMarker marker_at(const Eigen::Vector3d& place, int number, double tilt = 0.4) {
  PrintedMarker out;
  out.number = number;
  out.side = 0.3;
  out.world_from_paper = Eigen::Translation3d(place) *
                         Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.3, 1, 0.2).normalized());
  return out;
}

// Where the corners really are, in the order of Marker.
std::array<Eigen::Vector2d, 4> true_corners(const PrintedMarker& marker) {
  std::array<Eigen::Vector2d, 4> out;
  const double h = marker.side / 2;
  const std::array<Eigen::Vector3d, 4> corners = {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
  for (size_t k = 0; k < 4; ++k) {
    out.at(k) = kCamera.project(marker.world_from_paper * corners.at(k)).head<2>();
  }
  return out;
}

TEST(FindMarkers, FindsEveryFamilyToAFifthOfAPixel) {
  const std::vector<std::pair<cv::aruco::PREDEFINED_DICTIONARY_NAME, std::string>> families = {
      {cv::aruco::DICT_APRILTAG_36h11, "AprilTag 36h11 7"},
      {cv::aruco::DICT_4X4_50, "ArUco 4x4 7"},
      {cv::aruco::DICT_5X5_100, "ArUco 5x5 7"},
      {cv::aruco::DICT_6X6_250, "ArUco 6x6 7"},
      {cv::aruco::DICT_ARUCO_ORIGINAL, "ArUco original 7"}};
  for (const auto& [dictionary, name] : families) {
    PrintedMarker printed = marker_at({0.07, -0.04, 1.1}, 7);
    printed.dictionary = dictionary;
    const std::vector<Marker> found = find_markers(test::photograph_of({printed}, kCamera));
    ASSERT_EQ(found.size(), 1u) << name;
    EXPECT_EQ(found[0].name, name);
    const auto truth = true_corners(printed);
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_LT((found[0].corners.at(k) - truth.at(k)).norm(), 0.3) << name << " corner " << k;
    }
  }
}

// The corners' errors over many poses: what marker_bars() takes for their sigma must hold.
TEST(FindMarkers, CornersAreWithinTheirSigma) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0;
  int count = 0;
  for (int i = 0; i < 12; ++i) {
    const PrintedMarker printed =
        marker_at({0.03 * i - 0.15, 0.02 * (i % 5) - 0.03, 1 + 0.07 * i}, i, 0.1 * i - 0.5);
    const auto truth = true_corners(printed);
    for (const Marker& marker : find_markers(test::photograph_of({printed}, kCamera))) {
      for (size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d error = marker.corners.at(k) - truth.at(k);
        sum += error;
        squares += error.squaredNorm();
        ++count;
      }
    }
  }
  ASSERT_GE(count, 40);
  EXPECT_LT((sum / count).norm(), 0.1);
  EXPECT_LT(std::sqrt(squares / (2 * count)), 0.2);
  std::printf("corners: rms %.3f pixels, mean %.3f %.3f\n",
              std::sqrt(squares / (2 * count)),
              sum.x() / count,
              sum.y() / count);
}

TEST(FindMarkers, LeavesOutWhatIsThereTwiceAndFindsNoneInNone) {
  std::vector<PrintedMarker> printed = {marker_at({-0.25, 0.1, 1.1}, 3),
                                        marker_at({0.25, 0.1, 1.1}, 3),
                                        marker_at({0, -0.25, 1.1}, 4)};
  for (PrintedMarker& marker : printed) marker.side = 0.2;
  const auto found = find_markers(test::photograph_of(printed, kCamera));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].name, "AprilTag 36h11 4");
  EXPECT_TRUE(find_markers(test::photograph_of({}, kCamera)).empty());
}

}  // namespace
}  // namespace cgs::markers_test
