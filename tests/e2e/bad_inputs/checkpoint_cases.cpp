// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdlib>
#include <map>
#include <stdexcept>

#include "tests/e2e/bad_inputs/valid_inputs.h"
#include "tests/support/run_cgs.h"

namespace cgs::test {

namespace {

constexpr const char* kNewest = "out/training.checkpoint";
constexpr const char* kBefore = "out/training.previous.checkpoint";
constexpr const char* kSteps = "steps=1500";

Call long_training(const fs::path& folder) {
  Call call = train_call(folder);
  call.arguments.insert(call.arguments.end(), {"--set", kSteps, "--threads", "1"});
  return call;
}

/// A training that was interrupted twice (made once per process), so that it left two states. How
/// long it takes is the machine's: the time until it is interrupted adapts itself.
const std::map<std::string, std::string>& interrupted() {
  static const std::map<std::string, std::string> files = [] {
    const TempDir dir;
    write_transforms_scene(dir.path());
    std::string training = CGS_BINARY;
    for (const std::string& word : long_training(dir.path()).arguments) training += " " + word;
    double seconds = 2;
    for (int tries = 0; tries < 40 && !fs::exists(dir / kBefore); ++tries) {
      const std::string interrupt = "timeout -s INT " + std::to_string(seconds) + " ";
      if (std::system((interrupt + training + " 2>/dev/null").c_str()) == 0) {
        fs::remove_all(dir / "out");  // it came to its end
        seconds /= 2;
      } else if (!fs::exists(dir / kNewest)) {
        seconds *= 1.3;  // it had not begun
      }
    }
    std::map<std::string, std::string> made;
    for (const char* name : {kNewest, kBefore}) made[name] = read_bytes(dir / name);
    if (made[kBefore].empty()) throw std::runtime_error("no training could be interrupted twice");
    return made;
  }();
  return files;
}

using Change = std::function<void(const fs::path& folder)>;

Case resumed(const std::string& row,
             const std::string& damage,
             const std::string& expected,
             const std::vector<std::string>& words,
             const Change& change) {
  return {row,
          damage,
          expected,
          words,
          [=](const fs::path& folder) {
            write_transforms_scene(folder);
            for (const auto& [name, bytes] : interrupted()) write_bytes(folder / name, bytes);
            change(folder);
            return long_training(folder);
          },
          true};
}

}  // namespace

Cases checkpoint_cases() {
  const auto edit = [](const char* name, const std::function<void(std::string&)>& how) {
    return [=](const fs::path& folder) {
      std::string bytes = read_bytes(folder / name);
      how(bytes);
      write_bytes(folder / name, bytes);
    };
  };
  Cases cases;
  const std::string falls_back = "going on from the state before";
  for (const size_t kept : {size_t{0}, size_t{4}, size_t{4096}, size_t{8192}}) {
    cases.push_back(resumed("K01",
                            "cut after " + std::to_string(kept) + " bytes",
                            "OK+W",
                            {"training.checkpoint", falls_back},
                            edit(kNewest, [=](std::string& bytes) { bytes.resize(kept); })));
  }
  // The photographs are there: what is lost is time, which is no reason to refuse.
  cases.push_back(
      resumed("K01", "both cut", "OK+W", {"starting anew"}, [=](const fs::path& folder) {
        for (const char* name : {kNewest, kBefore}) fs::resize_file(folder / name, 4096);
      }));
  cases.push_back(resumed("K02",
                          "one bit of the state flipped",
                          "OK+W",
                          {"hash", falls_back},
                          edit(kNewest, [](std::string& bytes) { bytes[bytes.size() / 2] ^= 1; })));
  // As any state that cannot be used: one that another version wrote must not end the work, either.
  cases.push_back(resumed("K03",
                          "of another version",
                          "OK+W",
                          {"version", falls_back},
                          edit(kNewest, [](std::string& bytes) { bytes[7] = '2'; })));
  cases.push_back(resumed(
      "K04", "of other photographs", "MISMATCH", {"--overwrite"}, [](const fs::path& folder) {
        write_bytes(folder / "scene/images/1.png", picture_png(2));
      }));
  cases.push_back(resumed("K05", "only a part is left", "OK", {}, [](const fs::path& folder) {
    fs::rename(folder / kNewest, folder / "out/training.checkpoint.part999999999");
    fs::remove(folder / kBefore);
  }));
  cases.push_back(resumed("E03",
                          "a state cannot be written",
                          "OK+W",
                          {"going on without it"},
                          [](const fs::path& folder) {
                            fs::remove(folder / kBefore);
                            fs::create_directory(folder /
                                                 kBefore);  // no file takes the place of a folder
                          }));
  return cases;
}

}  // namespace cgs::test
