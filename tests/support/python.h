// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <string>

#include "tests/support/temp_dir.h"

namespace cgs::test {

/// Runs a script of Python in a folder, for what other people's programs write and read.
/// \return whether it ended well; what it says is on the terminal
inline bool run_python(const std::string& script, const std::filesystem::path& folder) {
  const TempDir dir;
  write_bytes(dir / "script.py", script);
  const std::string command =
      "cd '" + folder.string() + "' && /usr/bin/python3 " + (dir / "script.py").string();
  return std::system(command.c_str()) == 0;
}

}  // namespace cgs::test
