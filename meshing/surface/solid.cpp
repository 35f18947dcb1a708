// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/solid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

using openvdb::Coord;
constexpr int kPadding = 2;  // Empty voxels around the bounds, so that the border closes.

// Sums over three voxels along one axis; the outermost voxels keep their own value.
template <typename T>
void sum_along(std::vector<T>& cells, const std::array<int, 3>& size, int axis) {
  const std::array<size_t, 3> strides = {size_t(size[1]) * size_t(size[2]), size_t(size[2]), 1};
  const size_t stride = strides.at(size_t(axis));
  const auto length = size_t(size.at(size_t(axis)));
  const size_t lines = cells.size() / length;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, lines, 64), [&](const auto& range) {
    for (size_t line = range.begin(); line != range.end(); ++line) {
      T* p = cells.data() + (line / stride) * stride * length + line % stride;
      T before = p[0];
      for (size_t i = 1; i + 1 < length; ++i) {
        const T here = p[i * stride];
        p[i * stride] = static_cast<T>(before + here + p[(i + 1) * stride]);
        before = here;
      }
    }
  });
}

template <typename T>
void sum_around(std::vector<T>& cells, const std::array<int, 3>& size) {
  for (const int axis : {0, 1, 2}) sum_along(cells, size, axis);
}

// 6-connected parts of equal sign.
class Parts {
 public:
  explicit Parts(Solid& solid) : solid_(solid), seen_(solid.inside.size(), 0) {}

  // Matter first: what was a cavity of matter that goes belongs to the emptiness around it then.
  SolidParts remove_small(double relative_size) {
    SolidParts out;
    out.floaters = flip_small(1, relative_size);
    out.cavities = flip_small(0, relative_size);
    return out;
  }

 private:
  struct Part {
    size_t seed = 0;
    size_t size = 0;           // [voxels]
    bool is_observed = false;  // somewhere
  };

  size_t flip_small(uint8_t sign, double relative_size) {
    std::fill(seen_.begin(), seen_.end(), uint8_t{0});
    std::vector<Part> parts;
    for (size_t i = 0; i < seen_.size(); ++i) {
      if (seen_[i] == 0 && solid_.inside[i] == sign) parts.push_back(flood(i, false));
    }
    size_t largest = 0;
    for (const Part& part : parts) {
      if (sign == 0 || part.is_observed) largest = std::max(largest, part.size);
    }
    const auto limit = static_cast<double>(largest) * relative_size;
    size_t out = 0;
    for (const Part& part : parts) {
      const bool is_outside = sign == 0 && part.seed == 0;
      // Matter that only fills what several views hide from each other is no body of its own.
      const bool is_invented = sign == 1 && !part.is_observed && largest > 0;
      const bool is_large = static_cast<double>(part.size) >= limit;
      if (is_outside || (is_large && !is_invented)) continue;
      flood(part.seed, true);
      ++out;
    }
    return out;
  }

  // Visits the part of `seed`, the first time (flip = false) to count it, then to change its sign.
  Part flood(size_t seed, bool flip) {
    const uint8_t sign = solid_.inside[seed];
    const uint8_t mark = flip ? 2 : 1;
    const auto row = size_t(solid_.size[2]);
    const std::array<size_t, 2> strides = {size_t(solid_.size[1]) * row, row};
    const auto is_new = [&](size_t at) { return seen_[at] != mark && solid_.inside[at] == sign; };
    const auto push_runs = [&](size_t begin, size_t end) {
      for (size_t at = begin; at < end; ++at) {
        if (is_new(at) && (at == begin || !is_new(at - 1))) stack_.push_back(at);
      }
    };
    Part out{seed, 0, false};
    stack_.assign(1, seed);
    while (!stack_.empty()) {  // a run of voxels along z at a time: the stack stays small
      size_t begin = stack_.back();
      stack_.pop_back();
      if (!is_new(begin)) continue;
      const size_t row_begin = begin - begin % row;
      size_t end = begin + 1;
      while (begin > row_begin && is_new(begin - 1)) --begin;
      while (end < row_begin + row && is_new(end)) ++end;
      for (size_t at = begin; at < end; ++at) {
        seen_[at] = mark;
        out.is_observed = out.is_observed || solid_.evidence[at] != 0;
        if (flip) solid_.inside[at] = sign == 0 ? 1 : 0;
      }
      out.size += end - begin;
      for (size_t axis = 0; axis < strides.size(); ++axis) {
        const size_t stride = strides.at(axis);
        const size_t place = begin / stride % size_t(solid_.size.at(axis));
        if (place > 0) push_runs(begin - stride, end - stride);
        if (place + 1 < size_t(solid_.size.at(axis))) push_runs(begin + stride, end + stride);
      }
    }
    return out;
  }

  Solid& solid_;
  std::vector<uint8_t> seen_;
  std::vector<size_t> stack_;
};

}  // namespace

Solid solid(const Volume& volume) {
  Solid out;
  const auto voxel = double(volume.voxel_size);
  const Eigen::Vector3i low = (volume.bounds.min() / voxel).array().ceil().cast<int>();
  const Eigen::Vector3i high = (volume.bounds.max() / voxel).array().floor().cast<int>();
  out.origin = Coord(low.x(), low.y(), low.z()).offsetBy(-kPadding);
  for (int axis = 0; axis < 3; ++axis) {
    out.size.at(size_t(axis)) = high[axis] - low[axis] + 1 + 2 * kPadding;
  }
  const size_t n = size_t(out.size[0]) * size_t(out.size[1]) * size_t(out.size[2]);
  out.inside.assign(n, 0);
  out.evidence.assign(n, 0);
  tbb::parallel_for(kPadding, out.size[0] - kPadding, [&](int x) {
    const auto state = volume.state->getConstAccessor();
    const auto tsdf = volume.tsdf->getConstAccessor();
    for (int y = kPadding; y < out.size[1] - kPadding; ++y) {
      for (int z = kPadding; z < out.size[2] - kPadding; ++z) {
        const Coord at = out.origin.offsetBy(x, y, z);
        const size_t i = out.index(x, y, z);
        int value = 0;
        const bool known = state.probeValue(at, value);
        if (value == int(VoxelState::Occupied) || value == int(VoxelState::Estimated)) {
          out.evidence[i] = 1;
          out.inside[i] = tsdf.getValue(at) < 0;
        } else {
          out.inside[i] = known && value == int(VoxelState::NeverSeen);
        }
      }
    }
  });
  return out;
}

void smooth(Solid& solid) {
  constexpr int kHalf = 364;  // of 27 * 27
  for (int round = 0; round < 2; ++round) {
    solid.blurred.assign(solid.inside.begin(), solid.inside.end());
    sum_around(solid.blurred, solid.size);
    sum_around(solid.blurred, solid.size);
    tbb::parallel_for(kPadding, solid.size[0] - kPadding, [&](int x) {
      for (int y = kPadding; y < solid.size[1] - kPadding; ++y) {
        for (int z = kPadding; z < solid.size[2] - kPadding; ++z) {
          const size_t i = solid.index(x, y, z);
          if (solid.evidence[i] == 0) solid.inside[i] = solid.blurred[i] > kHalf;
        }
      }
    });
  }
}

SolidParts remove_small_parts(Solid& solid, double relative_size) {
  return Parts(solid).remove_small(relative_size);
}

}  // namespace cgs
