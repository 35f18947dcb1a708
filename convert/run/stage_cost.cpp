// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/stage_cost.h"

#include <fstream>

#include <malloc.h>
#include <sys/resource.h>

#include "convert/text/terminal.h"

namespace cgs {

namespace {

double cpu_seconds() {
  struct rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Makes the present the peak. Source: Linux, Documentation/filesystems/proc.rst, clear_refs.
bool reset_peak_memory() {
  malloc_trim(0);  // what earlier work gave back counts no more
  std::ofstream file("/proc/self/clear_refs");
  file << 5 << std::flush;
  return file.good();
}

}  // namespace

CostMeter::CostMeter()
    : cpu_(cpu_seconds()),
      start_(std::chrono::steady_clock::now()),
      has_peak_(reset_peak_memory()) {}

StageCost CostMeter::read() const {
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start_;
  return {cpu_seconds() - cpu_, wall.count(), has_peak_ ? peak_memory() : 0};
}

}  // namespace cgs
