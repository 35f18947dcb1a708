// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/view_exr.h"

#include <cmath>
#include <string>

#include "io/bytes/byte_writer.h"
#include "io/bytes/mesh_arrays.h"
#include "io/images/exr.h"
#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

/// Channel order of the values below.
constexpr std::array<const char*, 13> kChannels = {"R",
                                                   "G",
                                                   "B",
                                                   "A",
                                                   "Z",
                                                   "N.X",
                                                   "N.Y",
                                                   "N.Z",
                                                   "distance.Y",
                                                   "variance.Y",
                                                   "support.Y",
                                                   "hole.Y",
                                                   "holeKind.Y"};

template <typename T>
void require_size(const Raster<T>& raster, const Camera& camera, const std::string& name) {
  require(raster.width == camera.width && raster.height == camera.height &&
              raster.data.size() ==
                  static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height),
          "ViewRasters." + name + " must have the size of the camera",
          std::to_string(raster.width) + "x" + std::to_string(raster.height));
}

float finite_or_zero(double value) {
  const auto narrow = static_cast<float>(value);
  return std::isfinite(narrow) ? narrow : 0.0f;
}

/// Linear light times alpha. Colours were blended while sRGB-coded, so alpha must be divided out
/// before decoding.
float premultiplied_linear(float coded, float alpha) {
  if (!(alpha > 0)) return 0;
  return finite_or_zero(alpha * linear_from_srgb(coded / alpha));
}

std::array<float, kChannels.size()> pixel(const ViewRasters& view,
                                          const Camera& camera,
                                          double scale,
                                          size_t i) {
  std::array<float, kChannels.size()> out{};
  const float alpha = view.alpha.data[i];
  for (size_t c = 0; c < 3; ++c) {
    out.at(c) = premultiplied_linear(view.color.data[i][static_cast<Eigen::Index>(c)], alpha);
    out.at(5 + c) = finite_or_zero(view.normal.data[i][static_cast<Eigen::Index>(c)]);
  }
  out[3] = finite_or_zero(alpha);
  const double depth = view.depth.data[i] * scale;
  const bool known = std::isfinite(depth);
  if (known) {
    const auto width = static_cast<size_t>(camera.width);
    const size_t row = i / width;
    const double u = static_cast<double>(i % width) + 0.5;
    const double v = static_cast<double>(row) + 0.5;
    out[4] = finite_or_zero(depth);
    out[8] = finite_or_zero(depth * camera.ray_in_cam(u, v).norm());
    out[9] = finite_or_zero(view.depth_variance.data[i] * scale * scale);
  }
  out[10] = view.support.data[i];
  const Hole stated = view.hole.data[i];
  const bool has_surface = stated == Hole::None || stated == Hole::Estimated;
  const Hole hole = !known && has_surface ? Hole::Transparent : stated;
  constexpr float kMasked = 4;
  const bool is_masked = !view.valid.empty() && view.valid.data[i] == 0 && hole != Hole::None;
  out[11] = is_hole(hole) && !is_masked ? 1 : 0;
  out[12] = is_masked ? kMasked : static_cast<float>(hole);
  return out;
}

template <typename Matrix>
std::string numbers(const Matrix& matrix) {
  std::string out;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
      if (!out.empty()) out += ' ';
      append_number(out, matrix(r, c));
    }
  }
  return out;
}

}  // namespace

void write_view_exr(const std::filesystem::path& path,
                    const ViewRasters& view,
                    const Camera& camera,
                    const Frame& frame) {
  require_size(view.color, camera, "color");
  require_size(view.alpha, camera, "alpha");
  require_size(view.depth, camera, "depth");
  require_size(view.normal, camera, "normal");
  require_size(view.depth_variance, camera, "depth_variance");
  require_size(view.support, camera, "support");
  require_size(view.hole, camera, "hole");
  ExrImage image;
  image.width = camera.width;
  image.height = camera.height;
  const size_t pixels = view.depth.data.size();
  for (const char* name : kChannels) image.channels.emplace_back(name, std::vector<float>(pixels));
  for (size_t i = 0; i < pixels; ++i) {
    const std::array<float, kChannels.size()> values = pixel(view, camera, frame.scale, i);
    for (size_t c = 0; c < values.size(); ++c) image.channels[c].second[i] = values.at(c);
  }
  Eigen::Isometry3d file_from_cam = camera.world_from_cam;
  file_from_cam.translation() = frame.file_from_internal(camera.center());
  const Eigen::Matrix4d cam_from_file = file_from_cam.inverse().matrix();
  const Eigen::Vector4d y_up(1, -1, 1, 1);
  const Eigen::Matrix4f left_handed = (y_up.asDiagonal() * cam_from_file).cast<float>();
  image.world_to_camera = left_handed.array() + 0.0f;  // no negative zeros
  image.text = {{"cgs:worldToCamera", numbers(cam_from_file)},
                {"cgs:K", numbers(camera.intrinsics())},
                {"cgs:units", frame.unit_name()},
                {"cgs:fileOrigin", numbers(frame.file_origin.transpose())}};
  write_exr(path, image);
}

}  // namespace cgs
