// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/forecast.h"

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "convert/model/memory_plan.h"
#include "convert/run/disk_plan.h"
#include "convert/run/pipeline.h"
#include "io/scenes/view_names.h"

namespace cgs {

using Json = nlohmann::ordered_json;

Json forecast(const RunRequest& request, Terminal& terminal) {
  refuse_contradictions(request);
  const Scene scene = open_scene_of(request, terminal).scene;
  (void)known_distances(request.scene.known_distances, scene);  // what the run would refuse at once
  check_lengths(request, scene);
  terminal.note(scene.notes);
  terminal.warn(scene.warnings);
  Json memory = Json::object();
  size_t most = 0;
  for (const StageMemory& stage : memory_plan(scene, picture_work(request))) {
    memory[traits(stage.stage).title] = stage.bytes;
    most = std::max(most, stage.bytes);
  }
  return {
      {"input", view_names(scene, scene.input)},
      {"held_out", view_names(scene, scene.held_out)},
      {"pixels", pixels_of(scene, scene.input)},
      {"memory", memory},
      {"most_memory", most + kKeptPhotographs},
      {"disk", disk_plan(scene)},
      {"threads", tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)},
      {"warnings", scene.warnings},
      {"notes", scene.notes}};
}

std::string forecast_words(const Json& forecast) {
  return std::to_string(forecast["input"].size()) + " input photographs, " +
         std::to_string(forecast["held_out"].size()) + " held out; memory up to " +
         mebibytes(forecast["most_memory"].get<size_t>()) + ", disk " +
         mebibytes(forecast["disk"].get<size_t>());
}

}  // namespace cgs
