// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/version.h"

namespace cgs {

const char* version() { return CGS_VERSION; }

}  // namespace cgs
