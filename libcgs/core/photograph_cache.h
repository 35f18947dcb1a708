// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "libcgs/core/raster.h"

namespace cgs {

/// Pixels of photographs as work takes them, kept between the stages of a run: none is decoded,
/// undistorted and reduced twice while there is room. Any number of threads may ask at once.
class PhotographCache {
 public:
  struct Pixels {
    ColorImage image;
    MaskMap valid;  ///< As View::valid.
  };

  /// \param most_bytes  what is kept altogether [bytes]; what no longer fits is not kept
  explicit PhotographCache(size_t most_bytes) : most_bytes_(most_bytes) {}

  /// A copy of what was kept under this key.
  std::optional<Pixels> find(const std::string& key) const;
  /// \param key  tells all that the pixels depend on
  void keep(const std::string& key, Pixels pixels);

 private:
  size_t most_bytes_;
  size_t bytes_ = 0;
  mutable std::mutex mutex_;
  std::map<std::string, Pixels> pixels_;
};

}  // namespace cgs
