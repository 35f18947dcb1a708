// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/splat_merging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/render/projection.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

namespace {

constexpr float kDilation = ProjectionOptions{}.dilation;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr size_t kMergedAtOnce = 2048;

template <typename Work>
void for_each_splat(size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kMergedAtOnce), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

// The edge of a pixel at a splat; infinite where the camera does not see it.
float pixel_at(const Camera& camera,
               const Eigen::Isometry3d& cam_from_world,
               const Eigen::Vector3f& position) {
  const Eigen::Vector3d uvz = camera.project_in_cam(cam_from_world * position.cast<double>());
  if (!camera.sees(uvz)) return kInfinity;
  return static_cast<float>(uvz.z() / std::max(camera.fx, camera.fy));
}

Eigen::Vector3f ray_to(const Camera& camera, const Eigen::Vector3f& position) {
  return (position.cast<double>() - camera.center()).normalized().cast<float>();
}

void keep_weighed(WeighedSplats& s, const std::vector<uint8_t>& keep) {
  size_t kept = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    s.weight[kept] = s.weight[i];
    s.pixel[kept] = s.pixel[i];
    s.ray[kept] = s.ray[i];
    ++kept;
  }
  s.weight.resize(kept);
  s.pixel.resize(kept);
  s.ray.resize(kept);
  keep_only(s.splats, keep);
}

/// What the costs of all merges of a round need of each splat.
struct Shapes {
  std::vector<Eigen::Vector3f> normal;  ///< As merge_splats() says.
  std::vector<float> reach;             ///< As seen, a pixel's blur included [internal units].
};

Eigen::Vector3f normal_of(const WeighedSplats& s, size_t i) {
  constexpr float kAsShort = 1.01f;  // what optimisation left as good as equal
  const Eigen::Vector3f& scale = s.splats.scale[i];
  const Eigen::Matrix3f axes = rotation_matrix(s.splats.rotation[i]);
  Eigen::Index shortest = 0;
  const float least = scale.minCoeff(&shortest);
  Eigen::Vector3f out = Eigen::Vector3f::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (scale[k] <= kAsShort * least) out += axes.col(k).dot(s.ray[i]) * axes.col(k);
  }
  const float length = out.norm();
  return length > 0 ? Eigen::Vector3f(out / length) : Eigen::Vector3f(axes.col(shortest));
}

Shapes shapes_of(const WeighedSplats& s) {
  Shapes out;
  out.normal.resize(s.splats.size());
  out.reach.resize(s.splats.size());
  for_each_splat(s.splats.size(), [&](size_t i) {
    out.normal[i] = normal_of(s, i);
    out.reach[i] = s.splats.scale[i].maxCoeff() + std::sqrt(kDilation) * s.pixel[i];
  });
  return out;
}

float merge_cost(const WeighedSplats& s,
                 const Shapes& shapes,
                 const MergeOptions& options,
                 uint32_t i,
                 uint32_t j) {
  if (i > j) std::swap(i, j);          // the same bits for both
  constexpr float kNeighbours = 1.5f;  // squared distance up to which nothing is smeared [pixels^2]
  const Eigen::Vector3f step = s.splats.position[i] - s.splats.position[j];
  const float reach = shapes.reach[i] + shapes.reach[j];
  if (!(step.squaredNorm() <= reach * reach)) return kInfinity;
  const float pixel = std::min(s.pixel[i], s.pixel[j]);
  const float off =
      std::max(std::abs(shapes.normal[i].dot(step)), std::abs(shapes.normal[j].dot(step))) / pixel;
  const float spread = step.squaredNorm() / (pixel * pixel) - kNeighbours;
  const auto stride = static_cast<size_t>(s.splats.sh_count());
  const float color =
      kShC0 * kShC0 * (s.splats.sh[i * stride] - s.splats.sh[j * stride]).squaredNorm();
  const float both = s.weight[i] + s.weight[j];
  if (!(both > 0)) return 0;
  return s.weight[i] * s.weight[j] / both *
         (color + options.depth_cost * off * off + options.spread_cost * std::max(0.0f, spread));
}

// Where all cost the same, as on a white wall, pairs are chosen in an order that both sides agree
// on and that is none of place: by index, everyone would choose the next, and hardly two each
// other.
uint64_t order_of_pair(uint32_t i, uint32_t j) {
  return split_mix(uint64_t{std::min(i, j)} << 32 | std::max(i, j));
}

constexpr uint32_t kNobody = UINT32_MAX;

// For each splat the one that it would cost least to merge with; kNobody = too much with any.
std::vector<uint32_t> cheapest_partners(const WeighedSplats& s, const MergeOptions& options) {
  constexpr size_t kNeighbors = 8;
  const Shapes shapes = shapes_of(s);
  const KdTree tree(s.splats.position);
  std::vector<uint32_t> out(s.splats.size(), kNobody);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, out.size(), kMergedAtOnce),
                    [&](const auto& range) {
                      std::vector<Neighbor> near;
                      for (size_t k = range.begin(); k < range.end(); ++k) {
                        const uint32_t i = tree.order()[k];
                        tree.nearest(s.splats.position[i], kNeighbors + 1, near);
                        float least = options.most_cost;
                        uint64_t first = UINT64_MAX;
                        for (const Neighbor& n : near) {
                          if (n.point == i) continue;
                          const float cost = merge_cost(s, shapes, options, i, n.point);
                          const uint64_t order = order_of_pair(i, n.point);
                          if (!(cost <= least) || (cost == least && order >= first))
                            continue;  // never NaN
                          least = cost;
                          first = order;
                          out[i] = n.point;
                        }
                      }
                    });
  return out;
}

/// Moments of one splat.
struct Moments {
  Eigen::Vector3d variance;  ///< Rising [internal units^2].
  Eigen::Matrix3d axes;
};

Moments moments_of(const Eigen::Matrix3d& covariance) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

double blur_of(float pixel) { return double(kDilation) * double(pixel) * double(pixel); }

// Across the two longest axes, as a camera sees it that resolves `pixel`, over 2 pi.
double area_seen(const Eigen::Vector3d& variance, float pixel) {
  const double blur = blur_of(pixel);
  return std::sqrt((variance[1] + blur) * (variance[2] + blur));
}

double area_seen(const Eigen::Vector3f& scale, float pixel) {
  Eigen::Vector3d variance = scale.cast<double>().cwiseAbs2();
  std::sort(variance.begin(), variance.end());
  return area_seen(variance, pixel);
}

// Sum of x^k / k^2: the optical depth -ln(1 - x G) of a Gaussian of opacity x in [0, 1], over the
// plane and over its area.
double dilogarithm(double x) {
  constexpr double kOfOne = std::numbers::pi * std::numbers::pi / 6;
  if (x >= 1) return kOfOne;
  if (x > 0.5) return kOfOne - std::log(x) * std::log1p(-x) - dilogarithm(1 - x);
  double sum = 0;
  double power = x;
  for (int k = 1; power > 1e-9; ++k, power *= x) sum += power / double(k * k);
  return sum;
}

// The opacity in [0, most] whose dilogarithm is nearest to `depth`.
double opacity_of(double depth, double most) {
  if (depth >= dilogarithm(most)) return most;
  double x = std::min(depth, most);
  constexpr int kSteps = 6;  // of Newton, from the right on a convex function
  for (int k = 0; k < kSteps && x > 0; ++k) {
    x = std::clamp(x - (dilogarithm(x) - depth) * x / -std::log1p(-x), 0.0, most);
  }
  return x;
}

void set_moments(Gaussians& g, size_t i, Moments m, float pixel) {
  constexpr double kThinnest = 0.05;  // [pixels]
  if (m.axes.determinant() < 0) m.axes.col(0) = -m.axes.col(0);
  const double least = kThinnest * double(pixel);
  g.scale[i] = m.variance.cwiseMax(least * least).cwiseSqrt().cast<float>();
  const Eigen::Quaterniond q(m.axes);
  g.rotation[i] = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()).normalized().cast<float>();
}

// Gives a splat an optical depth, summed over the picture [internal units^2 over 2 pi], by its
// opacity, and by its size where that is not enough.
void set_depth(Gaussians& g, size_t i, Moments& m, float pixel, double depth) {
  constexpr double kMostOpacity = 0.97;  // one splat never hides everything
  const double area = area_seen(m.variance, pixel);
  g.opacity[i] = static_cast<float>(opacity_of(depth / area, kMostOpacity));
  const double grow = depth / (area * dilogarithm(kMostOpacity));
  if (!(grow > 1)) return;
  for (const Eigen::Index k : {1, 2}) {
    m.variance[k] += (grow - 1) * (m.variance[k] + blur_of(pixel));
  }
}

double depth_of(const WeighedSplats& s, uint32_t i) {
  return dilogarithm(double(s.splats.opacity[i])) * area_seen(s.splats.scale[i], s.pixel[i]);
}

// Merges splat j into i.
void merge_into(WeighedSplats& s, uint32_t i, uint32_t j) {
  constexpr float kFaintest = 1e-6f;  // so that two of no weight have a middle, too
  Gaussians& g = s.splats;
  const double of_i = std::max(s.weight[i], kFaintest);
  const double of_j = std::max(s.weight[j], kFaintest);
  const double a = of_i / (of_i + of_j);
  const double b = 1 - a;
  const Eigen::Matrix3d cov_i = covariance(g.scale[i], g.rotation[i]).cast<double>();
  const Eigen::Matrix3d cov_j = covariance(g.scale[j], g.rotation[j]).cast<double>();
  const Eigen::Vector3d step = (g.position[j] - g.position[i]).cast<double>();
  const float pixel = std::min(s.pixel[i], s.pixel[j]);
  Moments both = moments_of(a * cov_i + b * cov_j + a * b * step * step.transpose());
  set_depth(g, i, both, pixel, depth_of(s, i) + depth_of(s, j));
  set_moments(g, i, both, pixel);
  g.position[i] += (b * step).cast<float>();
  const auto count = static_cast<size_t>(g.sh_count());
  for (size_t k = 0; k < count; ++k) {
    Eigen::Vector3f& c = g.sh[i * count + k];
    c += static_cast<float>(b) * (g.sh[j * count + k] - c);
  }
  if (!g.provenance.empty()) {
    g.provenance[i] = weaker_evidence(g.provenance[i], g.provenance[j]);
  }
  if (!g.synthetic.empty()) g.synthetic[i] = std::max(g.synthetic[i], g.synthetic[j]);
  if (s.pixel[j] < s.pixel[i]) s.ray[i] = s.ray[j];
  s.weight[i] += s.weight[j];
  s.pixel[i] = pixel;
}

// \return how many went
size_t merge_round(WeighedSplats& s, const MergeOptions& options) {
  const std::vector<uint32_t> partner = cheapest_partners(s, options);
  std::vector<uint8_t> keep(partner.size(), 1);
  size_t merged = 0;
  for (uint32_t i = 0; i < partner.size(); ++i) {
    const uint32_t j = partner[i];
    if (j == kNobody || j < i || partner[j] != i) continue;
    merge_into(s, i, j);
    keep[j] = 0;
    ++merged;
  }
  keep_weighed(s, keep);
  return merged;
}

}  // namespace

void MergeOptions::validate() const {
  const auto require_cost = [](float value, const char* name) {
    require(value >= 0 && std::isfinite(value),
            std::string("MergeOptions.") + name + " must be >= 0 and finite",
            value);
  };
  require_cost(least_weight, "least_weight");
  require_cost(most_cost, "most_cost");
  require_cost(depth_cost, "depth_cost");
  require_cost(spread_cost, "spread_cost");
}

WeighedSplats weigh_splats(const Gaussians& gaussians, std::span<const Camera> cameras) {
  require(!cameras.empty(), "weigh_splats: number of cameras must be > 0", cameras.size());
  WeighedSplats out{gaussians,
                    std::vector<float>(gaussians.size(), 0),
                    std::vector(gaussians.size(), kInfinity),
                    std::vector<Eigen::Vector3f>(gaussians.size(), Eigen::Vector3f::Zero())};
  // Grey, so that the derivative of a picture with respect to the constant coefficient is the sum
  // of weights: no colour is cut off at black.
  Gaussians grey;
  grey.position = gaussians.position;
  grey.scale = gaussians.scale;
  grey.rotation = gaussians.rotation;
  grey.opacity = gaussians.opacity;
  grey.sh.assign(gaussians.size(), Eigen::Vector3f::Zero());
  TrainingRasterizer rasterizer(
      {.shape = GaussianShape::Ellipsoids, .sh_gradients = true, .depth_sums = false});
  GaussianGradients sum;
  for (const Camera& camera : cameras) {
    rasterizer.forward(grey, camera);
    TrainingBuffers loss;
    loss.color[0] = Raster<float>(camera.width, camera.height, 1 / kShC0);
    for (const int c : {1, 2}) loss.color[c] = Raster<float>(camera.width, camera.height, 0);
    set_zero(sum);
    rasterizer.backward(loss, sum);
    const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
    for_each_splat(grey.size(), [&](size_t i) {
      out.weight[i] = std::max(out.weight[i], sum.sh[i].x());
      const float pixel = pixel_at(camera, cam_from_world, gaussians.position[i]);
      if (!(pixel < out.pixel[i])) return;
      out.pixel[i] = pixel;
      out.ray[i] = ray_to(camera, gaussians.position[i]);
    });
  }
  // What no camera sees is as large as its own pixel would be; it weighs nothing or little.
  for_each_splat(grey.size(), [&](size_t i) {
    if (!std::isfinite(out.pixel[i])) out.pixel[i] = std::max(grey.scale[i].maxCoeff(), 1e-6f);
  });
  return out;
}

WeighedSplats merge_splats(WeighedSplats s, const MergeOptions& options) {
  options.validate();
  const size_t count = s.splats.size();
  require(s.weight.size() == count && s.pixel.size() == count && s.ray.size() == count,
          "merge_splats: there must be a weight, a pixel and a ray per splat; splats",
          count);
  std::vector<uint8_t> keep(count);
  for (size_t i = 0; i < keep.size(); ++i) {
    keep[i] = static_cast<uint8_t>(s.weight[i] >= options.least_weight);
  }
  keep_weighed(s, keep);
  constexpr int kMostRounds = 8;
  constexpr size_t kHardly = 50;  // one in so many
  for (int round = 0; round < kMostRounds && s.splats.size() > 1; ++round) {
    const size_t merged = merge_round(s, options);
    if (merged <= s.splats.size() / kHardly) break;
  }
  return s;
}

}  // namespace cgs
