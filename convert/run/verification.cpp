// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/verification.h"

#include <set>

#include <nlohmann/json.hpp>

#include "convert/run/pipeline.h"
#include "convert/run/recorded_request.h"
#include "convert/run/request_fields.h"
#include "convert/run/run_record.h"
#include "convert/text/advice.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kInput = "input ";  // begins the lines on what went in

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
  const RunRequest request = recorded_request(record, output / "run.json");
  const OpenedScene opened = [&] {
    try {
      return open_scene(request.scene, output / "model", terminal);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      out.differing.push_back(std::string(kInput) + words_of(error));
      return OpenedScene();
    }
  }();
  if (!out.differing.empty()) return;
  const Json now = request_json(request, opened.scene);
  const Json& before = record["request"];
  for (const char* kind : {"input_images", "held_out_images"}) {
    compare(before.value(kind, Json::object()), now[kind], kInput, out);
    out.inputs += now[kind].size();
  }
  if (now.contains("control_points")) {
    if (before.value("control_points", Json()) != now["control_points"]) {
      out.differing.push_back(std::string(kInput) + "control points: changed");
    }
    ++out.inputs;
  }
  if (before.value("stated_scale", Json()) != now.value("stated_scale", Json())) {
    out.differing.push_back(std::string(kInput) + "scale of the scene: changed");
  }
  if (before.value("cameras", Json()) != now["cameras"]) {
    out.differing.push_back(std::string(kInput) + "cameras: changed");
  }
  ++out.inputs;
}

// Hashes of the outputs that a record names and that are there.
Json hashes_now(const Json& record, const fs::path& output) {
  Json now = Json::object();
  for (const auto& [name, hash] : record["outputs"].items()) {
    // A name that leads out of the folder is none of ours.
    if (!stays_below(name) || !is_present(output / name)) continue;
    try {
      now[name] = file_hash(output / name);
    } catch (const BadInput&) {
      now[name] = nullptr;  // it was read once
    }
  }
  return now;
}

// The file that a line of Verification::differing is about.
std::string name_of(const std::string& line) { return line.substr(0, line.rfind(": ")); }

// What an earlier call computed to its end is of another day; what it did not, goes on.
void remove_finished(const fs::path& fresh) {
  if (!fs::exists(fresh)) return;
  if (!is_present(fresh / "run.json")) {
    throw InvalidInput(printable(fresh) + " is in the way of what is computed again; move it");
  }
  const Json record = Json::parse(read_file(fresh / "run.json"), nullptr, false);
  const bool goes_on = record.is_object() && !record.contains("outputs") &&
                       record.value("program", Json()) == Json(program_version());
  if (!goes_on) fs::remove_all(fresh);
}

}  // namespace

Verification verify_run(const fs::path& output, Terminal& terminal) {
  const Json record = finished_record(output);
  Verification out;
  verify_inputs(record, output, terminal, out);
  const Json now = hashes_now(record, output);
  out.outputs = record["outputs"].size();
  compare(record["outputs"], now, "", out);
  return out;
}

Verification recompute_run(const fs::path& output, size_t memory_limit, Terminal& terminal) {
  const FolderLock lock(output);
  Verification out = verify_run(output, terminal);
  const bool has_inputs =
      std::none_of(out.differing.begin(), out.differing.end(), [](const std::string& line) {
        return line.starts_with(kInput);
      });
  if (!has_inputs) return out;
  const fs::path fresh = output / kRecomputedFolder;
  remove_finished(fresh);
  RunRequest request = recorded_request(finished_record(output), output / "run.json");
  request.output = fresh;
  request.overwrite = true;
  request.memory_limit = memory_limit;
  (void)run_pipeline(request, terminal);
  std::set<std::string> known;
  for (const std::string& line : out.differing) known.insert(name_of(line));
  for (const std::string& line : compare_runs(output, fresh).differing) {
    if (known.count(name_of(line)) == 0) out.differing.push_back(line);
  }
  if (out.differing.empty()) {
    fs::remove_all(fresh);
  } else {
    out.recomputed = fresh;
  }
  return out;
}

Verification compare_runs(const fs::path& one, const fs::path& other) {
  std::set<std::string> names;
  const auto hashes = [&](const fs::path& folder) {
    const Json record = finished_record(folder);
    for (const auto& [name, hash] : record["outputs"].items()) names.insert(name);
    return hashes_now(record, folder);
  };
  Json first = hashes(one);
  Json second = hashes(other);
  for (const char* name : {"report.json", "report.html"}) {
    names.erase(name);
    first.erase(name);
    second.erase(name);
  }
  Verification out;
  out.outputs = names.size();
  for (const std::string& name : names) {
    if (first.contains(name) || second.contains(name)) continue;
    out.differing.push_back(name + ": missing");
  }
  compare(first, second, "", out);
  return out;
}

}  // namespace cgs
