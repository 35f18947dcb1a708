// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/cameras_json_scene.h"

#include <string>
#include <vector>

#include "io/bytes/byte_reader.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/photograph_index.h"

namespace cgs {

namespace {

constexpr const char* kName = "cameras.json";

// Where a photograph that is named with its folder lies; empty if it is not there.
std::filesystem::path photograph_in_folder(const SceneRoot& root, const std::string& name) {
  if (name.find('/') == std::string::npos) return {};
  for (const std::string& place : {"images/" + name, name}) {
    std::filesystem::path file = resolve_in_scene(root, place, root.folder / kName);
    if (is_present(file)) return file;
  }
  return {};
}

}  // namespace

bool is_cameras_json(const std::filesystem::path& folder) {
  constexpr uint64_t kEnough = 65536;
  if (!is_present(folder / kName)) return false;
  try {
    const std::string start = read_file_start(folder / kName, kEnough);
    const size_t first = start.find_first_not_of(" \t\r\n\xef\xbb\xbf");
    return first != std::string::npos && start[first] == '[' &&
           start.find("\"img_name\"") != std::string::npos;
  } catch (const Error&) {
    return false;  // what cannot be read states no cameras
  }
}

Scene read_cameras_json_scene(const SceneRoot& root) {
  std::vector<std::string> names;
  Scene scene = read_cameras_json(resolve_in_scene(root, kName, root.folder), &names);
  PhotographIndex photographs(root);
  scene.kind = SceneKind::CamerasJson;
  scene.folder = root.folder;
  scene.input.clear();
  scene.held_out.clear();
  scene.missing.clear();
  scene.water.reset();  // of another choice of input views, too
  for (size_t i = 0; i < scene.views.size(); ++i) {
    View& view = scene.views[i];
    view.image_path = photograph_in_folder(root, names[i]);
    if (view.image_path.empty()) view.image_path = photographs.take(names[i]);
    if (view.image_path.empty()) scene.missing.push_back(names[i]);
    view.exposure.setOnes();  // of another choice of input views
    view.response = {};
    view.may_have_border = false;
    // What this program wrote is in its internal frame.
    Camera& camera = view.camera;
    const Eigen::Isometry3d pose = world_from_internal(scene.frame, camera.world_from_cam);
    if (view.fisheye) camera = view.fisheye->photograph;
    camera.world_from_cam = pose;
    view.near *= scene.frame.scale;
    view.far *= scene.frame.scale;
  }
  for (const std::string& note : photographs.notes()) scene.notes.push_back(note);
  Frame world;
  world.metres_per_unit = scene.frame.metres_per_unit;
  world.metres_sigma = scene.frame.metres_sigma;
  world.scale_source = scene.frame.scale_source;
  world.up = scene.frame.up;
  scene.frame = world;
  return scene;
}

}  // namespace cgs
