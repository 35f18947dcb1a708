// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/stage.h"
#include "convert/run/run_request.h"

namespace cgs {

/// A part of a request as run.json keeps it.
struct RequestField {
  const char* key;
  /// The first stage that depends on it: where it changes, what earlier stages made is kept.
  Stage decides;
  /// Null leaves the key out, so that folders of runs without such a setting go on as before.
  std::function<nlohmann::ordered_json(const RunRequest&, const Scene&)> write;
  /// Takes what was written; empty for what the scene tells. A value of another type counts as not
  /// stated where earlier versions did not state it.
  /// \throws nlohmann::json::exception or std::out_of_range for one that cannot be taken
  std::function<void(const nlohmann::ordered_json&, RunRequest&)> read = {};
  /// The member of a request that it keeps; empty for what the scene tells.
  std::function<const void*(const RunRequest&)> member = {};
  /// Metric depth is brought into the scene by it where photographs do not tell how, and held
  /// against it where they do: where depth is given, it decides all.
  bool states_scale = false;
};

/// What "request" holds, in its order: all that decides the result. request_json(),
/// decided_stages() and recorded_request() are made of it.
const std::vector<RequestField>& request_fields();

/// Everything that decides the result of a request: arguments, and hashes of what goes in.
nlohmann::ordered_json request_json(const RunRequest& request, const Scene& scene);

/// What run.json holds beside "request": it must be known to read the inputs again, while what it
/// leads to is in "request" already. These decide no stage.
const std::vector<RequestField>& noted_fields();

/// For keys of "request", the first stage that depends on them; on other keys all stages depend.
std::map<std::string, std::string> decided_stages(const RunRequest& request, const Scene& scene);

}  // namespace cgs
