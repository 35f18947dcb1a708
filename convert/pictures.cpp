// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/pictures.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace cgs {

namespace {

// The 256 colours of the turbo map, as RGB in [0, 1].
std::vector<Eigen::Vector3f> turbo_colors() {
  cv::Mat ramp(1, 256, CV_8U);
  for (int i = 0; i < 256; ++i) ramp.at<uint8_t>(0, i) = static_cast<uint8_t>(i);
  cv::Mat bgr;
  cv::applyColorMap(ramp, bgr, cv::COLORMAP_TURBO);
  std::vector<Eigen::Vector3f> colors;
  for (int i = 0; i < 256; ++i) {
    const auto& c = bgr.at<cv::Vec3b>(0, i);
    colors.emplace_back(Eigen::Vector3f(c[2], c[1], c[0]) / 255.0f);
  }
  return colors;
}

}  // namespace

ColorImage depth_picture(const DepthMap& depth) {
  ColorImage out(depth.width, depth.height, Eigen::Vector3f::Zero());
  std::vector<float> inverse;
  for (const float z : depth.data) {
    if (std::isfinite(z) && z > 0) inverse.push_back(1 / z);
  }
  if (inverse.empty()) return out;
  std::sort(inverse.begin(), inverse.end());
  const float low = inverse[inverse.size() / 100];
  const float high = inverse[inverse.size() - 1 - inverse.size() / 100];
  const float range = std::max(high - low, 1e-12f * high);
  const std::vector<Eigen::Vector3f> colors = turbo_colors();
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float z = depth.data[i];
    if (!std::isfinite(z) || z <= 0) continue;
    const float t = std::clamp((1 / z - low) / range, 0.0f, 1.0f);
    out.data[i] = colors[static_cast<size_t>(std::lround(t * 255))];
  }
  return out;
}

ColorImage normal_picture(const NormalMap& normals, const Eigen::Isometry3d& cam_from_world) {
  ColorImage out(normals.width, normals.height, Eigen::Vector3f::Zero());
  const Eigen::Matrix3f R = cam_from_world.rotation().cast<float>();
  for (size_t i = 0; i < out.data.size(); ++i) {
    const Eigen::Vector3f& n = normals.data[i];
    if (n.isZero()) continue;
    const Eigen::Vector3f in_cam = R * n;
    const Eigen::Vector3f shown(in_cam.x(), -in_cam.y(), -in_cam.z());
    out.data[i] = 0.5f * (shown + Eigen::Vector3f::Ones());
  }
  return out;
}

MaskMap hole_mask(const RenderBuffers& buffers) {
  MaskMap mask(buffers.hole.width, buffers.hole.height, 0);
  for (size_t i = 0; i < mask.data.size(); ++i) mask.data[i] = buffers.hole.data[i] != Hole::None;
  return mask;
}

}  // namespace cgs
