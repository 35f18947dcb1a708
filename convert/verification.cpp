// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/verification.h"

#include <algorithm>
#include <set>

#include <nlohmann/json.hpp>

#include "convert/run_record.h"
#include "io/byte_reader.h"
#include "io/json_file.h"
#include "io/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

// The record of a run that came to its end.
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

std::string text_at(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
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
  const Json scale = json.value("scale", Json(0));
  if (scale.is_number()) out.scale = scale.get<double>();
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
  out.options.allow_external = true;  // the run was allowed what it needed
  const Json focal = record.value("focal", Json(0));
  if (focal.is_number()) out.focal = focal.get<double>();
  out.refine_poses = request.value("refine_poses", Json(false)) == Json(true);
  out.options.depth = depth_options_from(record.value("depth_options", Json()));
  out.control.file = text_at(record, "control_points");
  if (request.contains("control_points") && request["control_points"].is_object()) {
    out.control.unit = text_at(request["control_points"], "unit");
  }
  return out;
}

// Adds what two sets of named hashes do not have in common.
void compare(const Json& before, const Json& now, const std::string& kind, Verification& out) {
  std::set<std::string> names;
  for (const Json* side : {&before, &now}) {
    if (!side->is_object()) continue;
    for (const auto& [name, hash] : side->items()) names.insert(name);
  }
  for (const std::string& name : names) {
    const bool was = before.is_object() && before.contains(name);
    const bool is = now.is_object() && now.contains(name);
    if (was && is && before[name] == now[name]) continue;
    out.differing.push_back(kind + name + (!is ? ": missing" : !was ? ": new" : ": changed"));
  }
}

void verify_inputs(const Json& record,
                   const fs::path& output,
                   Terminal& terminal,
                   Verification& out) {
  RunRequest request;
  request.scene = scene_request(record);
  const OpenedScene opened = open_scene(request.scene, output / "model", terminal);
  const Json now = request_json(request, opened.scene);
  const Json& before = record["request"];
  for (const char* kind : {"input_images", "held_out_images"}) {
    compare(before.value(kind, Json::object()), now[kind], "input ", out);
    out.inputs += now[kind].size();
  }
  if (now.contains("control_points")) {
    if (before.value("control_points", Json()) != now["control_points"]) {
      out.differing.emplace_back("input control points: changed");
    }
    ++out.inputs;
  }
  if (before.value("cameras", Json()) != now["cameras"]) {
    out.differing.emplace_back("input cameras: changed");
  }
  ++out.inputs;
}

// Hashes of the outputs that a record names and that are there.
Json hashes_now(const Json& record, const fs::path& output) {
  Json now = Json::object();
  for (const auto& [name, hash] : record["outputs"].items()) {
    // A name that leads out of the folder is none of ours.
    const fs::path relative(name);
    const bool is_inside = relative.is_relative() && name.find("..") == std::string::npos;
    if (is_inside && is_present(output / relative)) now[name] = file_hash(output / relative);
  }
  return now;
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

std::vector<std::string> named_outputs(const fs::path& output, const std::set<std::string>& names) {
  std::vector<std::string> out;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(output)) {
    if (!entry.is_regular_file() || entry.is_symlink()) continue;
    const std::string name = fs::relative(entry.path(), output).generic_string();
    const bool is_named = names.count(name) > 0 ||
                          std::any_of(names.begin(), names.end(), [&](const std::string& known) {
                            return known.back() == '.' && name.starts_with(known);
                          });
    if (is_named) out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  return out;
}

Json output_hashes(const fs::path& output, const std::set<std::string>& names) {
  Json out = Json::object();
  for (const std::string& name : named_outputs(output, names)) out[name] = file_hash(output / name);
  return out;
}

Verification verify_run(const fs::path& output, Terminal& terminal) {
  const Json record = finished_record(output);
  Verification out;
  verify_inputs(record, output, terminal, out);
  const Json now = hashes_now(record, output);
  out.outputs = record["outputs"].size();
  compare(record["outputs"], now, "", out);
  return out;
}

Verification compare_runs(const fs::path& one, const fs::path& other) {
  const auto hashes = [](const fs::path& folder) {
    Json out = hashes_now(finished_record(folder), folder);
    for (const char* name : {"report.json", "report.html"}) out.erase(name);
    return out;
  };
  const Json first = hashes(one);
  Verification out;
  out.outputs = first.size();
  compare(first, hashes(other), "", out);
  return out;
}

}  // namespace cgs
