// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>

namespace cgs {

/// What a piece of work cost this process.
struct StageCost {
  double cpu = 0;          ///< Processor time of all threads, of the user and the system [s].
  double wall = 0;         ///< [s]
  size_t peak_memory = 0;  ///< Resident, with what was there before [bytes]; 0 = cannot be told.
};

/// Measures from its construction on. The peak of memory is that of the whole process, so one at a
/// time; it is reset in the system's books, which other processes see.
class CostMeter {
 public:
  CostMeter();
  StageCost read() const;

 private:
  double cpu_;
  std::chrono::steady_clock::time_point start_;
  bool has_peak_;
};

}  // namespace cgs
