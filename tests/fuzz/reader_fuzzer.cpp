// SPDX-License-Identifier: GPL-3.0-or-later
//
// Gives a reader whatever bytes libFuzzer thinks of. Whatever it does but return or throw an Error
// of ours is a defect.
//
//   reader_fuzzer --list
//   reader_fuzzer --kind=spz-3 [--seed=FILE] [libFuzzer's flags and corpus folders]
//
// --seed writes the valid file of the kind and ends.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include <unistd.h>

#include "libcgs/core/error.h"
#include "tests/fuzz/file_kinds.h"
#include "tests/support/temp_dir.h"

namespace {

const cgs::test::FileKind* chosen = nullptr;

const cgs::test::TempDir& folder() {
  static const cgs::test::TempDir dir;
  return dir;
}

// The value of "--name=value" among the arguments, or nothing.
const char* value_of(const char* name, int argc, char** argv) {
  const size_t length = std::strlen(name);
  for (int i = 1; i < argc; ++i) {
    if (std::strncmp(argv[i], name, length) == 0 && argv[i][length] == '=') {
      return argv[i] + length + 1;
    }
  }
  return nullptr;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const char* const wanted = value_of("--kind", *argc, *argv);
  for (const cgs::test::FileKind& kind : cgs::test::file_kinds()) {
    if (wanted == nullptr && !kind.is_isolated) std::puts(kind.name.c_str());
    if (wanted != nullptr && kind.name == wanted) chosen = &kind;
  }
  if (wanted == nullptr) std::exit(0);
  if (chosen == nullptr) {
    std::fprintf(stderr, "--kind=%s is none of --list\n", wanted);
    std::exit(2);
  }
  chosen->write(folder().path());
  if (const char* const seed = value_of("--seed", *argc, *argv)) {
    cgs::test::write_bytes(seed, cgs::test::read_bytes(folder() / chosen->file));
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::filesystem::path file = folder() / chosen->file;
  cgs::test::write_bytes(file, std::string(reinterpret_cast<const char*>(data), size));
  cgs::test::require(std::filesystem::file_size(file) == size, "no room for the file to try");
  try {
    chosen->read(folder().path());
  } catch (const cgs::IoError&) {
    throw std::logic_error("the disk is full, or the like: nothing was tried");
  } catch (const cgs::Error&) {
    return 0;  // refused, as it should be
  }
  return 0;
}
