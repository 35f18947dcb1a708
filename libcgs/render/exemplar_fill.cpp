// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/exemplar_fill.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/render/hidden_depth.h"

namespace cgs {

namespace {

constexpr int kRadius = 3;  // of a window [pixels]
constexpr int kHalf = 2;
constexpr float kNoMatch = std::numeric_limits<float>::infinity();

/// The window of the known picture that one of a gap is like.
struct Match {
  int x = -1;  // < 0 = none
  int y = -1;
  float cost = kNoMatch;  // mean squared difference of a pixel
};

/// A picture at one size.
struct Level {
  ColorImage color;
  MaskMap open;
  DepthMap depth;
  DepthMap nearest;  // of the window around a pixel; NaN = no piece may come from there
};

void find_pieces(Level& level) {
  level.nearest = DepthMap(level.color.width, level.color.height, kNaN);
  tbb::parallel_for(kRadius, level.color.height - kRadius, [&](int y) {
    for (int x = kRadius; x < level.color.width - kRadius; ++x) {
      float nearest = kNoMatch;
      for (int v = y - kRadius; v <= y + kRadius; ++v) {
        for (int u = x - kRadius; u <= x + kRadius; ++u) {
          const bool is_known = level.open(u, v) == 0 && level.depth(u, v) > 0;
          nearest = std::min(nearest, is_known ? level.depth(u, v) : 0);
        }
      }
      if (nearest > 0) level.nearest(x, y) = nearest;
    }
  });
}

// Half the size: what is known of each four pixels, where that is two or more.
Level halved(const Level& fine) {
  const int w = fine.color.width / kHalf;
  const int h = fine.color.height / kHalf;
  Level out{ColorImage(w, h, Eigen::Vector3f::Zero()), MaskMap(w, h, 0), DepthMap(w, h, kNaN), {}};
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      int known = 0;
      for (int k = 0; k < kHalf * kHalf; ++k) {
        known += fine.open(kHalf * x + k % kHalf, kHalf * y + k / kHalf) == 0 ? 1 : 0;
      }
      out.open(x, y) = known < 2 ? 1 : 0;
      Eigen::Vector3f color = Eigen::Vector3f::Zero();
      float depth = 0;
      int count = 0;
      for (int k = 0; k < kHalf * kHalf; ++k) {
        const size_t i = fine.open.index(kHalf * x + k % kHalf, kHalf * y + k / kHalf);
        if ((fine.open.data[i] != 0) != (out.open(x, y) != 0)) continue;
        color += fine.color.data[i];
        depth += fine.depth.data[i];  // NaN, too
        ++count;
      }
      out.color(x, y) = color / static_cast<float>(count);
      out.depth(x, y) = depth / static_cast<float>(count);
    }
  }
  find_pieces(out);
  return out;
}

/// Finds windows and colours at one size.
class Filling {
 public:
  explicit Filling(Level& level)
      : level_(level), matches_(level.color.width, level.color.height, Match{}) {
    for (int y = 0; y < matches_.height; ++y) {
      for (int x = 0; x < matches_.width; ++x) {
        if (!std::isnan(level.nearest(x, y))) pieces_.push_back({x, y});
      }
    }
  }

  bool has_pieces() const { return !pieces_.empty(); }
  const Raster<Match>& matches() const { return matches_; }

  /// Begins with the windows that were found at half the size, if there are any.
  void begin(const Raster<Match>& coarse) {
    for_open([&](int x, int y) {
      if (coarse.contains(x / kHalf, y / kHalf)) {
        const Match& half = coarse(x / kHalf, y / kHalf);
        if (half.x >= 0) consider(x, y, kHalf * half.x + x % kHalf, kHalf * half.y + y % kHalf);
      }
    });
  }

  /// One round over all windows of gaps.
  void match(uint64_t round) {
    for_open([&](int x, int y) {  // colours have changed
      Match& match = matches_(x, y);
      if (match.x >= 0) match.cost = cost(x, y, match.x, match.y, kNoMatch);
    });
    for (const int color : {0, 1}) {
      for_open([&](int x, int y) {
        if ((x + y) % 2 == color) visit(x, y, round);
      });
    }
  }

  /// Colours of gaps as their windows say, those within `reach` pixels of each.
  void vote(int reach) {
    const float scale = typical_cost();
    ColorImage out = level_.color;
    for_open([&](int x, int y) {
      float least = kNoMatch;
      for_window(x, y, reach, [&](int, int, const Match& m) { least = std::min(least, m.cost); });
      if (least == kNoMatch) return;
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float weight = 0;
      for_window(x, y, reach, [&](int u, int v, const Match& match) {
        const float w = std::exp((least - match.cost) / scale);
        sum += w * level_.color(match.x + x - u, match.y + y - v);
        weight += w;
      });
      out(x, y) = sum / weight;
    });
    level_.color = std::move(out);
  }

 private:
  struct Place {
    int x, y;
  };

  template <typename Visit>
  void for_open(const Visit& visit) {
    tbb::parallel_for(0, level_.open.height, [&](int y) {
      for (int x = 0; x < level_.open.width; ++x) {
        if (level_.open(x, y) != 0) visit(x, y);
      }
    });
  }

  // Calls visit(u, v, match) for the pixels around one that have a match.
  template <typename Visit>
  void for_window(int x, int y, int reach, const Visit& visit) const {
    for (int v = std::max(0, y - reach); v <= std::min(matches_.height - 1, y + reach); ++v) {
      for (int u = std::max(0, x - reach); u <= std::min(matches_.width - 1, x + reach); ++u) {
        if (matches_(u, v).x >= 0) visit(u, v, matches_(u, v));
      }
    }
  }

  // Whether a piece may be taken for a window of a gap.
  bool is_behind(int x, int y, int from_x, int from_y) const {
    const float nearest = level_.nearest(from_x, from_y);
    const float hidden = level_.depth(x, y);
    return !std::isnan(nearest) && !(nearest < kFarSide * hidden);
  }

  float cost(int x, int y, int from_x, int from_y, float most) const {
    const float hidden = level_.depth(x, y);
    float sum = 0;
    int count = 0;
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
      for (int dx = -kRadius; dx <= kRadius; ++dx) {
        const int u = x + dx;
        const int v = y + dy;
        if (!level_.open.contains(u, v)) continue;
        // What stands in front of the gap is no part of what it hides.
        const float depth = level_.depth(u, v);
        if (level_.open(u, v) == 0 && (depth == 0 || depth < kFarSide * hidden)) continue;
        sum += (level_.color(u, v) - level_.color(from_x + dx, from_y + dy)).squaredNorm();
        ++count;
      }
      constexpr auto kWindow = static_cast<float>((2 * kRadius + 1) * (2 * kRadius + 1));
      if (sum > most * kWindow) return kNoMatch;
    }
    return sum / static_cast<float>(count);
  }

  void consider(int x, int y, int from_x, int from_y) {
    if (!level_.nearest.contains(from_x, from_y) || !is_behind(x, y, from_x, from_y)) return;
    Match& best = matches_(x, y);
    const float c = cost(x, y, from_x, from_y, best.cost);
    if (c < best.cost) best = {from_x, from_y, c};
  }

  void visit(int x, int y, uint64_t round) {
    uint64_t index = (round * level_.open.data.size() + level_.open.index(x, y)) * 64;
    const auto random_below = [&index](int count) {
      return static_cast<int>(random_number(index++) % static_cast<uint64_t>(count));
    };
    constexpr Place kNeighbours[] = {
        {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-5, 0}, {5, 0}, {0, -5}, {0, 5}};
    for (const Place& o : kNeighbours) {
      if (!matches_.contains(x + o.x, y + o.y)) continue;
      const Match& there = matches_(x + o.x, y + o.y);
      if (there.x >= 0) consider(x, y, there.x - o.x, there.y - o.y);
    }
    constexpr int kAnywhere = 4;
    for (int k = 0; k < kAnywhere; ++k) {
      const Place& piece = pieces_[random_number(index++) % pieces_.size()];
      consider(x, y, piece.x, piece.y);
    }
    for (int reach = std::max(level_.open.width, level_.open.height) / 4; reach > 0; reach /= 2) {
      const Match& best = matches_(x, y);
      if (best.x < 0) break;
      const int dx = random_below(2 * reach + 1) - reach;
      const int dy = random_below(2 * reach + 1) - reach;
      consider(x, y, best.x + dx, best.y + dy);
    }
  }

  // By how much more a window may cost than the best one and still have a say: what three quarters
  // of them cost.
  float typical_cost() const {
    std::vector<float> costs;
    for (const Match& match : matches_.data) {
      if (match.x >= 0) costs.push_back(match.cost);
    }
    constexpr float kLeast = 1e-5f;
    if (costs.empty()) return kLeast;
    return std::max(nth_smallest(costs, costs.size() * 3 / 4), kLeast);
  }

  Level& level_;
  std::vector<Place> pieces_;
  Raster<Match> matches_;
};

// Whether a pixel has a window of which nothing is known.
bool has_wide_gap(const MaskMap& open) {
  for (int y = 0; y < open.height; ++y) {
    for (int x = 0; x < open.width; ++x) {
      bool is_open = true;
      for (int v = std::max(0, y - kRadius); is_open && v <= y + kRadius; ++v) {
        for (int u = std::max(0, x - kRadius); is_open && u <= x + kRadius; ++u) {
          is_open = !open.contains(u, v) || open(u, v) != 0;
        }
      }
      if (is_open) return true;
    }
  }
  return false;
}

// Sizes from the given one down to where gaps are a window wide or the picture is a few of them.
std::vector<Level> levels_of(Level finest) {
  constexpr int kLeastSide = 12 * kRadius;
  find_pieces(finest);
  std::vector<Level> out = {std::move(finest)};
  while (std::min(out.back().color.width, out.back().color.height) >= 2 * kLeastSide &&
         has_wide_gap(out.back().open)) {
    out.push_back(halved(out.back()));
  }
  return out;
}

}  // namespace

ColorImage exemplar_fill(const ColorImage& picture, const MaskMap& open, const DepthMap& depth) {
  require(open.width == picture.width && open.height == picture.height &&
              depth.width == picture.width && depth.height == picture.height,
          "mask and depth must be of the size of the picture; its width",
          picture.width);
  std::vector<Level> levels = levels_of({picture, open, depth, {}});
  Raster<Match> found;
  for (size_t k = levels.size(); k-- > 0;) {
    Level& level = levels[k];
    Filling filling(level);
    if (!filling.has_pieces()) {
      found = {};
      continue;
    }
    const bool is_coarsest = found.empty();
    filling.begin(found);
    // What was found at half the size says more than the colours to begin with.
    if (!is_coarsest) filling.vote(kRadius);
    const int rounds = is_coarsest ? 12 : k == 0 ? 3 : 5;
    for (int round = 0; round < rounds; ++round) {
      filling.match(k * 16 + static_cast<uint64_t>(round));
      const bool is_last = k == 0 && round == rounds - 1;
      filling.vote(is_last ? 1 : kRadius);  // sharp in the end
    }
    found = filling.matches();
  }
  return std::move(levels.front().color);
}

}  // namespace cgs
