// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/portal_capture.h"

#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/temp_dir.h"

namespace cgs::test {

std::filesystem::path portal_capture(int divisor) {
  return std::filesystem::path(CGS_CAPTURES) / std::to_string(divisor);
}

std::filesystem::path underwater_capture() { return std::filesystem::path(CGS_CAPTURES) / "water"; }

void copy_portal_capture(const std::filesystem::path& folder, int divisor, size_t views) {
  namespace fs = std::filesystem;
  const fs::path made = portal_capture(divisor);
  fs::create_directories(folder);
  fs::copy(made, folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  auto transforms = nlohmann::ordered_json::parse(read_bytes(made / "transforms.json"));
  auto& frames = transforms["frames"];
  if (views >= frames.size()) return;
  for (size_t i = views; i < frames.size(); ++i) {
    fs::remove(folder / frames[i]["file_path"].get<std::string>());
  }
  frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(views), frames.end());
  write_bytes(folder / "transforms.json", transforms.dump());
}

}  // namespace cgs::test
