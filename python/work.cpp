// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/work.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace py = pybind11;

// What the thread that works and the one that waits tell each other.
class Watch {
 public:
  // For the thread that works.
  void hear(const std::string& stage, double fraction) {
    if (is_cancelled_) throw Cancelled();
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    fraction_ = fraction;
  }
  void warn(const std::string& line) {
    const std::lock_guard lock(mutex_);
    warnings_.push_back(line);
  }
  void end() {
    const std::lock_guard lock(mutex_);
    is_done_ = true;
    done_.notify_all();
  }

  // For the thread that waits.
  void cancel() { is_cancelled_ = true; }
  bool wait() {
    constexpr std::chrono::milliseconds kBetweenLooks(50);
    const py::gil_scoped_release others_may_run;
    std::unique_lock lock(mutex_);
    return done_.wait_for(lock, kBetweenLooks, [&] { return is_done_; });
  }
  // May raise what Python code or a signal raises.
  void tell(const py::object& progress) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    std::vector<std::string> warnings;
    std::string stage;
    double fraction = 0;
    {
      const std::lock_guard lock(mutex_);
      warnings.swap(warnings_);
      stage = stage_;
      fraction = fraction_;
    }
    cgs::warn(warnings);
    if (progress.is_none() || stage.empty() || (stage == told_stage_ && fraction == told_fraction_))
      return;
    told_stage_ = stage;
    told_fraction_ = fraction;
    progress(stage, fraction);
  }

 private:
  std::atomic<bool> is_cancelled_ = false;
  std::mutex mutex_;
  std::condition_variable done_;
  bool is_done_ = false;
  std::string stage_;
  double fraction_ = 0;
  std::vector<std::string> warnings_;
  std::string told_stage_;
  double told_fraction_ = -1;
};

}  // namespace

void warn(const std::vector<std::string>& lines, size_t from) {
  for (size_t i = from; i < lines.size(); ++i) {
    if (PyErr_WarnEx(PyExc_UserWarning, lines[i].c_str(), 1) != 0) throw py::error_already_set();
  }
}

void work_beside(const py::object& progress, const std::function<void()>& work) {
  Watch watch;
  const TerminalListener listener = {
      [&](const std::string& stage, double fraction) { watch.hear(stage, fraction); },
      [&](const std::string& line) { watch.warn(line); }};
  std::exception_ptr failure;
  std::thread worker([&] {
    const ListensToTerminals listening(listener);
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    watch.end();
  });
  std::optional<py::error_already_set> raised;
  for (bool is_done = false; !is_done;) {
    is_done = watch.wait();
    if (raised) continue;
    try {
      watch.tell(progress);
    } catch (const py::error_already_set& error) {
      raised = error;
      watch.cancel();
    }
  }
  worker.join();
  if (raised) throw *raised;
  if (failure) std::rethrow_exception(failure);
}

}  // namespace cgs
