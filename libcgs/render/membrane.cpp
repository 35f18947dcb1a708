// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/membrane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

namespace cgs {

namespace {

struct Step {
  int dx, dy;
};
constexpr std::array<Step, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

// Where the neighbours of a pixel draw it to; its own value if it has none.
float rest_of(
    const Raster<float>& values, const Raster<MembranePixel>& pixels, int x, int y, float pull) {
  float sum = 0;
  float count = 0;
  for (const auto& [dx, dy] : kSides) {
    if (!pixels.contains(x + dx, y + dy)) continue;
    if (pixels(x + dx, y + dy) == MembranePixel::Outside) continue;
    sum += values(x + dx, y + dy);
    ++count;
  }
  return count > 0 ? sum / (count + pull) : values(x, y);
}

// The open pixels of a row that are swept together.
struct OpenRow {
  int y;
  std::vector<int> inside;  // columns of those whose four neighbours are of the membrane
  std::vector<int> at_edge;
};

bool is_inside(const Raster<MembranePixel>& pixels, int x, int y) {
  return std::all_of(kSides.begin(), kSides.end(), [&](const Step& step) {
    return pixels.contains(x + step.dx, y + step.dy) &&
           pixels(x + step.dx, y + step.dy) != MembranePixel::Outside;
  });
}

// Rows with open pixels of one colour of a chessboard: most sweeps of a large picture are over a
// few small gaps.
std::vector<OpenRow> rows_to_sweep(const Raster<MembranePixel>& pixels, int color) {
  std::vector<OpenRow> out;
  for (int y = 0; y < pixels.height; ++y) {
    OpenRow row{y, {}, {}};
    for (int x = (y + color) % 2; x < pixels.width; x += 2) {
      if (pixels(x, y) != MembranePixel::Open) continue;
      (is_inside(pixels, x, y) ? row.inside : row.at_edge).push_back(x);
    }
    if (!row.inside.empty() || !row.at_edge.empty()) out.push_back(std::move(row));
  }
  return out;
}

/// Sweeps rows, and says how far they moved.
class Sweep {
 public:
  Sweep(Raster<float>& values, const Raster<MembranePixel>& pixels, float pull)
      : values_(values), pixels_(pixels), pull_(pull) {}

  // The furthest that a value went to where its neighbours draw it to, times `step`.
  float operator()(const std::vector<OpenRow>& rows, float step) const {
    return tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, rows.size()),
        0.0f,
        [&](const tbb::blocked_range<size_t>& range, float most) {
          for (size_t r = range.begin(); r < range.end(); ++r) most = swept(rows[r], step, most);
          return most;
        },
        [](float a, float b) { return std::max(a, b); });
  }

 private:
  float swept(const OpenRow& row, float step, float most) const {
    const auto move = [&](float& value, float rest) {
      const float by = step * (rest - value);
      value += by;
      most = std::max(most, std::abs(by));
    };
    float* const here = &values_(0, row.y);
    const int width = values_.width;
    for (const int x : row.inside) {
      const float sum = here[x - 1] + here[x + 1] + here[x - width] + here[x + width];
      move(here[x], sum / (4 + pull_));
    }
    for (const int x : row.at_edge) move(here[x], rest_of(values_, pixels_, x, row.y, pull_));
    return most;
  }

  Raster<float>& values_;
  const Raster<MembranePixel>& pixels_;
  float pull_;
};

float largest(const Raster<float>& values, const Raster<MembranePixel>& pixels) {
  float out = 0;
  for (size_t i = 0; i < values.data.size(); ++i) {
    if (pixels.data[i] != MembranePixel::Outside) out = std::max(out, std::abs(values.data[i]));
  }
  return out;
}

}  // namespace

void relax_membrane(Raster<float>& values,
                    const Raster<MembranePixel>& pixels,
                    float reach,
                    int sweeps) {
  constexpr float kOver = 1.8f;  // beyond the mean: waves across a gap die out sooner
  const float pull = reach > 0 ? 1 / (reach * reach) : 0;
  const std::array<std::vector<OpenRow>, 2> colors = {rows_to_sweep(pixels, 0),
                                                      rows_to_sweep(pixels, 1)};
  constexpr float kAtRest = 1e-6f;
  const float at_rest = kAtRest * largest(values, pixels);
  const Sweep sweep(values, pixels, pull);
  for (int k = 0; k < sweeps; ++k) {
    // The last ones end at the mean, so that nothing overshoots.
    const float step = k + 8 < sweeps ? kOver : 1;
    float moved = 0;
    for (const std::vector<OpenRow>& rows : colors) moved = std::max(moved, sweep(rows, step));
    if (moved <= at_rest) break;
  }
}

}  // namespace cgs
