// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run_record.h"

#include <array>
#include <cstdio>
#include <utility>

#include "convert/terminal.h"
#include "io/atomic_file.h"
#include "io/byte_reader.h"
#include "io/content_hash.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

std::string difference(const Json& before, const Json& now) {
  std::string names;
  for (const auto& [key, value] : now.items()) {
    if (before.contains(key) && before[key] == value) continue;
    names += (names.empty() ? "" : ", ") + key;
  }
  return names;
}

}  // namespace

RunRecord::RunRecord(std::filesystem::path folder, Json request, bool overwrite)
    : folder_(std::move(folder)) {
  const std::filesystem::path path = folder_ / "run.json";
  if (std::filesystem::exists(path)) {
    const Json old = Json::parse(read_file(path), nullptr, false);
    const bool readable = old.is_object() && old.contains("request") && old.contains("stages") &&
                          old["stages"].is_object();
    if (readable && old["request"] == request) {
      json_ = old;
      return;
    }
    if (!overwrite) {
      throw InvalidInput(
          printable(folder_) + " holds the results of another run" +
          (readable ? " (different: " + difference(old["request"], request) + ")" : "") +
          "; choose another folder, or say --overwrite");
    }
  }
  json_ = {
      {"program", kProgramVersion}, {"request", std::move(request)}, {"stages", Json::object()}};
  save();
}

bool RunRecord::is_done(const std::string& stage, const std::vector<std::string>& files) const {
  if (!json_["stages"].contains(stage)) return false;
  for (const std::string& file : files) {
    if (!std::filesystem::exists(folder_ / file)) return false;
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
  stages[stage] = {{"seconds", seconds}, {"peak_memory", peak_memory()}, {"result", result}};
  save();
}

void RunRecord::save() const { write_file(folder_ / "run.json", json_.dump(2) + "\n"); }

std::string file_hash(const std::filesystem::path& file) {
  std::array<char, 17> text{};
  const auto hash = static_cast<unsigned long long>(content_hash(read_file(file)));
  std::snprintf(text.data(), text.size(), "%016llx", hash);
  return text.data();
}

}  // namespace cgs
