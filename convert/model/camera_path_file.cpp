// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/camera_path_file.h"

#include "convert/model/model.h"
#include "io/scenes/cameras_json.h"

namespace cgs {

std::vector<View> camera_views_from(const std::filesystem::path& file, const Model& model) {
  Scene path = read_cameras_json(file);
  use_metres_where_measured(path);  // as read_model() does
  const bool states_frame = path.kind != SceneKind::ForeignCameras;
  for (View& view : path.views) {
    Camera& camera = view.camera;
    const Frame& frame = model.scene.frame;  // whose coordinates in files may have another origin
    camera.world_from_cam.translation() =
        states_frame ? frame.internal_from_world(path.frame.world_from_internal(camera.center()))
                     : frame.internal_from_file(camera.center());
  }
  return path.views;
}

std::vector<Camera> camera_path_from(const std::filesystem::path& file, const Model& model) {
  std::vector<Camera> out;
  for (const View& view : camera_views_from(file, model)) out.push_back(view.camera);
  return out;
}

Scene scene_of_cameras(const Model& model,
                       const std::vector<Camera>& cameras,
                       const std::function<std::string(size_t)>& name_of) {
  Scene out;
  out.kind = model.scene.kind;
  out.folder = model.scene.folder;
  out.frame = model.scene.frame;
  for (size_t k = 0; k < cameras.size(); ++k) {
    View& view = out.views.emplace_back();
    view.name = name_of(k);
    view.camera = cameras[k];
  }
  return out;
}

}  // namespace cgs
