// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>

#include "libcgs/core/error.h"

namespace cgs {

/// The value that an argument names.
/// \param allowed  what the error says of other names
/// \throws InvalidInput if there is none of that name
template <typename T>
T named(const std::map<std::string, T>& values, const std::string& name, const char* allowed) {
  const auto value = values.find(name);
  require(value != values.end(), allowed, name);
  return value->second;
}

}  // namespace cgs
