// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/slanted_refinement.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cgs {

namespace {

constexpr int kRadius = 4;
constexpr int kSide = 2 * kRadius + 1;
constexpr int kSamples = (kSide * kSide + 7) / 8 * 8;  // padded with weight 0
constexpr float kLevelScale = 12;      // bilateral weight halves at this difference [gray levels]
constexpr float kDistanceScale = 4;    // … and at this distance [pixels]
constexpr float kNoiseVariance = 4;    // [gray levels squared]
constexpr float kSmoothness = 0.12f;   // cost of a full disagreement with the neighbours
constexpr float kTruncation = 2.0f;    // largest disagreement that counts [planes]
constexpr float kSecondWeight = 0.35f;
constexpr float kUnseenCost = 1.0f;    // as uncorrelated
constexpr float kMaxSlope = 2.0f;      // [planes per pixel]
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Offset {
  int dx, dy;
};
// All of the other colour of the chessboard.
constexpr std::array<Offset, 8> kNeighbours = {{
    {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-5, 0}, {5, 0}, {0, -5}, {0, 5}}};

using Samples = std::array<float, kSamples>;

struct OffsetTable {
  Samples dx{}, dy{};
  OffsetTable() {
    for (int i = 0; i < kSide * kSide; ++i) {
      dx[static_cast<size_t>(i)] = static_cast<float>(i % kSide - kRadius);
      dy[static_cast<size_t>(i)] = static_cast<float>(i / kSide - kRadius);
    }
  }
};
const OffsetTable kOffsets;

// The homography of a plane near one pixel: where it goes and its derivative.
struct LocalMap {
  float u, v;      // in array coordinates: pixel centres on integers
  float ux, uy, vx, vy;
  float ut, vt;    // derivative by t
  bool seen;
};

LocalMap local_map(const SweepImage& image, const SweepSource& s, Offset p, const SlantedPlane& q) {
  const Eigen::Vector3d h = s.project(p.dx + 0.5, p.dy + 0.5, static_cast<double>(q.t));
  const double u = h.x() / h.z();
  const double v = h.y() / h.z();
  LocalMap m{};
  m.seen = h.z() > 0 && u >= 0 && v >= 0 && u < image.gray.width && v < image.gray.height &&
           image.valid(static_cast<int>(u), static_cast<int>(v)) != 0;
  if (!m.seen) return m;
  const Eigen::Vector3d hx = s.A.col(0) + double(q.slope_x) * s.b;
  const Eigen::Vector3d hy = s.A.col(1) + double(q.slope_y) * s.b;
  const double inv = 1 / h.z();
  m.u = static_cast<float>(u - 0.5);
  m.v = static_cast<float>(v - 0.5);
  m.ux = static_cast<float>((hx.x() - u * hx.z()) * inv);
  m.uy = static_cast<float>((hy.x() - u * hy.z()) * inv);
  m.vx = static_cast<float>((hx.y() - v * hx.z()) * inv);
  m.vy = static_cast<float>((hy.y() - v * hy.z()) * inv);
  m.ut = static_cast<float>((s.b.x() - u * s.b.z()) * inv);
  m.vt = static_cast<float>((s.b.y() - v * s.b.z()) * inv);
  return m;
}

// Bilinear samples of the source around the image of a window; `inside` is 0 beyond the frame.
void sample(const Raster<float>& gray, const LocalMap& m, Samples& value, Samples& inside) {
  const float max_u = static_cast<float>(gray.width) - 1.001f;
  const float max_v = static_cast<float>(gray.height) - 1.001f;
  const float* data = gray.data.data();
  const int stride = gray.width;
  for (int i = 0; i < kSamples; ++i) {
    const float u = m.u + m.ux * kOffsets.dx[i] + m.uy * kOffsets.dy[i];
    const float v = m.v + m.vx * kOffsets.dx[i] + m.vy * kOffsets.dy[i];
    const float cu = std::min(std::max(u, 0.0f), max_u);
    const float cv = std::min(std::max(v, 0.0f), max_v);
    inside[i] = std::abs(u - cu) + std::abs(v - cv) <= 1.0f ? 1.0f : 0.0f;
    const int iu = static_cast<int>(cu);
    const int iv = static_cast<int>(cv);
    const float a = cu - static_cast<float>(iu);
    const float b = cv - static_cast<float>(iv);
    const float* p = data + iv * stride + iu;
    const float top = p[0] + a * (p[1] - p[0]);
    const float bottom = p[stride] + a * (p[stride + 1] - p[stride]);
    value[i] = top + b * (bottom - top);
  }
}

// As sample(), with the derivative of the value by t at a fixed pixel.
void sample_with_slope(const Raster<float>& gray, const LocalMap& m, Samples& value, Samples& slope,
                       Samples& inside) {
  const float max_u = static_cast<float>(gray.width) - 1.001f;
  const float max_v = static_cast<float>(gray.height) - 1.001f;
  const float* data = gray.data.data();
  const int stride = gray.width;
  for (int i = 0; i < kSamples; ++i) {
    const float u = m.u + m.ux * kOffsets.dx[i] + m.uy * kOffsets.dy[i];
    const float v = m.v + m.vx * kOffsets.dx[i] + m.vy * kOffsets.dy[i];
    const float cu = std::min(std::max(u, 0.0f), max_u);
    const float cv = std::min(std::max(v, 0.0f), max_v);
    inside[i] = std::abs(u - cu) + std::abs(v - cv) <= 1.0f ? 1.0f : 0.0f;
    const int iu = static_cast<int>(cu);
    const int iv = static_cast<int>(cv);
    const float a = cu - static_cast<float>(iu);
    const float b = cv - static_cast<float>(iv);
    const float* p = data + iv * stride + iu;
    const float top = p[0] + a * (p[1] - p[0]);
    const float bottom = p[stride] + a * (p[stride + 1] - p[stride]);
    value[i] = top + b * (bottom - top);
    const float gu = (1 - b) * (p[1] - p[0]) + b * (p[stride + 1] - p[stride]);
    slope[i] = gu * m.ut + (bottom - top) * m.vt;
  }
}

}  // namespace

// The reference side of a match.
struct SlantedRefinement::Window {
  int x, y;
  Samples value;   // reference gray levels
  Samples weight;  // bilateral
};

// Normal equations of a Gauss-Newton step on (t, slope_x, slope_y), gain and offset eliminated.
struct SlantedRefinement::Normal {
  Eigen::Matrix3f H = Eigen::Matrix3f::Zero();
  Eigen::Vector3f g = Eigen::Vector3f::Zero();
  float residual = 0;  // weighted sum of squares
  float weight = 0;
};

SlantedRefinement::SlantedRefinement(const std::vector<SweepImage>& images,
                                     const SweepGeometry& geometry, const Raster<float>& start)
    : images_(images),
      geometry_(geometry),
      reference_(images[static_cast<size_t>(geometry.image)]),
      planes_(start.width, start.height, SlantedPlane{}) {
  const auto slope = [&](int x, int y, int dx, int dy) {
    if (!start.contains(x - dx, y - dy) || !start.contains(x + dx, y + dy)) return 0.0f;
    const float before = start(x, y) - start(x - dx, y - dy);
    const float after = start(x + dx, y + dy) - start(x, y);
    if (before * after <= 0) return 0.0f;
    return std::clamp(std::abs(before) < std::abs(after) ? before : after, -kMaxSlope, kMaxSlope);
  };
  for (int y = 0; y < start.height; ++y) {
    for (int x = 0; x < start.width; ++x) {
      planes_(x, y) = {start(x, y), slope(x, y, 1, 0), slope(x, y, 0, 1)};
    }
  }
}

SlantedRefinement::Window SlantedRefinement::window(int x, int y) const {
  Window w;
  w.x = x;
  w.y = y;
  const Raster<float>& gray = reference_.gray;
  const float center = gray(x, y);
  w.value.fill(center);
  w.weight.fill(0);
  for (int dy = std::max(-kRadius, -y); dy <= std::min(kRadius, gray.height - 1 - y); ++dy) {
    for (int dx = std::max(-kRadius, -x); dx <= std::min(kRadius, gray.width - 1 - x); ++dx) {
      const auto i = static_cast<size_t>((dy + kRadius) * kSide + dx + kRadius);
      w.value[i] = gray(x + dx, y + dy);
      w.weight[i] = reference_.valid(x + dx, y + dy) != 0 ? 1.0f : 0.0f;
    }
  }
  for (size_t i = 0; i < kSamples; ++i) {
    const float level = (w.value[i] - center) / kLevelScale;
    const float far = (kOffsets.dx[i] * kOffsets.dx[i] + kOffsets.dy[i] * kOffsets.dy[i]) /
                      (kDistanceScale * kDistanceScale);
    w.weight[i] /= (1 + level * level) * (1 + far);
    w.value[i] -= center;  // smaller numbers, smaller rounding
  }
  return w;
}

float SlantedRefinement::correlation(const Window& w, size_t source,
                                     const SlantedPlane& plane) const {
  const SweepSource& s = geometry_.sources[source];
  const SweepImage& image = images_[static_cast<size_t>(s.image)];
  const LocalMap map = local_map(image, s, {w.x, w.y}, plane);
  if (!map.seen) return kNaN;
  Samples value;
  Samples inside;
  sample(image.gray, map, value, inside);
  const float center = value[kRadius * kSide + kRadius];
  std::array<float, 8> sw{}, sa{}, sb{}, saa{}, sbb{}, sab{};
  for (size_t i = 0; i < kSamples; i += 8) {
    for (size_t k = 0; k < 8; ++k) {
      const float weight = w.weight[i + k] * inside[i + k];
      const float a = w.value[i + k];
      const float b = value[i + k] - center;
      sw[k] += weight;
      sa[k] += weight * a;
      sb[k] += weight * b;
      saa[k] += weight * a * a;
      sbb[k] += weight * b * b;
      sab[k] += weight * a * b;
    }
  }
  const auto sum = [](const std::array<float, 8>& v) {
    return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
  };
  const float inv = 1 / std::max(sum(sw), 1e-6f);
  const float ma = sum(sa) * inv;
  const float mb = sum(sb) * inv;
  const float va = std::max(sum(saa) * inv - ma * ma, 0.0f) + kNoiseVariance;
  const float vb = std::max(sum(sbb) * inv - mb * mb, 0.0f) + kNoiseVariance;
  return (sum(sab) * inv - ma * mb) / std::sqrt(va * vb);
}

float SlantedRefinement::data_cost(const Window& w, const SlantedPlane& plane) const {
  std::array<float, 16> scores;
  const size_t count = std::min(geometry_.sources.size(), scores.size());
  size_t seen = 0;
  for (size_t s = 0; s < count; ++s) {
    const float c = correlation(w, s, plane);
    if (!std::isnan(c)) scores[seen++] = 1 - c;
  }
  if (seen == 0) return kUnseenCost;
  std::sort(scores.begin(), scores.begin() + static_cast<std::ptrdiff_t>(seen));
  const size_t full = (seen + 1) / 2;
  float total = 0;
  float weight = 0;
  for (size_t i = 0; i < seen; ++i) {
    const float k = i < full ? 1.0f : kSecondWeight;
    total += k * scores[i];
    weight += k;
  }
  return total / weight;
}

float SlantedRefinement::smoothness(const Window& w, const SlantedPlane& plane) const {
  float total = 0;
  float weight = 1e-6f;
  for (const Offset o : {Offset{-1, 0}, Offset{1, 0}, Offset{0, -1}, Offset{0, 1}}) {
    if (!planes_.contains(w.x + o.dx, w.y + o.dy)) continue;
    const float k = w.weight[static_cast<size_t>((o.dy + kRadius) * kSide + o.dx + kRadius)];
    const float there = planes_(w.x + o.dx, w.y + o.dy).at(-o.dx, -o.dy);
    total += k * std::min(std::abs(there - plane.t), kTruncation);
    weight += k;
  }
  return total / weight / kTruncation;
}

float SlantedRefinement::cost(const Window& w, const SlantedPlane& plane) const {
  return data_cost(w, plane) + kSmoothness * smoothness(w, plane);
}

bool SlantedRefinement::normal_equations(const Window& w, size_t source, const SlantedPlane& plane,
                                         Normal& sum) const {
  const SweepSource& s = geometry_.sources[source];
  const SweepImage& image = images_[static_cast<size_t>(s.image)];
  const LocalMap map = local_map(image, s, {w.x, w.y}, plane);
  if (!map.seen) return false;
  Samples value;
  Samples slope;
  Samples inside;
  sample_with_slope(image.gray, map, value, slope, inside);
  // Unknowns: t, slope_x, slope_y, gain, offset; right side: the reference.
  Eigen::Matrix<float, 6, 6> M = Eigen::Matrix<float, 6, 6>::Zero();
  const float center = value[kRadius * kSide + kRadius];
  for (size_t i = 0; i < kSide * kSide; ++i) {
    const float weight = w.weight[i] * inside[i];
    Eigen::Matrix<float, 6, 1> row;
    row << slope[i], slope[i] * kOffsets.dx[i], slope[i] * kOffsets.dy[i], value[i] - center, 1,
        w.value[i];
    M.noalias() += weight * row * row.transpose();
  }
  if (!(M(4, 4) > 0)) return false;
  // Photometric gain and offset first, by regression of the reference on the source.
  const float inv = 1 / M(4, 4);
  const Eigen::Matrix<float, 6, 6> C = M - inv * M.col(4) * M.row(4);
  const float gain = C(3, 5) / (C(3, 3) + kNoiseVariance * M(4, 4));
  if (!(gain > 0.1f)) return false;
  const float inv_gain = 1 / (C(3, 3) + kNoiseVariance * M(4, 4));
  const Eigen::Matrix3f H = C.topLeftCorner<3, 3>() -
                            inv_gain * C.block<3, 1>(0, 3) * C.block<1, 3>(3, 0);
  const Eigen::Vector3f g = C.block<3, 1>(0, 5) - gain * C.block<3, 1>(0, 3);
  const float residual = std::max(C(5, 5) - gain * C(3, 5), 0.0f);
  // Divided by the variance of the reference, so that sources count as in the correlation.
  const float scale = 1 / (C(5, 5) * inv + kNoiseVariance);
  sum.H += scale * gain * gain * H;
  sum.g += scale * gain * g;
  sum.residual += scale * residual;
  sum.weight += M(4, 4);
  return true;
}

SlantedRefinement::Normal SlantedRefinement::normal_equations(const Window& w,
                                                              const SlantedPlane& plane) const {
  std::array<float, 16> scores;
  const size_t count = std::min(geometry_.sources.size(), scores.size());
  float best = -2;
  for (size_t s = 0; s < count; ++s) {
    scores[s] = correlation(w, s, plane);
    if (scores[s] > best) best = scores[s];
  }
  Normal sum;
  constexpr float kBelowBest = 0.3f;  // a source this much worse is taken for occluded
  for (size_t s = 0; s < count; ++s) {
    if (scores[s] >= best - kBelowBest) normal_equations(w, s, plane, sum);
  }
  return sum;
}

void SlantedRefinement::visit(int x, int y, const Raster<SlantedPlane>& extra) {
  const Window w = window(x, y);
  SlantedPlane best = planes_(x, y);
  float least = cost(w, best);
  const auto largest = static_cast<float>(geometry_.planes - 1);
  const auto try_plane = [&](const SlantedPlane& plane) {
    if (!(plane.t >= 0 && plane.t <= largest)) return;
    if (std::abs(plane.slope_x) > kMaxSlope || std::abs(plane.slope_y) > kMaxSlope) return;
    const float change = std::abs(plane.t - best.t) +
                         2 * (std::abs(plane.slope_x - best.slope_x) +
                              std::abs(plane.slope_y - best.slope_y));
    if (change < 0.02f) return;
    const float c = cost(w, plane);
    if (c < least) {
      least = c;
      best = plane;
    }
  };
  for (const Offset o : kNeighbours) {
    if (!planes_.contains(x + o.dx, y + o.dy)) continue;
    SlantedPlane plane = planes_(x + o.dx, y + o.dy);
    plane.t = plane.at(-o.dx, -o.dy);
    try_plane(plane);
  }
  if (!extra.empty()) try_plane(extra(x, y));
  constexpr int kSteps = 2;
  for (int k = 0; k < kSteps; ++k) {
    Normal n = normal_equations(w, best);
    // Damped towards the current plane: without texture the step must vanish, not explode.
    constexpr float kDamping = 0.02f;
    const float d = kDamping * std::max(n.weight, 1e-3f);
    n.H.diagonal() += Eigen::Vector3f(d, 10 * d, 10 * d);
    const Eigen::Vector3f step = n.H.ldlt().solve(n.g);
    if (!step.allFinite() || std::abs(step.x()) > kTruncation) break;
    try_plane({best.t + step.x(), best.slope_x + step.y(), best.slope_y + step.z()});
  }
  planes_(x, y) = best;
}

void SlantedRefinement::round(const Raster<SlantedPlane>& extra) {
  for (const int color : {0, 1}) {
    tbb::parallel_for(0, planes_.height, [&](int y) {
      for (int x = (y + color) % 2; x < planes_.width; x += 2) {
        if (reference_.valid(x, y) != 0) visit(x, y, extra);
      }
    });
  }
}

Raster<RefinedPixel> SlantedRefinement::result() const {
  Raster<RefinedPixel> out(planes_.width, planes_.height, RefinedPixel{{kNaN, 0, 0}, 0, 0});
  tbb::parallel_for(0, planes_.height, [&](int y) {
    for (int x = 0; x < planes_.width; ++x) {
      if (reference_.valid(x, y) == 0) continue;
      const Window w = window(x, y);
      const Normal n = normal_equations(w, planes_(x, y));
      // Cramer-Rao: residual variance over information on t, the slopes eliminated.
      const float total = std::max(n.weight, 1e-6f);
      Eigen::Matrix3f H = n.H;
      H.diagonal().array() += 1e-6f * total;
      const float variance = std::max(n.residual / total, 1e-4f);
      const float t_variance = variance * H.inverse()(0, 0);
      out(x, y) = {planes_(x, y), 1 - data_cost(w, planes_(x, y)), std::sqrt(t_variance)};
    }
  });
  return out;
}

}  // namespace cgs
