// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <span>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "libcgs/core/progress.h"
#include "meshing/volume/tsdf_options.h"
#include "meshing/volume/tsdf_view.h"

namespace cgs {

/// \throws InvalidInput if its rasters differ in size, naming the view
void validate_view(const TsdfView& view, size_t number);

/// Views that are in memory, or come one after the other.
class FusionViews {
 public:
  explicit FusionViews(std::span<const TsdfView> views) : views_(views), count_(views.size()) {}
  explicit FusionViews(const TsdfSource& source) : source_(&source), count_(source.count) {}

  size_t size() const { return count_; }
  bool are_in_memory() const { return source_ == nullptr; }
  /// Calls work(i, view) for views first ... last - 1, several at once.
  /// \throws Error that the first view to fail throws, whichever thread met which
  template <typename Work>
  void each(size_t first, size_t last, bool with_color, const Work& work) const {
    std::atomic<size_t> first_failed = last;
    std::exception_ptr failure;
    std::mutex mutex;
    tbb::parallel_for(first, last, [&](size_t i) {
      if (i > first_failed) return;
      try {
        do_one(i, with_color, work);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (i > first_failed) return;
        first_failed = i;
        failure = std::current_exception();
      }
    });
    if (failure) std::rethrow_exception(failure);
  }

 private:
  template <typename Work>
  void do_one(size_t i, bool with_color, const Work& work) const {
    if (are_in_memory()) {
      work(i, views_[i]);
      return;
    }
    // Nested loops of a waiting thread must not begin another view: that would hold one more.
    tbb::this_task_arena::isolate([&] {
      TsdfView view = source_->view(i, with_color);
      validate_view(view, i);
      work(i, std::move(view));
    });
  }

  std::span<const TsdfView> views_;
  const TsdfSource* source_ = nullptr;
  size_t count_;
};

/// Where the surface lies, and how finely it is known.
struct SurfaceExtent {
  Eigen::AlignedBox3d surface;
  double footprint = 0;  ///< Median size of a pixel on the surface [internal units].
  double sigma = 0;      ///< Median of the known ones [internal units].
  size_t pixels = 0;     ///< Of all views.
};

/// What the trustworthy pixels of all views show: those whose depth lies between the 1st and the
/// 99th percentile of their view, and patches of measured pixels beyond (2 % from pixel to pixel,
/// a 500th of the view or more).
/// \param most_footprints  of how many pixels medians are taken, evenly spaced
/// \throws InvalidInput without any depth
SurfaceExtent surface_extent(const FusionViews& views,
                             double depth_trunc,
                             size_t most_footprints,
                             const Progress& progress);

/// Voxel edge of the options or, where that is 0, by the extent [internal units].
double chosen_voxel_size(const SurfaceExtent& extent, const TsdfOptions& options);

inline constexpr double kFusionMargin = 2;  ///< Voxels around the band.
inline constexpr size_t kViewsAtOnce = 16;  ///< Between two reports of progress.

}  // namespace cgs
