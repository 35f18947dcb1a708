// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/cameras_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/fisheye_map.h"

namespace cgs {

namespace {

using Json = nlohmann::json;

Json vector_json(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json frame_json(const Scene& scene) {
  const Frame& frame = scene.frame;
  Json out = {{"origin", vector_json(frame.origin)},
              {"scale", frame.scale},
              {"file_origin", vector_json(frame.file_origin)},
              {"metres_per_unit", frame.metres_per_unit},
              {"metres_sigma", frame.metres_sigma},
              {"scale_source", scale_source_name(frame.scale_source)},
              {"up", vector_json(frame.up)},
              {"kind", scene_kind_name(scene.kind)},
              {"folder", std::filesystem::absolute(scene.folder).lexically_normal().string()}};
  if (!scene.photographs.empty()) out["photographs"] = scene.photographs;
  return out;
}

constexpr std::array<std::pair<const char*, Eigen::Vector3d Water::*>, 6> kWaterFields = {
    {{"attenuation", &Water::attenuation},
     {"attenuation_sigma", &Water::attenuation_sigma},
     {"backscatter", &Water::backscatter},
     {"backscatter_sigma", &Water::backscatter_sigma},
     {"veil", &Water::veil},
     {"veil_sigma", &Water::veil_sigma}}};

Json water_json(const Water& water) {
  Json out = Json::object();
  for (const auto& [name, field] : kWaterFields) out[name] = vector_json(water.*field);
  if (water.lamp_range > 0) out["lamp_range"] = water.lamp_range;
  return out;
}

Json fisheye_json(const Fisheye& fisheye) {
  const Camera& c = fisheye.photograph;
  return {{"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"k", fisheye.k},
          {"p", fisheye.p},
          {"radius", fisheye.radius}};
}

Json response_json(const PhotoResponse& response) {
  const Eigen::Matrix3d& m = response.matrix;
  return {{"grey", response.is_grey},
          {"gamma", response.gamma},
          {"vignette", {response.vignette.x(), response.vignette.y()}},
          {"matrix",
           Json::array({vector_json(m.row(0)), vector_json(m.row(1)), vector_json(m.row(2))})}};
}

Json camera_json(const Scene& scene, size_t index) {
  const View& view = scene.views[index];
  const Camera& camera = view.camera;
  const Eigen::Matrix3d R = camera.world_from_cam.linear();
  const bool is_finite = camera.world_from_cam.matrix().allFinite() && std::isfinite(camera.fx) &&
                         std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                         std::isfinite(camera.cy);
  require(is_finite, "write_cameras_json: every camera must be finite", view.name);
  Json entry = {
      {"id", index},
      {"img_name", view.name},
      {"width", camera.width},
      {"height", camera.height},
      {"position", vector_json(scene.frame.file_from_internal(camera.center()))},
      {"rotation",
       Json::array({vector_json(R.row(0)), vector_json(R.row(1)), vector_json(R.row(2))})},
      {"fx", camera.fx},
      {"fy", camera.fy},
      {"cx", camera.cx},
      {"cy", camera.cy},
      // position loses the low bits of the internal one where the origin is far away
      {"internal_position", vector_json(camera.center())},
      {"near", view.near},
      {"far", view.far},
      {"distortion", view.distortion},
  };
  const auto contains = [&](const std::vector<int>& list) {
    return std::find(list.begin(), list.end(), static_cast<int>(index)) != list.end();
  };
  entry["role"] = contains(scene.input) ? "input" : contains(scene.held_out) ? "held_out" : "";
  if (view.fisheye) entry["fisheye"] = fisheye_json(*view.fisheye);
  if (view.orientation != 1) entry["orientation"] = view.orientation;
  if (view.exposure != Eigen::Vector3f::Ones()) {
    entry["exposure"] = vector_json(view.exposure.cast<double>());
  }
  if (view.response != PhotoResponse{}) entry["response"] = response_json(view.response);
  if (view.may_have_border) entry["may_have_border"] = true;
  if (!view.image_path.empty()) {
    entry["image_path"] = std::filesystem::absolute(view.image_path).lexically_normal().string();
  }
  if (!view.mask_path.empty()) {
    entry["mask_path"] = std::filesystem::absolute(view.mask_path).lexically_normal().string();
  }
  return entry;
}

Eigen::Vector3d read_vector(const JsonValue& value) {
  if (value.size() != 3) value.fail(Defect::Schema, "expected 3 numbers");
  return {value.at(size_t{0}).number(), value.at(1).number(), value.at(2).number()};
}

ScaleSource read_scale_source(const JsonValue& value) {
  const std::string name = value.text();
  for (int i = 0; i <= static_cast<int>(ScaleSource::DepthSensor); ++i) {
    if (scale_source_name(static_cast<ScaleSource>(i)) == name) return static_cast<ScaleSource>(i);
  }
  value.fail(Defect::Schema, "unknown source of the scale");
}

void read_frame(const JsonValue& value, Scene& scene) {
  Frame& frame = scene.frame;
  frame.origin = read_vector(value.at("origin"));
  frame.scale = value.at("scale").number();
  frame.file_origin = read_vector(value.at("file_origin"));
  frame.metres_per_unit = value.at("metres_per_unit").number();
  frame.metres_sigma = value.at("metres_sigma").number();
  frame.scale_source = read_scale_source(value.at("scale_source"));
  if (const auto up = value.find("up")) frame.up = read_vector(*up);
  try {
    frame.validate();
  } catch (const InvalidInput& error) {
    value.fail(Defect::Value, error.what());
  }
  scene.kind = scene_kind_of(value.at("kind").text());
  scene.folder = value.at("folder").text();
  // Numbers of views count them, those that have no camera, too.
  if (const auto names = value.find("photographs")) {
    for (size_t i = 0; i < names->size(); ++i) {
      scene.photographs.push_back(names->at(i).text());
    }
  }
}

Water read_water(const JsonValue& value) {
  Water out;
  for (const auto& [name, field] : kWaterFields) {
    const JsonValue numbers = value.at(name);
    out.*field = read_vector(numbers);
    if (!((out.*field).allFinite() && (out.*field).minCoeff() >= 0)) {
      numbers.fail(Defect::Value, "must be >= 0");
    }
  }
  if (out.veil.maxCoeff() > 1) value.at("veil").fail(Defect::Value, "must be <= 1");
  if (const auto lamp = value.find("lamp_range")) {
    out.lamp_range = lamp->number();
    if (!(out.lamp_range > 0 && std::isfinite(out.lamp_range))) {
      lamp->fail(Defect::Value, "must be > 0");
    }
  }
  return out;
}

Eigen::Vector3d read_position(const JsonValue& entry, const Frame& frame) {
  const Eigen::Vector3d in_file = read_vector(entry.at("position"));
  Eigen::Vector3d from_file = frame.internal_from_file(in_file);
  const auto exact = entry.find("internal_position");
  if (!exact) return from_file;
  Eigen::Vector3d internal = read_vector(*exact);
  // Written together they agree exactly; otherwise somebody moved the camera.
  return frame.file_from_internal(internal) == in_file ? internal : from_file;
}

Fisheye read_fisheye(const JsonValue& value) {
  Fisheye out;
  Camera& camera = out.photograph;
  camera.width = value.at("width").count();
  camera.height = value.at("height").count();
  camera.fx = value.at("fx").number();
  camera.fy = value.at("fy").number();
  camera.cx = value.at("cx").number();
  camera.cy = value.at("cy").number();
  const JsonValue k = value.at("k");
  const JsonValue p = value.at("p");
  if (k.size() != out.k.size()) k.fail(Defect::Schema, "expected k1 k2 k3 k4");
  if (p.size() != out.p.size()) p.fail(Defect::Schema, "expected p1 p2");
  for (size_t i = 0; i < out.k.size(); ++i) out.k.at(i) = k.at(i).number();
  for (size_t i = 0; i < out.p.size(); ++i) out.p.at(i) = p.at(i).number();
  out.radius = value.at("radius").number();
  check_fisheye(out, [&](Defect defect, const std::string& why) { value.fail(defect, why); });
  return out;
}

// Photographs are undistorted to the picture of the fisheye, at the size of the camera.
void check_picture(const View& view, const JsonValue& entry) {
  const Camera& camera = view.camera;
  const Camera expected = resized(FisheyeMap(*view.fisheye).picture(), camera.width, camera.height);
  const Eigen::Vector4d difference(expected.fx - camera.fx,
                                   expected.fy - camera.fy,
                                   expected.cx - camera.cx,
                                   expected.cy - camera.cy);
  constexpr double kSame = 0.01;  // [pixels]
  if (difference.cwiseAbs().maxCoeff() <= kSame) return;
  entry.fail(Defect::Mismatch, "the camera is not that of the undistorted picture of its fisheye");
}

bool is_file_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('\0') == std::string::npos;
}

// Files are named after views: a name must not lead into another folder. Other programs name
// photographs of several cameras by their folders.
std::string read_name(const JsonValue& value, bool is_foreign, std::set<std::string>& taken) {
  std::string name = value.text();
  bool is_plain = is_foreign || name.find('/') == std::string::npos;
  for (size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = name.find('/', begin);
    is_plain = is_plain && is_file_name(name.substr(begin, end - begin));
  }
  if (!is_plain) value.fail(Defect::Path, "a view must have the name of a file without a folder");
  std::replace(name.begin(), name.end(), '/', '_');
  if (!taken.insert(name).second) value.fail(Defect::Syntax, "two views are named " + name);
  return name;
}

constexpr float kLargestGain = 1000;  // ten stops

View read_view(const JsonValue& entry, const Frame& frame) {
  const Refuse refuse = [&](Defect defect, const std::string& why) { entry.fail(defect, why); };
  View view;
  Camera& camera = view.camera;
  camera.width = entry.at("width").count();
  camera.height = entry.at("height").count();
  camera.fx = entry.at("fx").number();
  camera.fy = entry.at("fy").number();
  const auto cx = entry.find("cx");
  const auto cy = entry.find("cy");
  camera.cx = cx ? cx->number() : 0.5 * camera.width;
  camera.cy = cy ? cy->number() : 0.5 * camera.height;
  check_intrinsics(camera, refuse);
  const JsonValue rotation = entry.at("rotation");
  if (rotation.size() != 3) rotation.fail(Defect::Schema, "expected a 3 x 3 matrix");
  Eigen::Matrix3d R;
  for (size_t i = 0; i < 3; ++i) R.row(Eigen::Index(i)) = read_vector(rotation.at(i));
  camera.world_from_cam = checked_pose(R, read_position(entry, frame), refuse);
  if (const auto near = entry.find("near")) view.near = near->number();
  if (const auto far = entry.find("far")) view.far = far->number();
  if (const auto distortion = entry.find("distortion")) {
    if (distortion->size() != 5) distortion->fail(Defect::Schema, "expected k1 k2 p1 p2 k3");
    for (size_t i = 0; i < 5; ++i) view.distortion[i] = distortion->at(i).number();
    check_distortion(camera, view.distortion, refuse);
  }
  if (const auto fisheye = entry.find("fisheye")) {
    view.fisheye = read_fisheye(*fisheye);
    check_picture(view, entry);
  }
  if (const auto orientation = entry.find("orientation")) {
    view.orientation = orientation->count();
    if (view.orientation < 1 || view.orientation > 8) {
      orientation->fail(Defect::Value, "must be 1 ... 8, as Exif counts");
    }
  }
  return view;
}

// Of files that this program wrote.
void read_exposure(const JsonValue& entry, View& view) {
  if (const auto exposure = entry.find("exposure")) {
    view.exposure = read_vector(*exposure).cast<float>();
    if (!(view.exposure.minCoeff() > 0 && view.exposure.maxCoeff() <= kLargestGain)) {
      exposure->fail(Defect::Value, "factors of exposure must be > 0 and <= 1000");
    }
  }
}

// Of files that this program wrote.
void read_response(const JsonValue& entry, View& view) {
  if (const auto border = entry.find("may_have_border")) view.may_have_border = border->boolean();
  const auto response = entry.find("response");
  if (!response) return;
  constexpr double kMost = 1000;
  PhotoResponse& out = view.response;
  out.is_grey = response->at("grey").boolean();
  out.gamma = response->at("gamma").number();
  const JsonValue vignette = response->at("vignette");
  const JsonValue matrix = response->at("matrix");
  if (vignette.size() != 2) vignette.fail(Defect::Schema, "expected 2 numbers");
  if (matrix.size() != 3) matrix.fail(Defect::Schema, "expected 3 rows");
  for (size_t i = 0; i < 2; ++i) {
    out.vignette[static_cast<Eigen::Index>(i)] = vignette.at(i).number();
  }
  for (size_t i = 0; i < 3; ++i) {
    out.matrix.row(static_cast<Eigen::Index>(i)) = read_vector(matrix.at(i)).transpose();
  }
  const bool is_sound = out.gamma > 0 && out.gamma <= kMost &&
                        out.vignette.cwiseAbs().maxCoeff() <= kMost &&
                        out.matrix.cwiseAbs().maxCoeff() <= kMost;
  if (!is_sound) response->fail(Defect::Value, "numbers of a response must be at most 1000");
}

void read_paths(const JsonValue& entry, View& view, Scene& scene) {
  const auto name = entry.find("image_path");
  if (!name) return;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(name->text(), ignored)) {
    view.image_path = name->text();
  } else {
    scene.missing.push_back(name->text());
  }
  if (const auto mask = entry.find("mask_path")) view.mask_path = mask->text();
}

}  // namespace

void write_cameras_json(const std::filesystem::path& path, const Scene& scene) {
  Json document = Json::array();
  for (size_t i = 0; i < scene.views.size(); ++i) {
    document.push_back(camera_json(scene, i));
    if (i > 0) continue;
    document.back()["frame"] = frame_json(scene);
    if (scene.water) document.back()["water"] = water_json(*scene.water);
  }
  // File names need not be UTF-8, JSON has to be.
  write_file(path, document.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Scene read_cameras_json(const std::filesystem::path& path, std::vector<std::string>* names) {
  const ReadLimits limits;
  const Json document = read_json(path, limits);
  const JsonValue entries(document, path);
  if (entries.size() == 0) entries.fail(Defect::Empty, "there is no camera");
  if (entries.size() > limits.max_views) {
    throw LimitError(printable(path) + ": " + std::to_string(entries.size()) + " cameras");
  }
  Scene scene;
  scene.kind = SceneKind::ForeignCameras;
  scene.folder = path.parent_path();
  const auto frame = entries.at(size_t{0}).find("frame");
  if (frame) {
    read_frame(*frame, scene);
    const auto water = entries.at(size_t{0}).find("water");
    if (water) scene.water = read_water(*water);
  }
  std::set<std::string> taken;
  for (size_t i = 0; i < entries.size(); ++i) {
    const JsonValue entry = entries.at(i);
    View view = read_view(entry, scene.frame);
    if (frame) {
      read_exposure(entry, view);
      read_response(entry, view);
    }
    view.name = read_name(entry.at("img_name"), !frame, taken);
    if (names != nullptr) names->push_back(entry.at("img_name").text());
    read_paths(entry, view, scene);
    if (const auto role = entry.find("role")) {
      if (role->text() == "input") scene.input.push_back(static_cast<int>(i));
      if (role->text() == "held_out") scene.held_out.push_back(static_cast<int>(i));
    }
    scene.views.push_back(std::move(view));
  }
  return scene;
}

}  // namespace cgs
