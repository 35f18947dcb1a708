// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/recorded_request.h"

#include <stdexcept>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/run/request_fields.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

void take_fields(const std::vector<RequestField>& fields, const Json& json, RunRequest& out) {
  for (const RequestField& field : fields) {
    if (field.read && json.contains(field.key)) field.read(json[field.key], out);
  }
}

}  // namespace

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
    RunRequest out;
    // Records of before do not say it; such runs were allowed what they needed.
    out.scene.options.allow_external = true;
    take_fields(request_fields(), record.at("request"), out);
    take_fields(noted_fields(), record, out);
    return out;
  } catch (const Json::exception&) {
    throw BadInput(Defect::Schema, path, "\"request\" is not as a run writes it");
  } catch (const std::out_of_range&) {
    throw BadInput(Defect::Schema,
                   path,
                   "\"glb_encoding\", \"estimated\" or \"medium\" is not one of this version");
  }
}

}  // namespace cgs
