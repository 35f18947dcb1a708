// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/sweep_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"

namespace cgs {

namespace {

constexpr int kFewestPlanes = 8;
constexpr size_t kMostMatched = 4;  // sources
// Below this ratio of baseline to depth, disparities drown in the rounding of the poses.
constexpr double kSmallestBaseline = 1e-6;

const View& input_view(const Scene& scene, int input) {
  return scene.views[static_cast<size_t>(scene.input[static_cast<size_t>(input)])];
}

// Continues the valid pixels of an image into the others: averages over ever larger cells.
void fill_invalid(Raster<float>& gray, const MaskMap& valid) {
  if (gray.width <= 1 && gray.height <= 1) return;
  const int w = (gray.width + 1) / 2;
  const int h = (gray.height + 1) / 2;
  Raster<float> sum(w, h, 0.0f);
  Raster<float> count(w, h, 0.0f);
  bool complete = true;
  for (int y = 0; y < gray.height; ++y) {
    for (int x = 0; x < gray.width; ++x) {
      if (valid(x, y) == 0) {
        complete = false;
        continue;
      }
      sum(x / 2, y / 2) += gray(x, y);
      count(x / 2, y / 2) += 1;
    }
  }
  if (complete) return;
  MaskMap coarse_valid(w, h, 0);
  for (size_t i = 0; i < sum.data.size(); ++i) {
    coarse_valid.data[i] = count.data[i] > 0;
    sum.data[i] /= std::max(count.data[i], 1.0f);
  }
  fill_invalid(sum, coarse_valid);
  for (int y = 0; y < gray.height; ++y) {
    for (int x = 0; x < gray.width; ++x) {
      if (valid(x, y) == 0) gray(x, y) = sum(x / 2, y / 2);
    }
  }
}

SweepSource source_of(const Camera& reference, const Camera& other, double inverse_far) {
  const Eigen::Isometry3d other_from_reference = other.cam_from_world() * reference.world_from_cam;
  SweepSource source;
  const Eigen::Vector3d shift = other.intrinsics() * other_from_reference.translation();
  source.A =
      other.intrinsics() * other_from_reference.rotation() * reference.intrinsics().inverse();
  source.A.col(2) += inverse_far * shift;
  source.b = shift;
  return source;
}

// Longest way a pixel of the reference goes in the source, per unit of inverse depth, on the part
// of its ray that the source sees.
double largest_speed(const Camera& reference,
                     const Camera& other,
                     double near_t,
                     const SweepSource& s) {
  constexpr int kGrid = 8;
  constexpr int kDepths = 32;
  double speed = 0;
  for (int i = 0; i <= kGrid; ++i) {
    for (int j = 0; j <= kGrid; ++j) {
      const double u = reference.width * double(i) / kGrid;
      const double v = reference.height * double(j) / kGrid;
      for (int k = 0; k <= kDepths; ++k) {
        const Eigen::Vector3d h = s.project(u, v, near_t * k / kDepths);
        const Eigen::Vector2d q = h.head<2>() / h.z();
        const bool seen =
            h.z() > 0 && q.x() >= 0 && q.y() >= 0 && q.x() <= other.width && q.y() <= other.height;
        if (!seen) continue;
        speed = std::max(speed, s.parallax(u, v, near_t * k / kDepths));
      }
    }
  }
  return speed;
}

// Those that can tell planes apart.
void match_with_parallax(std::vector<SweepSource>& sources) {
  constexpr double kHardlyAny = 0.05;  // of the most
  double most = 0;
  for (const SweepSource& source : sources) most = std::max(most, source.speed);
  for (SweepSource& source : sources) source.is_matched = !(source.speed < kHardlyAny * most);
}

void choose_matched(const Scene& scene, SweepGeometry& geometry) {
  std::vector<SweepSource>& sources = geometry.sources;
  if (sources.size() <= kMostMatched) return match_with_parallax(sources);
  const std::vector<size_t> best =
      neighbours(scene, static_cast<size_t>(geometry.image), kMostMatched);
  for (SweepSource& source : sources) {
    source.is_matched =
        std::binary_search(best.begin(), best.end(), static_cast<size_t>(source.image));
  }
}

}  // namespace

SweepImage sweep_image(const View& view) {
  const ColorImage& image = view.image;
  SweepImage out;
  out.gray = Raster<float>(image.width, image.height, 0.0f);
  out.valid = view.valid.empty() ? MaskMap(image.width, image.height, 1) : view.valid;
  const Eigen::Vector3f luma(0.299f, 0.587f, 0.114f);
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (out.valid.data[i] != 0) out.gray.data[i] = 255 * luma.dot(image.data[i]);
  }
  fill_invalid(out.gray, out.valid);
  return out;
}

std::pair<double, double> range_over(const Eigen::RowVector3d& affine,
                                     const Eigen::Vector2d& from,
                                     const Eigen::Vector2d& to) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const double u : {from.x(), to.x()}) {
    for (const double v : {from.y(), to.y()}) {
      const double at = affine.dot(Eigen::RowVector3d(u, v, 1));
      least = std::min(least, at);
      most = std::max(most, at);
    }
  }
  return {least, most};
}

SweepGeometry sweep_geometry(const Scene& scene, int input, const SweepSampling& sampling) {
  const Camera& reference = input_view(scene, input).camera;
  const DepthRange range = depth_range(scene, scene.input[static_cast<size_t>(input)]);
  SweepGeometry geometry;
  geometry.image = input;
  geometry.inverse_far = (1 - sampling.range_margin) / range.far;
  const double inverse_near = (1 + sampling.range_margin) / range.near;
  const double span = inverse_near - geometry.inverse_far;
  const double middle = 2 / (inverse_near + geometry.inverse_far);
  double baseline = 0;
  for (const int i : scene.input) {
    const Camera& other = scene.views[static_cast<size_t>(i)].camera;
    baseline = std::max(baseline, (other.center() - reference.center()).norm());
  }
  for (const size_t j : neighbours(scene, static_cast<size_t>(input), kMostCompared)) {
    const Camera& other = input_view(scene, static_cast<int>(j)).camera;
    SweepSource source = source_of(reference, other, geometry.inverse_far);
    source.image = static_cast<int>(j);
    source.speed = largest_speed(reference, other, span, source);
    geometry.sources.push_back(source);
  }
  if (!(baseline >= kSmallestBaseline * middle)) {
    throw BadInput(Defect::Value,
                   scene.folder,
                   "the input cameras share one centre (baseline 0), so no depth can be measured; "
                   "choose views taken from different places");
  }
  choose_matched(scene, geometry);
  double speed = 0;
  for (const SweepSource& source : geometry.sources) {
    if (source.is_matched) speed = std::max(speed, source.speed);
  }
  const double wanted = std::ceil(speed * span / sampling.pixels_per_plane) + 1;
  geometry.planes = static_cast<int>(std::clamp(
      wanted, double(kFewestPlanes), std::max<double>(kFewestPlanes, sampling.max_planes)));
  geometry.step = span / (geometry.planes - 1);
  for (SweepSource& source : geometry.sources) source.b *= geometry.step;
  return geometry;
}

SweepSource sweep_source(const Camera& reference,
                         const SweepGeometry& geometry,
                         const Camera& other) {
  SweepSource source = source_of(reference, other, geometry.inverse_far);
  source.b *= geometry.step;
  return source;
}

SweepGeometry matched_sources(SweepGeometry geometry) {
  std::erase_if(geometry.sources, [](const SweepSource& source) { return !source.is_matched; });
  return geometry;
}

}  // namespace cgs
