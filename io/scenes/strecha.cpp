// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/strecha.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/bytes/text_lines.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/photograph_index.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> camera_files(const fs::path& folder) {
  std::vector<std::string> out = sorted_entries(folder);
  std::erase_if(out, [](const std::string& name) { return !name.ends_with(".camera"); });
  return out;
}

// Name, relative to the scene, of the first folder that holds .camera files.
std::optional<std::string> camera_folder(const fs::path& folder) {
  if (!camera_files(folder).empty()) return ".";
  for (const std::string& name : sorted_entries(folder)) {
    if (is_folder(folder / name) && !camera_files(folder / name).empty()) return name;
  }
  return std::nullopt;
}

constexpr size_t kNumbers = 9 + 3 + 9 + 3 + 2;

Camera read_strecha_camera(const fs::path& path) {
  const std::string text = read_file(path);
  refuse_foreign_content(path, text, "a .camera file");
  TextLines lines(text, path);
  std::vector<double> numbers;
  while (const auto line = lines.next_data()) {
    for (const std::string_view token : tokens(*line)) numbers.push_back(lines.number(token));
    if (numbers.size() > kNumbers) break;
  }
  if (numbers.size() != kNumbers) {
    throw BadInput(numbers.size() < kNumbers ? Defect::Truncated : Defect::Syntax,
                   path,
                   "expected 26 numbers (K, distortion, rotation, centre, size), found " +
                       std::string(numbers.size() < kNumbers ? "" : "more than ") +
                       std::to_string(std::min(numbers.size(), kNumbers)));
  }
  const Refuse refuse = [&](Defect defect, const std::string& why) {
    throw BadInput(defect, path, why);
  };
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d K = Eigen::Map<const RowMajor>(numbers.data());
  const Eigen::Vector3d distortion = Eigen::Map<const Eigen::Vector3d>(numbers.data() + 9);
  const Eigen::Matrix3d R = Eigen::Map<const RowMajor>(numbers.data() + 12);
  const Eigen::Vector3d center = Eigen::Map<const Eigen::Vector3d>(numbers.data() + 21);
  if (distortion != Eigen::Vector3d::Zero()) {
    refuse(Defect::Unsupported, "lens distortion is not read in this layout");
  }
  Camera camera;
  constexpr double kMaxSide = 1e6;
  const double width = numbers[24];
  const double height = numbers[25];
  for (const double side : {width, height}) {
    if (!(side >= 1 && side <= kMaxSide && side == std::floor(side))) {
      refuse(Defect::Value, "image sizes must be whole numbers in [1, 1e6]");
    }
  }
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  set_intrinsics(camera, K, refuse);
  camera.world_from_cam = checked_pose(R, center, refuse);
  return camera;
}

}  // namespace

bool is_strecha(const fs::path& folder) { return camera_folder(folder).has_value(); }

Scene read_strecha(const SceneRoot& root) {
  const std::optional<std::string> folder = camera_folder(root.folder);
  if (!folder) throw BadInput(Defect::Schema, root.folder, "no .camera files");
  Scene scene;
  scene.kind = SceneKind::Strecha;
  scene.folder = root.folder;
  const fs::path cameras = resolve_in_scene(root, *folder, root.folder);
  std::optional<PhotographIndex> index;  // made for the first name that is not there as it is
  for (const std::string& name : camera_files(cameras)) {
    const fs::path path =
        resolve_in_scene(root, (fs::path(*folder) / name).lexically_normal().string(), cameras);
    View view;
    view.camera = read_strecha_camera(path);
    view.name = path.stem().string();  // 0000.jpg.camera belongs to 0000.jpg
    for (const std::string& place : {*folder, std::string("images"), std::string(".")}) {
      const fs::path image =
          resolve_in_scene(root, (fs::path(place) / view.name).lexically_normal().string(), path);
      if (!is_present(image)) continue;
      view.image_path = image;
      break;
    }
    if (view.image_path.empty()) {
      if (!index) index.emplace(root, std::vector<std::string>{*folder, "images", "."});
      view.image_path = index->take_path(view.name);
    }
    if (view.image_path.empty()) scene.missing.push_back(view.name);
    scene.views.push_back(std::move(view));
  }
  if (index) {
    for (const std::string& note : index->notes()) scene.notes.push_back(note);
  }
  return scene;
}

}  // namespace cgs
