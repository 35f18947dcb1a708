// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "libcgs/core/error.h"

namespace cgs::test {

/// A kind of file that a reader of ours takes, for tests that damage such files.
struct FileKind {
  std::string name;  ///< Letters, digits and hyphens; none twice.
  std::string file;  ///< Its path in a folder.
  /// Writes a small valid file there, and whatever it refers to.
  std::function<void(const std::filesystem::path& folder)> write;
  /// Reads it. What is damaged may be read as something else or refused with an Error of ours;
  /// what was read survives being written and read again.
  std::function<void(const std::filesystem::path& folder)> read;
  bool is_isolated = false;  ///< Decoded in a child process, where a fuzzer sees nothing.
};

/// For what must hold of anything that was read.
/// \throws std::logic_error
inline void require(bool holds, const char* what) {
  if (!holds) throw std::logic_error(what);
}

/// What a reader returns of a file that we wrote: there is no reason to refuse it.
/// \throws std::logic_error if it does
template <typename Read>
auto read_back(const Read& read) {
  try {
    return read();
  } catch (const BadInput& error) {
    throw std::logic_error(std::string("what was written is refused: ") + error.what());
  }
}

std::vector<FileKind> asset_kinds();  ///< Of splats and meshes.

/// All kinds, each with its valid file.
const std::vector<FileKind>& file_kinds();

}  // namespace cgs::test
