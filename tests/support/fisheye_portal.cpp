// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/fisheye_portal.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/images/exr.h"
#include "io/images/png.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/fisheye_map.h"
#include "libcgs/core/error.h"
#include "samples/capture/compare.h"
#include "samples/capture/render.h"

namespace cgs::test {

namespace {

using nlohmann::json;

// Inverse of the definition by bisection: the ray, with z = 1, that falls on a point.
Eigen::Vector3d ray_of(const Fisheye& lens, double u, double v) {
  const Eigen::Vector2d bent = lens.photograph.ray_in_cam(u, v).head<2>();
  double low = 0;
  double high = 0.5 * std::numbers::pi;
  for (int i = 0; i < 60; ++i) {
    const double a = 0.5 * (low + high);
    double d = 1;
    for (size_t k = 0; k < 4; ++k) d += lens.k.at(k) * std::pow(a, 2.0 * double(k + 1));
    (a * d < bent.norm() ? low : high) = a;
  }
  const Eigen::Vector2d side = bent.normalized() * std::tan(low);
  return {side.x(), side.y(), 1};
}

json opengl_pose(const Camera& camera) {
  Eigen::Matrix4d pose = camera.world_from_cam.matrix();
  pose.col(1) *= -1;
  pose.col(2) *= -1;
  json rows = json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
  return rows;
}

}  // namespace

Fisheye portal_lens(int downscale) {
  Fisheye out;
  out.photograph = {.width = 504, .height = 378, .fx = 262, .fy = 262, .cx = 254, .cy = 187.5};
  out.photograph = resized(out.photograph, 504 / downscale, 378 / downscale);
  out.k = {-0.02, 0.006, -0.004, 0.0006};
  return out;
}

std::vector<CaptureView> fisheye_views(int downscale) {
  std::vector<CaptureView> out = capture_views(downscale);
  const Camera picture = FisheyeMap(portal_lens(downscale)).picture();
  const Eigen::Vector3d portal(0, 0.2, 2.25);
  constexpr double kNearer = 0.45;
  for (CaptureView& view : out) {
    Eigen::Isometry3d pose = view.camera.world_from_cam;
    pose.translation() = portal + kNearer * (pose.translation() - portal);
    view.camera = picture;
    view.camera.world_from_cam = pose;
  }
  return out;
}

void write_fisheye_capture(const std::filesystem::path& folder,
                           const PortalScene& scene,
                           int downscale) {
  make_output_folder(folder / "images");
  const std::vector<float> sky = sky_visibility(scene);
  const Fisheye lens = portal_lens(downscale);
  const Camera& c = lens.photograph;
  json transforms = {{"camera_model", "OPENCV_FISHEYE"},
                     {"w", c.width},
                     {"h", c.height},
                     {"fl_x", c.fx},
                     {"fl_y", c.fy},
                     {"cx", c.cx},
                     {"cy", c.cy},
                     {"k1", lens.k[0]},
                     {"k2", lens.k[1]},
                     {"k3", lens.k[2]},
                     {"k4", lens.k[3]}};
  for (const CaptureView& view : fisheye_views(downscale)) {
    Camera camera = c;
    camera.world_from_cam = view.camera.world_from_cam;
    const ColorImage image = render_view(
        scene, sky, camera, view.seed, [&](double u, double v) { return ray_of(lens, u, v); });
    write_png(folder / "images" / (view.name + ".png"), image);
    transforms["frames"].push_back(
        {{"file_path", "images/" + view.name + ".png"}, {"transform_matrix", opengl_pose(camera)}});
  }
  write_file(folder / "transforms.json", transforms.dump(1) + "\n");
}

std::vector<double> fisheye_depth_accuracy(const std::filesystem::path& run_folder,
                                           const PortalScene& scene,
                                           double tolerance) {
  const Scene run = read_cameras_json(run_folder / "model/cameras.json");
  std::vector<Camera> inputs;
  for (const int i : run.input) {
    inputs.push_back(run.views[static_cast<size_t>(i)].camera);
    Eigen::Isometry3d& pose = inputs.back().world_from_cam;
    pose = world_from_internal(run.frame, pose);
  }
  std::vector<double> out;
  for (size_t k = 0; k < inputs.size(); ++k) {
    const View& view = run.views[static_cast<size_t>(run.input[k])];
    const std::filesystem::path path = run_folder / "views" / (view.name + ".exr");
    const ExrImage image = read_exr(path);
    const std::vector<float>* const z = image.find("Z");
    if (z == nullptr) throw BadInput(Defect::Schema, path, "has no channel Z");
    DepthMap depth(image.width, image.height, 0);
    depth.data = *z;
    for (float& value : depth.data) {
      if (value == 0) value = std::numeric_limits<float>::quiet_NaN();
    }
    out.push_back(depth_accuracy(depth, view_truth(scene, inputs[k], inputs), tolerance));
  }
  return out;
}

}  // namespace cgs::test
