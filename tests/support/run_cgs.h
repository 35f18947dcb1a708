// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <string>

#include <sys/wait.h>

#include "tests/support/temp_dir.h"

namespace cgs::test {

struct ProgramResult {
  int exit_code = -1;  ///< -1 if a signal ended it.
  std::string out;
  std::string err;
};

/// Runs the cgs program of this build with arguments as a shell would take them.
inline ProgramResult run_cgs(const std::string& arguments) {
  const TempDir dir;
  const std::string command = std::string(CGS_BINARY) + " " + arguments + " >" +
                              (dir / "out").string() + " 2>" + (dir / "err").string();
  const int status = std::system(command.c_str());
  ProgramResult result;
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.out = read_bytes(dir / "out");
  result.err = read_bytes(dir / "err");
  return result;
}

}  // namespace cgs::test
