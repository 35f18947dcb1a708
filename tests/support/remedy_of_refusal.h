// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <exception>
#include <functional>

#include "libcgs/core/remedy.h"

namespace cgs::test {

/// What can be done about the exception that an action ends with; None where it ends without.
inline Remedy remedy_of_refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return remedy_of(error);
  }
  return Remedy::None;
}

}  // namespace cgs::test
