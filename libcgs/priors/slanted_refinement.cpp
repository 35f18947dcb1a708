// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/slanted_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include <Eigen/Cholesky>
#include <tbb/parallel_for.h>

#include "libcgs/core/lanes.h"
#include "libcgs/core/nan.h"
#include "libcgs/priors/matching_cost.h"

namespace cgs {

namespace {

constexpr int kPatchRadius = 4;
constexpr int kPatchSide = 2 * kPatchRadius + 1;
constexpr size_t kTaps = (kPatchSide * kPatchSide + 1) / 2;  // every other pixel, like a chessboard
constexpr size_t kSamples = (kTaps + 7) / 8 * 8;             // padded with weight 0
constexpr size_t kCenter = kTaps / 2;
constexpr float kLevelScale = 12;        // bilateral weight halves at this difference [gray levels]
constexpr float kDistanceScale = 1.6f;   // … and at this distance [pixels]
constexpr float kGrayNoiseVariance = 4;  // [gray levels squared]
constexpr float kSmoothness = 0.12f;     // cost of a full disagreement with the neighbours
constexpr float kTruncation = 0.8f;      // largest disagreement that counts [planes]
constexpr float kUnseenCost = 1.0f;      // as uncorrelated
constexpr float kMaxSlope = 6.0f;        // [planes per pixel]; ground before the feet has 3 to 4
constexpr float kSteep = 2.0f;           // few surfaces are steeper: what is must correlate better,
constexpr float kSteepCost = 0.1f;       // by so much per plane per pixel
constexpr float kOffLevel = 0.5f;        // ground rises and falls a little [planes per pixel]

struct Offset {
  int dx, dy;
};
// All of the other colour of the chessboard.
constexpr std::array<Offset, 8> kNeighbours = {
    {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-5, 0}, {5, 0}, {0, -5}, {0, 5}}};

using Samples = std::array<float, kSamples>;

// Eight samples at a time; sums of lanes have a fixed order.
float sum(const Floats& v) {
  return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}
float dot(const Samples& a, const Samples& b) {
  Floats total{};
  for (size_t i = 0; i < kSamples; i += kLanes) total += load<Floats>(&a[i]) * load<Floats>(&b[i]);
  return sum(total);
}

struct OffsetTable {
  Samples dx{}, dy{};
  OffsetTable() {
    for (size_t i = 0; i < kTaps; ++i) {
      const int column = static_cast<int>(2 * i) % kPatchSide;
      const int row = static_cast<int>(2 * i) / kPatchSide;
      dx[i] = static_cast<float>(column - kPatchRadius);
      dy[i] = static_cast<float>(row - kPatchRadius);
    }
  }
};
const OffsetTable kOffsets;

// The homography of a plane near one pixel: where it goes and its derivative.
struct LocalMap {
  float u, v;  // in array coordinates: pixel centres on integers
  float ux, uy, vx, vy;
  float ut, vt;  // derivative by t
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

// The source around the image of a window: the bilinear cell of every sample.
struct Cells {
  Samples inside;              // 0 beyond the frame, else 1
  Samples a, b;                // position in the cell
  Samples p00, p10, p01, p11;  // its corners, first index along the row

  Cells(const Raster<float>& gray, const LocalMap& m) {
    const float max_u = static_cast<float>(gray.width) - 1.001f;
    const float max_v = static_cast<float>(gray.height) - 1.001f;
    std::array<int, kSamples> at;
    for (size_t i = 0; i < kSamples; ++i) {
      const float u = m.u + m.ux * kOffsets.dx[i] + m.uy * kOffsets.dy[i];
      const float v = m.v + m.vx * kOffsets.dx[i] + m.vy * kOffsets.dy[i];
      const float cu = std::min(std::max(u, 0.0f), max_u);
      const float cv = std::min(std::max(v, 0.0f), max_v);
      inside[i] = std::abs(u - cu) + std::abs(v - cv) <= 1.0f ? 1.0f : 0.0f;
      const int iu = static_cast<int>(cu);
      const int iv = static_cast<int>(cv);
      a[i] = cu - static_cast<float>(iu);
      b[i] = cv - static_cast<float>(iv);
      at[i] = iv * gray.width + iu;
    }
    const float* top = gray.data.data();
    const float* bottom = top + gray.width;
    for (size_t i = 0; i < kSamples; i += kLanes) {
      const auto cells = load<Ints>(&at[i]);
      store(gathered(top, cells), &p00[i]);
      store(gathered(top + 1, cells), &p10[i]);
      store(gathered(bottom, cells), &p01[i]);
      store(gathered(bottom + 1, cells), &p11[i]);
    }
  }

  void values(Samples& out) const {
    for (size_t i = 0; i < kSamples; ++i) {
      const float top = p00[i] + a[i] * (p10[i] - p00[i]);
      const float bottom = p01[i] + a[i] * (p11[i] - p01[i]);
      out[i] = top + b[i] * (bottom - top);
    }
  }

  // Derivative of the values by t at a fixed pixel.
  void derivatives(const LocalMap& m, Samples& out) const {
    for (size_t i = 0; i < kSamples; ++i) {
      const float along_top = p10[i] - p00[i];
      const float along_bottom = p11[i] - p01[i];
      const float gu = along_top + b[i] * (along_bottom - along_top);
      const float gv = p01[i] - p00[i] + a[i] * (along_bottom - along_top);
      out[i] = gu * m.ut + gv * m.vt;
    }
  }
};

/// One number per source, without an allocation for the usual few: it is asked for per candidate.
class Scratch {
 public:
  explicit Scratch(size_t count) : count_(count), many_(count > few_.size() ? count : 0) {}
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  std::span<float> values() { return {many_.empty() ? few_.data() : many_.data(), count_}; }
  void copy(Scratch& other) {
    const std::span<float> from = other.values();
    std::copy(from.begin(), from.end(), values().begin());
  }

 private:
  size_t count_;
  std::array<float, 16> few_;
  std::vector<float> many_;
};

// The cost of correlations with the sources, NaN where one does not see the pixel.
float data_cost(std::span<const float> scores) {
  Scratch scratch(scores.size());
  const std::span<float> costs = scratch.values();
  size_t seen = 0;
  for (const float c : scores) {
    if (!std::isnan(c)) costs[seen++] = 1 - c;
  }
  if (seen == 0) return kUnseenCost;
  std::sort(costs.begin(), costs.begin() + static_cast<std::ptrdiff_t>(seen));
  return combined_cost<float>(costs.first(seen));
}

bool is_same(const SlantedPlane& a, const SlantedPlane& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;  // NaN, too
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
  float parallax = 0;  // largest of the sources [pixels per plane]
};

SlantedRefinement::SlantedRefinement(const std::vector<SweepImage>& images,
                                     const SweepGeometry& geometry,
                                     const Raster<float>& start)
    : images_(images),
      geometry_(geometry),
      reference_(images[static_cast<size_t>(geometry.image)]),
      planes_(start.width, start.height, SlantedPlane{}),
      visited_(start.width, start.height, 0),
      moved_(start.width, start.height, 0) {
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

SlantedRefinement::SlantedRefinement(const std::vector<SweepImage>& images,
                                     const SweepGeometry& geometry,
                                     Raster<SlantedPlane> start)
    : images_(images),
      geometry_(geometry),
      reference_(images[static_cast<size_t>(geometry.image)]),
      planes_(std::move(start)),
      visited_(planes_.width, planes_.height, 0),
      moved_(planes_.width, planes_.height, 0) {
  for (SlantedPlane& plane : planes_.data) {
    if (std::isnan(plane.t)) plane = {};
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
  for (size_t i = 0; i < kTaps; ++i) {
    const int u = x + static_cast<int>(kOffsets.dx[i]);
    const int v = y + static_cast<int>(kOffsets.dy[i]);
    if (!gray.contains(u, v) || reference_.valid(u, v) == 0) continue;
    w.value[i] = gray(u, v);
    w.weight[i] = 1;
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

float SlantedRefinement::correlation(const Window& w,
                                     size_t source,
                                     const SlantedPlane& plane) const {
  const SweepSource& s = geometry_.sources[source];
  const SweepImage& image = images_[static_cast<size_t>(s.image)];
  const LocalMap map = local_map(image, s, {w.x, w.y}, plane);
  if (!map.seen) return kNaN;
  const Cells cells(image.gray, map);
  Samples value;
  cells.values(value);
  const float center = value[kCenter];
  Floats sw{}, sa{}, sb{}, saa{}, sbb{}, sab{};
  for (size_t i = 0; i < kSamples; i += kLanes) {
    const Floats weight = load<Floats>(&w.weight[i]) * load<Floats>(&cells.inside[i]);
    const Floats a = load<Floats>(&w.value[i]);
    const Floats b = load<Floats>(&value[i]) - center;
    const Floats wa = weight * a;
    const Floats wb = weight * b;
    sw += weight;
    sa += wa;
    sb += wb;
    saa += wa * a;
    sbb += wb * b;
    sab += wa * b;
  }
  const float inv = 1 / std::max(sum(sw), 1e-6f);
  const float ma = sum(sa) * inv;
  const float mb = sum(sb) * inv;
  const float va = std::max(sum(saa) * inv - ma * ma, 0.0f) + kGrayNoiseVariance;
  const float vb = std::max(sum(sbb) * inv - mb * mb, 0.0f) + kGrayNoiseVariance;
  return (sum(sab) * inv - ma * mb) / std::sqrt(va * vb);
}

void SlantedRefinement::score(const Window& w,
                              const SlantedPlane& plane,
                              std::span<float> scores) const {
  for (size_t s = 0; s < scores.size(); ++s) scores[s] = correlation(w, s, plane);
}

// Of a plane among those of its neighbours, and of one that is steep.
float SlantedRefinement::prior_cost(const Window& w, const SlantedPlane& plane) const {
  float total = 0;
  float weight = 1e-6f;
  for (const Offset o : {Offset{-1, 0}, Offset{1, 0}, Offset{0, -1}, Offset{0, 1}}) {
    if (!planes_.contains(w.x + o.dx, w.y + o.dy)) continue;
    if (reference_.valid(w.x + o.dx, w.y + o.dy) == 0) continue;
    const float level =
        (reference_.gray(w.x + o.dx, w.y + o.dy) - reference_.gray(w.x, w.y)) / kLevelScale;
    const float k = 1 / (1 + level * level);
    const float there = planes_(w.x + o.dx, w.y + o.dy).at(-o.dx, -o.dy);
    total += k * std::min(std::abs(there - plane.t), kTruncation);
    weight += k;
  }
  return kSmoothness * total / weight / kTruncation + kSteepCost * steepness(w, plane);
}

// By how much a plane is steeper than most surfaces are, or off the level plane there if that is
// less [planes per pixel].
float SlantedRefinement::steepness(const Window& w, const SlantedPlane& plane) const {
  const float steepest = std::max(std::abs(plane.slope_x), std::abs(plane.slope_y));
  if (steepest <= kSteep) return 0;
  const double drop = drop_.dot(Eigen::RowVector3d(w.x + 0.5, w.y + 0.5, 1));
  if (!(drop > 0)) return steepest - kSteep;
  const double share = (double(plane.t) - geometry_.plane_of(0)) / drop;
  const double off = std::max(std::abs(double(plane.slope_x) - share * drop_.x()),
                              std::abs(double(plane.slope_y) - share * drop_.y()));
  return std::clamp(static_cast<float>(off) - kOffLevel, 0.0f, steepest - kSteep);
}

bool SlantedRefinement::normal_equations(const Window& w,
                                         size_t source,
                                         const SlantedPlane& plane,
                                         Normal& total) const {
  const SweepSource& s = geometry_.sources[source];
  const SweepImage& image = images_[static_cast<size_t>(s.image)];
  const LocalMap map = local_map(image, s, {w.x, w.y}, plane);
  if (!map.seen) return false;
  total.parallax = std::max(total.parallax, std::hypot(map.ut, map.vt));
  const Cells cells(image.gray, map);
  // Unknowns: t, slope_x, slope_y, gain, offset; last the right side: the reference.
  std::array<Samples, 6> rows;
  cells.derivatives(map, rows[0]);
  cells.values(rows[3]);
  const float center = rows[3][kCenter];
  for (size_t i = 0; i < kSamples; ++i) {
    rows[1][i] = rows[0][i] * kOffsets.dx[i];
    rows[2][i] = rows[0][i] * kOffsets.dy[i];
    rows[3][i] -= center;
    rows[4][i] = 1;
  }
  rows[5] = w.value;
  Eigen::Matrix<float, 6, 6> M;
  for (size_t r = 0; r < 6; ++r) {
    Samples weighted;
    for (size_t i = 0; i < kSamples; ++i) {
      weighted[i] = w.weight[i] * cells.inside[i] * rows[r][i];
    }
    for (size_t c = r; c < 6; ++c) {
      M(int(r), int(c)) = dot(weighted, rows[c]);
      M(int(c), int(r)) = M(int(r), int(c));
    }
  }
  if (!(M(4, 4) > 0)) return false;
  // Photometric gain and offset first, by regression of the reference on the source.
  const float inv = 1 / M(4, 4);
  const Eigen::Matrix<float, 6, 6> C = M - inv * M.col(4) * M.row(4);
  const float gain = C(3, 5) / (C(3, 3) + kGrayNoiseVariance * M(4, 4));
  if (!(gain > 0.1f)) return false;
  const float inv_gain = 1 / (C(3, 3) + kGrayNoiseVariance * M(4, 4));
  const Eigen::Matrix3f H =
      C.topLeftCorner<3, 3>() - inv_gain * C.block<3, 1>(0, 3) * C.block<1, 3>(3, 0);
  const Eigen::Vector3f g = C.block<3, 1>(0, 5) - gain * C.block<3, 1>(0, 3);
  const float residual = std::max(C(5, 5) - gain * C(3, 5), 0.0f);
  // Divided by the variance of the reference, so that sources count as in the correlation.
  const float scale = 1 / (C(5, 5) * inv + kGrayNoiseVariance);
  total.H += scale * gain * gain * H;
  total.g += scale * gain * g;
  total.residual += scale * residual;
  total.weight += M(4, 4);
  return true;
}

// \param scores  the correlations of the plane with the sources
SlantedRefinement::Normal SlantedRefinement::normal_equations(const Window& w,
                                                              const SlantedPlane& plane,
                                                              std::span<const float> scores) const {
  float best = -2;
  for (const float c : scores) {
    if (c > best) best = c;
  }
  Normal total;
  constexpr float kBelowBest = 0.3f;  // a source this much worse is taken for occluded
  for (size_t s = 0; s < scores.size(); ++s) {
    if (scores[s] >= best - kBelowBest) normal_equations(w, s, plane, total);
  }
  return total;
}

void SlantedRefinement::visit(int x, int y, const Raster<SlantedPlane>& extra) {
  const Window w = window(x, y);
  SlantedPlane best = planes_(x, y);
  Scratch scores_of_best(geometry_.sources.size());
  Scratch scores(geometry_.sources.size());
  score(w, best, scores_of_best.values());
  float least = data_cost(scores_of_best.values()) + prior_cost(w, best);
  const auto largest = static_cast<float>(geometry_.planes - 1);
  const auto try_plane = [&](const SlantedPlane& plane) {
    if (!(plane.t >= 0 && plane.t <= largest)) return;
    if (std::abs(plane.slope_x) > kMaxSlope || std::abs(plane.slope_y) > kMaxSlope) return;
    const float change = std::abs(plane.t - best.t) + 2 * (std::abs(plane.slope_x - best.slope_x) +
                                                           std::abs(plane.slope_y - best.slope_y));
    if (change < 0.02f) return;
    const float prior = prior_cost(w, plane);
    if (prior >= least) return;
    score(w, plane, scores.values());
    const float c = prior + data_cost(scores.values());
    if (c < least) {
      least = c;
      best = plane;
      scores_of_best.copy(scores);
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
    Normal n = normal_equations(w, best, scores_of_best.values());
    // Damped towards the current plane: without texture the step must vanish, not explode.
    constexpr float kDamping = 0.02f;
    const float d = kDamping * std::max(n.weight, 1e-3f);
    n.H.diagonal() += Eigen::Vector3f(d, 10 * d, 10 * d);
    const Eigen::Vector3f step = n.H.ldlt().solve(n.g);
    if (!step.allFinite() || std::abs(step.x()) > kTruncation) break;
    const SlantedPlane before = best;
    try_plane({best.t + step.x(), best.slope_x + step.y(), best.slope_y + step.z()});
    if (is_same(best, before)) break;  // the next step would be this one
  }
  if (!is_same(planes_(x, y), best)) moved_(x, y) = time_;
  visited_(x, y) = time_;
  planes_(x, y) = best;
}

bool SlantedRefinement::is_settled(int x, int y, const Raster<SlantedPlane>& extra) const {
  const uint16_t visited = visited_(x, y);
  if (visited == 0 || moved_(x, y) == visited) return false;
  if (extra.empty() != extra_before_.empty()) return false;
  if (!extra.empty() && !is_same(extra(x, y), extra_before_(x, y))) return false;
  return std::none_of(kNeighbours.begin(), kNeighbours.end(), [&](const Offset& o) {
    return planes_.contains(x + o.dx, y + o.dy) && moved_(x + o.dx, y + o.dy) > visited;
  });
}

void SlantedRefinement::round(const Raster<SlantedPlane>& extra, const Progress& progress) {
  SharedProgress shared(progress, 2 * static_cast<size_t>(planes_.height));
  for (const int color : {0, 1}) {
    ++time_;
    tbb::parallel_for(0, planes_.height, [&](int y) {
      for (int x = (y + color) % 2; x < planes_.width; x += 2) {
        if (reference_.valid(x, y) != 0 && !is_settled(x, y, extra)) visit(x, y, extra);
      }
      shared.advance();
    });
  }
  extra_before_ = extra;
}

void SlantedRefinement::take_result(Raster<RefinedPixel>& out, const Progress& progress) const {
  if (out.empty()) out = {planes_.width, planes_.height, RefinedPixel{{kNaN, 0, 0}, 0, 0}};
  SharedProgress shared(progress, static_cast<size_t>(planes_.height));
  tbb::parallel_for(0, planes_.height, [&](int y) {
    for (int x = 0; x < planes_.width; ++x) {
      if (reference_.valid(x, y) == 0 || is_same(out(x, y).plane, planes_(x, y))) continue;
      const Window w = window(x, y);
      Scratch scratch(geometry_.sources.size());
      const std::span<float> scores = scratch.values();
      score(w, planes_(x, y), scores);
      const Normal n = normal_equations(w, planes_(x, y), scores);
      // Cramer-Rao: residual variance over information on the match, the slopes eliminated.
      const float total = std::max(n.weight, 1e-6f);
      const double least = 1e-6 * double(total);
      const double planes_per_pixel = n.parallax > 0 ? 1 / double(n.parallax) : 0;
      Eigen::Matrix3d H = planes_per_pixel * planes_per_pixel * n.H.cast<double>();
      H.diagonal().array() += least;
      // Without texture H is singular but for rounding, and its inverse may come out negative.
      const double inverse = H.inverse()(0, 0);
      const double per_variance = inverse > 0 ? std::min(inverse, 1 / least) : 1 / least;
      const double variance = std::max(n.residual / total, 1e-4f);
      const auto sigma = static_cast<float>(std::sqrt(variance * per_variance));
      out(x, y) = {planes_(x, y), 1 - data_cost(scores), sigma};
    }
    shared.advance();
  });
}

}  // namespace cgs
