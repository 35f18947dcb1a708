// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/rgbd_frames.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"
#include "io/bytes/text_lines.h"
#include "io/images/image.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/depth_file.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kPose = ".pose.txt";
constexpr const char* kMatrix = "camera-intrinsics.txt";

// The first of some files that is there, relative to a folder; empty if none is.
std::string first_present(const fs::path& folder, std::initializer_list<const char*> names) {
  const auto is_there = [&](const char* name) { return is_present(folder / name); };
  const auto* const found = std::find_if(names.begin(), names.end(), is_there);
  return found == names.end() ? "" : *found;
}

// --- poses ----------------------------------------------------------------------------------

// As programs write what is no number: inf, -inf, nan, -nan, -1.#IND, 1.#QNAN.
bool is_not_finite(std::string_view token) {
  double value = 0;
  const auto [end, error] = std::from_chars(token.begin(), token.end(), value);
  const bool is_number = error == std::errc() && end == token.end();
  return is_number ? !std::isfinite(value) : token.find(".#") != std::string_view::npos;
}

// Four rows of four; empty where they tell that there is no pose.
std::optional<Eigen::Isometry3d> read_pose(TextLines& lines) {
  Eigen::Matrix4d M = Eigen::Matrix4d::Zero();
  bool is_lost = false;
  for (int r = 0; r < 4; ++r) {
    const auto line = lines.next_data();
    if (!line) throw BadInput(Defect::Truncated, lines.path(), "a pose has four rows");
    const std::vector<std::string_view> row = tokens(*line);
    if (row.size() != 4) lines.fail(Defect::Schema, "a row of a pose has four numbers");
    for (int c = 0; c < 4; ++c) {
      const std::string_view token = row[static_cast<size_t>(c)];
      if (is_not_finite(token)) {
        is_lost = true;
      } else {
        M(r, c) = lines.number(token);
      }
    }
  }
  if (is_lost) return std::nullopt;
  const Refuse refuse = [&](Defect defect, const std::string& why) { lines.fail(defect, why); };
  if (M.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    refuse(Defect::Value, "the last row of a pose must be 0 0 0 1");
  }
  return checked_pose(M.topLeftCorner<3, 3>(), M.topRightCorner<3, 1>(), refuse);
}

std::optional<Eigen::Isometry3d> read_pose_file(const fs::path& path) {
  const std::string text = read_file(path);
  TextLines lines(text, path);
  return read_pose(lines);
}

// A line of numbers of the frame before each pose.
std::vector<std::optional<Eigen::Isometry3d>> read_trajectory(const fs::path& path) {
  const std::string text = read_file(path);
  refuse_foreign_content(path, text, "a trajectory");
  TextLines lines(text, path);
  std::vector<std::optional<Eigen::Isometry3d>> out;
  while (const auto line = lines.next_data()) {
    if (tokens(*line).size() != 3) lines.fail(Defect::Schema, "three numbers precede a pose");
    out.push_back(read_pose(lines));
  }
  return out;
}

// --- intrinsics -----------------------------------------------------------------------------

// The middle of the first pixel is (0, 0) in the file.
Camera camera_of(const Eigen::Matrix3d& K, const ImageSize& size, const Refuse& refuse) {
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  set_intrinsics(camera, K, refuse);
  camera.cx += 0.5;
  camera.cy += 0.5;
  return camera;
}

Camera read_matrix(const fs::path& path, const ImageSize& size) {
  const std::string text = read_file(path);
  TextLines lines(text, path);
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  for (int r = 0; r < 3; ++r) {
    const auto line = lines.next_data();
    if (!line) throw BadInput(Defect::Truncated, path, "the matrix of the camera has three rows");
    const std::vector<std::string_view> row = tokens(*line);
    if (row.size() != 3) lines.fail(Defect::Schema, "a row of the matrix has three numbers");
    for (int c = 0; c < 3; ++c) K(r, c) = lines.number(row[static_cast<size_t>(c)]);
  }
  return camera_of(
      K, size, [&](Defect defect, const std::string& why) { throw BadInput(defect, path, why); });
}

Camera read_open3d_camera(const fs::path& path) {
  const nlohmann::json json = read_json(path);
  const JsonValue document(json, path);
  const JsonValue matrix = document.at("intrinsic_matrix");
  if (matrix.size() != 9) matrix.fail(Defect::Schema, "nine numbers were expected");
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < 9; ++i) {
    K(static_cast<int>(i % 3), static_cast<int>(i / 3)) = matrix.at(i).number();
  }
  const ImageSize size{document.at("width").count(), document.at("height").count()};
  return camera_of(
      K, size, [&](Defect defect, const std::string& why) { matrix.fail(defect, why); });
}

// --- 7-Scenes and 3DMatch -------------------------------------------------------------------

bool holds_poses(const fs::path& folder) {
  const std::vector<std::string> names = sorted_entries(folder);
  return std::any_of(
      names.begin(), names.end(), [](const std::string& name) { return name.ends_with(kPose); });
}

// Folders with frames, relative to the scene.
std::vector<std::string> sequences(const fs::path& folder) {
  std::vector<std::string> out;
  if (holds_poses(folder)) out.emplace_back(".");
  for (const std::string& name : sorted_entries(folder)) {
    const bool is_sequence = name.starts_with("seq-") && is_folder(folder / name);
    if (is_sequence && holds_poses(folder / name)) out.push_back(name);
  }
  return out;
}

// Appends a frame, or counts it among the lost.
void add_view(const std::optional<Eigen::Isometry3d>& pose, View view, Scene& scene, size_t& lost) {
  if (!pose) {
    ++lost;
    return;
  }
  view.camera.world_from_cam = *pose;
  scene.views.push_back(std::move(view));
  if (scene.views.size() > ReadLimits{}.max_views) {
    throw LimitError(printable(scene.folder) + ": more than " +
                     std::to_string(ReadLimits{}.max_views) + " frames");
  }
}

// Frames of the sequences; how large pictures are and how the camera is comes later.
size_t read_frames(const SceneRoot& root, Scene& scene) {
  size_t lost = 0;
  for (const std::string& folder : sequences(root.folder)) {
    const auto inside = [&](const std::string& name) {
      return resolve_in_scene(
          root, (fs::path(folder) / name).lexically_normal().string(), root.folder);
    };
    for (const std::string& file : sorted_entries(inside("."))) {
      if (!file.ends_with(kPose)) continue;
      const std::string frame = file.substr(0, file.size() - kPose.size());
      View view;
      view.name = (fs::path(folder) / frame).lexically_normal().string();
      for (const char* ending : {".color.png", ".color.jpg"}) {
        const fs::path image = inside(frame + ending);
        if (view.image_path.empty() && is_present(image)) view.image_path = image;
      }
      if (view.image_path.empty()) scene.missing.push_back(view.name + ".color.png");
      const fs::path depth = inside(frame + ".depth.png");
      if (is_present(depth)) view.depth_path = depth;
      add_view(read_pose_file(inside(file)), std::move(view), scene, lost);
    }
  }
  return lost;
}

void set_cameras(const SceneRoot& root, Scene& scene) {
  const fs::path path = resolve_in_scene(root, kMatrix, root.folder);
  if (!is_present(path)) {
    throw BadInput(Defect::Schema,
                   root.folder,
                   "frames have poses, but there is no " + std::string(kMatrix) +
                       ": write fx 0 cx, 0 fy cy and 0 0 1 in three rows (7-Scenes states "
                       "585 0 320, 0 585 240, 0 0 1)");
  }
  const auto shown = std::find_if(scene.views.begin(), scene.views.end(), [](const View& view) {
    return !view.image_path.empty();
  });
  if (shown == scene.views.end()) {
    throw BadInput(Defect::Empty, root.folder, "no frame with a pose has a photograph");
  }
  const Camera camera = read_matrix(path, image_size(shown->image_path));
  for (View& view : scene.views) {
    const Eigen::Isometry3d pose = view.camera.world_from_cam;
    view.camera = camera;
    view.camera.world_from_cam = pose;
  }
}

// --- Open3D ---------------------------------------------------------------------------------

std::string trajectory_name(const fs::path& folder) {
  return first_present(folder, {"trajectory.log", "scene/trajectory.log"});
}

std::string photograph_folder(const fs::path& folder) {
  return first_present(folder, {"color", "image", "rgb"});
}

// "9.jpg" before "10.jpg": runs of digits compare as numbers, as Open3D orders what it reads.
bool comes_before(const fs::path& a, const fs::path& b) {
  const std::string one = a.filename().string();
  const std::string other = b.filename().string();
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto digits_at = [&](const std::string& text, size_t at) {
    const auto begin = text.begin() + static_cast<std::ptrdiff_t>(at);
    std::string out(begin, std::find_if_not(begin, text.end(), is_digit));
    out.erase(0, std::min(out.find_first_not_of('0'), out.size() - 1));
    return out;
  };
  size_t i = 0;
  size_t j = 0;
  while (i < one.size() && j < other.size()) {
    if (is_digit(one[i]) && is_digit(other[j])) {
      const std::string m = digits_at(one, i);
      const std::string n = digits_at(other, j);
      if (m != n) return m.size() != n.size() ? m.size() < n.size() : m < n;
      while (i < one.size() && is_digit(one[i])) ++i;
      while (j < other.size() && is_digit(other[j])) ++j;
      continue;
    }
    if (one[i] != other[j]) return one[i] < other[j];
    ++i;
    ++j;
  }
  return one.size() - i != other.size() - j ? one.size() - i < other.size() - j : one < other;
}

size_t read_open3d(const SceneRoot& root, Scene& scene) {
  const auto inside = [&](const std::string& name) {
    return resolve_in_scene(root, name, root.folder);
  };
  const std::string intrinsics =
      first_present(root.folder, {"camera_intrinsic.json", "intrinsic.json"});
  if (intrinsics.empty()) {
    throw BadInput(
        Defect::Schema,
        root.folder,
        "there is no camera_intrinsic.json; what Open3D takes for a camera that it does "
        "not know is {\"width\": 640, \"height\": 480, \"intrinsic_matrix\": [525, 0, 0, "
        "0, 525, 0, 319.5, 239.5, 1]}");
  }
  const Camera camera = read_open3d_camera(inside(intrinsics));
  const fs::path trajectory = inside(trajectory_name(root.folder));
  const auto poses = read_trajectory(trajectory);
  std::vector<fs::path> photographs = image_files(root, photograph_folder(root.folder));
  const bool has_depth = is_folder(root.folder / "depth");
  std::vector<fs::path> depths = has_depth ? image_files(root, "depth") : std::vector<fs::path>();
  std::sort(photographs.begin(), photographs.end(), comes_before);
  std::sort(depths.begin(), depths.end(), comes_before);
  if (photographs.size() != poses.size() || (has_depth && depths.size() != poses.size())) {
    throw BadInput(Defect::Mismatch,
                   trajectory,
                   std::to_string(poses.size()) + " poses for " +
                       std::to_string(photographs.size()) + " photographs and " +
                       std::to_string(depths.size()) + " depth files");
  }
  size_t lost = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    View view;
    view.name = photographs[i].stem().string();
    view.image_path = photographs[i];
    if (has_depth) view.depth_path = depths[i];
    view.camera = camera;
    add_view(poses[i], std::move(view), scene, lost);
  }
  return lost;
}

bool is_open3d(const fs::path& folder) {
  return !trajectory_name(folder).empty() && !photograph_folder(folder).empty();
}

}  // namespace

bool is_rgbd_frames(const fs::path& folder) {
  return !sequences(folder).empty() || is_open3d(folder);
}

Scene read_rgbd_frames(const SceneRoot& root) {
  Scene scene;
  scene.folder = root.folder;
  scene.depth_kind = DepthKind::Metric;
  scene.frame.metres_per_unit = 1;
  scene.frame.scale_source = ScaleSource::CameraPoses;
  scene.frame.metres_sigma = kTrackedScale;
  size_t lost = 0;
  if (sequences(root.folder).empty()) {
    scene.kind = SceneKind::Open3dRgbd;
    lost = read_open3d(root, scene);
  } else {
    scene.kind = SceneKind::RgbdFrames;
    lost = read_frames(root, scene);
    if (!scene.views.empty()) set_cameras(root, scene);
  }
  if (scene.views.empty()) throw BadInput(Defect::Empty, root.folder, "no frame has a pose");
  if (lost > 0) {
    scene.warnings.push_back(std::to_string(lost) +
                             " frames are left out: their poses are not finite, as where tracking "
                             "was lost");
  }
  return scene;
}

}  // namespace cgs
