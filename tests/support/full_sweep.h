// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <string_view>

namespace cgs::test {

/// All cases of a sweep are wished for, not the representative part of them: CGS_SWEEP=full.
inline bool is_full_sweep() {
  const char* const wish = std::getenv("CGS_SWEEP");
  return wish != nullptr && std::string_view(wish) == "full";
}

}  // namespace cgs::test
