// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/camera_path_file.h"

#include "convert/model/model.h"
#include "io/scenes/cameras_json.h"

namespace cgs {

std::vector<Camera> camera_path_from(const std::filesystem::path& file, const Model& model) {
  Scene path = read_cameras_json(file);
  use_metres_where_measured(path);  // as read_model() does
  const bool states_frame = path.kind != SceneKind::ForeignCameras;
  std::vector<Camera> out;
  for (const View& view : path.views) {
    Camera camera = view.camera;
    const Frame& frame = model.scene.frame;  // whose coordinates in files may have another origin
    camera.world_from_cam.translation() =
        states_frame ? frame.internal_from_world(path.frame.world_from_internal(camera.center()))
                     : frame.internal_from_file(camera.center());
    out.push_back(camera);
  }
  return out;
}

}  // namespace cgs
