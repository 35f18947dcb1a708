// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/recorded_request.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "io/bytes/byte_reader.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

// Values of another type count as not stated, as in records of versions that did not have them.
std::string text_at(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
}

double number_at(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_number() ? json[key].get<double>() : 0;
}

// As depth_options_json() wrote them; runs of before have none.
DepthOptions depth_options_from(const Json& json) {
  DepthOptions out;
  if (!json.is_object()) return out;
  out.folder = text_at(json, "folder");
  out.network = text_at(json, "network");
  const Json kind = json.value("kind", Json(0));
  const bool is_kind = kind.is_number_integer() && kind.get<int64_t>() >= 0 &&
                       kind.get<int64_t>() <= static_cast<int64_t>(DepthKind::Disparity);
  if (is_kind) out.kind = static_cast<DepthKind>(kind.get<int>());
  out.scale = number_at(json, "scale");
  return out;
}

SceneRequest scene_request(const Json& record) {
  const Json& request = record["request"];
  SceneRequest out;
  out.path = text_at(request, "scene");
  out.options.views = text_at(request, "views");
  const Json downscale = request.value("downscale", Json(0));
  if (downscale.is_number_integer() && downscale.get<int>() > 0) {
    out.options.downscale = downscale.get<int>();
  }
  // Records of before do not say it; such runs were allowed what they needed.
  out.options.allow_external = record.value("allow_external", Json(true)) == Json(true);
  out.options.depth = depth_options_from(record.value("depth_options", Json()));
  out.focal = number_at(record, "focal");
  out.refine_poses = request.value("refine_poses", Json(false)) == Json(true);
  out.assume_unit = text_at(request, "assume_unit");
  out.up = request.value("up", std::vector<double>());
  out.known_distances = request.value("known_distances", std::vector<DistanceWords>());
  out.marker_size = text_at(request, "marker_size");
  out.control.file = text_at(record, "control_points");
  if (request.contains("control_points") && request["control_points"].is_object()) {
    out.control.unit = text_at(request["control_points"], "unit");
  }
  return out;
}

}  // namespace

Json depth_options_json(const DepthOptions& options) {
  const auto whole = [](const fs::path& path) {
    return path.empty() ? std::string() : fs::weakly_canonical(path).string();
  };
  return {{"folder", whole(options.folder)},
          {"kind", static_cast<int>(options.kind)},
          {"scale", options.scale},
          {"network", whole(options.network)}};
}

Json finished_record(const fs::path& output) {
  const fs::path path = output / "run.json";
  if (!is_present(path)) {
    throw BadInput(Defect::Missing, path, "no such file; give the folder of a run");
  }
  (void)read_json(path);  // refuses what is nested too deep to be copied
  Json record = Json::parse(read_file(path));
  const bool is_finished = record.is_object() && record.contains("outputs") &&
                           record["outputs"].is_object() && record.contains("request") &&
                           record["request"].is_object();
  if (is_finished) return record;
  throw BadInput(Defect::Schema,
                 path,
                 "is not of a finished run: it does not say what the outputs were; run it again");
}

RunRequest recorded_request(const Json& record, const fs::path& path) {
  try {
    const Json& asked = record.at("request");
    RunRequest out;
    out.scene = scene_request(record);
    const Json training = asked.value("training", Json::object());
    for (const auto& [name, value] : training.items()) {
      set_training_field(out.training, name, value.get<std::string>());
    }
    out.voxel_size = text_at(asked, "voxel_size");
    out.simplify = text_at(asked, "simplify");
    out.compression_error = text_at(asked, "compression_error");
    out.max_error = text_at(asked, "max_error");
    out.max_size = asked.value("max_size", size_t{0});
    out.lods = std::min(asked.value("lods", size_t{0}), kMostLods);
    const std::string encoding = text_at(asked, "glb_encoding");
    if (!encoding.empty()) out.glb_encoding = glb_encodings().at(encoding);
    const std::string estimated = text_at(asked, "estimated");
    if (!estimated.empty()) out.estimated = estimated_surfaces().at(estimated);
    return out;
  } catch (const Json::exception&) {
    throw BadInput(Defect::Schema, path, "\"request\" is not as a run writes it");
  } catch (const std::out_of_range&) {
    throw BadInput(
        Defect::Schema, path, "\"glb_encoding\" or \"estimated\" is not one of this version");
  }
}

}  // namespace cgs
