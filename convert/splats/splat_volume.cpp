// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/render/thin_sheets.h"

namespace cgs {

namespace {

/// Leaves out what lies between the scene and cameras around it.
size_t drop_outside(Gaussians& g, const Eigen::Vector3d& center, double radius) {
  std::vector<uint8_t> keep(g.size());
  std::transform(g.position.begin(), g.position.end(), keep.begin(), [&](const auto& p) {
    return (p.template cast<double>() - center).norm() <= radius ? 1 : 0;
  });
  return keep_only(g, keep);
}

/// Mean normals over 5 x 5 pixels: single splats are not smooth.
NormalMap smooth_normals(const DepthMap& depth, const Camera& camera) {
  constexpr int kRadius = 2;
  constexpr float kSameSurface = 0.03f;
  const NormalMap sharp = normals_from_depth(depth, camera);
  NormalMap out(depth.width, depth.height, Eigen::Vector3f::Zero());
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int v = std::max(0, y - kRadius); v <= std::min(depth.height - 1, y + kRadius); ++v) {
        for (int u = std::max(0, x - kRadius); u <= std::min(depth.width - 1, x + kRadius); ++u) {
          const float step = std::abs(depth(u, v) - depth(x, y));
          if (step <= kSameSurface * depth(x, y)) sum += sharp(u, v);
        }
      }
      if (sum.norm() > 0) out(x, y) = sum.normalized();
    }
  });
  return out;
}

TsdfView seen_by(const Camera& camera, const Gaussians& gaussians, NormalMap& normal) {
  constexpr float kNothing = 0.05f;  // alpha below which there is nothing
  const RenderBuffers buffers = rasterize(gaussians, camera);
  TsdfView view;
  view.is_virtual = true;
  view.camera = camera;
  view.depth = buffers.median_depth;
  view.color = picture(buffers);
  normal = smooth_normals(buffers.depth, camera);
  for (size_t i = 0; i < view.depth.data.size(); ++i) {
    if (buffers.alpha.data[i] < kNothing) {
      view.depth.data[i] = std::numeric_limits<float>::infinity();
    }
  }
  return view;
}

/// The median size of a pixel on the surface, but no less than a part of the scene.
/// \throws NumericalError if no pixel shows a surface
double default_voxel(const std::vector<TsdfView>& views, double radius) {
  constexpr double kMostAcross = 320;
  std::vector<float> footprints;
  for (const TsdfView& view : views) {
    for (const float depth : view.depth.data) {
      if (std::isfinite(depth)) footprints.push_back(depth / static_cast<float>(view.camera.fx));
    }
  }
  const double smallest = 2 * radius / kMostAcross;
  if (footprints.empty()) {
    throw NumericalError("the splats are too few, too small or too transparent to show a surface");
  }
  return std::max(smallest, double{median(footprints)});
}

size_t thicken(std::vector<TsdfView>& views, std::vector<NormalMap>& normals, double thickness) {
  std::vector<SheetView> sheets;
  for (size_t i = 0; i < views.size(); ++i) {
    sheets.push_back({views[i].camera, std::move(views[i].depth), std::move(normals[i])});
  }
  size_t moved = 0;
  std::vector<DepthMap> depths = thickened_sheets(sheets, thickness, moved);
  for (size_t i = 0; i < views.size(); ++i) views[i].depth = std::move(depths[i]);
  return moved;
}

}  // namespace

SplatVolume splat_volume(Gaussians gaussians,
                         const Frame& frame,
                         const SplatVolumeRequest& request,
                         const Progress& progress) {
  constexpr double kAround = 1.2;     // of the radius that holds most splats
  constexpr double kPlateVoxels = 3;  // what the fusion keeps apart
  SplatVolume out;
  out.cameras = virtual_cameras(gaussians, request.cameras, part_of(progress, 0, 0.2));
  const VirtualCameras& virtual_views = out.cameras;
  if (!virtual_views.inside) {
    out.left_out = drop_outside(gaussians, virtual_views.center, kAround * virtual_views.radius);
  }
  std::vector<TsdfView> views;
  std::vector<NormalMap> normals(virtual_views.cameras.size());
  for (size_t i = 0; i < normals.size(); ++i) {
    report(progress, 0.2 + 0.4 * static_cast<double>(i) / static_cast<double>(normals.size()));
    views.push_back(seen_by(virtual_views.cameras[i], gaussians, normals[i]));
  }
  gaussians = {};  // their memory is the fusion's now
  TsdfOptions options;
  options.voxel_size = default_voxel(views, virtual_views.radius);
  if (!request.voxel_size.empty())
    options.voxel_size = parse_length(request.voxel_size, frame, "--voxel-size");
  options.memory_limit = memory_budget(request.memory_limit);
  out.two_sided = thicken(views, normals, kPlateVoxels * options.voxel_size);
  report(progress, 0.7);
  out.fused = fuse(views, options, part_of(progress, 0.7, 1));
  return out;
}

nlohmann::ordered_json splat_volume_to_json(const SplatVolume& volume, const Frame& frame) {
  const VirtualCameras& cameras = volume.cameras;
  nlohmann::ordered_json out = fusion_to_json(volume.fused.report, frame);
  out["virtual_cameras"] = {{"count", cameras.cameras.size()},
                            {"placement", cameras.inside ? "inside" : "outside"},
                            {"coverage", cameras.coverage},
                            {"coverage_of_other_placement", cameras.coverage_of_other_placement}};
  out["splats_left_out"] = volume.left_out;
  out["two_sided_pixels"] = volume.two_sided;
  return out;
}

}  // namespace cgs
