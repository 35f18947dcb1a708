// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/llff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/bytes/text_lines.h"
#include "io/images/npy.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/colmap_model.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

constexpr size_t kColumns = 17;

Camera camera_of_row(const double* row, const Refuse& refuse) {
  const auto at = [&](int r, int c) { return row[5 * r + c]; };
  for (size_t i = 0; i < kColumns; ++i) {
    if (!std::isfinite(row[i])) refuse(Defect::Value, "contains a value that is not finite");
  }
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
  for (int r = 0; r < 3; ++r) {
    // down, right, backward -> right, down, forward
    R.row(r) << at(r, 1), at(r, 0), -at(r, 2);
    t[r] = at(r, 3);
  }
  const double height = at(0, 4);
  const double width = at(1, 4);
  const double focal = at(2, 4);
  constexpr double kMaxSide = 1e6;
  if (!(width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide)) {
    refuse(Defect::Value, "image size must be in [1, 1e6]");
  }
  Camera camera;
  camera.width = static_cast<int>(std::lround(width));
  camera.height = static_cast<int>(std::lround(height));
  camera.fx = camera.fy = focal;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  check_intrinsics(camera, refuse);
  camera.world_from_cam = checked_pose(R, t, refuse);
  return camera;
}

std::vector<View> views_of_rows(const NpyArray& array, const fs::path& path) {
  std::vector<View> views(array.shape[0]);
  for (size_t i = 0; i < views.size(); ++i) {
    const double* row = array.values.data() + i * kColumns;
    const Refuse refuse = [&](Defect defect, const std::string& reason) {
      throw BadInput(defect, path, "row " + std::to_string(i) + ": " + reason);
    };
    views[i].camera = camera_of_row(row, refuse);
    views[i].near = row[15];
    views[i].far = row[16];
    if (!(views[i].near > 0 && views[i].far > views[i].near)) {
      refuse(Defect::Value, "the depth bounds must obey 0 < near < far");
    }
  }
  return views;
}

std::string image_folder(const SceneRoot& root) {
  for (const char* name : {"images_8", "images_4", "images_2", "images"}) {
    if (is_folder(root.folder / name)) return name;
  }
  throw BadInput(Defect::Missing,
                 root.folder,
                 "no folder images_8, images_4, images_2 or images beside poses_bounds.npy");
}

// Row -> file name, from INDEX.txt.
std::map<size_t, std::string> read_index(const fs::path& path, size_t rows) {
  const std::string text = read_file(path);
  TextLines lines(text, path);
  std::map<size_t, std::string> names;
  while (const auto line = lines.next_data()) {
    const auto parts = tokens(*line);
    if (parts.size() != 2) lines.fail(Defect::Syntax, "expected \"<row> <file name>\"");
    const uint64_t row = lines.count(parts[0]);
    if (row >= rows) lines.fail(Defect::Ref, "there are only " + std::to_string(rows) + " rows");
    if (!names.emplace(row, std::string(parts[1])).second) {
      lines.fail(Defect::Syntax, "the row occurs twice");
    }
  }
  return names;
}

void pair_by_index(const SceneRoot& root, const std::string& folder, Scene& scene) {
  const fs::path index = resolve_in_scene(root, "INDEX.txt", root.folder);
  std::vector<View> named;
  std::vector<int> place(scene.views.size(), -1);  // of each row
  for (const auto& [row, name] : read_index(index, scene.views.size())) {
    View view = scene.views[row];
    view.name = name;
    const fs::path path = resolve_in_scene(root, (fs::path(folder) / name).string(), index);
    if (is_present(path)) {
      view.image_path = path;
    } else {
      scene.missing.push_back((fs::path(folder) / name).string());
    }
    place[row] = static_cast<int>(named.size());
    named.push_back(std::move(view));
  }
  scene.views = std::move(named);
  for (SparsePoint& point : scene.points) {
    for (int& view : point.views) view = place[static_cast<size_t>(view)];
    std::erase(point.views, -1);
  }
  std::erase_if(scene.points, [](const SparsePoint& point) { return point.views.empty(); });
}

void pair_with_images(const SceneRoot& root, Scene& scene) {
  const std::string folder = image_folder(root);
  const std::vector<fs::path> files = image_files(root, folder);
  if (files.size() != scene.views.size() && is_present(root.folder / "INDEX.txt")) {
    pair_by_index(root, folder, scene);
    return;
  }
  if (files.size() != scene.views.size()) {
    throw BadInput(Defect::Mismatch,
                   root.folder / "poses_bounds.npy",
                   "has " + std::to_string(scene.views.size()) + " rows, but " + folder +
                       " holds " + std::to_string(files.size()) + " images");
  }
  for (size_t i = 0; i < files.size(); ++i) {
    scene.views[i].name = files[i].filename().string();
    scene.views[i].image_path = files[i];
  }
}

// LLFF keeps COLMAP's points but not always its list of images; by convention image id i + 1 is
// row i. The points are taken only if nearly all of their observations bear that out.
void add_sparse_points(const SceneRoot& root, Scene& scene) {
  std::string name = "sparse/0/points3D.bin";
  if (!is_present(root.folder / name)) name = "sparse/points3D.bin";
  if (!is_present(root.folder / name)) return;
  const fs::path path = resolve_in_scene(root, name, root.folder);
  std::vector<SparsePoint> points;
  size_t observations = 0;
  size_t agreeing = 0;
  for (const ColmapPoint& point : read_colmap_points_binary(path)) {
    SparsePoint out{point.position, {}};
    for (const auto& [image_id, index] : point.track) {
      (void)index;
      ++observations;
      if (image_id < 1 || image_id > scene.views.size()) continue;
      const View& view = scene.views[image_id - 1];
      const Eigen::Vector3d uvz = view.camera.project(point.position);
      constexpr double kMargin = 0.25;  // bounds are quantiles of the depths of these points
      if (!view.camera.sees(uvz) || uvz.z() < view.near * (1 - kMargin) ||
          uvz.z() > view.far * (1 + kMargin)) {
        continue;
      }
      ++agreeing;
      out.views.push_back(static_cast<int>(image_id - 1));
    }
    std::sort(out.views.begin(), out.views.end());
    out.views.erase(std::unique(out.views.begin(), out.views.end()), out.views.end());
    if (!out.views.empty()) points.push_back(std::move(out));
  }
  constexpr double kNearlyAll = 0.95;
  if (static_cast<double>(agreeing) < kNearlyAll * static_cast<double>(observations)) {
    scene.warnings.emplace_back(
        "points3D.bin does not fit the cameras of poses_bounds.npy and was not used");
    return;
  }
  scene.points = std::move(points);
}

}  // namespace

bool is_llff(const fs::path& folder) { return is_present(folder / "poses_bounds.npy"); }

Scene read_llff(const SceneRoot& root) {
  const fs::path path = resolve_in_scene(root, "poses_bounds.npy", root.folder);
  ReadLimits limits;
  limits.max_file_bytes = limits.max_header_bytes + limits.max_views * kColumns * sizeof(double);
  const NpyArray array = read_npy(path, limits);
  if (array.shape.size() != 2 || array.shape[1] != kColumns) {
    std::string shape;
    for (const size_t n : array.shape) shape += (shape.empty() ? "" : ", ") + std::to_string(n);
    throw BadInput(Defect::Schema, path, "expected shape (N,17), found (" + shape + ")");
  }
  Scene scene;
  scene.kind = SceneKind::Llff;
  scene.folder = root.folder;
  scene.views = views_of_rows(array, path);
  add_sparse_points(root, scene);
  pair_with_images(root, scene);
  return scene;
}

}  // namespace cgs
