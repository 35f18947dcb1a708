// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
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

/// Reports the progress of items that several threads work on at once, so that even one long loop
/// over the rows of an image can be cancelled.
class SharedProgress {
 public:
  /// \param progress  not owned; must outlive this
  /// \param items     > 0
  SharedProgress(const Progress& progress, size_t items) : progress_(progress), items_(items) {}

  /// Called for every finished item, from any thread; what is reported never falls. A thread that
  /// finds another one reporting goes on with its work.
  void advance() {
    ++done_;
    tell();
  }
  /// Reports again amid a long item, from any thread.
  void tell() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock) report(progress_, double(done_) / double(items_));
  }

 private:
  const Progress& progress_;
  const size_t items_;
  std::atomic<size_t> done_ = 0;
  std::mutex mutex_;
};

}  // namespace cgs
