// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/membrane.h"

#include <array>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

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
  std::vector<int> columns;
};

// Rows with open pixels of one colour of a chessboard: most sweeps of a large picture are over a
// few small gaps.
std::vector<OpenRow> rows_to_sweep(const Raster<MembranePixel>& pixels, int color) {
  std::vector<OpenRow> out;
  for (int y = 0; y < pixels.height; ++y) {
    OpenRow row{y, {}};
    for (int x = (y + color) % 2; x < pixels.width; x += 2) {
      if (pixels(x, y) == MembranePixel::Open) row.columns.push_back(x);
    }
    if (!row.columns.empty()) out.push_back(std::move(row));
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
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    // The last ones end at the mean, so that nothing overshoots.
    const float step = sweep + 8 < sweeps ? kOver : 1;
    for (const std::vector<OpenRow>& rows : colors) {
      tbb::parallel_for(size_t{0}, rows.size(), [&](size_t r) {
        const auto& [y, columns] = rows[r];
        for (const int x : columns) {
          float& value = values(x, y);
          value += step * (rest_of(values, pixels, x, y, pull) - value);
        }
      });
    }
  }
}

}  // namespace cgs
