// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/matching_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <tbb/parallel_for.h>

#include "libcgs/core/lanes.h"

namespace cgs {

namespace {

constexpr int kMargin = 3;  // census radius, the larger window
constexpr int kZnccRadius = 2;
constexpr int kBandRows = 32;
constexpr float kCensusWeight = 0.6f;
constexpr float kNoiseVariance = 4.0f;  // [gray levels squared]
constexpr int kLevels = 64;             // of the census, in a gray level
constexpr int16_t kCensusNoise = 112;   // [levels of the census] a level and three quarters, …
constexpr float kEvenVariance = 9.0f;   // … in windows that vary by less [gray levels squared]
// Burnt out or drawn, and no noise: rounding breaks ties between planes there, in each view
// otherwise, so that views do not agree on any.
constexpr float kNoVariance = 0.01f;
constexpr float kUnseen = 1e9f;
constexpr float kNeutral = 0.5f;  // cost of a plane that no source sees

// Rows [first - kMargin, last + kMargin) of an image, columns [-kMargin, width + kMargin), borders
// repeated; as floats and, for the census, as integers. Whole lanes may be read and written from
// any pixel on.
struct Band {
  static constexpr size_t kRoom = 16;
  int stride = 0;
  size_t rows = 0;  // with margins
  std::vector<float> gray;
  std::vector<int16_t> level;

  Band(int width, int inner_rows)
      : stride(width + 2 * kMargin),
        rows(static_cast<size_t>(inner_rows) + 2 * kMargin),
        gray(static_cast<size_t>(stride) * rows + kRoom),
        level(gray.size()) {}
  const float* gray_row(int row) const {
    return &gray[static_cast<size_t>(row + kMargin) * static_cast<size_t>(stride) + kMargin];
  }
  float* gray_row(int row) {
    return &gray[static_cast<size_t>(row + kMargin) * static_cast<size_t>(stride) + kMargin];
  }
  const int16_t* level_row(int row) const {
    return &level[static_cast<size_t>(row + kMargin) * static_cast<size_t>(stride) + kMargin];
  }
  void finish_rows(int width) {
    for (size_t row = 0; row < rows; ++row) {
      const size_t start = row * static_cast<size_t>(stride) + kMargin;
      for (int k = 1; k <= kMargin; ++k) {
        gray[start - k] = gray[start];
        gray[start + width - 1 + k] = gray[start + width - 1];
      }
    }
    for (size_t i = 0; i < gray.size(); ++i) level[i] = static_cast<int16_t>(gray[i] * kLevels);
  }
};

/// Planes t along a row: t = first + x * step at pixel x.
struct PlanesOfRow {
  float first;
  float step;
  float last;  // the nearest plane that counts
};

// One row of the source as the reference would see it on plane t. `seen_at` tells which pixel of
// the source that is, or -1 where the plane does not count or the source does not reach.
// \pre out and seen_at have room for whole lanes
void warp_row(const SweepImage& image,
              const Eigen::Vector3f& first,
              const Eigen::Vector3f& step,
              const PlanesOfRow& planes,
              int width,
              float* out,
              int32_t* seen_at) {
  const Floats width_of = Floats{} + static_cast<float>(image.gray.width);
  const Floats height_of = Floats{} + static_cast<float>(image.gray.height);
  const Floats max_u = width_of - 1.001f;
  const Floats max_v = height_of - 1.001f;
  const float* gray = image.gray.data.data();
  const int stride = image.gray.width;
  constexpr Floats kCount = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int x = 0; x < width; x += kLanes) {
    const Floats fx = static_cast<float>(x) + kCount;
    const Floats z = first.z() + fx * step.z();
    const Floats t = planes.first + fx * planes.step;
    const Floats in_front = max(z, Floats{} + 1e-6f);
    const Floats at_u = (first.x() + fx * step.x()) / in_front;
    const Floats at_v = (first.y() + fx * step.y()) / in_front;
    const Floats u = min(max(at_u - 0.5f, Floats{}), max_u);
    const Floats v = min(max(at_v - 0.5f, Floats{}), max_v);
    const Ints iu = __builtin_convertvector(u, Ints);
    const Ints iv = __builtin_convertvector(v, Ints);
    const Floats a = u - __builtin_convertvector(iu, Floats);
    const Floats b = v - __builtin_convertvector(iv, Floats);
    const Ints corner = iv * stride + iu;
    const Floats top_left = gathered(gray, corner);
    const Floats top = top_left + a * (gathered(gray + 1, corner) - top_left);
    const Floats bottom_left = gathered(gray + stride, corner);
    const Floats bottom = bottom_left + a * (gathered(gray + stride + 1, corner) - bottom_left);
    store(top + b * (bottom - top), out + x);
    const Ints inside = (z > 0.0f) & (t >= 0.0f) & (t <= planes.last) & (at_u >= 0.0f) &
                        (at_v >= 0.0f) & (at_u < width_of) & (at_v < height_of);
    const Ints row = __builtin_convertvector(min(max(at_v, Floats{}), height_of), Ints);
    const Ints column = __builtin_convertvector(min(max(at_u, Floats{}), width_of), Ints);
    const Ints pixel = row * stride + column;
    store((pixel & inside) | ~inside, seen_at + x);
  }
}

/// The census of a row: which of the 48 neighbours of a pixel are brighter than it, 16 in a word.
/// What is `noise` there is not brighter. (By noise alone half of them would be on an even wall,
/// others in every photograph.)
class CensusRow {
 public:
  static constexpr int kWords = 3;

  /// \param noise  per pixel [levels of the census], with room for whole lanes
  void take(const Band& band, int row, int width, const std::vector<int16_t>& noise) {
    words_.resize(static_cast<size_t>(kWords) * static_cast<size_t>(width));
    take_word<0>(band, row, width, noise.data());
    take_word<1>(band, row, width, noise.data());
    take_word<2>(band, row, width, noise.data());
  }

  // The share of bits that differ.
  void compare(const CensusRow& other, int width, float* out) const {
    constexpr int kBits = 16 * kWords;
    const auto w = static_cast<size_t>(width);
    const uint16_t* a = words_.data();
    const uint16_t* b = other.words_.data();
    for (size_t x = 0; x < w; ++x) {
      const int differ = fours_of(a[x] ^ b[x]) + fours_of(a[w + x] ^ b[w + x]) +
                         fours_of(a[2 * w + x] ^ b[2 * w + x]);
      const int eights = (differ & 0x0f0f) + (differ >> 4 & 0x0f0f);
      out[x] = kCensusWeight * static_cast<float>((eights & 0xff) + (eights >> 8)) / kBits;
    }
  }

 private:
  // The number of bits that are set in each group of four.
  static int fours_of(int bits) {
    const int twos = bits - (bits >> 1 & 0x5555);
    return (twos & 0x3333) + (twos >> 2 & 0x3333);
  }

  // Neighbours from 16 * kWord on, row by row and without the pixel itself. The loop over them is
  // unrolled, that over pixels uses all lanes there are.
  template <int kWord>
  void take_word(const Band& band, int row, int width, const int16_t* noise) {
    constexpr int kSide = 2 * kMargin + 1;
    std::array<const int16_t*, 16> neighbor{};
    for (int k = 0; k < 16; ++k) {
      int at = 16 * kWord + k;
      if (at >= kSide * kMargin + kMargin) ++at;
      neighbor.at(static_cast<size_t>(k)) =
          band.level_row(row + at / kSide - kMargin) + at % kSide - kMargin;
    }
    const int16_t* center = band.level_row(row);
    uint16_t* out = words_.data() + static_cast<size_t>(kWord) * static_cast<size_t>(width);
    for (int x = 0; x < width; x += kShortLanes) {
      x = std::min(x, std::max(width - kShortLanes, 0));  // the last ones overlap those before
      const auto middle = load<Shorts>(center + x) + load<Shorts>(noise + x);
      Shorts word{};
      for (const int16_t* from : neighbor) word += word - (load<Shorts>(from + x) > middle);
      store_first(word, width, out + x);
    }
  }

  static constexpr int kShortLanes = 16;
  using Shorts = int16_t __attribute__((vector_size(sizeof(int16_t) * kShortLanes)));

  // Rows may be shorter than the lanes.
  static void store_first(const Shorts& word, int width, uint16_t* to) {
    std::memcpy(to, &word, sizeof(uint16_t) * static_cast<size_t>(std::min(width, kShortLanes)));
  }

  std::vector<uint16_t> words_;
};

/// Sums of a row of box windows, in columns from -kMargin on.
struct BoxSums {
  std::vector<float> of_columns;

  void clear(int width) { of_columns.assign(static_cast<size_t>(width) + 2 * kMargin, 0.0f); }
  float at(int x) const {
    static_assert(kZnccRadius == 2);
    const float* s = &of_columns[static_cast<size_t>(x) + kMargin];
    return s[-2] + s[-1] + s[0] + s[1] + s[2];
  }
};

constexpr float kZnccArea = (2 * kZnccRadius + 1) * (2 * kZnccRadius + 1);
constexpr float kMiddleGray = 128;  // smaller sums of squares round less

/// Of the reference, for all planes: mean and variance of the window of each pixel of a row, and
/// what is noise in it.
struct WindowMoments {
  std::vector<float> mean, variance;
  std::vector<int16_t> noise;  // as CensusRow takes it

  void take(const Band& band, int row, int width) {
    BoxSums a;
    BoxSums aa;
    for (BoxSums* sums : {&a, &aa}) sums->clear(width);
    for (int dy = -kZnccRadius; dy <= kZnccRadius; ++dy) {
      const float* from = band.gray_row(row + dy) - kMargin;
      for (size_t x = 0; x < a.of_columns.size(); ++x) {
        const float value = from[x] - kMiddleGray;
        a.of_columns[x] += value;
        aa.of_columns[x] += value * value;
      }
    }
    mean.resize(static_cast<size_t>(width));
    variance.resize(static_cast<size_t>(width));
    noise.assign(static_cast<size_t>(width) + Band::kRoom, 0);
    for (int x = 0; x < width; ++x) {
      const float m = a.at(x) / kZnccArea;
      mean[static_cast<size_t>(x)] = m;
      const float spread = std::max(aa.at(x) / kZnccArea - m * m, 0.0f);
      variance[static_cast<size_t>(x)] = spread + kNoiseVariance;
      const bool is_even = spread > kNoVariance && spread < kEvenVariance;
      if (is_even) noise[static_cast<size_t>(x)] = kCensusNoise;
    }
  }
};

// Adds (1 - ZNCC) / 2 over a box window.
struct ZnccRow {
  BoxSums b, bb, ab;

  void add(
      const WindowMoments& of_a, const Band& A, const Band& B, int row, int width, float* out) {
    for (BoxSums* sums : {&b, &bb, &ab}) sums->clear(width);
    const size_t n = b.of_columns.size();
    for (int dy = -kZnccRadius; dy <= kZnccRadius; ++dy) {
      const float* ra = A.gray_row(row + dy) - kMargin;
      const float* rb = B.gray_row(row + dy) - kMargin;
      float* sum = b.of_columns.data();
      float* sum_of_squares = bb.of_columns.data();
      float* sum_of_products = ab.of_columns.data();
      for (size_t x = 0; x < n; ++x) {
        const float va = ra[x] - kMiddleGray;
        const float vb = rb[x] - kMiddleGray;
        sum[x] += vb;
        sum_of_squares[x] += vb * vb;
        sum_of_products[x] += va * vb;
      }
    }
    const float* ma = of_a.mean.data();
    const float* va = of_a.variance.data();
    for (int x = 0; x < width; ++x) {
      const float mb = b.at(x) / kZnccArea;
      const float vb = std::max(bb.at(x) / kZnccArea - mb * mb, 0.0f) + kNoiseVariance;
      const float zncc = (ab.at(x) / kZnccArea - ma[x] * mb) / std::sqrt(va[x] * vb);
      out[x] += (1 - kCensusWeight) * 0.5f * (1 - zncc);
    }
  }
};

uint8_t quantised(float cost) {
  const float scaled = kLargestCost * std::clamp(cost, 0.0f, 1.0f);
  const int whole = static_cast<int>(scaled);
  return static_cast<uint8_t>(whole + (scaled - static_cast<float>(whole) >= 0.5f ? 1 : 0));
}

// Combined cost of one pixel on one plane, over the sources that see it.
float combine(std::span<float> costs) {
  std::sort(costs.begin(), costs.end());
  size_t seen = 0;
  while (seen < costs.size() && costs[seen] < kUnseen) ++seen;
  return seen == 0 ? kNeutral : combined_cost<float>(costs.first(seen));
}

// In each lane the lesser of two values first. (Costs are never NaN.)
void order(Floats& a, Floats& b) {
  const Floats least = min(a, b);
  b = max(a, b);
  a = least;
}

// Sorts the costs of each lane: a network of exchanges for two to four.
template <size_t kSources>
void sort_lanes(std::array<Floats, kSources>& costs) {
  static_assert(kSources >= 2 && kSources <= 4);
  if constexpr (kSources == 2) {
    order(costs[0], costs[1]);
  } else if constexpr (kSources == 3) {
    order(costs[0], costs[1]);
    order(costs[1], costs[2]);
    order(costs[0], costs[1]);
  } else {
    order(costs[0], costs[1]);
    order(costs[2], costs[3]);
    order(costs[0], costs[2]);
    order(costs[1], costs[3]);
    order(costs[1], costs[2]);
  }
}

// As combine(), of eight pixels at once.
template <size_t kSources>
Floats combined_lanes(std::array<Floats, kSources> costs) {
  sort_lanes(costs);
  Floats out = Floats{} + kNeutral;
  for (size_t seen = 1; seen <= kSources; ++seen) {  // as many as are seen, or more
    out =
        select(costs[seen - 1] < kUnseen, combined_cost<Floats>(std::span(costs).first(seen)), out);
  }
  return out;
}

// \param costs  as BandCost::plane() gives them
template <size_t kSources>
void combine_few(const float* costs, size_t pixels, uint8_t* out) {
  size_t p = 0;
  for (; p + kLanes <= pixels; p += kLanes) {
    std::array<Floats, kSources> of_sources;
    for (size_t s = 0; s < kSources; ++s) of_sources[s] = load<Floats>(costs + s * pixels + p);
    const Floats combined = combined_lanes(of_sources);
    for (size_t lane = 0; lane < kLanes; ++lane) out[p + lane] = quantised(combined[lane]);
  }
  for (; p < pixels; ++p) {
    std::array<float, kSources> of_sources;
    for (size_t s = 0; s < kSources; ++s) of_sources[s] = costs[s * pixels + p];
    out[p] = quantised(combine(of_sources));
  }
}

void combine_all(const std::vector<float>& costs, size_t sources, size_t pixels, uint8_t* out) {
  if (sources == 2) return combine_few<2>(costs.data(), pixels, out);
  if (sources == 3) return combine_few<3>(costs.data(), pixels, out);
  if (sources == 4) return combine_few<4>(costs.data(), pixels, out);
  std::vector<float> of_pixel(sources);
  for (size_t p = 0; p < pixels; ++p) {
    for (size_t s = 0; s < sources; ++s) of_pixel[s] = costs[s * pixels + p];
    out[p] = quantised(combine(of_pixel));
  }
}

class BandCost {
 public:
  BandCost(const std::vector<SweepImage>& images,
           const SweepGeometry& geometry,
           int first,
           int last)
      : images_(images),
        geometry_(geometry),
        reference_(images[static_cast<size_t>(geometry.image)]),
        first_(first),
        rows_(last - first),
        width_(reference_.gray.width),
        fixed_(width_, rows_),
        warped_(width_, rows_),
        seen_at_(static_cast<size_t>(rows_ + 1) * static_cast<size_t>(width_) + kLanes) {
    for (int r = -kMargin; r < rows_ + kMargin; ++r) {
      const float* from = &reference_.gray.data[reference_.gray.index(0, clamped(r))];
      std::copy(from, from + width_, fixed_.gray_row(r));
    }
    fixed_.finish_rows(width_);
    for (int r = 0; r < rows_; ++r) {
      fixed_moments_.emplace_back().take(fixed_, r, width_);
      fixed_census_.emplace_back().take(fixed_, r, width_, fixed_moments_.back().noise);
    }
  }

  // Costs of all sources on a plane, source-major, then row-major over the band.
  void plane(const Eigen::RowVector3d& t, std::vector<float>& costs) {
    const size_t band = static_cast<size_t>(rows_) * static_cast<size_t>(width_);
    costs.resize(band * geometry_.sources.size());
    if (!is_in_range(t)) {
      std::fill(costs.begin(), costs.end(), kUnseen);
      return;
    }
    for (size_t s = 0; s < geometry_.sources.size(); ++s) {
      const SweepSource& source = geometry_.sources[s];
      const SweepImage& image = images_[static_cast<size_t>(source.image)];
      const Eigen::Vector3f step = (source.A.col(0) + t.x() * source.b).cast<float>();
      const auto t_at = [&](int r) { return t.dot(Eigen::RowVector3d(0.5, clamped(r) + 0.5, 1)); };
      const auto start = [&](int r) -> Eigen::Vector3f {
        return source.project(0.5, clamped(r) + 0.5, t_at(r)).cast<float>();
      };
      for (int r = -kMargin; r < rows_ + kMargin; ++r) {
        const PlanesOfRow planes{
            float(t_at(r)), float(t.x()), static_cast<float>(geometry_.planes - 1)};
        const int place = r >= 0 && r < rows_ ? r : rows_;  // of margins nobody asks
        warp_row(image, start(r), step, planes, width_, warped_.gray_row(r), seen_row(place));
      }
      warped_.finish_rows(width_);
      for (int r = 0; r < rows_; ++r) {
        const auto row = static_cast<size_t>(r);
        float* out = &costs[s * band + row * static_cast<size_t>(width_)];
        warped_census_.take(warped_, r, width_, fixed_moments_[row].noise);
        warped_census_.compare(fixed_census_[row], width_, out);
        zncc_.add(fixed_moments_[row], fixed_, warped_, r, width_, out);
        const int32_t* seen = seen_row(r);
        for (int x = 0; x < width_; ++x) {
          if (seen[x] < 0 || image.valid.data[static_cast<size_t>(seen[x])] == 0) out[x] = kUnseen;
        }
      }
    }
  }

 private:
  // Whether a plane may lie in the range that is swept anywhere in the band.
  bool is_in_range(const Eigen::RowVector3d& t) const {
    const auto [least, most] = range_over(t, {0, first_}, {width_, first_ + rows_});
    return most >= 0 && least <= geometry_.planes - 1;
  }

  int32_t* seen_row(int r) {
    return &seen_at_[static_cast<size_t>(r) * static_cast<size_t>(width_)];
  }
  int clamped(int r) const { return std::clamp(first_ + r, 0, reference_.gray.height - 1); }

  const std::vector<SweepImage>& images_;
  const SweepGeometry& geometry_;
  const SweepImage& reference_;
  int first_;
  int rows_;
  int width_;
  Band fixed_;
  Band warped_;
  std::vector<int32_t> seen_at_;         // as warp_row() tells it, per row
  std::vector<CensusRow> fixed_census_;  // per row
  std::vector<WindowMoments> fixed_moments_;
  CensusRow warped_census_;
  ZnccRow zncc_;
};

}  // namespace

CostVolume matching_cost(const std::vector<SweepImage>& images,
                         const SweepGeometry& geometry,
                         const PlaneFamily& family,
                         const Progress& progress) {
  const Raster<float>& gray = images[static_cast<size_t>(geometry.image)].gray;
  CostVolume volume{gray.width, gray.height, family.count, {}};
  const auto planes = static_cast<size_t>(family.count);
  volume.cost.resize(gray.data.size() * planes);
  const int bands = (gray.height + kBandRows - 1) / kBandRows;
  SharedProgress shared(progress, static_cast<size_t>(bands) * planes);
  tbb::parallel_for(0, bands, [&](int band) {
    const int first = band * kBandRows;
    const int last = std::min(gray.height, first + kBandRows);
    BandCost cost(images, geometry, first, last);
    std::vector<float> costs;
    const size_t pixels = static_cast<size_t>(last - first) * static_cast<size_t>(gray.width);
    uint8_t* out = &volume.cost[static_cast<size_t>(first) * gray.width * planes];
    constexpr size_t kAtOnce =
        16;  // planes: those of a pixel lie together, those of a sweep do not
    std::vector<uint8_t> of_planes(kAtOnce * pixels);
    for (size_t t = 0; t < planes; t += kAtOnce) {
      const size_t count = std::min(kAtOnce, planes - t);
      for (size_t k = 0; k < count; ++k) {
        cost.plane(family.plane(double(t + k)), costs);
        combine_all(costs, geometry.sources.size(), pixels, &of_planes[k * pixels]);
        shared.advance();
      }
      for (size_t p = 0; p < pixels; ++p) {
        for (size_t k = 0; k < count; ++k) out[p * planes + t + k] = of_planes[k * pixels + p];
      }
    }
  });
  return volume;
}

CostVolume matching_cost(const std::vector<SweepImage>& images,
                         const SweepGeometry& geometry,
                         const Progress& progress) {
  PlaneFamily family;
  family.count = geometry.planes;
  return matching_cost(images, geometry, family, progress);
}

}  // namespace cgs
