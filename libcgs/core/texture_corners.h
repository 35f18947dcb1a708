// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace cgs {

/// The vertices of faces, once for each photograph that such a face shows: each has a texture
/// coordinate of its own. Numbered by vertex, then by photograph.
class TextureCorners {
 public:
  /// \param photographs  one per face; faces with a negative one are left out
  /// \param vertices     number of them
  /// \pre every index is below it
  TextureCorners(std::span<const std::array<uint32_t, 3>> faces,
                 std::span<const int> photographs,
                 size_t vertices)
      : first_(vertices + 1, 0) {
    const auto for_each = [&](const auto& visit) {
      for (size_t f = 0; f < faces.size(); ++f) {
        if (photographs[f] < 0) continue;
        for (const uint32_t v : faces[f]) visit(v, photographs[f]);
      }
    };
    for_each([&](uint32_t v, int) { ++first_[v + 1]; });
    for (size_t v = 0; v < vertices; ++v) first_[v + 1] += first_[v];
    corners_.resize(static_cast<size_t>(first_[vertices]));
    std::vector<std::ptrdiff_t> next(first_.begin(), first_.end() - 1);
    for_each([&](uint32_t v, int photograph) {
      corners_[static_cast<size_t>(next[v]++)] = {v, photograph};
    });
    leave_out_repeated();
  }

  size_t size() const { return corners_.size(); }
  uint32_t vertex(size_t i) const { return corners_[i].first; }
  int photograph(size_t i) const { return corners_[i].second; }

  /// The number of a corner. \pre a face with this vertex shows this photograph
  size_t operator()(uint32_t vertex, int photograph) const {
    const auto end = corners_.begin() + first_[vertex + 1];
    const auto found =
        std::lower_bound(corners_.begin() + first_[vertex], end, Corner(vertex, photograph));
    return static_cast<size_t>(found - corners_.begin());
  }

 private:
  using Corner = std::pair<uint32_t, int>;

  void leave_out_repeated() {
    auto end = corners_.begin();
    for (size_t v = 0; v + 1 < first_.size(); ++v) {
      const auto from = corners_.begin() + first_[v];
      const auto to = corners_.begin() + first_[v + 1];
      first_[v] = end - corners_.begin();
      std::sort(from, to);
      end = std::unique_copy(from, to, end);
    }
    first_.back() = end - corners_.begin();
    corners_.erase(end, corners_.end());
  }

  std::vector<std::ptrdiff_t> first_;  // per vertex, and the end
  std::vector<Corner> corners_;
};

}  // namespace cgs
