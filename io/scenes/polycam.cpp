// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/polycam.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"
#include "io/images/image.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/photograph_index.h"

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

bool holds_cameras(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".json" && has_pose(entry->path())) return true;
  }
  return false;
}

// The folders of a capture, relative to the scene.
struct Keyframes {
  fs::path base;
  fs::path cameras;
  fs::path images;
};

// The corrected cameras come first, but not without their images: they are without distortion.
std::optional<Keyframes> keyframes(const fs::path& folder) {
  for (const char* base : {"keyframes", "."}) {
    const auto holds = [&](const char* cameras) { return holds_cameras(folder / base / cameras); };
    const bool is_corrected = holds("corrected_cameras");
    if (is_corrected && holds_images(folder / base / "corrected_images")) {
      return Keyframes{base, "corrected_cameras", "corrected_images"};
    }
    if (holds("cameras")) return Keyframes{base, "cameras", "images"};
    if (is_corrected) return Keyframes{base, "corrected_cameras", "images"};
  }
  return std::nullopt;
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

// Captures since 2025 do not state the size, which is then that of the photograph.
// \return false if nothing tells it
bool read_polycam_size(const JsonValue& document, const fs::path& image, Camera& camera) {
  const auto width = document.find("width");
  const auto height = document.find("height");
  if (width && height && !width->is_null() && !height->is_null()) {
    camera.width = width->count();
    camera.height = height->count();
    return true;
  }
  if (image.empty()) return false;
  const ImageSize size = image_size(image);
  camera.width = size.width;
  camera.height = size.height;
  return true;
}

// Empty if nothing tells the size of the photograph.
std::optional<Camera> read_polycam_camera(const fs::path& path, const fs::path& image) {
  const nlohmann::json json = read_json(path);
  const JsonValue document(json, path);
  const auto number_or = [&](const char* key, double fallback) {
    const auto value = document.find(key);
    return value ? value->number() : fallback;
  };
  Camera camera;
  camera.world_from_cam = read_polycam_pose(document);
  if (!read_polycam_size(document, image, camera)) return std::nullopt;
  camera.fx = document.at("fx").number();
  camera.fy = number_or("fy", camera.fx);
  camera.cx = number_or("cx", 0.5 * camera.width);
  camera.cy = number_or("cy", 0.5 * camera.height);
  check_intrinsics(camera,
                   [&](Defect defect, const std::string& why) { document.fail(defect, why); });
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

bool is_polycam(const fs::path& folder) { return keyframes(folder).has_value(); }

Scene read_polycam(const SceneRoot& root) {
  const std::optional<Keyframes> found = keyframes(root.folder);
  if (!found) throw BadInput(Defect::Schema, root.folder, "no cameras of Polycam");
  const auto place = [&](const fs::path& name) {
    return (found->base / name).lexically_normal().string();
  };
  const auto inside = [&](const fs::path& name) {
    return resolve_in_scene(root, place(name), root.folder);
  };
  Scene scene;
  scene.kind = SceneKind::Polycam;
  scene.folder = root.folder;
  scene.depth_kind = DepthKind::Metric;
  scene.frame.metres_per_unit = 1;
  scene.frame.scale_source = ScaleSource::CameraPoses;
  scene.frame.metres_sigma = kTrackedScale;
  scene.frame.up = Eigen::Vector3d::UnitY();  // of ARKit, along gravity
  PhotographIndex photographs(root, {place(found->images)});
  for (const std::string& name : json_files(inside(found->cameras))) {
    const fs::path stem = fs::path(name).stem();
    View view;
    view.name = stem.string();
    view.image_path = photographs.take(view.name);
    if (view.image_path.empty()) scene.missing.push_back(stem.string() + ".jpg");
    const auto camera = read_polycam_camera(inside(found->cameras / name), view.image_path);
    if (!camera) continue;
    view.camera = *camera;
    view.depth_path = depth_file_of({inside("depth"), root.allow_external}, stem);
    scene.views.push_back(std::move(view));
  }
  if (scene.views.empty() && scene.missing.empty()) {
    throw BadInput(Defect::Empty, root.folder, "there is no camera");
  }
  return scene;
}

}  // namespace cgs
