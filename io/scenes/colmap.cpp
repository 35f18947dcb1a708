// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "io/scenes/camera_checks.h"
#include "io/scenes/colmap_model.h"
#include "io/scenes/photograph_index.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

bool holds_model(const fs::path& folder, const std::string& extension) {
  return is_present(folder / ("cameras" + extension)) &&
         is_present(folder / ("images" + extension));
}

bool holds_model(const fs::path& folder) {
  return holds_model(folder, ".bin") || holds_model(folder, ".txt");
}

// Folders of models below a folder, itself included: COLMAP writes one for each group of
// photographs that it cannot connect.
std::vector<std::string> models_in(const fs::path& scene, const std::string& folder) {
  std::vector<std::string> out;
  if (!is_folder(scene / folder)) return out;
  for (const std::string& entry : sorted_entries(scene / folder)) {
    if (holds_model(scene / folder / entry)) out.push_back(folder + "/" + entry);
  }
  if (holds_model(scene / folder)) out.push_back(folder);
  return out;
}

// The models of a scene of which one is to be read: those in the first place that has any.
std::vector<std::string> model_folders(const fs::path& scene) {
  std::vector<std::string> out = models_in(scene, "sparse");
  if (out.empty() && holds_model(scene)) return {"."};
  for (const std::string& entry :
       out.empty() ? sorted_entries(scene) : std::vector<std::string>()) {
    if (!entry.starts_with("sparse")) continue;  // sparse_3 and such, of subsets of photographs
    const std::vector<std::string> more = models_in(scene, entry);
    out.insert(out.end(), more.begin(), more.end());
  }
  for (const char* place : {"colmap/sparse", "distorted/sparse"}) {
    if (out.empty()) out = models_in(scene, place);
  }
  return out;
}

// How many images a model has; 0 where that cannot be told.
uint64_t image_count(const SceneRoot& root, const std::string& name) {
  try {
    const fs::path model = resolve_in_scene(root, name, root.folder);
    if (!holds_model(model, ".bin")) return read_colmap_images_text(model / "images.txt").size();
    const std::string start = read_file_start(model / "images.bin", 8);
    return ByteReader(start, model).get<uint64_t>("number of images");
  } catch (const Error&) {
    return 0;  // whoever reads it is told what is wrong
  }
}

// The model with most images, told where there are others.
std::string largest_model(const SceneRoot& root, Scene& scene) {
  const std::vector<std::string> models = model_folders(root.folder);
  if (models.empty()) throw BadInput(Defect::Schema, root.folder, "no COLMAP model");
  if (models.size() == 1) return models.front();
  std::vector<uint64_t> counts;
  for (const std::string& model : models) counts.push_back(image_count(root, model));
  const auto most =
      static_cast<size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  std::string others;
  for (size_t i = 0; i < models.size(); ++i) {
    if (i == most) continue;
    others += (others.empty() ? "" : ", ") + printable(fs::path(models[i])) + " (" +
              std::to_string(counts[i]) + ")";
  }
  const bool is_one = models.size() == 2;
  scene.warnings.push_back(printable(fs::path(models[most])) + " was read, with " +
                           std::to_string(counts[most]) + " images; there " +
                           (is_one ? "is another model in " : "are other models in ") + others +
                           ", with coordinates of " + (is_one ? "its" : "their") +
                           " own; move the one that was read away to read another");
  return models[most];
}

// Where the photographs of a model lie: of the usual places the one that has most of them.
std::string photograph_folder(const SceneRoot& root,
                              const std::string& model_folder,
                              const ColmapModel& model) {
  std::vector<std::string> places = {"images", "input", "."};
  for (const std::string base : {"colmap", "distorted"}) {
    if (!model_folder.starts_with(base + "/")) continue;
    places.insert(places.begin(), base + "/images");
    // Those of before they were undistorted.
    if (base == "distorted") std::swap(places[1], places[2]);
  }
  std::string best = is_folder(root.folder / "images") ? "images" : ".";
  size_t most = 0;
  const auto try_place = [&](const std::string& place) {
    if (!is_folder(root.folder / place)) return;
    size_t count = 0;
    for (const ColmapImage& image : model.images) {
      const fs::path name = with_slashes(image.name);
      count += stays_below(name) && is_present(root.folder / place / name) ? 1 : 0;
    }
    if (count > most) best = place;
    most = std::max(most, count);
  };
  std::for_each(places.begin(), places.end(), try_place);
  // Smaller copies, where they are all that was kept of a published scene.
  for (const char* copies : {"images_2", "images_4", "images_8"}) {
    if (most == 0) try_place(copies);
  }
  return best;
}

// Only cameras that images name are judged.
ColmapCameras used_cameras(const fs::path& file, const std::vector<ColmapImage>& images) {
  std::set<uint32_t> used;
  for (const ColmapImage& image : images) used.insert(image.camera_id);
  return file.extension() == ".bin" ? read_colmap_cameras_binary(file, &used)
                                    : read_colmap_cameras_text(file, &used);
}

// \param where  of the model, relative to the scene
ColmapModel read_model(const SceneRoot& root, const std::string& where, Scene& scene) {
  const fs::path folder = resolve_in_scene(root, where, root.folder);
  const auto file = [&](const char* name) {
    return resolve_in_scene(root, (fs::path(where) / name).lexically_normal().string(), folder);
  };
  ColmapModel model;
  const bool is_binary = holds_model(folder, ".bin");
  if (is_binary && holds_model(folder, ".txt")) {
    scene.warnings.emplace_back("the model is there as .bin and as .txt; .bin was read");
  }
  if (is_binary) {
    model.images = read_colmap_images_binary(file("images.bin"));
    model.cameras = used_cameras(file("cameras.bin"), model.images);
    const fs::path points = file("points3D.bin");
    if (is_present(points)) model.points = read_colmap_points_binary(points);
  } else {
    model.images = read_colmap_images_text(file("images.txt"));
    model.cameras = used_cameras(file("cameras.txt"), model.images);
    const fs::path points = file("points3D.txt");
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

// The photographs of a model, which lie in one folder.
class Photographs {
 public:
  Photographs(const SceneRoot& root, std::string folder)
      : root_(root), folder_(std::move(folder)) {}

  // Of an image name; empty if it does not exist.
  fs::path of(const std::string& name) {
    fs::path path = resolved(name);
    if (!is_present(path) && name.find('\\') != std::string::npos) {
      path = resolved(with_slashes(name));
    }
    if (is_present(path)) return path;
    if (!index_) index_.emplace(root_, std::vector<std::string>{folder_});
    return index_->take_path(name);
  }

  std::vector<std::string> notes() const {
    return index_ ? index_->notes() : std::vector<std::string>();
  }

 private:
  fs::path resolved(const std::string& name) const {
    // The name itself must stay below the image folder, not only the joined path.
    (void)resolve_in_scene(root_, name, root_.folder);
    return resolve_in_scene(
        root_, (fs::path(folder_) / name).lexically_normal().string(), root_.folder);
  }

  const SceneRoot& root_;
  std::string folder_;
  std::optional<PhotographIndex> index_;  // made for the first name that is not there as it is
};

View view_of(Photographs& photographs,
             const ColmapModel& model,
             const ColmapImage& image,
             Scene& scene) {
  const Refuse refuse = [&](Defect defect, const std::string& reason) {
    throw BadInput(defect, scene.folder, "image " + printable(image.name) + ": " + reason);
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
  view.image_path = photographs.of(image.name);
  if (view.image_path.empty()) scene.missing.push_back(image.name);
  return view;
}

// Two images may mean one file where one of the names is not its own.
void refuse_shared_photographs(const ColmapModel& model, const Scene& scene) {
  std::map<fs::path, std::string> names;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const fs::path& path = scene.views[i].image_path;
    if (path.empty()) continue;
    const auto [owner, is_new] = names.emplace(path, model.images[i].name);
    if (is_new || owner->second == model.images[i].name) continue;
    throw BadInput(Defect::Ref,
                   path,
                   "is the photograph of two images, \"" + printable(owner->second) + "\" and \"" +
                       printable(model.images[i].name) + "\"");
  }
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
               const std::string& photograph_folder,
               const ColmapModel& model,
               Scene& scene) {
  Photographs photographs(root, photograph_folder);
  for (const ColmapImage& image : model.images) {
    scene.views.push_back(view_of(photographs, model, image, scene));
  }
  refuse_shared_photographs(model, scene);
  for (const std::string& note : photographs.notes()) scene.notes.push_back(note);
  add_points(model, scene);
}

}  // namespace

bool is_colmap(const fs::path& folder) { return !model_folders(folder).empty(); }

Scene read_colmap(const SceneRoot& root) {
  Scene scene;
  scene.kind = SceneKind::Colmap;
  scene.folder = root.folder;
  const std::string folder = largest_model(root, scene);
  const ColmapModel model = read_model(root, folder, scene);
  add_model(root, photograph_folder(root, folder, model), model, scene);
  return scene;
}

Scene scene_of_colmap(const SceneRoot& root,
                      const ColmapModel& model,
                      const std::filesystem::path& photographs) {
  Scene scene;
  scene.kind = SceneKind::Colmap;
  scene.folder = root.folder;
  add_model(root, photographs.string(), model, scene);
  return scene;
}

}  // namespace cgs
