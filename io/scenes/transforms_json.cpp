// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/transforms_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"
#include "io/images/image.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/fisheye_map.h"
#include "io/scenes/photograph_index.h"
#include "io/scenes/view_sizes.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

// A setting of the frame, else of the whole file.
std::optional<JsonValue> setting(const JsonValue& document,
                                 const JsonValue& frame,
                                 std::string_view key) {
  if (auto value = frame.find(key)) return value;
  return document.find(key);
}

double number_or(const std::optional<JsonValue>& value, double fallback) {
  return value ? value->number() : fallback;
}

double focal_from_angle(const JsonValue& angle, int side) {
  const double value = angle.number();
  if (!(value > 0 && value < std::numbers::pi)) {
    angle.fail(Defect::Value, "a field of view must lie in (0, pi)");
  }
  return 0.5 * side / std::tan(0.5 * value);
}

// Whether the photograph was taken through a fisheye; refuses models that are not read.
bool is_fisheye(const JsonValue& document, const JsonValue& frame) {
  static constexpr std::array<std::string_view, 6> kKnown = {
      "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "PERSPECTIVE"};
  // Other lenses of instant-ngp, which has no camera_model and takes the key alone for yes.
  for (const char* key : {"ftheta_p0", "latlong", "equirectangular"}) {
    if (const auto other = setting(document, frame, key)) {
      other->fail(Defect::Unsupported,
                  "whatever its value, this key says a lens that is not read: undistort the images "
                  "first, or take it out if they are none of such a lens");
    }
  }
  const auto flag = setting(document, frame, "is_fisheye");
  const auto model = setting(document, frame, "camera_model");
  if (!model) return flag && flag->boolean();
  if (model->text() == "OPENCV_FISHEYE") return true;
  if (std::find(kKnown.begin(), kKnown.end(), model->text()) == kKnown.end()) {
    model->fail(Defect::Unsupported,
                "camera model \"" + printable(model->text()) +
                    "\" is not read; known are PINHOLE, OPENCV and OPENCV_FISHEYE: undistort the "
                    "images first");
  }
  return flag && flag->boolean();
}

// A coefficient as one object states it: in the list, which wins in nerfstudio, or by its name.
std::optional<JsonValue> stated_coefficient(const JsonValue& object, std::string_view key) {
  static constexpr std::array<std::string_view, 6> kOrder = {"k1", "k2", "k3", "k4", "p1", "p2"};
  const auto list = object.find("distortion_params");
  if (!list) return object.find(key);
  if (list->size() != kOrder.size()) list->fail(Defect::Schema, "expected k1 k2 k3 k4 p1 p2");
  const auto* const place = std::find(kOrder.begin(), kOrder.end(), key);
  if (place == kOrder.end()) return object.find(key);
  return list->at(static_cast<size_t>(place - kOrder.begin()));
}

// Of the frame, else of the whole file; 0 if neither states it.
double coefficient(const JsonValue& document, const JsonValue& frame, std::string_view key) {
  if (const auto value = stated_coefficient(frame, key)) return value->number();
  return number_or(stated_coefficient(document, key), 0);
}

void refuse_further_terms(const JsonValue& document,
                          const JsonValue& frame,
                          std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (coefficient(document, frame, key) == 0) continue;
    frame.fail(Defect::Unsupported,
               std::string("the distortion ") + key + " is not read: undistort the images first");
  }
}

void read_distortion(const JsonValue& document, const JsonValue& frame, View& view) {
  const auto get = [&](const char* key) { return coefficient(document, frame, key); };
  const Refuse refuse = [&](Defect defect, const std::string& why) { frame.fail(defect, why); };
  if (is_fisheye(document, frame)) {
    refuse_further_terms(document, frame, {"k5", "k6"});
    view.fisheye = Fisheye{view.camera,
                           {get("k1"), get("k2"), get("k3"), get("k4")},
                           {get("p1"), get("p2")},
                           number_or(setting(document, frame, "fisheye_crop_radius"), 0)};
    check_fisheye(*view.fisheye, refuse);
    return;
  }
  refuse_further_terms(document, frame, {"k4", "k5", "k6"});
  view.distortion = {get("k1"), get("k2"), get("p1"), get("p2"), get("k3")};
  check_distortion(view.camera, view.distortion, refuse);
}

// Intrinsics of a frame for an image of the given size.
void read_intrinsics(const JsonValue& document, const JsonValue& frame, View& view) {
  Camera& camera = view.camera;
  const auto get = [&](std::string_view key) { return setting(document, frame, key); };
  // A frame that states a focal length states all of it.
  const bool is_own = frame.find("fl_x") || frame.find("camera_angle_x");
  const auto focal = [&](std::string_view key) { return (is_own ? frame : document).find(key); };
  const auto fl_x = focal("fl_x");
  const auto fl_y = is_own ? focal("fl_y") : get("fl_y");
  const auto angle_x = focal("camera_angle_x");
  const auto angle_y = is_own ? focal("camera_angle_y") : get("camera_angle_y");
  if (fl_x) {
    camera.fx = fl_x->number();
  } else if (angle_x) {
    camera.fx = focal_from_angle(*angle_x, camera.width);
  } else {
    frame.fail(Defect::Schema, "neither fl_x nor camera_angle_x is given, here or for all frames");
  }
  if (fl_y) {
    camera.fy = fl_y->number();
  } else if (!fl_x && angle_y) {
    camera.fy = focal_from_angle(*angle_y, camera.height);
  } else {
    camera.fy = camera.fx;  // square pixels
  }
  camera.cx = number_or(get("cx"), 0.5 * camera.width);
  camera.cy = number_or(get("cy"), 0.5 * camera.height);
  const Refuse refuse = [&](Defect defect, const std::string& why) { frame.fail(defect, why); };
  check_intrinsics(camera, refuse);
  read_distortion(document, frame, view);
}

Eigen::Isometry3d read_transform(const JsonValue& matrix) {
  const size_t rows = matrix.size();
  if (rows != 4 && rows != 3) matrix.fail(Defect::Schema, "expected a 4 x 4 matrix");
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  for (size_t r = 0; r < rows; ++r) {
    const JsonValue row = matrix.at(r);
    if (row.size() != 4) row.fail(Defect::Schema, "expected a row of 4 numbers");
    for (size_t c = 0; c < 4; ++c) M(Eigen::Index(r), Eigen::Index(c)) = row.at(c).number();
  }
  if ((M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9) {
    matrix.fail(Defect::Value, "the last row must be 0 0 0 1");
  }
  const Eigen::Matrix3d opencv_from_opengl = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return checked_pose(M.topLeftCorner<3, 3>() * opencv_from_opengl,
                      M.topRightCorner<3, 1>(),
                      [&](Defect defect, const std::string& why) { matrix.fail(defect, why); });
}

fs::path file_named(const SceneRoot& root, const std::string& name, const fs::path& json) {
  fs::path path = resolve_in_scene(root, name, json);
  if (is_present(path) || name.find('\\') == std::string::npos) return path;
  return resolve_in_scene(root, with_slashes(name), json);
}

// The photograph a frame names, whether or not it exists.
fs::path photograph(const SceneRoot& root, const std::string& name, const fs::path& json) {
  fs::path path = resolve_in_scene(root, name, json);
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return path;
  if (name.find('\\') != std::string::npos) return photograph(root, with_slashes(name), json);
  for (const char* extension : {".png", ".jpg", ".jpeg"}) {
    fs::path candidate = resolve_in_scene(root, name + extension, json);
    if (fs::is_regular_file(candidate, ignored)) return candidate;
  }
  for (const std::string& entry : sorted_entries(path.parent_path())) {  // .JPG, .webp, …
    const fs::path file(entry);
    if (file.stem() != path.filename() || !has_image_extension(file)) continue;
    return resolve_in_scene(root, (fs::path(name).parent_path() / file).string(), json);
  }
  return path;
}

// Sets the size of the view's camera from w and h, to which its intrinsics refer, or from the file.
void read_size(const JsonValue& document, const JsonValue& frame, View& view) {
  const auto w = setting(document, frame, "w");
  const auto h = setting(document, frame, "h");
  Camera& camera = view.camera;
  camera.width = w ? w->count() : 0;
  camera.height = h ? h->count() : 0;
  if (view.image_path.empty()) return;
  const ImageSize size = image_size(view.image_path);
  if (!w && !h) {
    camera.width = size.width;
    camera.height = size.height;
    return;
  }
  const auto other = [](int stated, int of, int wanted) {
    return static_cast<int>(std::lround(double(stated) * wanted / of));
  };
  if (!w) camera.width = other(camera.height, size.height, size.width);
  if (!h) camera.height = other(camera.width, size.width, size.height);
  if (have_same_shape(camera.width, camera.height, size.width, size.height)) return;
  frame.fail(Defect::Mismatch,
             "w x h is " + size_text(camera.width, camera.height) + ", the image file has " +
                 size_text(size.width, size.height));
}

// Paths that this reader does not follow are held to the same rule as those it does.
void check_other_paths(const SceneRoot& root, const JsonValue& object, const fs::path& json) {
  for (const char* key : {"depth_file_path", "mask_path", "ply_file_path"}) {
    if (const auto name = object.find(key)) (void)resolve_in_scene(root, name->text(), json);
  }
}

}  // namespace

bool is_transforms_json(const fs::path& folder) {
  return is_present(folder / "transforms.json") || is_present(folder / "transforms_train.json");
}

Scene read_transforms_json(const SceneRoot& root) {
  const bool has_all = is_present(root.folder / "transforms.json");
  const char* const file_name = has_all ? "transforms.json" : "transforms_train.json";
  const fs::path path = resolve_in_scene(root, file_name, root.folder);
  const nlohmann::json json = read_json(path);
  const JsonValue document(json, path);
  const JsonValue frames = document.at("frames");
  check_other_paths(root, document, path);
  Scene scene;
  scene.kind = SceneKind::TransformsJson;
  scene.folder = root.folder;
  if (frames.size() == 0) frames.fail(Defect::Empty, "there are no frames");
  std::set<fs::path> seen;
  std::optional<PhotographIndex> index;  // made for the first name that is not there as it is
  for (size_t i = 0; i < frames.size(); ++i) {
    const JsonValue frame = frames.at(i);
    check_other_paths(root, frame, path);
    View view;
    const std::string name = frame.at("file_path").text();
    fs::path image = photograph(root, name, path);
    if (!is_present(image)) {
      if (!index) index.emplace(root, std::vector<std::string>{"."});
      if (fs::path close = index->take_path(name); !close.empty()) image = std::move(close);
    }
    if (!seen.insert(image.lexically_normal()).second) {
      scene.warnings.push_back(frame.pointer() + ": \"" + printable(name) +
                               "\" occurs twice; the first was taken");
      continue;
    }
    if (is_present(image)) {
      view.image_path = image;
    } else {
      scene.missing.push_back(name);
    }
    view.name = view.image_path.empty() ? name : image.lexically_relative(root.folder).string();
    if (const auto depth = frame.find("depth_file_path")) {
      const fs::path file = file_named(root, depth->text(), path);
      if (is_present(file) && has_depth_extension(file)) {
        view.depth_path = file;
      } else {
        scene.warnings.push_back(
            depth->pointer() + ": \"" + printable(fs::path(depth->text())) +
            (is_present(file) ? "\" is no file of depth that can be read" : "\" does not exist") +
            "; view " + printable(fs::path(view.name)) + " has no depth");
      }
    }
    if (const auto mask = frame.find("mask_path")) {
      view.mask_path = file_named(root, mask->text(), path);
      if (!is_present(view.mask_path)) {
        scene.warnings.push_back(mask->pointer() + ": there is no mask \"" +
                                 printable(fs::path(mask->text())) + "\"; all of view " +
                                 printable(fs::path(view.name)) + " is used");
        view.mask_path.clear();
      }
    }
    read_size(document, frame, view);
    view.camera.world_from_cam = read_transform(frame.at("transform_matrix"));
    const bool has_size = view.camera.width > 0 && view.camera.height > 0;
    if (!has_size && view.image_path.empty()) continue;  // nothing would ever tell its size
    read_intrinsics(document, frame, view);
    scene.views.push_back(std::move(view));
  }
  if (index) {
    for (const std::string& note : index->notes()) scene.notes.push_back(note);
  }
  return scene;
}

}  // namespace cgs
