// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_files.h"

#include <system_error>
#include <utility>

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

namespace {

/// What stands for names in StageTraits::files, and the names.
using Place = std::pair<std::string, std::vector<std::string>>;

Place names_of_views(const char* place, const Scene& scene, const std::vector<int>& views) {
  Place out = {place, {}};
  for (const int i : views) out.second.push_back(scene.views[static_cast<size_t>(i)].name);
  return out;
}

// The path itself where it has no place for names.
void add_files(const std::string& path,
               const std::vector<Place>& places,
               std::vector<std::string>& out) {
  for (const auto& [place, names] : places) {
    const size_t at = path.find(place);
    if (at == std::string::npos) continue;
    for (const std::string& name : names) {
      out.push_back(std::string(path).replace(at, place.size(), name));
    }
    return;
  }
  out.push_back(path);
}

}  // namespace

std::vector<StageFiles> stage_files(const Scene& scene, size_t lods) {
  const std::vector<Place> places = {names_of_views("<input>", scene, scene.input),
                                     names_of_views("<view>", scene, views_with_photograph(scene)),
                                     {"<level>", level_files(lods)}};
  std::vector<StageFiles> out;
  for (const StageTraits& stage : stage_table()) {
    StageFiles& files = out.emplace_back();
    files.stage = stage.id;
    files.further.assign(stage.further.begin(), stage.further.end());
    for (const char* path : stage.files) add_files(path, places, files.files);
  }
  return out;
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
    for (const std::string& file : record.files(traits(other.stage).name)) {
      if (own.contains(file)) names.insert(file);
    }
  }
  return output_hashes(output, names);
}

void remove_outputs_after(Stage stage,
                          const std::vector<StageFiles>& stages,
                          const RunRecord& record,
                          const fs::path& output) {
  bool is_later = false;
  std::set<std::string> kept;
  std::set<std::string> names;
  for (const StageFiles& other : stages) {
    (is_later ? names : kept).insert(other.files.begin(), other.files.end());
    for (const std::string& file : record.files(traits(other.stage).name)) {
      (is_later ? names : kept).insert(file);
    }
    is_later = is_later || other.stage == stage;
  }
  for (const std::string& name : named_outputs(output, names)) {
    if (!kept.contains(name)) fs::remove(output / name);
  }
}

}  // namespace cgs
