// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/depth_field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <tbb/parallel_for.h>

#include "libcgs/core/lanes.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/padded_raster.h"
#include "meshing/volume/observation_kernel.h"

namespace cgs {

namespace {

constexpr float kBackground = 1e6f;  // Depth of rays that hit nothing; far beyond any surface.
constexpr float kMinSlope = 0.25f;   // At grazing incidence the local plane says little.
constexpr float kMinFacing = 0.05f;  // Cosine of incidence.

// Depth steps between neighbours, in footprints of a pixel.
constexpr float kSmallStep = 3.0f;     // A surface tilted by 72 degrees.
constexpr float kLargestStep = 12.0f;  // 85 degrees, if the next step is alike.
constexpr float kNoiseSteps = 5.0f;    // Steps up to this many standard deviations are noise.

constexpr float kRounding = 1e-3f;  // [voxels]; far more than floats lose

// In the order in which Eigen adds up.
Floats norm(const std::array<Floats, 3>& v) {
  return _mm256_sqrt_ps(v[0] * v[0] + (v[1] * v[1] + v[2] * v[2]));
}

Ints is_finite(Floats values) { return values - values == 0.0f; }

float least(Floats values) {
  const __m128 four = _mm_min_ps(_mm256_castps256_ps128(values), _mm256_extractf128_ps(values, 1));
  const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
}

// One row or column of four depths: is the step between the middle two part of a surface?
Ints continuous_step(const std::array<Floats, 4>& depths, float inverse_focal, float noise) {
  const auto& [before, a, b, after] = depths;
  const Floats step = b - a;
  const Floats near = min(a, b);
  const Floats footprint = near * inverse_focal;
  const Floats small = max(kSmallStep * footprint, kNoiseSteps * (near * noise));
  const auto alike = [&](Floats other) {
    return (other * step > 0.0f) & (magnitude(other) * 2.0f >= magnitude(step));
  };
  return (magnitude(step) <= small) |
         ((magnitude(step) <= kLargestStep * footprint) & (alike(a - before) | alike(after - b)));
}

// The value in the middle of the order of values >= 0, as std::nth_element finds it. Numbers above
// zero have the order of their bits, so that a histogram of the upper ones tells most of it.
float middle_value(std::vector<float>& values) {
  const auto upper = [](float value) { return std::bit_cast<uint32_t>(value) >> 16; };
  std::vector<uint32_t> histogram(1 << 16, 0);
  for (const float value : values) ++histogram[upper(value)];
  size_t rank = values.size() / 2;
  uint32_t bin = 0;
  while (rank >= histogram[bin]) rank -= histogram[bin++];
  std::erase_if(values, [&](float value) { return upper(value) != bin; });
  const auto middle = values.begin() + std::ptrdiff_t(rank);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Standard deviation of the pixel noise relative to depth, from the median second difference
// along rows, which is blind to slopes and to the few pixels at edges; background has none.
// \param padded  with a margin of one pixel
float relative_noise(const Raster<float>& padded, int width, int height) {
  std::vector<float> bends(size_t(width) * size_t(height));
  size_t count = 0;
  for (int y = 1; y <= height; ++y) {
    for (int x = 0; x < width; x += kLanes) {
      const auto at = [&](int k) { return load<Floats>(&padded(x + k, y)); };
      const Floats d = at(1);
      const Floats bend = magnitude(at(0) - 2 * d + at(2)) / d;
      for (unsigned left = bits((bend - bend == 0.0f) & (d < kBackground)); left != 0;
           left &= left - 1) {
        bends[count++] = bend[std::countr_zero(left)];
      }
    }
  }
  if (count == 0) return 0;
  bends.resize(count);
  constexpr float kSigmaPerMedian = 1.4826f / 2.4495f;  // sqrt(1 + 4 + 1) terms in a difference
  return kSigmaPerMedian * middle_value(bends);
}

DepthMap usable_depth(const TsdfView& view, double depth_trunc) {
  DepthMap depth = view.depth;
  for (float& d : depth.data) {
    if (!(d > 0) || (depth_trunc > 0 && double(d) > depth_trunc && !std::isinf(d))) d = kNaN;
    if (std::isinf(d)) d = kBackground;
  }
  if (view.usable.empty()) return depth;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (view.usable.data[i] == 0) depth.data[i] = kNaN;
  }
  return depth;
}

// A pixel that no surface passes through hangs between foreground and background: it would make
// a floater and carve a tunnel.
void drop_hanging_pixels(DepthMap& depth, const Raster<uint8_t>& continuous) {
  const auto width = static_cast<size_t>(depth.width);
  std::vector<uint8_t> above(width, 0);
  std::vector<uint8_t> either(width + 1, 0);  // of two quads one above the other, left of a pixel
  for (int y = 0; y < depth.height; ++y) {
    const uint8_t* const own = &continuous(0, y);
    for (size_t x = 0; x < width; ++x) either[x + 1] = own[x] | above[x];
    std::copy_n(own, width, above.data());
    float* const row = &depth(0, y);
    for (size_t x = 0; x < width; ++x) row[x] = (either[x] | either[x + 1]) != 0 ? row[x] : kNaN;
  }
}

// Mean normals over 5 x 5 pixels of similar depth: the factors made from them must vary slowly, or
// they would move the zero crossing between voxels of different pixels.
class SmoothNormals {
 public:
  SmoothNormals(const DepthMap& depth, const Camera& camera) : depth_(with_margin(depth, kRadius)) {
    const NormalMap normals = normals_from_depth(depth, camera);
    for (auto& one : normal_) one = Raster<float>(depth_.width, depth_.height, 0);
    for (int y = 0; y < depth.height; ++y) {
      const size_t to = depth_.index(kRadius, y + kRadius);
      for (int x = 0; x < depth.width; ++x) {
        const Eigen::Vector3f& n = normals(x, y);
        for (size_t k = 0; k < 3; ++k) normal_[k].data[to + size_t(x)] = n[Eigen::Index(k)];
      }
    }
  }

  // Of the eight pixels from (x, y) on: those with a depth.
  Ints known(int x, int y) const {
    return is_finite(load<Floats>(&depth_(x + kRadius, y + kRadius)));
  }
  // Their normals, not yet of length 1.
  std::array<Floats, 3> sum(int x, int y) const {
    constexpr float kSameSurface = 0.03f;
    std::array<Floats, 3> out = {};
    const auto here = load<Floats>(&depth_(x + kRadius, y + kRadius));
    for (int v = y; v <= y + 2 * kRadius; ++v) {
      for (int u = x; u <= x + 2 * kRadius; ++u) {
        const Ints same = magnitude(load<Floats>(&depth_(u, v)) - here) <= kSameSurface * here;
        for (size_t k = 0; k < 3; ++k) {
          out[k] += select(same, load<Floats>(&normal_[k](u, v)), Floats{});
        }
      }
    }
    return out;
  }

 private:
  static constexpr int kRadius = 2;

  Raster<float> depth_;
  std::array<Raster<float>, 3> normal_;
};

// Of the eight pixels from (x, y) on; 0 where there is none.
Floats given_sigma(const TsdfView& view, int x, int y) {
  Floats out = {};
  if (view.sigma.empty()) return out;
  for (int k = 0; k < std::min(kLanes, view.sigma.width - x); ++k) out[k] = view.sigma(x + k, y);
  return out;
}

}  // namespace

Raster<uint8_t> continuous_quads(const DepthMap& depth, const Camera& camera) {
  Raster<uint8_t> out(depth.width, depth.height, 0);
  const auto inverse_focal = static_cast<float>(camera.pixel_size(1));
  const Raster<float> padded = with_margin(depth, 1);
  const float noise = relative_noise(padded, depth.width, depth.height);
  const auto step = [&](int x, int y, int dx, int dy) {  // from (x, y)
    const auto at = [&](int k) { return load<Floats>(&padded(x + 1 + k * dx, y + 1 + k * dy)); };
    return continuous_step({at(-1), at(0), at(1), at(2)}, inverse_focal, noise);
  };
  tbb::parallel_for(0, std::max(0, depth.height - 1), [&](int y) {
    std::vector<int32_t> down(size_t(depth.width) + 2 * size_t{kLanes});
    const auto is_empty = [&](int x) {
      return !any(is_finite(load<Floats>(&padded(x + 1, y + 1))));
    };
    for (int x = 0; x < depth.width; x += kLanes) {
      if (!is_empty(x)) store(step(x, y, 0, 1), &down[size_t(x)]);
    }
    for (int x = 0; x < depth.width; x += kLanes) {
      if (is_empty(x)) continue;
      const unsigned is_one = bits(step(x, y, 1, 0) & step(x, y + 1, 1, 0) &
                                   load<Ints>(&down[size_t(x)]) & load<Ints>(&down[size_t(x) + 1]));
      const int count = std::min(kLanes, depth.width - 1 - x);
      const uint64_t bytes = _pdep_u64(is_one, 0x0101010101010101);
      if (count > 0) std::memcpy(&out(x, y), &bytes, size_t(count));
    }
  });
  return out;
}

DepthField::DepthField(const TsdfView& view, const TsdfOptions& options, double voxel, Asked asked)
    : R_(view.camera.cam_from_world().rotation().cast<float>()),
      t_(view.camera.cam_from_world().translation().cast<float>()),
      fx_(static_cast<float>(view.camera.fx)),
      fy_(static_cast<float>(view.camera.fy)),
      cx_(static_cast<float>(view.camera.cx)),
      cy_(static_cast<float>(view.camera.cy)),
      width_(view.camera.width),
      height_(view.camera.height),
      truncation_(static_cast<float>(options.truncation * voxel)),
      voxel_(static_cast<float>(voxel)) {
  DepthMap depth = usable_depth(view, options.depth_trunc);
  drop_hanging_pixels(depth, continuous_quads(depth, view.camera));
  const DepthMap hides = with_gaps_filled(depth, options.gap_pixels * options.gap_pixels);
  if (asked == Asked::Points) {
    pixels_ = std::make_unique_for_overwrite<Pixel[]>(depth.data.size());
    if (!view.sigma.empty()) sigma_ = DepthMap(width_, height_, 0);
    put_depth(depth, continuous_quads(depth, view.camera), hides);
  }
  bounds_.emplace(depth, hides, look_along(view, depth));
}

void DepthField::put_depth(const DepthMap& depth,
                           const Raster<uint8_t>& continuous,
                           const DepthMap& hides) {
  for (size_t i = 0; i < depth.data.size(); ++i) {
    const float d = depth.data[i];
    pixels_[i] = {continuous.data[i] != 0 ? -d : d, 1, 1, hides.data[i]};
  }
}

Raster<float> DepthField::look_along(const TsdfView& view, const DepthMap& depth) {
  const SmoothNormals normals(depth, view.camera);
  std::vector<float> across(size_t(width_) + kLanes);
  for (int x = 0; x < width_; ++x) {
    across[size_t(x)] = static_cast<float>(view.camera.ray_in_cam(x + 0.5, 0).x());
  }
  Raster<float> slack(width_, height_, truncation_);
  tbb::parallel_for(0, height_, [&](int y) {
    const auto down = static_cast<float>(view.camera.ray_in_cam(0, y + 0.5).y());
    for (int x = 0; x < width_; x += kLanes) {
      const Ints known = normals.known(x, y);
      if (!any(known)) continue;
      const std::array<Floats, 3> sum = normals.sum(x, y);
      // Sums in the order of Eigen's.
      const auto ray_x = load<Floats>(&across[size_t(x)]);
      std::array<Floats, 3> ray;
      for (int k = 0; k < 3; ++k) ray[size_t(k)] = R_(0, k) * ray_x + (R_(1, k) * down + R_(2, k));
      const Floats length = norm(sum);
      const Floats dot =
          sum[0] / length * ray[0] + (sum[1] / length * ray[1] + sum[2] / length * ray[2]);
      const Floats along = select(length > 0.0f, magnitude(dot), Floats{});
      const Floats one = Floats{} + 1.0f;
      const Floats facing = select(known, min(max(along / norm(ray), one * kMinFacing), one), one);
      const Floats slope = select(known, max(along, kMinSlope * norm(ray)), one);
      const Floats given = given_sigma(view, x, y);
      const Floats sigma = select(given > 0.0f, given * slope, Floats{});
      const Floats noise = sigma / voxel_;
      const Floats weight = facing * facing / (1.0f + noise * noise);
      const Floats limit = max(Floats{} + truncation_, 3.0f * sigma) / slope;
      const int count = std::min(kLanes, width_ - x);
      for (int k = 0; k < count; ++k) slack(x + k, y) = limit[k];
      if (!pixels_) continue;
      Pixel* const pixels = &pixels_[slack.index(x, y)];
      for (int k = 0; k < count; ++k) {
        pixels[k].slope = slope[k];
        pixels[k].weight = weight[k];
        if (!sigma_.empty()) sigma_(x + k, y) = sigma[k];
      }
    }
  });
  return slack;
}

bool DepthField::shows_one_surface(float u, float v) const {
  const int x0 = static_cast<int>(std::floor(u - 0.5f));
  const int y0 = static_cast<int>(std::floor(v - 0.5f));
  return x0 >= 0 && y0 >= 0 && pixel_at(x0, y0).depth < 0;
}

float DepthField::interpolated(float u, float v) const {
  const float fu = u - 0.5f;
  const float fv = v - 0.5f;
  const int x0 = static_cast<int>(std::floor(fu));
  const int y0 = static_cast<int>(std::floor(fv));
  const float a = fu - static_cast<float>(x0);
  const float b = fv - static_cast<float>(y0);
  const auto depth = [&](int x, int y) { return std::abs(pixel_at(x, y).depth); };
  // Inverse depth is linear in pixel coordinates on a plane, depth is not.
  const float top = (1 - a) / depth(x0, y0) + a / depth(x0 + 1, y0);
  const float bottom = (1 - a) / depth(x0, y0 + 1) + a / depth(x0 + 1, y0 + 1);
  return 1 / ((1 - b) * top + b * bottom);
}

PointObservation DepthField::at(const Eigen::Vector3f& point) const {
  PointObservation out;
  const Eigen::Vector3f p = R_ * point + t_;
  if (!(p.z() > 0)) return out;
  const float u = fx_ * p.x() / p.z() + cx_;
  const float v = fy_ * p.y() / p.z() + cy_;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_) && v < static_cast<float>(height_))) {
    return out;
  }
  out.x = static_cast<int>(u);
  out.y = static_cast<int>(v);
  const bool one_surface = shows_one_surface(u, v);
  const Pixel& pixel = pixel_at(out.x, out.y);
  const float d = one_surface ? interpolated(u, v) : std::abs(pixel.depth);
  if (!std::isfinite(d)) {
    if (p.z() > pixel.hides) out.sight = Sight::Hidden;
    return out;
  }
  if (!sigma_.empty()) out.sigma = sigma_(out.x, out.y);
  out.distance = (d - p.z()) * pixel.slope;
  const float wanted = std::max(truncation_, 3 * out.sigma);
  const float band = std::min(wanted, kMaxBandGrowth * truncation_);
  out.weight = pixel.weight;
  // Half a pixel from an occlusion edge either surface may be the true one.
  if (!one_surface) out.weight *= kEdgeWeight;
  if (out.distance > wanted) {
    out.sight = Sight::Free;
  } else if (out.distance < -band) {
    out.sight = Sight::Hidden;
  } else if (out.distance <= band) {
    out.sight = Sight::Band;
    // Behind the surface by more than a voxel the band only assumes that there is matter.
    const float behind = -out.distance - voxel_;
    if (behind > 0) out.weight *= std::max(kLeastBehind, 1 - behind / (band - voxel_));
    out.is_assumed = -out.distance > std::max(kMeasured * voxel_, 3 * out.sigma);
  }
  return out;
}

Looks DepthField::look(const EightBoxes& boxes) const {
  const auto x = load<Floats>(boxes.x.data());
  const auto y = load<Floats>(boxes.y.data());
  const auto z = load<Floats>(boxes.z.data());
  const auto moved = [&](int r) { return R_(r, 0) * x + R_(r, 1) * y + R_(r, 2) * z + t_[r]; };
  // A little larger, so that no rounding makes a point say something else than its box.
  constexpr float kFloatRounding = 0x1p-21f;  // of coordinates that are turned and moved
  const float far_off = std::abs(boxes.x[0]) + std::abs(boxes.y[0]) + std::abs(boxes.z[0]);
  const float rounding = kRounding * voxel_ + kFloatRounding * (far_off + t_.lpNorm<1>());
  const Eigen::Vector3f half = boxes.half.array() + rounding;
  const Floats depth = moved(2);
  const float deep =
      std::abs(R_(2, 0)) * half[0] + std::abs(R_(2, 1)) * half[1] + std::abs(R_(2, 2)) * half[2];
  const Floats z_min = depth - deep;
  const Floats z_max = depth + deep;
  const Ints is_before_camera = z_max > 0.0f;
  const Ints is_clear = is_before_camera & (z_min > 0.1f * z_max);  // of the camera
  Looks out;
  out.nothing = ~bits(is_before_camera) & 0xff;
  out.may_touch = out.may_free = bits(is_before_camera & ~is_clear);
  if (!any(is_clear)) return out;

  // A point p in a box of centre c is seen off c by (e - q f) / p.z, where e and f are its offsets
  // along x and z of the camera and q = c.x / c.z.
  constexpr float kReach = 1.5f;  // Own and rounded pixels.
  const auto reach = [&](int r, Floats q, float focal) {
    const auto along = [&](int k) { return half[k] * magnitude(R_(r, k) - q * R_(2, k)); };
    return focal * (along(0) + along(1) + along(2)) / z_min + kReach;
  };
  const Floats across = moved(0) / depth;
  const Floats down = moved(1) / depth;
  const Floats u = fx_ * across + cx_;
  const Floats v = fy_ * down + cy_;
  const Floats reach_u = reach(0, across, fx_);
  const Floats reach_v = reach(1, down, fy_);
  const auto w = static_cast<float>(width_);
  const auto h = static_cast<float>(height_);
  const Ints is_seen = is_clear & (u + reach_u >= 0.0f) & (v + reach_v >= 0.0f) &
                       (u - reach_u < w) & (v - reach_v < h);
  out.nothing |= bits(is_clear & ~is_seen);
  if (!any(is_seen)) return out;
  const Ints is_inside =
      is_seen & (u >= reach_u) & (v >= reach_v) & (u + reach_u < w) & (v + reach_v < h);
  const auto within = [&](Floats at, float size) {
    return select(is_seen, min(max(at, Floats{}), Floats{} + (size - 1)), Floats{});
  };
  const Floats widest = select(is_seen, max(reach_u, reach_v), Floats{});
  const auto [near, far, is_nothing, is_partial] =
      bounds_->around(within(u, w), within(v, h), -least(-widest));
  const Ints is_known = is_seen & ~is_nothing;
  const Ints is_before = is_known & (z_max < near);
  const Ints is_behind = is_known & (z_min > far);
  const Ints is_whole = is_inside & ~is_partial;
  out.nothing |= bits(is_seen & is_nothing);
  out.free = bits(is_before & is_whole);
  out.hidden = bits(is_behind & is_whole);
  out.may_touch |= bits(is_known & ~is_before & ~is_behind);
  out.may_free |= bits(is_known & ~is_behind);
  return out;
}

Look DepthField::look(const Eigen::AlignedBox3f& box) const {
  EightBoxes boxes;
  boxes.x.fill(box.center().x());
  boxes.y.fill(box.center().y());
  boxes.z.fill(box.center().z());
  boxes.half = 0.5f * box.sizes();
  return look(boxes)[0];
}

}  // namespace cgs
