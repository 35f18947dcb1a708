// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/matching_cost.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

constexpr int kMargin = 3;  // census radius, the larger window
constexpr int kZnccRadius = 2;
constexpr int kBandRows = 16;
constexpr float kCensusWeight = 0.6f;
constexpr float kNoiseVariance = 4.0f;  // [gray levels squared]
constexpr float kUnseen = 1e9f;
constexpr float kNeutral = 0.5f;  // cost of a plane that no source sees

// Rows [first - kMargin, last + kMargin) of an image, columns [-kMargin, width + kMargin), borders
// repeated; as floats and, for the census, as integers.
struct Band {
  int stride = 0;
  std::vector<float> gray;
  std::vector<int16_t> level;

  Band(int width, int rows)
      : stride(width + 2 * kMargin),
        gray(static_cast<size_t>(stride) * static_cast<size_t>(rows + 2 * kMargin)),
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
    for (size_t start = kMargin; start < gray.size(); start += static_cast<size_t>(stride)) {
      for (int k = 1; k <= kMargin; ++k) {
        gray[start - k] = gray[start];
        gray[start + width - 1 + k] = gray[start + width - 1];
      }
    }
    for (size_t i = 0; i < gray.size(); ++i) level[i] = static_cast<int16_t>(gray[i] * 64);
  }
};

// One row of the source as the reference would see it on plane t.
void warp_row(const SweepImage& image,
              const Eigen::Vector3f& first,
              const Eigen::Vector3f& step,
              int width,
              float* out) {
  const float max_u = static_cast<float>(image.gray.width) - 1.001f;
  const float max_v = static_cast<float>(image.gray.height) - 1.001f;
  const float* gray = image.gray.data.data();
  const int stride = image.gray.width;
  for (int x = 0; x < width; ++x) {
    const float fx = static_cast<float>(x);
    const float z = std::max(first.z() + fx * step.z(), 1e-6f);
    const float u = std::clamp((first.x() + fx * step.x()) / z - 0.5f, 0.0f, max_u);
    const float v = std::clamp((first.y() + fx * step.y()) / z - 0.5f, 0.0f, max_v);
    const int iu = static_cast<int>(u);
    const int iv = static_cast<int>(v);
    const float a = u - static_cast<float>(iu);
    const float b = v - static_cast<float>(iv);
    const float* p = gray + static_cast<std::ptrdiff_t>(iv) * stride + iu;
    const float top = p[0] + a * (p[1] - p[0]);
    const float bottom = p[stride] + a * (p[stride + 1] - p[stride]);
    out[x] = top + b * (bottom - top);
  }
}

/// Planes t along a row: t = first + x * step at pixel x.
struct PlanesOfRow {
  float first;
  float step;
  float last;  // the nearest plane that counts
};

void seen_row(const SweepImage& image,
              const Eigen::Vector3f& first,
              const Eigen::Vector3f& step,
              const PlanesOfRow& planes,
              int width,
              uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    const Eigen::Vector3f h = first + static_cast<float>(x) * step;
    const float t = planes.first + static_cast<float>(x) * planes.step;
    const float u = h.x() / h.z();
    const float v = h.y() / h.z();
    const bool inside = h.z() > 0 && t >= 0 && t <= planes.last && u >= 0 && v >= 0 &&
                        u < static_cast<float>(image.gray.width) &&
                        v < static_cast<float>(image.gray.height);
    out[x] = inside && image.valid(static_cast<int>(u), static_cast<int>(v)) != 0;
  }
}

// Adds the share of census bits that differ.
void census_row(const Band& a, const Band& b, int row, int width, float* out) {
  std::vector<int16_t> count(static_cast<size_t>(width), 0);
  const int16_t* center_a = a.level_row(row);
  const int16_t* center_b = b.level_row(row);
  int16_t* n = count.data();
  for (int dy = -kMargin; dy <= kMargin; ++dy) {
    for (int dx = -kMargin; dx <= kMargin; ++dx) {
      if (dx == 0 && dy == 0) continue;
      const int16_t* ra = a.level_row(row + dy) + dx;
      const int16_t* rb = b.level_row(row + dy) + dx;
      for (int x = 0; x < width; ++x) {
        n[x] = static_cast<int16_t>(n[x] + ((ra[x] > center_a[x]) != (rb[x] > center_b[x])));
      }
    }
  }
  constexpr int kBits = (2 * kMargin + 1) * (2 * kMargin + 1) - 1;
  for (int x = 0; x < width; ++x) out[x] = kCensusWeight * static_cast<float>(n[x]) / kBits;
}

// Adds (1 - ZNCC) / 2 over a box window.
struct ZnccRow {
  std::vector<float> a, b, aa, bb, ab;  // column sums, from -kMargin

  void add(const Band& A, const Band& B, int row, int width, float* out) {
    const size_t n = static_cast<size_t>(width) + kMargin + kMargin;
    for (auto* sums : {&a, &b, &aa, &bb, &ab}) sums->assign(n, 0.0f);
    for (int dy = -kZnccRadius; dy <= kZnccRadius; ++dy) {
      const float* ra = A.gray_row(row + dy) - kMargin;
      const float* rb = B.gray_row(row + dy) - kMargin;
      for (size_t x = 0; x < n; ++x) {
        const float va = ra[x] - 128;  // smaller sums of squares round less
        const float vb = rb[x] - 128;
        a[x] += va;
        b[x] += vb;
        aa[x] += va * va;
        bb[x] += vb * vb;
        ab[x] += va * vb;
      }
    }
    const auto box = [](const std::vector<float>& sums, int x) {
      const float* s = &sums[static_cast<size_t>(x) + kMargin];
      return s[-2] + s[-1] + s[0] + s[1] + s[2];
    };
    static_assert(kZnccRadius == 2);
    constexpr float kArea = 25;
    for (int x = 0; x < width; ++x) {
      const float ma = box(a, x) / kArea;
      const float mb = box(b, x) / kArea;
      const float va = std::max(box(aa, x) / kArea - ma * ma, 0.0f) + kNoiseVariance;
      const float vb = std::max(box(bb, x) / kArea - mb * mb, 0.0f) + kNoiseVariance;
      const float zncc = (box(ab, x) / kArea - ma * mb) / std::sqrt(va * vb);
      out[x] += (1 - kCensusWeight) * 0.5f * (1 - zncc);
    }
  }
};

// Combined cost of one pixel on one plane, over the sources that see it.
float combine(float* costs, size_t count) {
  std::sort(costs, costs + count);
  size_t seen = 0;
  while (seen < count && costs[seen] < kUnseen) ++seen;
  if (seen == 0) return kNeutral;
  return combined_cost({costs, seen});
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
        seen_(static_cast<size_t>(width_)) {
    for (int r = -kMargin; r < rows_ + kMargin; ++r) {
      const float* from = &reference_.gray.data[reference_.gray.index(0, clamped(r))];
      std::copy(from, from + width_, fixed_.gray_row(r));
    }
    fixed_.finish_rows(width_);
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
        warp_row(image, start(r), step, width_, warped_.gray_row(r));
      }
      warped_.finish_rows(width_);
      for (int r = 0; r < rows_; ++r) {
        float* out = &costs[s * band + static_cast<size_t>(r) * static_cast<size_t>(width_)];
        census_row(fixed_, warped_, r, width_, out);
        zncc_.add(fixed_, warped_, r, width_, out);
        const PlanesOfRow planes{
            float(t_at(r)), float(t.x()), static_cast<float>(geometry_.planes - 1)};
        seen_row(image, start(r), step, planes, width_, seen_.data());
        for (int x = 0; x < width_; ++x) {
          if (seen_[static_cast<size_t>(x)] == 0) out[x] = kUnseen;
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

  int clamped(int r) const { return std::clamp(first_ + r, 0, reference_.gray.height - 1); }

  const std::vector<SweepImage>& images_;
  const SweepGeometry& geometry_;
  const SweepImage& reference_;
  int first_;
  int rows_;
  int width_;
  Band fixed_;
  Band warped_;
  std::vector<uint8_t> seen_;
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
    std::vector<float> of_pixel(geometry.sources.size());
    const size_t pixels = static_cast<size_t>(last - first) * static_cast<size_t>(gray.width);
    uint8_t* out = &volume.cost[static_cast<size_t>(first) * gray.width * planes];
    for (int t = 0; t < family.count; ++t) {
      cost.plane(family.plane(t), costs);
      for (size_t p = 0; p < pixels; ++p) {
        for (size_t s = 0; s < of_pixel.size(); ++s) of_pixel[s] = costs[s * pixels + p];
        const float c = combine(of_pixel.data(), of_pixel.size());
        out[p * planes + static_cast<size_t>(t)] =
            static_cast<uint8_t>(std::lround(kLargestCost * std::clamp(c, 0.0f, 1.0f)));
      }
      shared.advance();
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
