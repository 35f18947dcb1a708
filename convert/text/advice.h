// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/core/error.h"

namespace cgs {

/// What an error says, and the option of the program by which its user can do something about it,
/// if there is one: "…; state it, in pixels (--focal)".
std::string words_of(const Error& error);

}  // namespace cgs
