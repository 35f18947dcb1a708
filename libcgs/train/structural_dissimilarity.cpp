// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "libcgs/train/loss_rows.h"
#include "libcgs/train/losses.h"

namespace cgs {

namespace {

// With a, b the images and d = a - b, and E the windowed mean, SSIM is written without the
// differences of nearly equal numbers that its usual form takes where a and b agree. Its luminance
// and its structure term (with contrast) become
//   1 - (2 E[a]E[b] + C1) / (E[a]^2 + E[b]^2 + C1) = E[d]^2 / (E[a]^2 + E[b]^2 + C1) = A,
//   1 - (2 cov(a, b) + C2) / (var a + var b + C2)  = var d  / (var a + var b + C2)   = B,
//   1 - SSIM = 1 - (1 - A)(1 - B) = A + B - AB.
// Rounding of float then costs a part of what is left of the loss, not of 1.

constexpr float kC1 = 0.01f * 0.01f;
constexpr float kC2 = 0.03f * 0.03f;
constexpr int kReach = 5;

using HalfWindow = std::array<float, kReach + 1>;  // symmetric: the centre, then one side

HalfWindow half_window() {
  constexpr double kSigma = 1.5;
  std::array<double, kReach + 1> half{};
  double sum = 0;
  for (int k = 0; k <= kReach; ++k) {
    half[k] = std::exp(-k * k / (2 * kSigma * kSigma));
    sum += k == 0 ? half[k] : 2 * half[k];
  }
  HalfWindow out{};
  for (int k = 0; k <= kReach; ++k) out[k] = static_cast<float>(half[k] / sum);
  return out;
}

// A row with kReach zeros on both sides.
class PaddedRow {
 public:
  explicit PaddedRow(int width) : data_(width + size_t(2) * kReach, 0) {}
  float* data() { return data_.data() + kReach; }

 private:
  std::vector<float> data_;
};

void blur_row(const HalfWindow& w, const float* from, int width, float* __restrict to) {
  for (int x = 0; x < width; ++x) {
    const float* at = from + x;
    to[x] = w[0] * at[0] + w[1] * (at[-1] + at[1]) + w[2] * (at[-2] + at[2]) +
            w[3] * (at[-3] + at[3]) + w[4] * (at[-4] + at[4]) + w[5] * (at[-5] + at[5]);
  }
}

// A raster with kReach rows of zeros above and below.
class PaddedPlane {
 public:
  PaddedPlane(int width, int height)
      : width_(width), data_(static_cast<size_t>(width) * (height + 2 * kReach), 0) {}
  float* row(int y) { return data_.data() + static_cast<size_t>(y + kReach) * width_; }

  void blur_column(const HalfWindow& w, int y, float* __restrict to) {
    const float* at = row(y);
    const std::ptrdiff_t n = width_;
    for (int x = 0; x < width_; ++x, ++at) {
      to[x] = w[0] * at[0] + w[1] * (at[-n] + at[n]) + w[2] * (at[-2 * n] + at[2 * n]) +
              w[3] * (at[-3 * n] + at[3 * n]) + w[4] * (at[-4 * n] + at[4 * n]) +
              w[5] * (at[-5 * n] + at[5 * n]);
    }
  }

 private:
  int width_;
  std::vector<float> data_;
};

// The windowed means of one pixel and what they make of it.
struct Term {
  float loss;  // 1 - SSIM
  // Derivatives of the loss: with respect to E[d] with E[a] = E[d] + E[b] following it, to E[d^2],
  // and to E[a^2] alone, which is E[a^2 + b^2] with b fixed.
  float by_d, by_dd, by_aa;
};

inline Term term(float d, float b, float dd, float squares) {
  const float a = b + d;
  const float means = a * a + b * b;
  // Negative only by rounding: a window of weights that sum to at most 1 has no negative variance.
  const float variance_d = std::max(dd - d * d, 0.0f);
  const float one = 1 / (means + kC1);
  const float two = 1 / (std::max(squares - means, 0.0f) + kC2);
  const float A = d * d * one;
  const float B = variance_d * two;
  const float by_luminance = 1 - B;
  const float by_structure = 1 - A;
  return {A + B - A * B,
          2 * (by_luminance * one * (d - A * a) + by_structure * two * (B * a - d)),
          by_structure * two,
          -by_structure * B * two};
}

class Channel {
 public:
  Channel(const Raster<float>& rendered, const Raster<float>& photograph, const MaskMap* use)
      : rendered_(rendered),
        photograph_(photograph),
        use_(use),
        means_(4, PaddedPlane(rendered.width, rendered.height)),
        derivatives_(3, PaddedPlane(rendered.width, rendered.height)) {}

  // Sum over pixels of 1 - SSIM; adds `scale` times its derivative to `gradient`.
  double add(float scale, Raster<float>& gradient) {
    for_rows(rendered_.height, [&](int y) { average_along_row(y); });
    const double sum = sum_over_rows(rendered_.height, [&](int y) { return compare_row(y); });
    for_rows(rendered_.height, [&](int y) { add_gradient(y, scale, gradient); });
    return sum;
  }

 private:
  bool counts(size_t pixel) const { return use_ == nullptr || use_->data[pixel] != 0; }

  void average_along_row(int y) {
    const int width = rendered_.width;
    std::vector<PaddedRow> rows(means_.size(), PaddedRow(width));
    const size_t begin = rendered_.index(0, y);
    const float* a = &rendered_.data[begin];
    const float* b = &photograph_.data[begin];
    float* d = rows[0].data();
    for (int x = 0; x < width; ++x) d[x] = counts(begin + x) ? a[x] - b[x] : 0;
    std::copy_n(b, width, rows[1].data());
    float* dd = rows[2].data();
    for (int x = 0; x < width; ++x) dd[x] = d[x] * d[x];
    float* squares = rows[3].data();
    for (int x = 0; x < width; ++x) squares[x] = (b[x] + d[x]) * (b[x] + d[x]) + b[x] * b[x];
    for (size_t k = 0; k < rows.size(); ++k) {
      blur_row(window_, rows[k].data(), width, means_[k].row(y));
    }
  }

  double compare_row(int y) {
    const int width = rendered_.width;
    std::vector<PaddedRow> rows(means_.size(), PaddedRow(width));
    for (size_t k = 0; k < rows.size(); ++k) means_[k].blur_column(window_, y, rows[k].data());
    // In place: the means of a pixel give way to its derivatives and its loss.
    float* d = rows[0].data();
    float* b = rows[1].data();
    float* dd = rows[2].data();
    float* squares = rows[3].data();
    for (int x = 0; x < width; ++x) {
      const Term here = term(d[x], b[x], dd[x], squares[x]);
      d[x] = here.by_d;
      b[x] = here.by_aa;
      dd[x] = here.by_dd;
      squares[x] = here.loss;
    }
    blur_row(window_, d, width, derivatives_[0].row(y));
    blur_row(window_, dd, width, derivatives_[1].row(y));
    blur_row(window_, b, width, derivatives_[2].row(y));
    return std::accumulate(squares, squares + width, 0.0);
  }

  // The window is symmetric, so its transpose is the same blur.
  void add_gradient(int y, float scale, Raster<float>& gradient) {
    const int width = rendered_.width;
    std::vector<PaddedRow> rows(derivatives_.size(), PaddedRow(width));
    for (size_t k = 0; k < rows.size(); ++k) {
      derivatives_[k].blur_column(window_, y, rows[k].data());
    }
    const size_t begin = rendered_.index(0, y);
    const float* a = &rendered_.data[begin];
    const float* b = &photograph_.data[begin];
    float* by_d = rows[0].data();
    const float* by_dd = rows[1].data();
    const float* by_aa = rows[2].data();
    for (int x = 0; x < width; ++x) {
      by_d[x] += 2 * ((a[x] - b[x]) * by_dd[x] + a[x] * by_aa[x]);
    }
    float* to = &gradient.data[begin];
    for (int x = 0; x < width; ++x) to[x] += counts(begin + x) ? scale * by_d[x] : 0;
  }

  const Raster<float>& rendered_;
  const Raster<float>& photograph_;
  const MaskMap* use_;
  HalfWindow window_ = half_window();
  std::vector<PaddedPlane> means_;        // along rows only: of d, b, d^2, a^2 + b^2
  std::vector<PaddedPlane> derivatives_;  // along rows only: by_d, by_dd, by_aa
};

}  // namespace

double structural_dissimilarity(const ColorPlanes& rendered,
                                const ColorPlanes& photograph,
                                const MaskMap* use,
                                double weight,
                                ColorPlanes& gradient) {
  check_sizes(rendered, photograph, use);
  if (weight == 0) return 0;
  const double scale = weight / (3 * static_cast<double>(rendered[0].data.size()));
  double sum = 0;
  for (size_t c = 0; c < 3; ++c) {
    Raster<float>& to = gradient_like(rendered[c], gradient[c]);
    sum += Channel(rendered[c], photograph[c], use).add(static_cast<float>(scale), to);
  }
  return scale * sum;
}

}  // namespace cgs
