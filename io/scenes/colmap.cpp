// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "io/scenes/camera_checks.h"
#include "io/scenes/colmap_model.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

bool holds_model(const fs::path& folder, const std::string& extension) {
  return is_present(folder / ("cameras" + extension)) &&
         is_present(folder / ("images" + extension));
}

// Where the model lies below the scene folder.
std::optional<fs::path> model_folder(const fs::path& folder) {
  for (const char* name : {"sparse/0", "sparse", "."}) {
    if (holds_model(folder / name, ".bin") || holds_model(folder / name, ".txt")) return name;
  }
  return std::nullopt;
}

// COLMAP writes a model of its own for each group of photographs that it cannot connect.
void warn_of_other_models(const fs::path& folder, Scene& scene) {
  const fs::path all = folder.parent_path();
  if (folder.filename() != "0") return;
  std::string names;
  for (const std::string& entry : sorted_entries(all)) {
    const bool is_other =
        entry != "0" && (holds_model(all / entry, ".bin") || holds_model(all / entry, ".txt"));
    if (is_other) names += (names.empty() ? "" : ", ") + printable(fs::path(entry));
  }
  if (names.empty()) return;
  scene.warnings.push_back("sparse/0 was read; there is another model in sparse/" + names +
                           ", of photographs that could not be connected with it; swap the "
                           "folders to read it");
}

ColmapModel read_model(const fs::path& folder, Scene& scene) {
  ColmapModel model;
  warn_of_other_models(folder, scene);
  const bool is_binary = holds_model(folder, ".bin");
  if (is_binary && holds_model(folder, ".txt")) {
    scene.warnings.emplace_back("the model is there as .bin and as .txt; .bin was read");
  }
  if (is_binary) {
    model.cameras = read_colmap_cameras_binary(folder / "cameras.bin");
    model.images = read_colmap_images_binary(folder / "images.bin");
    const fs::path points = folder / "points3D.bin";
    if (is_present(points)) model.points = read_colmap_points_binary(points);
  } else {
    model.cameras = read_colmap_cameras_text(folder / "cameras.txt");
    model.images = read_colmap_images_text(folder / "images.txt");
    const fs::path points = folder / "points3D.txt";
    if (is_present(points)) model.points = read_colmap_points_text(points);
  }
  return model;
}

Eigen::Isometry3d pose_of(const ColmapImage& image, const Refuse& refuse, Scene& scene) {
  const double norm = image.rotation.norm();
  if (!(norm > 1e-6 && norm < 1e6)) refuse(Defect::Value, "the rotation quaternion is not usable");
  constexpr double kRounding = 1e-4;
  if (std::abs(norm - 1) > kRounding) {
    scene.warnings.push_back("image " + printable(image.name) +
                             ": the rotation quaternion has length " + std::to_string(norm) +
                             " and was normalised");
  }
  const Eigen::Vector4d q = image.rotation / norm;
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  return checked_pose(rotation.toRotationMatrix(), image.translation, refuse).inverse();
}

// The photograph of an image name; empty if it does not exist.
fs::path photograph(const SceneRoot& root,
                    const fs::path& folder,
                    const std::string& name,
                    const fs::path& named_in) {
  const auto resolve = [&](const std::string& text) {
    // The name itself must stay below the image folder, not only the joined path.
    (void)resolve_in_scene(root, text, named_in);
    return resolve_in_scene(root, (folder / text).lexically_normal().string(), named_in);
  };
  fs::path path = resolve(name);
  if (is_present(path) || name.find('\\') == std::string::npos) return path;
  return resolve(with_slashes(name));
}

View view_of(const SceneRoot& root,
             const fs::path& folder,
             const ColmapModel& model,
             const ColmapImage& image,
             Scene& scene) {
  const Refuse refuse = [&](Defect defect, const std::string& reason) {
    throw BadInput(defect, root.folder, "image " + printable(image.name) + ": " + reason);
  };
  const auto camera = model.cameras.find(image.camera_id);
  if (camera == model.cameras.end()) {
    refuse(Defect::Ref, "camera " + std::to_string(image.camera_id) + " does not exist");
  }
  View view;
  view.name = image.name;
  view.camera = camera->second.camera;
  view.distortion = camera->second.distortion;
  view.fisheye = camera->second.fisheye;
  view.camera.world_from_cam = pose_of(image, refuse, scene);
  const fs::path path = photograph(root, folder, image.name, root.folder);
  if (is_present(path)) {
    view.image_path = path;
  } else {
    scene.missing.push_back(image.name);
  }
  return view;
}

struct DropCounts {
  size_t observations = 0;
  size_t bad_observations = 0;
  size_t bad_points = 0;
};

void add_points(const ColmapModel& model, Scene& scene) {
  std::map<uint32_t, size_t> index_of_id;
  for (size_t i = 0; i < model.images.size(); ++i) index_of_id[model.images[i].id] = i;
  DropCounts counts;
  for (const ColmapPoint& point : model.points) {
    SparsePoint out{point.position, {}};
    bool is_usable = point.position.allFinite();
    for (const auto& [image_id, keypoint] : point.track) {
      ++counts.observations;
      const auto found = index_of_id.find(image_id);
      // Models whose keypoints were stripped to save space keep their tracks.
      const uint64_t keypoints =
          found == index_of_id.end() ? 0 : model.images[found->second].keypoints;
      if (found == index_of_id.end() || (keypoints > 0 && keypoint >= keypoints)) {
        ++counts.bad_observations;
        continue;
      }
      // A point at a camera centre has no direction from there, hence no place in the image.
      const Camera& camera = scene.views[found->second].camera;
      is_usable = is_usable && camera.center() != point.position;
      out.views.push_back(static_cast<int>(found->second));
    }
    std::sort(out.views.begin(), out.views.end());
    out.views.erase(std::unique(out.views.begin(), out.views.end()), out.views.end());
    counts.bad_points += is_usable ? 0 : 1;
    if (is_usable) scene.points.push_back(std::move(out));
  }
  if (counts.observations > 0 && counts.bad_observations == counts.observations) {
    throw BadInput(
        Defect::Ref, scene.folder, "no observation of a sparse point fits the images of the model");
  }
  if (counts.bad_observations > 0) {
    scene.warnings.push_back("dropped " + std::to_string(counts.bad_observations) + " of " +
                             std::to_string(counts.observations) +
                             " observations that name unknown images or keypoints");
  }
  if (counts.bad_points > 0) {
    scene.warnings.push_back("dropped " + std::to_string(counts.bad_points) +
                             " sparse points that are not finite or lie at a camera centre");
  }
}

void add_model(const SceneRoot& root,
               const fs::path& photographs,
               const ColmapModel& model,
               Scene& scene) {
  for (const ColmapImage& image : model.images) {
    scene.views.push_back(view_of(root, photographs, model, image, scene));
  }
  add_points(model, scene);
}

}  // namespace

bool is_colmap(const fs::path& folder) { return model_folder(folder).has_value(); }

Scene read_colmap(const SceneRoot& root) {
  const std::optional<fs::path> folder = model_folder(root.folder);
  if (!folder) throw BadInput(Defect::Schema, root.folder, "no COLMAP model");
  Scene scene;
  scene.kind = SceneKind::Colmap;
  scene.folder = root.folder;
  const ColmapModel model =
      read_model(resolve_in_scene(root, folder->string(), root.folder), scene);
  add_model(root, is_folder(root.folder / "images") ? "images" : ".", model, scene);
  return scene;
}

Scene scene_of_colmap(const SceneRoot& root, const ColmapModel& model) {
  Scene scene;
  scene.kind = SceneKind::Colmap;
  scene.folder = root.folder;
  add_model(root, ".", model, scene);
  return scene;
}

}  // namespace cgs
