// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/fusion_views.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

struct Pixel {
  float depth;
  int x, y;
};

// Pixels that hang together at depths that change little from one to the next.
class Patches {
 public:
  // \param wanted  1 where a pixel takes part
  Patches(const DepthMap& depth, MaskMap wanted) : depth_(depth), left_(std::move(wanted)) {}

  // Those of patches of at least so many.
  std::vector<Pixel> of_size(size_t least) {
    std::vector<Pixel> out;
    for (int y = 0; y < depth_.height; ++y) {
      for (int x = 0; x < depth_.width; ++x) {
        if (left_(x, y) == 0) continue;
        const std::vector<Pixel> patch = taken_around(x, y);
        if (patch.size() >= least) out.insert(out.end(), patch.begin(), patch.end());
      }
    }
    return out;
  }

 private:
  std::vector<Pixel> taken_around(int x, int y) {
    constexpr float kStep = 0.02f;  // of the depth
    std::vector<Pixel> out = {{depth_(x, y), x, y}};
    left_(x, y) = 0;
    for (size_t i = 0; i < out.size(); ++i) {
      const Pixel at = out[i];
      for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const int u = at.x + dx;
        const int v = at.y + dy;
        if (!left_.contains(u, v) || left_(u, v) == 0) continue;
        if (std::abs(depth_(u, v) - at.depth) > kStep * at.depth) continue;
        left_(u, v) = 0;
        out.push_back({depth_(u, v), u, v});
      }
    }
    return out;
  }

  const DepthMap& depth_;
  MaskMap left_;
};

// The pixels of a view whose depth lies within its 1st and 99th percentile, and of those beyond
// what hangs together as no false match does: a finial before a wall, say.
std::vector<Pixel> trustworthy_pixels(const TsdfView& view, double depth_trunc) {
  std::vector<Pixel> pixels;
  std::vector<float> depths;
  for (int y = 0; y < view.depth.height; ++y) {
    for (int x = 0; x < view.depth.width; ++x) {
      const float d = view.depth(x, y);
      if (!std::isfinite(d) || d <= 0 || (depth_trunc > 0 && d > depth_trunc)) continue;
      if (!view.usable.empty() && view.usable(x, y) == 0) continue;
      pixels.push_back({d, x, y});
      depths.push_back(d);
    }
  }
  if (pixels.empty()) return pixels;
  const float low = nth_smallest(depths, (depths.size() - 1) / 100);
  const float high = nth_smallest(depths, (depths.size() - 1) * 99 / 100);
  MaskMap beyond(view.depth.width, view.depth.height, 0);
  for (const Pixel& p : pixels) {
    const bool is_measured =
        view.evidence.empty() || view.evidence(p.x, p.y) == DepthEvidence::Measured;
    beyond(p.x, p.y) = is_measured && (p.depth < low || p.depth > high) ? 1 : 0;
  }
  const size_t least = std::max<size_t>(16, pixels.size() / 500);
  std::erase_if(pixels, [&](const Pixel& p) { return p.depth < low || p.depth > high; });
  const std::vector<Pixel> patches = Patches(view.depth, std::move(beyond)).of_size(least);
  pixels.insert(pixels.end(), patches.begin(), patches.end());
  return pixels;
}

// What one view adds to it.
struct ViewExtent {
  Eigen::AlignedBox3d surface;
  size_t pixels = 0;
  std::vector<double> footprints, sigmas;
};

// Footprints and sigmas are those of at most `most` pixels, evenly spaced.
ViewExtent view_extent(const TsdfView& view, double depth_trunc, size_t most) {
  ViewExtent out;
  out.pixels = view.depth.data.size();
  const size_t stride = 1 + (out.pixels - 1) / most;
  size_t i = 0;
  for (const Pixel& p : trustworthy_pixels(view, depth_trunc)) {
    out.surface.extend(view.camera.unproject(p.x + 0.5, p.y + 0.5, double(p.depth)));
    if (i++ % stride != 0) continue;
    const float sigma = view.sigma.empty() ? 0 : view.sigma(p.x, p.y);
    if (sigma > 0) out.sigmas.push_back(double(sigma));
    out.footprints.push_back(view.camera.pixel_size(double(p.depth)));
  }
  return out;
}

double voxels_in(const Eigen::AlignedBox3d& surface, double voxel, double margin) {
  return ((surface.sizes().array() / voxel) + 2 * margin).prod();
}

}  // namespace

void validate_view(const TsdfView& v, size_t i) {
  const auto fits = [&](const auto& raster) {
    return raster.width == v.camera.width && raster.height == v.camera.height;
  };
  const bool ok = fits(v.depth) && (v.sigma.empty() || fits(v.sigma)) &&
                  (v.color.empty() || fits(v.color)) && (v.usable.empty() || fits(v.usable)) &&
                  (v.evidence.empty() || fits(v.evidence));
  require(ok && v.camera.width > 1 && v.camera.height > 1,
          "every raster must have the size of its camera, the view where one has not",
          i);
}

SurfaceExtent surface_extent(const FusionViews& views,
                             double depth_trunc,
                             size_t most_footprints,
                             const Progress& progress) {
  SurfaceExtent out;
  const size_t most = std::max(size_t{1}, most_footprints / views.size());
  std::vector<double> footprints;
  std::vector<double> sigmas;
  std::vector<ViewExtent> parts(kViewsAtOnce);
  for (size_t first = 0; first < views.size(); first += kViewsAtOnce) {
    const size_t last = std::min(first + kViewsAtOnce, views.size());
    views.each(first, last, false, [&](size_t i, const TsdfView& view) {
      parts[i - first] = view_extent(view, depth_trunc, most);
    });
    for (size_t i = first; i < last; ++i) {
      const ViewExtent& part = parts[i - first];
      out.surface.extend(part.surface);
      out.pixels += part.pixels;
      footprints.insert(footprints.end(), part.footprints.begin(), part.footprints.end());
      sigmas.insert(sigmas.end(), part.sigmas.begin(), part.sigmas.end());
    }
    report(progress, static_cast<double>(last) / static_cast<double>(views.size()));
  }
  require(!footprints.empty(), "fuse needs pixels with a depth, their number", 0);
  out.footprint = median(footprints);
  if (!sigmas.empty()) out.sigma = median(sigmas);
  return out;
}

double chosen_voxel_size(const SurfaceExtent& extent, const TsdfOptions& options) {
  if (options.voxel_size > 0) {
    // Coarser, what comes out is the shape of the voxels.
    constexpr double kLeastAcross = 4;
    Eigen::Vector3d sides = extent.surface.sizes();
    std::sort(sides.begin(), sides.end());
    const double across = sides[1] / options.voxel_size;
    if (!(across >= kLeastAcross)) {
      char text[160];  // NOLINT(modernize-avoid-c-arrays)
      std::snprintf(
          text,
          sizeof(text),
          "the voxels are too large: the surface that was seen is %.2g of them wide; make "
          "them %.2g times smaller",
          across,
          kLeastAcross / across);
      throw InvalidInput(text);
    }
    return options.voxel_size;
  }
  const double margin = double(options.truncation) + kFusionMargin;
  const auto limit = static_cast<double>(options.max_voxels);
  const double coarsest = options.coarsest_voxel > 0
                              ? std::max({options.coarsest_voxel, extent.footprint, extent.sigma})
                              : std::numeric_limits<double>::infinity();
  double voxel = extent.footprint;
  while (voxels_in(extent.surface, voxel, margin) > limit) voxel *= 1.02;
  return std::min(voxel, coarsest);
}

}  // namespace cgs
