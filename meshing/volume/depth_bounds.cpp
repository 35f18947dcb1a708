// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/depth_bounds.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/padded_raster.h"

namespace cgs {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Extremes over cells of pixels, side by side. Rows are longer than the picture, so that eight
// lanes fit behind their last cell.
struct Extremes {
  Extremes(int w, int h) : width(w), height(h) {
    const int stride = w + 2 * kLanes;
    near = Raster<float>(stride, h, kInfinity);
    far = Raster<float>(stride, h, -kInfinity);
    unknown = Raster<float>(stride, h, 0);
  }
  int width, height;
  Raster<float> near;     // infinity where there is no depth
  Raster<float> far;      // -infinity where there is neither depth nor gap, 0 where only gaps
  Raster<float> unknown;  // 1 where a pixel has no depth
};

struct EightExtremes {
  Floats near = Floats{} + kInfinity;
  Floats far = Floats{} - kInfinity;
  Floats unknown = {};

  static EightExtremes at(const Extremes& cells, int x, int y) {
    return {load<Floats>(&cells.near(x, y)),
            load<Floats>(&cells.far(x, y)),
            load<Floats>(&cells.unknown(x, y))};
  }
  void add(const EightExtremes& other) {
    near = min(near, other.near);
    far = max(far, other.far);
    unknown = max(unknown, other.unknown);
  }
  void put(Extremes& cells, int x, int y) const {
    store(near, &cells.near(x, y));
    store(far, &cells.far(x, y));
    store(unknown, &cells.unknown(x, y));
  }
};

// Neighbours of a and b, of which each has one in `first` and one in `second`.
struct Pairs {
  Floats first, second;
};
Pairs pairs(Floats a, Floats b) {
  const auto in_order = [](Floats v) -> Floats {
    return _mm256_castpd_ps(_mm256_permute4x64_pd(_mm256_castps_pd(v), 0xd8));
  };
  return {in_order(_mm256_shuffle_ps(a, b, 0x88)), in_order(_mm256_shuffle_ps(a, b, 0xdd))};
}

EightExtremes joined(const EightExtremes& a, const EightExtremes& b) {
  const Pairs near = pairs(a.near, b.near);
  const Pairs far = pairs(a.far, b.far);
  const Pairs unknown = pairs(a.unknown, b.unknown);
  EightExtremes out = {near.first, far.first, unknown.first};
  out.add({near.second, far.second, unknown.second});
  return out;
}

// Over 2 x 2 cells.
Extremes coarser(const Extremes& fine) {
  Extremes out((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (int y = 0; y < out.height; ++y) {
    const int below = std::min(2 * y + 1, fine.height - 1);
    for (int x = 0; x < out.width; x += kLanes) {
      const auto both = [&](int at) {
        if (at >= fine.width) return EightExtremes{};
        EightExtremes one = EightExtremes::at(fine, at, 2 * y);
        one.add(EightExtremes::at(fine, at, below));
        return one;
      };
      joined(both(2 * x), both(2 * x + kLanes)).put(out, x, y);
    }
  }
  return out;
}

// Rows of pixels, before they become cells of 2 x 2.
class PixelExtremes {
 public:
  PixelExtremes(const DepthMap& depth, const DepthMap& hides, const Raster<float>& slack)
      : depth_(with_margin(depth, 1)), hides_(hides), slack_(slack) {}

  // Of pixels y and y + 1.
  void put_two_rows(int y, Extremes& out) const {
    Extremes rows(hides_.width, 2);
    for (int r = 0; r < std::min(2, hides_.height - y); ++r) put_row(y + r, r, rows);
    for (int x = 0; x < out.width; x += kLanes) {
      EightExtremes left = EightExtremes::at(rows, 2 * x, 0);
      left.add(EightExtremes::at(rows, 2 * x, 1));
      EightExtremes right;
      if (2 * x + kLanes < rows.width) {
        right = EightExtremes::at(rows, 2 * x + kLanes, 0);
        right.add(EightExtremes::at(rows, 2 * x + kLanes, 1));
      }
      joined(left, right).put(out, x, y / 2);
    }
  }

 private:
  void put_row(int y, int r, Extremes& rows) const {
    const int width = hides_.width;
    std::vector<float> hides(size_t(width) + kLanes, std::numeric_limits<float>::quiet_NaN());
    std::vector<float> slack(size_t(width) + kLanes, 0);
    std::copy_n(&hides_(0, y), width, hides.data());
    std::copy_n(&slack_(0, y), width, slack.data());
    for (int x = 0; x < width; x += kLanes) {
      // A point is held against depth between its pixel's and those around it.
      Floats low = Floats{} + kInfinity;
      Floats high = Floats{} - kInfinity;
      for (int v = y; v < y + 3; ++v) {
        for (int u = x; u < x + 3; ++u) {
          const auto around = load<Floats>(&depth_(u, v));
          low = min(around, low);  // NaN leaves the other
          high = max(around, high);
        }
      }
      const auto own = load<Floats>(&depth_(x + 1, y + 1));
      const auto hidden = load<Floats>(&hides[size_t(x)]);
      const auto reach = load<Floats>(&slack[size_t(x)]);
      const Ints known = own - own == 0.0f;
      const Floats gap = select(hidden - hidden == 0.0f, Floats{}, Floats{} - kInfinity);
      const EightExtremes out = {select(known, max(low - reach, Floats{}), Floats{} + kInfinity),
                                 select(known, high + reach, gap),
                                 select(known, Floats{}, Floats{} + 1.0f)};
      out.put(rows, x, r);
    }
    for (int x = width; x < width + kLanes; ++x) {
      rows.near(x, r) = kInfinity;
      rows.far(x, r) = -kInfinity;
      rows.unknown(x, r) = 0;
    }
  }

  Raster<float> depth_;
  const DepthMap& hides_;
  const Raster<float>& slack_;
};

// Over windows that reach `reach` cells to all sides.
Extremes widened(const Extremes& cells, int reach) {
  Extremes across(cells.width, cells.height);
  Extremes out(cells.width, cells.height);
  const auto padded = [&](const Raster<float>& of, float fill) {
    return with_margin(of, reach, fill);
  };
  const Raster<float> near = padded(cells.near, kInfinity);
  const Raster<float> far = padded(cells.far, -kInfinity);
  const Raster<float> unknown = padded(cells.unknown, 0);
  for (int y = 0; y < cells.height; ++y) {
    for (int x = 0; x < cells.width; x += kLanes) {
      EightExtremes sum;
      for (int k = x; k <= x + 2 * reach; ++k) {
        sum.add({load<Floats>(&near(k, y + reach)),
                 load<Floats>(&far(k, y + reach)),
                 load<Floats>(&unknown(k, y + reach))});
      }
      sum.put(across, x, y);
    }
  }
  for (int y = 0; y < cells.height; ++y) {
    const int last = std::min(y + reach, cells.height - 1);
    for (int x = 0; x < cells.width; x += kLanes) {
      EightExtremes sum;
      for (int k = std::max(0, y - reach); k <= last; ++k) {
        sum.add(EightExtremes::at(across, x, k));
      }
      sum.put(out, x, y);
    }
  }
  return out;
}

}  // namespace

DepthBounds::DepthBounds(const DepthMap& depth, const DepthMap& hides, const Raster<float>& slack) {
  Extremes cells((depth.width + 1) / 2, (depth.height + 1) / 2);
  const PixelExtremes pixels(depth, hides, slack);
  tbb::parallel_for(0, cells.height, [&](int row) { pixels.put_two_rows(2 * row, cells); });
  const int most = std::max(depth.width, depth.height);
  for (int shift = 1;; ++shift) {
    for (const int reach : {2, 3}) {
      if (shift == 1 && reach == 2) continue;  // hardly ever enough
      Extremes wide = widened(cells, reach);
      for (size_t i = 0; i < wide.near.data.size(); ++i) {
        if (wide.unknown.data[i] != 0) wide.near.data[i] = -wide.near.data[i];
      }
      rungs_.push_back({shift, float(reach << shift), std::move(wide.near), std::move(wide.far)});
      if (reach << shift >= most) return;
    }
    cells = coarser(cells);
  }
}

DepthBounds::Lanes DepthBounds::around(Floats u, Floats v, float reach) const {
  size_t k = 0;
  while (k + 1 < rungs_.size() && rungs_[k].reach < reach) ++k;
  const Rung& rung = rungs_[k];
  const Ints column = __builtin_convertvector(u, Ints) >> rung.shift;
  const Ints row = __builtin_convertvector(v, Ints) >> rung.shift;
  const Ints at = row * rung.near.width + column;
  const auto all = [&](const Raster<float>& values) -> Floats {
    return _mm256_i32gather_ps(values.data.data(), std::bit_cast<__m256i>(at), sizeof(float));
  };
  const Floats near = all(rung.near);
  const Floats far = all(rung.far);
  return {magnitude(near), far, far < 0.0f, std::bit_cast<Ints>(near) < 0};
}

}  // namespace cgs
