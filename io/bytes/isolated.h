// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace cgs {

/// What a child process may use.
struct IsolationLimits {
  size_t memory = size_t{4} << 30;  ///< Address space on top of what the parent holds [bytes].
  unsigned seconds = 120;           ///< Of processor time.
};

/// Runs a decoder that is not hardened against hostile files in a child process, so that a crash,
/// or memory and time without end, cost nothing but an error message.
///
/// \param work  returns bytes, or throws; must not use threads that the parent started
/// \param path  for messages
/// \return the bytes that `work` returned
/// \throws BadInput Syntax with the message of what `work` threw, or where the child died;
///         LimitError where it ran out of memory or time; IoError if no child can be started
std::string run_isolated(const std::function<std::string()>& work,
                         const std::filesystem::path& path,
                         const IsolationLimits& limits = {});

}  // namespace cgs
