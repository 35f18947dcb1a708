// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_record.h"

#include <algorithm>
#include <utility>

#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

std::vector<std::string> differing_keys(const Json& before, const Json& now) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : now.items()) {
    if (!before.contains(key) || before[key] != value) keys.push_back(key);
  }
  for (const auto& [key, value] : before.items()) {
    if (!now.contains(key)) keys.push_back(key);
  }
  return keys;
}

std::string listed(const std::vector<std::string>& keys) {
  std::string out;
  for (const std::string& key : keys) out += (out.empty() ? "" : ", ") + key;
  return out;
}

// The stages before the first that one of the keys has a say in.
Json unaffected_stages(const Json& stages,
                       const std::vector<std::string>& keys,
                       const std::map<std::string, std::string>& decides) {
  Json kept = Json::object();
  for (const auto& [name, stage] : stages.items()) {
    for (const std::string& key : keys) {
      const auto first = decides.find(key);
      if (first == decides.end() || first->second == name) return kept;
    }
    kept[name] = stage;
  }
  return kept;
}

// What a stage wrote; a name that leads out of the folder is none of ours.
std::vector<std::string> files_of(const Json& stage) {
  std::vector<std::string> out;
  const Json files = stage.value("files", Json::object());
  for (const auto& [file, hash] : files.items()) {
    if (stays_below(file)) out.push_back(file);
  }
  return out;
}

std::string hash_or_none(const std::filesystem::path& file) {
  try {
    return file_hash(file);
  } catch (const Error&) {
    return "";
  }
}

bool is_stage(const Json& stage) {
  if (!stage.is_object()) return false;
  const Json files = stage.value("files", Json::object());
  const bool lists_files =
      files.is_object() &&
      std::all_of(files.begin(), files.end(), [](const Json& file) { return file.is_string(); });
  return lists_files && stage.contains("seconds") && stage["seconds"].is_number() &&
         stage.contains("peak_memory") && stage["peak_memory"].is_number() &&
         stage.contains("result");
}

void remove_files_of_others(const std::filesystem::path& folder,
                            const Json& stages,
                            const Json& kept) {
  for (const auto& [name, stage] : stages.items()) {
    if (kept.contains(name)) continue;
    for (const std::string& file : files_of(stage)) {
      std::error_code leaves_it;  // as a folder would be
      std::filesystem::remove(folder / file, leaves_it);
    }
  }
}

}  // namespace

Json read_run_record(const std::filesystem::path& path) {
  Json record;
  try {
    (void)read_json(path);  // refuses what is nested too deep to be copied
    record = Json::parse(read_file(path));
  } catch (const Error&) {
    return nullptr;
  } catch (const Json::exception&) {
    return nullptr;
  }
  const bool is_record = record.is_object() && record.contains("request") &&
                         record.contains("stages") && record["stages"].is_object();
  if (!is_record) return nullptr;
  const Json& stages = record["stages"];
  return std::all_of(stages.begin(), stages.end(), is_stage) ? record : Json();
}

RunRecord::RunRecord(std::filesystem::path folder,
                     Json request,
                     bool overwrite,
                     const std::map<std::string, std::string>& decides)
    : folder_(std::move(folder)) {
  request = Json::parse(json_text(request));  // as it reads back from the file
  const std::filesystem::path path = folder_ / "run.json";
  Json stages = Json::object();
  if (is_present(path)) {
    const Json old = read_run_record(path);
    const bool readable = !old.is_null();
    if (readable && old["request"] == request) {
      json_ = old;
      return;
    }
    const auto keys =
        readable ? differing_keys(old["request"], request) : std::vector<std::string>();
    if (readable) stages = unaffected_stages(old["stages"], keys, decides);
    if (!overwrite) {
      throw InvalidInput(printable(folder_) + " holds the results of another run" +
                         (readable ? " (different: " + listed(keys) + ")" : "") +
                         "; choose another folder, or say --overwrite" +
                         (stages.empty() ? "" : ", which keeps what this does not change"));
    }
    // First, as a stage without its files is not done, whichever request the record states.
    if (readable) remove_files_of_others(folder_, old["stages"], stages);
  }
  json_ = {{"program", program_version()},
           {"request", std::move(request)},
           {"stages", std::move(stages)}};
  save();
}

bool RunRecord::is_done(const std::string& stage, const std::vector<std::string>& files) const {
  if (!json_["stages"].contains(stage)) return false;
  const auto is_there = [&](const std::string& file) { return is_present(folder_ / file); };
  const std::vector<std::string> written = files_of(json_["stages"][stage]);
  return std::all_of(files.begin(), files.end(), is_there) &&
         std::all_of(written.begin(), written.end(), is_there);
}

Json RunRecord::result(const std::string& stage) const {
  return json_["stages"].contains(stage) ? json_["stages"][stage]["result"] : Json();
}

double RunRecord::seconds(const std::string& stage) const {
  return json_.at("stages").at(stage).at("seconds").get<double>();
}

std::vector<std::string> RunRecord::files(const std::string& stage) const {
  return json_["stages"].contains(stage) ? files_of(json_["stages"][stage])
                                         : std::vector<std::string>();
}

std::vector<std::string> RunRecord::changed_files(const std::string& stage) const {
  std::vector<std::string> out;
  for (const std::string& file : files(stage)) {
    if (json_["stages"][stage]["files"][file] != hash_or_none(folder_ / file)) out.push_back(file);
  }
  return out;
}

Json RunRecord::file_hashes() const {
  Json out = Json::object();
  for (const auto& [name, stage] : json_["stages"].items()) {
    for (const std::string& file : files_of(stage)) out[file] = stage["files"][file];
  }
  return out;
}

void RunRecord::finish(const std::string& stage,
                       double seconds,
                       const Json& result,
                       const std::set<std::string>& files) {
  Json& stages = json_["stages"];
  Json kept = Json::object();
  for (const auto& [name, value] : stages.items()) {
    if (name == stage) break;
    kept[name] = value;
  }
  stages = kept;
  json_.erase("outputs");
  stages[stage] = {{"seconds", seconds}, {"peak_memory", peak_memory()}, {"result", result}};
  for (const std::string& file : files) {
    Json* writer = &stages[stage];
    for (auto& [name, earlier] : kept.items()) {
      if (earlier.value("files", Json::object()).contains(file)) writer = &stages[name];
    }
    (*writer)["files"][file] = file_hash(folder_ / file);
  }
  save();
}

void RunRecord::note(const std::string& key, const Json& value) {
  if (json_.contains(key) && json_[key] == value) return;
  json_[key] = value;
  save();
}

void RunRecord::save() const {
  write_file(folder_ / "run.json", json_text(versioned(json_)) + "\n");
}

}  // namespace cgs
