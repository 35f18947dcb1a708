// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace cgs {

/// Saves the state of unfinished work to NAME.checkpoint in a folder. The one before is kept as
/// NAME.previous.checkpoint, so that there is a whole one at any moment.
///
/// Layout, little-endian: "CGSCKPT1", u64 belongs_to, u64 size, `size` bytes of state, u64 FNV-1a
/// of everything before.
/// \param belongs_to  hash of whatever the state depends on
/// \throws IoError
void write_checkpoint(const std::filesystem::path& folder,
                      const std::string& name,
                      uint64_t belongs_to,
                      std::string_view state);

/// What read_checkpoint() found.
struct SavedState {
  std::optional<std::string> state;  ///< The newest whole one; none = work starts anew.
  std::string warning;               ///< What was damaged; empty = nothing.
  bool is_of_other = false;          ///< There is none, but a whole one of other work.
};

/// The newest whole state that belongs to `belongs_to`, or nothing: a missing, damaged or foreign
/// checkpoint means that work starts anew, never that it fails.
SavedState read_checkpoint(const std::filesystem::path& folder,
                           const std::string& name,
                           uint64_t belongs_to);

/// True if there is a file of either generation, whole or not.
bool has_checkpoint(const std::filesystem::path& folder, const std::string& name);

/// Removes both generations once the work is done.
/// \throws IoError
void remove_checkpoint(const std::filesystem::path& folder, const std::string& name);

}  // namespace cgs
