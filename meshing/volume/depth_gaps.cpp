// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "meshing/volume/depth_field.h"

namespace cgs {

namespace {

constexpr std::array<std::array<int, 2>, 4> kNeighbours = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

// The pixels of the enclosed patch of NaN that holds one, marked in `seen`.
std::vector<size_t> patch_of(const DepthMap& depth, size_t start, Raster<uint8_t>& seen) {
  std::vector<size_t> patch = {start};
  seen.data[start] = 1;
  for (size_t i = 0; i < patch.size(); ++i) {
    const int x = static_cast<int>(patch[i] % size_t(depth.width));
    const int y = static_cast<int>(patch[i] / size_t(depth.width));
    for (const auto& [dx, dy] : kNeighbours) {
      const size_t next = depth.index(x + dx, y + dy);
      if (seen.data[next] != 0 || std::isfinite(depth.data[next])) continue;
      seen.data[next] = 1;
      patch.push_back(next);
    }
  }
  return patch;
}

// Gauss-Seidel on the Laplace equation of inverse depth, with the rim as boundary.
void fill_membrane(DepthMap& depth, const std::vector<size_t>& patch) {
  const auto width = static_cast<size_t>(depth.width);
  float rim = 0;
  int count = 0;
  const std::array<std::ptrdiff_t, 4> steps = {
      1, -1, std::ptrdiff_t(width), -std::ptrdiff_t(width)};
  for (const size_t p : patch) {
    for (const auto step : steps) {
      const float d = depth.data[p + size_t(step)];
      if (!std::isfinite(d)) continue;
      rim += 1 / d;
      ++count;
    }
  }
  if (count == 0) return;
  for (const size_t p : patch) depth.data[p] = static_cast<float>(count) / rim;
  const int rounds = 4 + 2 * static_cast<int>(std::sqrt(double(patch.size())));
  for (int round = 0; round < rounds; ++round) {
    for (const size_t p : patch) {
      float sum = 0;
      for (const auto step : steps) sum += 1 / depth.data[p + size_t(step)];
      depth.data[p] = 4 / sum;
    }
  }
}

// A stretch of unknown pixels in one row.
struct Run {
  int first, last;  // columns
  int part;
};

// Connected parts of unknown pixels, told by the stretches they consist of: most of a picture may
// be one of them.
class Parts {
 public:
  void add() {
    parent_.push_back(int(parent_.size()));
    area_.push_back(0);
    is_open_.push_back(0);
  }
  int size() const { return int(parent_.size()); }
  int root(int part) {
    while (parent_[size_t(part)] != part) {
      part = parent_[size_t(part)] = parent_[size_t(parent_[size_t(part)])];
    }
    return part;
  }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    if (a == b) return;
    parent_[size_t(b)] = a;
    area_[size_t(a)] += area_[size_t(b)];
    is_open_[size_t(a)] |= is_open_[size_t(b)];
  }
  void add_run(const Run& run, bool is_open) {
    area_[size_t(run.part)] += run.last - run.first + 1;
    if (is_open) is_open_[size_t(run.part)] = 1;
  }
  bool is_gap(int part, int max_area) {
    part = root(part);
    return is_open_[size_t(part)] == 0 && area_[size_t(part)] <= max_area;
  }

 private:
  std::vector<int> parent_, area_;
  std::vector<uint8_t> is_open_;
};

// The first pixels of runs that belong to enclosed patches of at most `max_area` pixels.
std::vector<size_t> gap_pixels(const DepthMap& depth, int max_area) {
  Parts parts;
  std::vector<Run> above;
  std::vector<Run> row;
  std::vector<std::pair<size_t, int>> starts;
  for (int y = 0; y < depth.height; ++y) {
    row.clear();
    for (int x = 0; x < depth.width; ++x) {
      if (std::isfinite(depth(x, y))) continue;
      const int first = x;
      while (x + 1 < depth.width && !std::isfinite(depth(x + 1, y))) ++x;
      const Run run = {first, x, parts.size()};
      parts.add();
      const bool is_at_side = first == 0 || x + 1 == depth.width;
      parts.add_run(run, is_at_side || y == 0 || y + 1 == depth.height);
      row.push_back(run);
      starts.emplace_back(depth.index(first, y), run.part);
    }
    size_t k = 0;
    for (const Run& run : row) {
      while (k < above.size() && above[k].last < run.first) ++k;
      for (size_t i = k; i < above.size() && above[i].first <= run.last; ++i) {
        parts.join(above[i].part, run.part);
      }
    }
    std::swap(above, row);
  }
  std::vector<size_t> out;
  for (const auto& [pixel, part] : starts) {
    if (parts.is_gap(part, max_area)) out.push_back(pixel);
  }
  return out;
}

}  // namespace

DepthMap with_gaps_filled(const DepthMap& depth, int max_area) {
  DepthMap filled = depth;
  Raster<uint8_t> seen(depth.width, depth.height, 0);
  for (const size_t pixel : gap_pixels(depth, max_area)) {
    if (seen.data[pixel] != 0) continue;
    fill_membrane(filled, patch_of(depth, pixel, seen));
  }
  return filled;
}

}  // namespace cgs
