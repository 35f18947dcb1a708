// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/run_cgs.h"

// What tests of cgs measure and cgs compare share.

namespace cgs::test {

/// What a command that has to succeed says as JSON.
inline nlohmann::json json_of(const std::string& arguments) {
  const auto result = run_cgs(arguments + " --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return nlohmann::json::parse(result.out);
}

/// What `arguments` would write over `input` is refused, by another name of the file as well.
inline void expect_kept(const TempDir& dir, const std::string& arguments, const char* input) {
  const std::string before = read_bytes(dir / input);
  const auto result = run_cgs(arguments);
  EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
  EXPECT_NE(result.err.find("lies in the input"), std::string::npos) << arguments << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(read_bytes(dir / input), before) << arguments;
}

}  // namespace cgs::test
