// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/markers.h"

#include <algorithm>
#include <map>

#include <opencv2/aruco.hpp>

namespace cgs {

namespace {

struct Family {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary;
};
// Of ArUco's sets the smaller ones hold the first markers of the larger ones, with more bits to
// spare between them.
constexpr std::array<Family, 5> kFamilies = {{{"AprilTag 36h11", cv::aruco::DICT_APRILTAG_36h11},
                                              {"ArUco 4x4", cv::aruco::DICT_4X4_50},
                                              {"ArUco 5x5", cv::aruco::DICT_5X5_100},
                                              {"ArUco 6x6", cv::aruco::DICT_6X6_250},
                                              {"ArUco original", cv::aruco::DICT_ARUCO_ORIGINAL}}};

cv::Mat grey_bytes(const ColorImage& image) {
  cv::Mat out(image.height, image.width, CV_8UC1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3f& c = image(x, y);
      const float luma = 0.299f * c.x() + 0.587f * c.y() + 0.114f * c.z();
      out.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255 * luma);
    }
  }
  return out;
}

}  // namespace

std::vector<Marker> find_markers(const ColorImage& image) {
  const cv::Mat grey = grey_bytes(image);
  const auto parameters = cv::aruco::DetectorParameters::create();
  // The others take the edge of paper with a narrow border for the marker on it.
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_APRILTAG;
  std::vector<Marker> found;
  std::map<std::string, int> count;
  for (const Family& family : kFamilies) {
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> numbers;
    const auto dictionary = cv::aruco::getPredefinedDictionary(family.dictionary);
    cv::aruco::detectMarkers(grey, dictionary, corners, numbers, parameters);
    for (size_t i = 0; i < numbers.size(); ++i) {
      Marker marker{std::string(family.name) + " " + std::to_string(numbers[i]), {}};
      for (size_t k = 0; k < 4; ++k) {
        const cv::Point2f& p = corners[i][k];
        marker.corners.at(k) = Eigen::Vector2d(p.x, p.y);  // this method has centres at +0.5
      }
      ++count[marker.name];
      found.push_back(std::move(marker));
    }
  }
  std::erase_if(found, [&](const Marker& marker) { return count[marker.name] > 1; });
  return found;
}

}  // namespace cgs
