// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/polycam.h"

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/depth_file.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

bool has_pose(const fs::path& file) {
  constexpr uint64_t kEnough = 65536;
  try {
    return read_file_start(file, kEnough).find("\"t_00\"") != std::string::npos;
  } catch (const Error&) {
    return false;  // what cannot be read has none
  }
}

// Name, relative to the scene, of the folder that holds cameras/; empty if there is none.
std::string keyframes(const fs::path& folder) {
  for (const char* name : {"keyframes", "."}) {
    for (const char* cameras : {"corrected_cameras", "cameras"}) {
      const fs::path candidate = folder / name / cameras;
      std::error_code error;
      for (fs::directory_iterator entry(candidate, error), end; !error && entry != end;
           entry.increment(error)) {
        if (entry->path().extension() == ".json" && has_pose(entry->path())) return name;
      }
    }
  }
  return "";
}

Eigen::Isometry3d read_polycam_pose(const JsonValue& camera) {
  Eigen::Matrix<double, 3, 4> M;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) {
      M(r, c) = camera.at("t_" + std::to_string(r) + std::to_string(c)).number();
    }
  }
  const Eigen::Matrix3d arkit_from_opencv = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return checked_pose(M.leftCols<3>() * arkit_from_opencv,
                      M.col(3),
                      [&](Defect defect, const std::string& why) { camera.fail(defect, why); });
}

Camera read_polycam_camera(const fs::path& path) {
  const nlohmann::json json = read_json(path);
  const JsonValue document(json, path);
  Camera camera;
  camera.width = document.at("width").count();
  camera.height = document.at("height").count();
  camera.fx = document.at("fx").number();
  camera.fy = document.at("fy").number();
  camera.cx = document.at("cx").number();
  camera.cy = document.at("cy").number();
  check_intrinsics(camera,
                   [&](Defect defect, const std::string& why) { document.fail(defect, why); });
  camera.world_from_cam = read_polycam_pose(document);
  return camera;
}

std::vector<std::string> json_files(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".json") out.push_back(entry->path().filename().string());
    if (out.size() > ReadLimits{}.max_views) {
      throw LimitError(printable(folder) + ": more than " + std::to_string(ReadLimits{}.max_views) +
                       " cameras");
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

bool is_polycam(const fs::path& folder) { return !keyframes(folder).empty(); }

Scene read_polycam(const SceneRoot& root) {
  const fs::path base = keyframes(root.folder);
  const bool is_corrected = is_folder(root.folder / base / "corrected_cameras") &&
                            is_folder(root.folder / base / "corrected_images");
  const std::string prefix = is_corrected ? "corrected_" : "";
  const auto inside = [&](const fs::path& name) {
    return resolve_in_scene(root, (base / name).lexically_normal().string(), root.folder);
  };
  Scene scene;
  scene.kind = SceneKind::Polycam;
  scene.folder = root.folder;
  scene.depth_kind = DepthKind::Metric;
  scene.frame.metres_per_unit = 1;
  scene.frame.scale_source = ScaleSource::CameraPoses;
  scene.frame.metres_sigma = kTrackedScale;
  scene.frame.up = Eigen::Vector3d::UnitY();  // of ARKit, along gravity
  const fs::path cameras = prefix + "cameras";
  for (const std::string& name : json_files(inside(cameras))) {
    View view;
    view.camera = read_polycam_camera(inside(cameras / name));
    const fs::path stem = fs::path(name).stem();
    for (const char* extension : {".jpg", ".jpeg", ".png"}) {
      const fs::path image = inside(fs::path(prefix + "images") / (stem.string() + extension));
      if (view.image_path.empty() && is_present(image)) view.image_path = image;
    }
    view.name = stem.string();
    if (view.image_path.empty()) scene.missing.push_back(stem.string() + ".jpg");
    view.depth_path = depth_file_of({inside("depth"), root.allow_external}, stem);
    scene.views.push_back(std::move(view));
  }
  if (scene.views.empty()) throw BadInput(Defect::Empty, root.folder, "there is no camera");
  return scene;
}

}  // namespace cgs
