// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/readable_inputs.h"

#include <algorithm>
#include <exception>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include "io/images/image.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// How many photographs may be decoded at once.
size_t read_at_once(const Scene& scene, size_t room) {
  constexpr double kOfPixel = 32;  // [bytes]; as of_reading() in the memory plan, and a mask
  double largest = 1;
  for (const View& view : scene.views) {
    if (view.image_path.empty()) continue;
    try {
      const ImageSize size = image_size(view.image_path);
      largest = std::max(largest, double(size.width) * size.height);
    } catch (const Error&) {
      continue;  // is told when it is read
    }
  }
  const double threads =
      double(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  return static_cast<size_t>(
      std::clamp(double(room) / (kOfPixel * largest), 1.0, std::max(1.0, threads)));
}

// In the order in which damage is told.
std::vector<std::function<void()>> reads_of(const Scene& scene) {
  std::set<int> used(scene.input.begin(), scene.input.end());
  used.insert(scene.held_out.begin(), scene.held_out.end());
  std::vector<std::function<void()>> out;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].image_path.empty()) continue;
    if (used.contains(static_cast<int>(i))) {
      out.emplace_back([&scene, i] {
        std::vector<std::string> told_when_used;
        (void)loaded_view(scene, static_cast<int>(i), /*with_image=*/true, told_when_used);
      });
    } else {
      out.emplace_back([&scene, i] { (void)read_image(scene.views[i].image_path); });
    }
  }
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (!view.depth_path.empty())
      out.emplace_back([&view] { (void)read_depth_file(view.depth_path); });
  }
  return out;
}

}  // namespace

void refuse_unreadable(const Scene& scene, size_t room, const Progress& progress) {
  const std::vector<std::function<void()>> reads = reads_of(scene);
  const size_t at_once = read_at_once(scene, room);
  for (size_t from = 0; from < reads.size(); from += at_once) {
    report(progress, double(from) / double(reads.size()));
    std::vector<std::exception_ptr> failures(std::min(at_once, reads.size() - from));
    tbb::parallel_for(size_t{0}, failures.size(), [&](size_t k) {
      try {
        reads[from + k]();
      } catch (...) {
        failures[k] = std::current_exception();
      }
    });
    for (const std::exception_ptr& failure : failures) {
      if (failure) std::rethrow_exception(failure);
    }
  }
  report(progress, 1);
}

}  // namespace cgs
