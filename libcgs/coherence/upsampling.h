// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "libcgs/coherence/feature_map.h"

namespace cgs {

/// Where one sample of an upsampled axis comes from: (1 - weight) first + weight second.
struct UpsampledTap {
  int first, second;
  float weight;
};

/// How one axis grows from `from` to `to` samples and makes room for a convolution that takes one
/// off either end. Doubled by linear interpolation that keeps the first and the last sample in
/// place (or, if `to` is `from`, left as it is), then extended to `to` + 2 samples by reflection
/// that does not repeat the edge: by 1 in front, by the rest behind.
/// \return to + 2 taps
/// \pre from >= 2, and `to` is from, 2 from or 2 from + 1
/// Source: Paliwal et al. 2024, "CoherentGS", published implementation.
std::vector<UpsampledTap> upsampled_axis(int from, int to);

struct Upsampling {
  std::vector<UpsampledTap> x, y;  ///< As upsampled_axis() gives them.
};

/// Rows [first, first + count) of a convolution's output; their input is two rows higher.
struct RowSpan {
  int first = 0;
  int count = 0;
};

/// What a 3x3 convolution needs for some rows of its output. Repeats nothing beyond `in`.
///
/// \param out  in.groups() x (rows.count + 2) x how.x.size() x lanes, overwritten
void upsample(const FeatureMap& in, const Upsampling& how, RowSpan rows, float* out);

/// Rows of a [group][row][x][lane] block.
struct RowBlock {
  RowSpan rows;
  FloatBuffer data;
};

/// The transpose of upsample(): the derivative with respect to those rows of `shape` that the range
/// depends on.
///
/// \param gradient  as `out` of upsample()
/// \param shape     only its sizes matter
/// \param out       overwritten; its buffer is used again
void upsample_transposed(const float* gradient,
                         const Upsampling& how,
                         RowSpan rows,
                         const FeatureMap& shape,
                         RowBlock& out);

}  // namespace cgs
