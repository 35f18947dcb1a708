// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/depth_field.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace cgs {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kBackground = 1e6f;  // Depth of rays that hit nothing; far beyond any surface.
constexpr float kMinSlope = 0.25f;   // At grazing incidence the local plane says little.
constexpr float kMaxBandGrowth = 3.0f;

// Depth steps between neighbours, in footprints of a pixel.
constexpr float kSmallStep = 3.0f;     // A surface tilted by 72 degrees.
constexpr float kLargestStep = 12.0f;  // 85 degrees, if the next step is alike.
constexpr float kNoiseSteps = 5.0f;    // Steps up to this many standard deviations are noise.

// One row or column of four depths: is the step between the middle two part of a surface?
bool continuous_step(const std::array<float, 4>& depths, float footprint, float noise) {
  const auto [before, a, b, after] = depths;
  const float step = b - a;
  const float small = std::max(kSmallStep * footprint, kNoiseSteps * noise);
  if (std::abs(step) <= small) return true;
  if (!(std::abs(step) <= kLargestStep * footprint)) return false;
  const auto alike = [&](float other) {
    return other * step > 0 && std::abs(other) * 2 >= std::abs(step);
  };
  return alike(a - before) || alike(after - b);
}

// Standard deviation of the pixel noise relative to depth, from the median second difference
// along rows, which is blind to slopes and to the few pixels at edges.
float relative_noise(const DepthMap& depth) {
  std::vector<float> bends;
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 1; x + 1 < depth.width; ++x) {
      const float d = depth(x, y);
      const float bend = std::abs(depth(x - 1, y) - 2 * d + depth(x + 1, y)) / d;
      if (std::isfinite(bend)) bends.push_back(bend);
    }
  }
  if (bends.empty()) return 0;
  const auto middle = bends.begin() + std::ptrdiff_t(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  constexpr float kSigmaPerMedian = 1.4826f / 2.4495f;  // sqrt(1 + 4 + 1) terms in a difference
  return kSigmaPerMedian * *middle;
}

DepthMap usable_depth(const TsdfView& view, double depth_trunc) {
  DepthMap depth = view.depth;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    float& d = depth.data[i];
    const bool usable = view.usable.empty() || view.usable.data[i] != 0;
    const bool beyond = depth_trunc > 0 && d > depth_trunc && !std::isinf(d);
    if (!usable || !(d > 0) || beyond) {
      d = kNaN;
    } else if (std::isinf(d)) {
      d = kBackground;
    }
  }
  return depth;
}

// A pixel that no surface passes through hangs between foreground and background: it would make
// a floater and carve a tunnel.
void drop_hanging_pixels(DepthMap& depth, const Raster<uint8_t>& continuous) {
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      bool part_of_surface = false;
      for (const int dy : {-1, 0}) {
        for (const int dx : {-1, 0}) {
          part_of_surface |= continuous.contains(x + dx, y + dy) && continuous(x + dx, y + dy) != 0;
        }
      }
      if (!part_of_surface) depth(x, y) = kNaN;
    }
  }
}

// Mean normal over 5 x 5 pixels of similar depth: the factors made from it must vary slowly, or
// they would move the zero crossing between voxels of different pixels.
Eigen::Vector3f smooth_normal(const NormalMap& normals, const DepthMap& depth, int x, int y) {
  constexpr int kRadius = 2;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int v = std::max(0, y - kRadius); v <= std::min(depth.height - 1, y + kRadius); ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min(depth.width - 1, x + kRadius); ++u) {
      constexpr float kSameSurface = 0.03f;
      if (std::abs(depth(u, v) - depth(x, y)) <= kSameSurface * depth(x, y)) sum += normals(u, v);
    }
  }
  const float length = sum.norm();
  return length > 0 ? Eigen::Vector3f(sum / length) : Eigen::Vector3f::Zero();
}

}  // namespace

Raster<uint8_t> continuous_quads(const DepthMap& depth, const Camera& camera) {
  Raster<uint8_t> out(depth.width, depth.height, 0);
  const auto at = [&](int x, int y) { return depth.contains(x, y) ? depth(x, y) : kNaN; };
  const auto inverse_focal = static_cast<float>(2 / (camera.fx + camera.fy));
  const float noise = relative_noise(depth);
  const auto step = [&](int x, int y, int dx, int dy) {
    const float near = std::min(at(x, y), at(x + dx, y + dy));
    return continuous_step(
        {at(x - dx, y - dy), at(x, y), at(x + dx, y + dy), at(x + 2 * dx, y + 2 * dy)},
        near * inverse_focal,
        near * noise);
  };
  tbb::parallel_for(0, std::max(0, depth.height - 1), [&](int y) {
    for (int x = 0; x + 1 < depth.width; ++x) {
      out(x, y) =
          step(x, y, 1, 0) && step(x, y + 1, 1, 0) && step(x, y, 0, 1) && step(x + 1, y, 0, 1);
    }
  });
  return out;
}

DepthField::DepthField(const TsdfView& view, const TsdfOptions& options, double voxel)
    : R_(view.camera.cam_from_world().rotation().cast<float>()),
      t_(view.camera.cam_from_world().translation().cast<float>()),
      fx_(static_cast<float>(view.camera.fx)),
      fy_(static_cast<float>(view.camera.fy)),
      cx_(static_cast<float>(view.camera.cx)),
      cy_(static_cast<float>(view.camera.cy)),
      width_(view.camera.width),
      height_(view.camera.height),
      truncation_(static_cast<float>(options.truncation * voxel)),
      voxel_(static_cast<float>(voxel)),
      depth_(usable_depth(view, options.depth_trunc)),
      slope_(width_, height_, 1),
      facing_(width_, height_, 1),
      sigma_(width_, height_, 0) {
  drop_hanging_pixels(depth_, continuous_quads(depth_, view.camera));
  continuous_ = continuous_quads(depth_, view.camera);
  hides_ = with_gaps_filled(depth_, options.gap_pixels * options.gap_pixels);

  const NormalMap normals = normals_from_depth(depth_, view.camera);
  const Eigen::Matrix3f R_world = R_.transpose();
  Level finest(width_, height_, {kNaN, kNaN, 0, false, true});
  tbb::parallel_for(0, height_, [&](int y) {
    for (int x = 0; x < width_; ++x) {
      const float d = depth_(x, y);
      const float behind = hides_(x, y);
      if (!view.sigma.empty() && view.sigma(x, y) > 0) sigma_(x, y) = view.sigma(x, y);
      const Eigen::Vector3f ray = R_world * view.camera.ray_in_cam(x + 0.5, y + 0.5).cast<float>();
      if (std::isfinite(d)) {
        const float along = std::abs(smooth_normal(normals, depth_, x, y).dot(ray));
        facing_(x, y) = std::clamp(along / ray.norm(), 0.05f, 1.0f);
        slope_(x, y) = std::max(along, kMinSlope * ray.norm());
      }
      const float free_limit = std::max(truncation_, 3 * sigma_(x, y) * slope_(x, y));
      finest(x, y) = {d, d, free_limit / slope_(x, y), std::isfinite(behind), !std::isfinite(d)};
    }
  });
  pyramid_.push_back(std::move(finest));
  while (pyramid_.back().width > 1 || pyramid_.back().height > 1) {
    const Level& fine = pyramid_.back();
    Level coarse((fine.width + 1) / 2, (fine.height + 1) / 2, {kNaN, kNaN, 0, false, false});
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        Extremes& to = coarse(x / 2, y / 2);
        const Extremes& from = fine(x, y);
        to = {std::fmin(to.nearest, from.nearest),
              std::fmax(to.farthest, from.farthest),
              std::max(to.slack, from.slack),
              to.any_known || from.any_known,
              to.any_unknown || from.any_unknown};
      }
    }
    pyramid_.push_back(std::move(coarse));
  }
}

bool DepthField::shows_one_surface(float u, float v) const {
  const int x0 = static_cast<int>(std::floor(u - 0.5f));
  const int y0 = static_cast<int>(std::floor(v - 0.5f));
  return continuous_.contains(x0, y0) && continuous_(x0, y0) != 0;
}

float DepthField::interpolated(float u, float v) const {
  const float fu = u - 0.5f;
  const float fv = v - 0.5f;
  const int x0 = static_cast<int>(std::floor(fu));
  const int y0 = static_cast<int>(std::floor(fv));
  const float a = fu - static_cast<float>(x0);
  const float b = fv - static_cast<float>(y0);
  // Inverse depth is linear in pixel coordinates on a plane, depth is not.
  const float top = (1 - a) / depth_(x0, y0) + a / depth_(x0 + 1, y0);
  const float bottom = (1 - a) / depth_(x0, y0 + 1) + a / depth_(x0 + 1, y0 + 1);
  return 1 / ((1 - b) * top + b * bottom);
}

Sighting DepthField::at(const Eigen::Vector3f& point) const {
  Sighting out;
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
  const float d = one_surface ? interpolated(u, v) : depth_(out.x, out.y);
  if (!std::isfinite(d)) {
    if (p.z() > hides_(out.x, out.y)) out.sight = Sight::Hidden;
    return out;
  }
  const float slope = slope_(out.x, out.y);
  out.sigma = sigma_(out.x, out.y) * slope;
  out.distance = (d - p.z()) * slope;
  const float wanted = std::max(truncation_, 3 * out.sigma);
  const float band = std::min(wanted, kMaxBandGrowth * truncation_);
  const float noise = out.sigma / voxel_;
  const float facing = facing_(out.x, out.y);
  out.weight = facing * facing / (1 + noise * noise);
  // Half a pixel from an occlusion edge either surface may be the true one.
  constexpr float kEdgeWeight = 0.25f;
  if (!one_surface) out.weight *= kEdgeWeight;
  if (out.distance > wanted) {
    out.sight = Sight::Free;
  } else if (out.distance < -band) {
    out.sight = Sight::Hidden;
  } else if (out.distance <= band) {
    out.sight = Sight::Band;
    // Behind the surface by more than a voxel the band only assumes that there is matter.
    const float behind = -out.distance - voxel_;
    if (behind > 0) out.weight *= std::max(0.05f, 1 - behind / (band - voxel_));
    constexpr float kMeasured = 2;  // [voxels], or what noise explains
    out.is_assumed = -out.distance > std::max(kMeasured * voxel_, 3 * out.sigma);
  }
  return out;
}

DepthField::Extremes DepthField::over_pixels(int x0, int y0, int x1, int y1) const {
  size_t k = 0;
  while (k + 1 < pyramid_.size() && std::max(x1 - x0, y1 - y0) >> k > 2) ++k;
  const Level& level = pyramid_[k];
  Extremes out = {kNaN, kNaN, 0, false, false};
  for (int y = y0 >> k; y <= y1 >> k; ++y) {
    for (int x = x0 >> k; x <= x1 >> k; ++x) {
      const Extremes& e = level(x, y);
      out = {std::fmin(out.nearest, e.nearest),
             std::fmax(out.farthest, e.farthest),
             std::max(out.slack, e.slack),
             out.any_known || e.any_known,
             out.any_unknown || e.any_unknown};
    }
  }
  return out;
}

Sight DepthField::over(const Eigen::AlignedBox3f& box) const {
  Eigen::AlignedBox2f shadow;
  float z_min = std::numeric_limits<float>::max();
  float z_max = std::numeric_limits<float>::lowest();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f p =
        R_ * box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner)) + t_;
    z_min = std::min(z_min, p.z());
    z_max = std::max(z_max, p.z());
    if (p.z() > 0) {
      shadow.extend(Eigen::Vector2f(fx_ * p.x() / p.z() + cx_, fy_ * p.y() / p.z() + cy_));
    }
  }
  if (z_max <= 0) return Sight::Nothing;
  if (!(z_min > 0.1f * z_max)) return Sight::Mixed;
  const auto w = static_cast<float>(width_);
  const auto h = static_cast<float>(height_);
  constexpr float kReach = 2;  // Interpolation looks one pixel further, rounding is paid too.
  const Eigen::Vector2f low = shadow.min().array() - kReach;
  const Eigen::Vector2f high = shadow.max().array() + kReach;
  if (high.x() < 0 || high.y() < 0 || low.x() >= w || low.y() >= h) return Sight::Nothing;
  const bool inside = low.x() >= 0 && low.y() >= 0 && high.x() < w && high.y() < h;
  const Extremes e = over_pixels(static_cast<int>(std::max(low.x(), 0.0f)),
                                 static_cast<int>(std::max(low.y(), 0.0f)),
                                 static_cast<int>(std::min(high.x(), w - 1)),
                                 static_cast<int>(std::min(high.y(), h - 1)));
  if (!e.any_known) return Sight::Nothing;
  if (!inside || e.any_unknown) return Sight::Mixed;
  if (z_max < e.nearest - e.slack) return Sight::Free;
  if (z_min > e.farthest + e.slack) return Sight::Hidden;
  return Sight::Mixed;
}

}  // namespace cgs
