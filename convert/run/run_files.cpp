// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_files.h"

#include <system_error>

#include <nlohmann/json.hpp>

#include "convert/model/views.h"
#include "convert/run/asset.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::vector<std::string> named_outputs(const fs::path& output, const std::set<std::string>& names) {
  std::set<std::string> out;
  const auto add = [&](const fs::path& name) {
    std::error_code ignored;  // what cannot be looked at is not there
    const bool is_file = fs::is_regular_file(fs::symlink_status(output / name, ignored));
    if (is_file) out.insert(name.generic_string());
  };
  for (const std::string& name : names) {
    const size_t any = name.find('*');
    if (any == std::string::npos) {
      add(name);
      continue;
    }
    const fs::path folder = fs::path(name).parent_path();
    for (const std::string& entry : sorted_entries(output / folder)) {
      const std::string file = (folder / entry).generic_string();
      const bool is_named = file.size() >= name.size() && file.starts_with(name.substr(0, any)) &&
                            file.ends_with(name.substr(any + 1));
      if (is_named) add(file);
    }
  }
  return {out.begin(), out.end()};
}

Json output_hashes(const fs::path& output, const std::set<std::string>& names) {
  Json out = Json::object();
  for (const std::string& name : named_outputs(output, names)) out[name] = file_hash(output / name);
  return out;
}

std::set<std::string> StageFiles::all() const {
  std::set<std::string> out(files.begin(), files.end());
  out.insert(further.begin(), further.end());
  return out;
}

std::vector<StageFiles> stage_files(const Scene& scene, size_t lods) {
  std::vector<std::string> view_files;
  for (const int i : views_with_photograph(scene)) {
    const std::string stem = "views/" + scene.views[static_cast<size_t>(i)].name;
    for (const char* suffix : {".exr", ".color.png", ".depth.png", ".normal.png", ".hole.png"}) {
      view_files.push_back(stem + suffix);
    }
  }
  std::vector<std::string> model_files = {"model/gaussians.ply", "model/cameras.json"};
  for (const int i : scene.input) {
    model_files.push_back("model/priors/" + scene.views[static_cast<size_t>(i)].name + ".exr");
  }
  std::vector<std::string> web_files = {
      "web/asset.glb", "mesh/watertight.obj", "mesh/watertight.mtl"};
  for (const std::string& name : level_files(lods)) web_files.push_back("web/" + name);
  return {{"model", model_files, {"model/training.json"}},
          {"scale", {}, {"model/gaussians.ply", "model/cameras.json"}},
          {"views", view_files},
          {"evaluation", {}},
          {"splats", {"web/splats.glb"}, {"web/splats.spz"}},
          {"mesh",
           {"volume.vdb",
            "mesh/surface.ply",
            "mesh/watertight.ply",
            "mesh/front.png",
            "mesh/side.png",
            "mesh/front.provenance.png",
            "mesh/side.provenance.png"},
           {"mesh/watertight.stl", "mesh/watertight.3mf"}},
          {"web",
           web_files,
           // Pictures of the texture, levels of a run that wanted more of them.
           {"mesh/watertight.*.jpg", "web/asset.lod*.glb", "web/tileset.json"}},
          {"report", {"report.html", "report.json"}}};
}

std::set<std::string> camera_files() {
  return {"model/refined_poses.json",
          "model/colmap/poses.json",
          "model/colmap/sparse/0/cameras.txt",
          "model/colmap/sparse/0/images.txt",
          "model/colmap/sparse/0/points3D.txt"};
}

void refuse_foreign_files(const fs::path& output, const std::vector<StageFiles>& stages) {
  if (is_present(output / "run.json")) return;
  std::set<std::string> names;
  for (const StageFiles& stage : stages) names.merge(stage.all());
  const std::vector<std::string> found = named_outputs(output, names);
  if (found.empty()) return;
  throw InvalidInput(printable(output) + " holds " + printable(found.front()) +
                     (found.size() > 1 ? " and more" : "") +
                     " but no run.json: this would replace files that no run here wrote; choose "
                     "another folder, or say --overwrite");
}

Json earlier_outputs(const StageFiles& stage,
                     const std::vector<StageFiles>& stages,
                     const RunRecord& record,
                     const fs::path& output) {
  const std::set<std::string> own = stage.all();
  std::set<std::string> names;
  for (const StageFiles& other : stages) {
    if (other.stage == stage.stage) break;
    for (const std::string& file : record.files(other.stage)) {
      if (own.contains(file)) names.insert(file);
    }
  }
  return output_hashes(output, names);
}

void remove_outputs_after(const std::string& stage,
                          const std::vector<StageFiles>& stages,
                          const RunRecord& record,
                          const fs::path& output) {
  bool is_later = false;
  std::set<std::string> kept;
  std::set<std::string> names;
  for (const StageFiles& other : stages) {
    (is_later ? names : kept).insert(other.files.begin(), other.files.end());
    for (const std::string& file : record.files(other.stage)) {
      (is_later ? names : kept).insert(file);
    }
    is_later = is_later || other.stage == stage;
  }
  for (const std::string& name : named_outputs(output, names)) {
    if (!kept.contains(name)) fs::remove(output / name);
  }
}

}  // namespace cgs
