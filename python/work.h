// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "convert/text/terminal.h"
#include "libcgs/core/progress.h"

namespace cgs {

/// Does work in a thread of its own while the caller's waits without the interpreter's lock: other
/// Python threads go on, Ctrl-C stops the work at its next report of progress.
///
/// Terminals that the work makes say nothing; their warnings become UserWarning.
/// \param progress  None, or called with the stage and the fraction done, some times a second
/// \throws what the work throws, or pybind11::error_already_set for what was raised meanwhile
void work_beside(const pybind11::object& progress, const std::function<void()>& work);

/// What work(terminal) returns.
template <typename Work>
auto result_of(const pybind11::object& progress, Work work) {
  std::optional<decltype(work(std::declval<Terminal&>()))> out;
  work_beside(progress, [&] {
    Terminal terminal(true);
    out.emplace(work(terminal));
  });
  return std::move(*out);
}

/// Raises a UserWarning for each line from an index on.
/// \throws pybind11::error_already_set where warnings are errors
void warn(const std::vector<std::string>& lines, size_t from = 0);

}  // namespace cgs
