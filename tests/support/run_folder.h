// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "tests/support/temp_dir.h"

namespace cgs::test {

/// Files of a run by their path in its folder. Of what states times or memory only the name counts.
inline std::map<std::string, std::string> files_of_run(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::map<std::string, std::string> out;
  if (!fs::exists(folder)) return out;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), folder).string();
    const bool states_times = name == "run.json" || name == "report.json" || name == "report.html";
    out[name] = states_times ? "" : read_bytes(entry.path());
  }
  return out;
}

/// True for what a run that was killed may leave behind beside whole files.
inline bool is_unfinished(const std::string& name) {
  return name.find(".part") != std::string::npos || name.find(".checkpoint") != std::string::npos;
}

}  // namespace cgs::test
