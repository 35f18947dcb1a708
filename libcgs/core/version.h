// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace cgs {

/// Of the libraries and the program, "major.minor.patch", as CMakeLists.txt states it.
const char* version();

}  // namespace cgs
