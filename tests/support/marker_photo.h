// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include <opencv2/aruco.hpp>

#include "libcgs/core/camera.h"

namespace cgs::test {

/// A marker printed on paper with a white border of a cell; the paper is the x-y plane of the pose,
/// x to the right and y down as printed, the middle of the marker its origin.
struct PrintedMarker {
  cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary = cv::aruco::DICT_APRILTAG_36h11;
  int number = 0;
  double side = 1;     ///< Of the black square.
  double stretch = 1;  ///< Of its height: a bad printer.
  Eigen::Isometry3d world_from_paper = Eigen::Isometry3d::Identity();
};

/// Light of a marker at a point of its paper, or a negative number beside the paper.
inline double light_of(const PrintedMarker& marker, const cv::Mat& cells, double x, double y) {
  const int count = cells.cols;
  const double cell = marker.side / count;
  const double u = x / cell + count / 2.0;
  const double v = y / (cell * marker.stretch) + count / 2.0;
  if (u < -1 || v < -1 || u > count + 1 || v > count + 1) return -1;
  const auto column = static_cast<int>(std::floor(u));
  const auto row = static_cast<int>(std::floor(v));
  if (column < 0 || row < 0 || column >= count || row >= count) return 0.9;
  return cells.at<uint8_t>(row, column) > 0 ? 0.9 : 0.08;
}

/// A photograph of markers before grey noise, by casting 16 rays per pixel. The nearest paper wins.
inline ColorImage photograph_of(const std::vector<PrintedMarker>& markers, const Camera& camera) {
  std::vector<cv::Mat> cells;
  for (const PrintedMarker& marker : markers) {
    const auto dictionary = cv::aruco::getPredefinedDictionary(marker.dictionary);
    cv::Mat drawn;
    dictionary->drawMarker(marker.number, dictionary->markerSize + 2, drawn, 1);
    cells.push_back(drawn);
  }
  constexpr int kRays = 4;  // along a side of a pixel
  const auto light_along = [&](double u, double v) {
    const Eigen::Vector3d ray = camera.world_from_cam.linear() * camera.ray_in_cam(u, v);
    double light = 0.4 + 0.1 * std::sin(0.9 * u + 1.7 * v) * std::cos(1.3 * u - 0.6 * v);
    double nearest = 1e300;
    for (size_t i = 0; i < markers.size(); ++i) {
      const Eigen::Isometry3d paper_from_world = markers[i].world_from_paper.inverse();
      const Eigen::Vector3d from = paper_from_world * camera.center();
      const Eigen::Vector3d along = paper_from_world.linear() * ray;
      const double t = -from.z() / along.z();
      if (!(t > 0) || t >= nearest) continue;
      const Eigen::Vector3d at = from + t * along;
      const double here = light_of(markers[i], cells[i], at.x(), at.y());
      if (here < 0) continue;
      light = here;
      nearest = t;
    }
    return light;
  };
  ColorImage out(camera.width, camera.height, Eigen::Vector3f::Zero());
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int k = 0; k < kRays * kRays; ++k) {
        sum += light_along(x + (k % kRays + 0.5) / kRays, y + (k / kRays + 0.5) / kRays);
      }
      out(x, y).setConstant(static_cast<float>(sum / (kRays * kRays)));
    }
  }
  return out;
}

}  // namespace cgs::test
