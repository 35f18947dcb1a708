// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cerrno>
#include <new>

namespace cgs {

/// For decoders and encoders in C, which report a failed allocation as they report damage: set
/// errno to 0 before they work, and call this where they refuse, in the same thread.
/// \throws std::bad_alloc if an allocation failed since
inline void throw_if_memory_ran_out() {
  if (errno == ENOMEM) throw std::bad_alloc();
}

}  // namespace cgs
