// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splat_merging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "convert/splat_selection.h"
#include "libcgs/core/error.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/render/projection.h"
#include "libcgs/render/training_rasterizer.h"
#include "meshing/kd_tree.h"

namespace cgs {

namespace {

constexpr float kDilation = ProjectionOptions{}.dilation;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr size_t kGrain = 2048;

template <typename Work>
void for_each_splat(size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kGrain), [&](const auto& range) {
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

void keep_weighed(WeighedSplats& s, const std::vector<uint8_t>& keep) {
  size_t kept = 0;
  for (size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    s.weight[kept] = s.weight[i];
    s.pixel[kept] = s.pixel[i];
    ++kept;
  }
  s.weight.resize(kept);
  s.pixel.resize(kept);
  keep_only(s.splats, keep);
}

/// What the costs of all merges of a round need of each splat.
struct Shapes {
  std::vector<Eigen::Vector3f> normal;  ///< Along the shortest axis.
  std::vector<float> reach;             ///< As seen, a pixel's blur included [internal units].
};

Shapes shapes_of(const WeighedSplats& s) {
  Shapes out;
  out.normal.resize(s.splats.size());
  out.reach.resize(s.splats.size());
  for_each_splat(s.splats.size(), [&](size_t i) {
    const Eigen::Vector3f& scale = s.splats.scale[i];
    Eigen::Index shortest = 0;
    scale.minCoeff(&shortest);
    out.normal[i] = rotation_matrix(s.splats.rotation[i]).col(shortest);
    out.reach[i] = scale.maxCoeff() + std::sqrt(kDilation) * s.pixel[i];
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
  tbb::parallel_for(tbb::blocked_range<size_t>(0, out.size(), kGrain), [&](const auto& range) {
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
        if (cost > least || (cost == least && order >= first)) continue;
        least = cost;
        first = order;
        out[i] = n.point;
      }
    }
  });
  return out;
}

// Across the two longest axes, as a camera sees it that resolves `pixel`.
double area_seen(const Eigen::Matrix3d& covariance, float pixel) {
  const double blur = double(kDilation) * double(pixel) * double(pixel);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt((eigen.eigenvalues()[1] + blur) * (eigen.eigenvalues()[2] + blur));
}

void set_covariance(Gaussians& g, size_t i, const Eigen::Matrix3d& covariance, float pixel) {
  constexpr double kThinnest = 0.05;  // [pixels]
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  const double least = kThinnest * double(pixel);
  g.scale[i] = eigen.eigenvalues().cwiseMax(least * least).cwiseSqrt().cast<float>();
  const Eigen::Quaterniond q(axes);
  g.rotation[i] = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()).normalized().cast<float>();
}

// Merges splat j into i.
void merge_into(WeighedSplats& s, uint32_t i, uint32_t j) {
  constexpr double kMostOpacity = 0.97;  // one splat never hides everything
  constexpr float kFaintest = 1e-6f;     // so that two of no weight have a middle, too
  Gaussians& g = s.splats;
  const double of_i = std::max(s.weight[i], kFaintest);
  const double of_j = std::max(s.weight[j], kFaintest);
  const double a = of_i / (of_i + of_j);
  const double b = 1 - a;
  const Eigen::Matrix3d cov_i = covariance(g.scale[i], g.rotation[i]).cast<double>();
  const Eigen::Matrix3d cov_j = covariance(g.scale[j], g.rotation[j]).cast<double>();
  const Eigen::Vector3d step = (g.position[j] - g.position[i]).cast<double>();
  const Eigen::Matrix3d cov = a * cov_i + b * cov_j + a * b * step * step.transpose();
  const float pixel = std::min(s.pixel[i], s.pixel[j]);
  const double covered = double(g.opacity[i]) * area_seen(cov_i, s.pixel[i]) +
                         double(g.opacity[j]) * area_seen(cov_j, s.pixel[j]);
  g.opacity[i] = static_cast<float>(std::min(covered / area_seen(cov, pixel), kMostOpacity));
  g.position[i] += (b * step).cast<float>();
  set_covariance(g, i, cov, pixel);
  const auto count = static_cast<size_t>(g.sh_count());
  for (size_t k = 0; k < count; ++k) {
    Eigen::Vector3f& c = g.sh[i * count + k];
    c += static_cast<float>(b) * (g.sh[j * count + k] - c);
  }
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
  WeighedSplats out{
      gaussians, std::vector<float>(gaussians.size(), 0), std::vector(gaussians.size(), kInfinity)};
  // Grey, so that the derivative of a picture with respect to the constant coefficient is the sum
  // of weights: no colour is cut off at black.
  Gaussians grey = gaussians;
  grey.sh_degree = 0;
  grey.sh.assign(grey.size(), Eigen::Vector3f::Zero());
  TrainingRasterizer rasterizer({.shape = GaussianShape::Ellipsoids, .sh_gradients = true});
  GaussianGradients sum;
  for (const Camera& camera : cameras) {
    rasterizer.forward(grey, camera);
    TrainingBuffers loss;
    loss.color[0] = Raster<float>(camera.width, camera.height, 1 / kShC0);
    for (const int c : {1, 2}) loss.color[c] = Raster<float>(camera.width, camera.height, 0);
    sum = {};
    rasterizer.backward(loss, sum);
    const Eigen::Isometry3d cam_from_world = camera.cam_from_world();
    for_each_splat(grey.size(), [&](size_t i) {
      out.weight[i] = std::max(out.weight[i], sum.sh[i].x());
      out.pixel[i] =
          std::min(out.pixel[i], pixel_at(camera, cam_from_world, gaussians.position[i]));
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
  require(s.weight.size() == s.splats.size() && s.pixel.size() == s.splats.size(),
          "merge_splats: there must be a weight and a pixel per splat; splats",
          s.splats.size());
  std::vector<uint8_t> keep(s.splats.size());
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
