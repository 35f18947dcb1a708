// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/pictures.h"

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

MaskMap intersection(const MaskMap& a, const MaskMap& b) {
  if (b.empty()) return a;
  MaskMap out = a;
  for (size_t i = 0; i < out.data.size(); ++i) out.data[i] = a.data[i] & b.data[i];
  return out;
}

MaskMap hole_mask(const RenderBuffers& buffers) {
  MaskMap mask(buffers.hole.width, buffers.hole.height, 0);
  for (size_t i = 0; i < mask.data.size(); ++i)
    mask.data[i] = is_hole(buffers.hole.data[i]) ? 1 : 0;
  return mask;
}

ColorImage tinted(ColorImage picture, const MaskMap& mask, const Eigen::Vector3f& tint) {
  constexpr float kShine = 0.25f;
  for (size_t i = 0; i < picture.data.size(); ++i) {
    if (mask.data[i] != 0) picture.data[i] = kShine * picture.data[i] + (1 - kShine) * tint;
  }
  return picture;
}

ColorImage contact_sheet(const std::vector<ColorImage>& pictures, int columns) {
  constexpr int kGap = 4;  // [pixels]
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  int width = 0;
  int height = 0;
  for (const ColorImage& picture : pictures) {
    width = std::max(width, picture.width + kGap);
    height = std::max(height, picture.height + kGap);
  }
  ColorImage out(columns * width - kGap, rows * height - kGap, Eigen::Vector3f::Ones());
  for (size_t k = 0; k < pictures.size(); ++k) {
    const ColorImage& picture = pictures[k];
    const int left = static_cast<int>(k) % columns * width + (width - kGap - picture.width) / 2;
    const int top = static_cast<int>(k) / columns * height + (height - kGap - picture.height) / 2;
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) out(left + x, top + y) = picture(x, y);
    }
  }
  return out;
}

}  // namespace cgs
