// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/report_json.h"

#include <iostream>

#include <nlohmann/json.hpp>

#include "io/bytes/json_file.h"

namespace cgs {

nlohmann::ordered_json versioned(const nlohmann::ordered_json& report) {
  if (!report.is_object()) return report;
  nlohmann::ordered_json out = {{"schema_version", nullptr}};
  out.update(report);
  out["schema_version"] = kSchemaVersion;  // also of a report that an earlier version wrote
  return out;
}

void print_report(const nlohmann::ordered_json& report) {
  std::cout << json_text(versioned(report)) << "\n";
}

}  // namespace cgs
