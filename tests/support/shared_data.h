// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <filesystem>

namespace cgs::test {

inline constexpr const char* kNoSharedData = "CGS_SHARED_DATA is not set";

/// The folder of files of others that are too large to be kept with the sources (CONTRIBUTING.md
/// tells what is in it); empty where the environment names none: such tests are skipped,
///   if (test::shared_data().empty()) GTEST_SKIP() << test::kNoSharedData;
inline std::filesystem::path shared_data() {
  const char* const folder = std::getenv("CGS_SHARED_DATA");
  return folder == nullptr ? "" : folder;
}

}  // namespace cgs::test
