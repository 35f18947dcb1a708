// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/strecha.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/camera_checks.h"
#include "io/text_lines.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> entries_sorted(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    out.push_back(entry->path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<fs::path> camera_files(const fs::path& folder) {
  std::vector<fs::path> out = entries_sorted(folder);
  std::erase_if(out, [](const fs::path& path) { return path.extension() != ".camera"; });
  return out;
}

// Name, relative to the scene, of the first folder that holds .camera files.
std::optional<std::string> camera_folder(const fs::path& folder) {
  if (!camera_files(folder).empty()) return ".";
  for (const fs::path& entry : entries_sorted(folder)) {
    if (is_folder(entry) && !camera_files(entry).empty()) return entry.filename().string();
  }
  return std::nullopt;
}

constexpr size_t kNumbers = 9 + 3 + 9 + 3 + 2;

Camera read_camera(const fs::path& path) {
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
  const bool has_skew = std::abs(K(0, 1)) > 1e-9 * std::abs(K(0, 0));
  if (has_skew || K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1) {
    refuse(Defect::Unsupported, "K must be fx 0 cx / 0 fy cy / 0 0 1");
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
  camera.fx = K(0, 0);
  camera.fy = K(1, 1);
  camera.cx = K(0, 2);
  camera.cy = K(1, 2);
  check_intrinsics(camera, refuse);
  camera.world_from_cam = checked_pose(R, center, refuse);
  return camera;
}

}  // namespace

bool is_strecha(const fs::path& folder) { return camera_folder(folder).has_value(); }

Scene read_strecha(const SceneRoot& root) {
  const std::optional<std::string> folder = camera_folder(root.folder);
  if (!folder) throw BadInput(Defect::Schema, root.folder, "no .camera files");
  Scene scene;
  scene.kind = "Strecha";
  scene.folder = root.folder;
  for (const fs::path& path : camera_files(resolve_in_scene(root, *folder, root.folder))) {
    View view;
    view.camera = read_camera(path);
    view.name = path.stem().string();  // 0000.jpg.camera belongs to 0000.jpg
    for (const std::string& place : {*folder, std::string("images"), std::string(".")}) {
      const fs::path image =
          resolve_in_scene(root, (fs::path(place) / view.name).lexically_normal().string(), path);
      if (!is_present(image)) continue;
      view.image_path = image;
      break;
    }
    if (view.image_path.empty()) scene.missing.push_back(view.name);
    scene.views.push_back(std::move(view));
  }
  return scene;
}

}  // namespace cgs
