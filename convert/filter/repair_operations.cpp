// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/operations.h"

namespace cgs {

std::vector<FilterOperation> repair_operations() { return {}; }

}  // namespace cgs
