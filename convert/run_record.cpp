// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run_record.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "convert/terminal.h"
#include "io/atomic_file.h"
#include "io/byte_reader.h"
#include "io/content_hash.h"
#include "io/json_file.h"
#include "io/scene_path.h"
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

bool is_stage(const Json& stage) {
  return stage.is_object() && stage.contains("seconds") && stage["seconds"].is_number() &&
         stage.contains("peak_memory") && stage["peak_memory"].is_number() &&
         stage.contains("result");
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
  }
  json_ = {
      {"program", kProgramVersion}, {"request", std::move(request)}, {"stages", std::move(stages)}};
  save();
}

bool RunRecord::is_done(const std::string& stage, const std::vector<std::string>& files) const {
  if (!json_["stages"].contains(stage)) return false;
  for (const std::string& file : files) {
    if (!is_present(folder_ / file)) return false;
  }
  return true;
}

Json RunRecord::result(const std::string& stage) const {
  return json_["stages"].contains(stage) ? json_["stages"][stage]["result"] : Json();
}

void RunRecord::finish(const std::string& stage, double seconds, const Json& result) {
  Json& stages = json_["stages"];
  Json kept = Json::object();
  for (const auto& [name, value] : stages.items()) {
    if (name == stage) break;
    kept[name] = value;
  }
  stages = kept;
  json_.erase("outputs");
  stages[stage] = {{"seconds", seconds}, {"peak_memory", peak_memory()}, {"result", result}};
  save();
}

void RunRecord::note(const std::string& key, const Json& value) {
  if (json_.contains(key) && json_[key] == value) return;
  json_[key] = value;
  save();
}

void RunRecord::save() const { write_file(folder_ / "run.json", json_text(json_) + "\n"); }

std::string file_hash(const std::filesystem::path& file) {
  std::array<char, 17> text{};
  const auto hash = static_cast<unsigned long long>(content_hash(read_file(file)));
  std::snprintf(text.data(), text.size(), "%016llx", hash);
  return text.data();
}

}  // namespace cgs
