// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/request_fields.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "convert/model/model_pictures.h"
#include "convert/model/model_training.h"
#include "convert/model/water_report.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/lens.h"
#include "io/scenes/view_names.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

// How members are kept, by their types, and taken back.

template <typename T>
Json kept(const T& value) {
  return value;
}
template <typename T>
void take(const Json& json, T& out) {
  out = json.get<T>();
}

void take(const Json& json, std::string& out) {
  if (json.is_string()) out = json.get<std::string>();
}
void take(const Json& json, double& out) {
  if (json.is_number()) out = json.get<double>();
}
void take(const Json& json, bool& out) { out = json == Json(true); }

Json kept(const fs::path& path) {
  return path.empty() ? std::string() : fs::weakly_canonical(path).string();
}
void take(const Json& json, fs::path& out) {
  if (json.is_string()) out = json.get<std::string>();
}

Json kept(const std::optional<int>& downscale) { return downscale.value_or(0); }
void take(const Json& json, std::optional<int>& out) {
  if (json.is_number_integer() && json.get<int>() > 0) out = json.get<int>();
}

Json kept(const TrainingOptions& training) { return settings_to_json(training); }
void take(const Json& json, TrainingOptions& out) {
  for (const auto& [name, value] : json.items()) {
    set_training_field(out, name, value.get<std::string>());
  }
}

template <typename Choice>
Json name_of(const std::map<std::string, Choice>& names, Choice value) {
  const auto has_value = [&](const auto& choice) { return choice.second == value; };
  return std::find_if(names.begin(), names.end(), has_value)->first;
}
Json kept(GlbEncoding value) { return name_of(glb_encodings(), value); }
void take(const Json& json, GlbEncoding& out) {
  if (json.is_string()) out = glb_encodings().at(json.get<std::string>());
}
Json kept(EstimatedSurface value) { return name_of(estimated_surfaces(), value); }
void take(const Json& json, EstimatedSurface& out) {
  if (json.is_string()) out = estimated_surfaces().at(json.get<std::string>());
}
Json kept(HoleFill value) { return name_of(hole_fills(), value); }
void take(const Json& json, HoleFill& out) {
  if (json.is_string()) out = hole_fills().at(json.get<std::string>());
}

Json kept(Medium value) { return name_of(media(), value); }
void take(const Json& json, Medium& out) {
  if (json.is_string()) out = media().at(json.get<std::string>());
}

Json kept(const DepthOptions& depth) {
  return {{"folder", kept(depth.folder)},
          {"kind", static_cast<int>(depth.kind)},
          {"scale", depth.scale},
          {"network", kept(depth.network)}};
}
void take(const Json& json, DepthOptions& out) {
  if (!json.is_object()) return;
  take(json.value("folder", Json()), out.folder);
  take(json.value("network", Json()), out.network);
  take(json.value("scale", Json()), out.scale);
  const Json kind = json.value("kind", Json(0));
  const bool is_kind = kind.is_number_integer() && kind.get<int64_t>() >= 0 &&
                       kind.get<int64_t>() <= static_cast<int64_t>(DepthKind::Disparity);
  if (is_kind) out.kind = static_cast<DepthKind>(kind.get<int>());
}

// Where members lie, as RequestField needs it.

template <typename T>
auto in_scene(T SceneRequest::*member) {
  return [member](auto& request) -> auto& { return request.scene.*member; };
}
template <typename T>
auto in_options(T SceneOptions::*member) {
  return [member](auto& request) -> auto& { return request.scene.options.*member; };
}
template <typename T>
auto in_control(T ControlRequest::*member) {
  return [member](auto& request) -> auto& { return request.scene.control.*member; };
}

template <typename Member>
RequestField asked(const char* key, Stage decides, Member member) {
  return {
      .key = key,
      .decides = decides,
      .write = [member](const RunRequest& request,
                        const Scene&) { return kept(std::invoke(member, request)); },
      .read = [member](const Json& json, RunRequest& out) { take(json, std::invoke(member, out)); },
      .member = [member](const RunRequest& request) -> const void* {
        return &std::invoke(member, request);
      }};
}

// Left out where it has its default.
template <typename Member>
RequestField chosen(const char* key, Stage decides, Member member) {
  RequestField out = asked(key, decides, member);
  out.write = [member](const RunRequest& request, const Scene&) {
    const RunRequest defaults;
    const auto& value = std::invoke(member, request);
    return value == std::invoke(member, defaults) ? Json() : kept(value);
  };
  return out;
}

RequestField stating_scale(RequestField field) {
  field.states_scale = true;
  return field;
}

// Hashes of the photographs and masks of views.
Json photograph_hashes(const Scene& scene, const std::vector<int>& views) {
  Json out = Json::object();
  for (const int i : views) {
    const View& view = scene.views[static_cast<size_t>(i)];
    out[view.name] = file_hash(view.image_path);
    if (!view.mask_path.empty()) out[view.name + ", mask"] = file_hash(view.mask_path);
  }
  return out;
}

// Hashes of what the model is made of, by what it is.
Json input_hashes(const SceneRequest& request, const Scene& scene) {
  Json out = photograph_hashes(scene, scene.input);
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.depth_path.empty()) continue;
    out[view.name + ", depth"] = file_hash(view.depth_path);
    const fs::path confidence = confidence_file(scene, view, true);
    if (!confidence.empty()) out[view.name + ", confidence"] = file_hash(confidence);
  }
  const fs::path& network = request.options.depth.network;
  if (!network.empty()) out["depth network"] = file_hash(network);
  return out;
}

// Of the cameras, and of what came with them that says how far away to look.
uint64_t cameras_hash(const Scene& scene) {
  Json cameras = Json::array();
  for (const View& view : scene.views) {
    const Camera& c = view.camera;
    const Eigen::Matrix4d pose = c.world_from_cam.matrix();
    cameras.push_back({view.name,
                       {c.width, c.height, c.fx, c.fy, c.cx, c.cy},
                       std::vector<double>(pose.data(), pose.data() + pose.size()),
                       lens_numbers(view)});
    if (view.near > 0) cameras.push_back({view.near, view.far});
  }
  for (const SparsePoint& point : scene.points) {
    const Eigen::Vector3d& p = point.position;
    cameras.push_back({p.x(), p.y(), p.z(), point.views});
  }
  return content_hash(json_text(cameras, -1));
}

// The cameras have moved with the table; what is left is the sigma of the scale.
RequestField control_points() {
  RequestField out = asked("control_points", Stage::Scale, in_control(&ControlRequest::unit));
  out.write = [](const RunRequest& request, const Scene&) -> Json {
    const ControlRequest& control = request.scene.control;
    if (control.file.empty()) return nullptr;
    return {{"table", file_hash(control.file)}, {"unit", control.unit}};
  };
  out.read = [](const Json& json, RunRequest& request) {
    if (json.is_object()) take(json.value("unit", Json()), request.scene.control.unit);
  };
  return stating_scale(out);
}

Json stated_scale(const RunRequest& request, const Scene& scene) {
  const Frame& frame = scene.frame;
  const bool is_stated = request.scene.assume_unit.empty() && request.scene.control.file.empty();
  if (!is_stated || !frame.has_metric_scale()) return nullptr;
  return {frame.metres_per_unit, frame.metres_sigma, static_cast<int>(frame.scale_source)};
}

Json depth_of(const RunRequest& request, const Scene& scene) {
  if (!has_given_depth(request.scene, scene)) return nullptr;
  return {static_cast<int>(scene.depth_kind), scene.depth_scale};
}

RequestField lods() {
  RequestField out = chosen("lods", Stage::Web, &RunRequest::lods);
  out.read = [](const Json& json, RunRequest& request) {
    request.lods = std::min(json.get<size_t>(), kMostLods);
  };
  return out;
}

std::vector<RequestField> found_in_scene() {
  return {{"input_images",
           Stage::Model,
           [](const RunRequest& request, const Scene& scene) {
             return input_hashes(request.scene, scene);
           }},
          {"held_out",
           Stage::Model,
           [](const RunRequest&, const Scene& scene) { return view_names(scene, scene.held_out); }},
          {"held_out_images",
           Stage::Views,
           [](const RunRequest&, const Scene& scene) {
             return photograph_hashes(scene, scene.held_out);
           }},
          {"cameras", Stage::Model, [](const RunRequest&, const Scene& scene) {
             return Json(cameras_hash(scene));
           }}};
}

std::vector<RequestField> all_fields() {
  std::vector<RequestField> out = {
      // Which photographs are meant is decided by their names and hashes, wherever they lie.
      asked("scene", Stage::Report, in_scene(&SceneRequest::path)),
      asked("views", Stage::Report, in_options(&SceneOptions::views)),
      asked("downscale", Stage::Model, in_options(&SceneOptions::downscale)),
      stating_scale(asked("assume_unit", Stage::Scale, in_scene(&SceneRequest::assume_unit))),
      // Level ground is looked for in the depth of the photographs, and goes on there.
      asked("up", Stage::Model, in_scene(&SceneRequest::up)),
      asked("known_distances", Stage::Scale, in_scene(&SceneRequest::known_distances)),
      asked("marker_size", Stage::Scale, in_scene(&SceneRequest::marker_size)),
      asked("training", Stage::Model, &RunRequest::training),
      asked("voxel_size", Stage::Mesh, &RunRequest::voxel_size),
      asked("max_error", Stage::Mesh, &RunRequest::max_error),
      asked("simplify", Stage::Mesh, &RunRequest::simplify),
      asked("compression_error", Stage::Web, &RunRequest::compression_error),
      asked("max_size", Stage::Web, &RunRequest::max_size)};
  for (RequestField& field : found_in_scene()) out.push_back(std::move(field));
  out.push_back(control_points());
  out.push_back(chosen("chunk", Stage::Model, in_options(&SceneOptions::chunk)));
  out.push_back(chosen("use_all", Stage::Report, in_options(&SceneOptions::all_views)));
  out.push_back(chosen("refine_poses", Stage::Model, in_scene(&SceneRequest::refine_poses)));
  out.push_back(chosen("medium", Stage::Model, &RunRequest::medium));
  out.push_back(chosen("old_photographs", Stage::Model, in_scene(&SceneRequest::old_photographs)));
  out.push_back(lods());
  out.push_back(chosen("max_voxels", Stage::Mesh, &RunRequest::max_voxels));
  out.push_back(chosen("glb_encoding", Stage::Web, &RunRequest::glb_encoding));
  out.push_back(chosen("texture", Stage::Web, &RunRequest::texture));
  out.push_back(chosen("fill", Stage::Splats, &RunRequest::fill));
  out.push_back(chosen("local_origin", Stage::Splats, &RunRequest::local_origin));
  out.push_back(chosen("estimated", Stage::Mesh, &RunRequest::estimated));
  out.push_back(stating_scale({"stated_scale", Stage::Scale, stated_scale}));
  out.push_back({"depth", Stage::Model, depth_of});
  return out;
}

}  // namespace

const std::vector<RequestField>& request_fields() {
  static const std::vector<RequestField> kFields = all_fields();
  return kFields;
}

const std::vector<RequestField>& noted_fields() {
  static const std::vector<RequestField> kFields = {
      asked("focal", Stage::Model, in_scene(&SceneRequest::focal)),
      chosen("each_lens", Stage::Model, in_scene(&SceneRequest::each_lens)),
      chosen("control_points", Stage::Model, in_control(&ControlRequest::file)),
      asked("allow_external", Stage::Model, in_options(&SceneOptions::allow_external)),
      asked("depth_options", Stage::Model, in_options(&SceneOptions::depth))};
  return kFields;
}

std::map<std::string, std::string> decided_stages(const RunRequest& request, const Scene& scene) {
  const bool has_depth = has_given_depth(request.scene, scene);
  std::map<std::string, std::string> out;
  for (const RequestField& field : request_fields()) {
    const bool decides_all = field.decides == Stage::Model || (has_depth && field.states_scale);
    if (!decides_all) out[field.key] = traits(field.decides).name;
  }
  return out;
}

Json request_json(const RunRequest& request, const Scene& scene) {
  Json out = Json::object();
  for (const RequestField& field : request_fields()) {
    Json value = field.write(request, scene);
    if (!value.is_null()) out[field.key] = std::move(value);
  }
  return out;
}

}  // namespace cgs
