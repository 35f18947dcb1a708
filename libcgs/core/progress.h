// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string_view>

namespace cgs {

/// Called by long work with the fraction done in [0, 1], from one thread at a time; an empty
/// function is allowed everywhere. It may throw Cancelled to stop the work.
using Progress = std::function<void(double fraction)>;

inline void report(const Progress& progress, double fraction) {
  if (progress) progress(fraction);
}

/// The part [begin, end] of a longer piece of work.
inline Progress part_of(const Progress& progress, double begin, double end) {
  if (!progress) return {};
  return [=](double fraction) { progress(begin + (end - begin) * fraction); };
}

}  // namespace cgs
