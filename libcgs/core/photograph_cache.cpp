// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/photograph_cache.h"

#include <utility>

namespace cgs {

std::optional<PhotographCache::Pixels> PhotographCache::find(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = pixels_.find(key);
  if (found == pixels_.end()) return std::nullopt;
  return found->second;
}

void PhotographCache::keep(const std::string& key, Pixels pixels) {
  const size_t bytes =
      pixels.image.data.size() * sizeof(pixels.image.data[0]) + pixels.valid.data.size();
  const std::lock_guard lock(mutex_);
  if (bytes > most_bytes_ - bytes_ || !pixels_.emplace(key, std::move(pixels)).second) return;
  bytes_ += bytes;
}

}  // namespace cgs
