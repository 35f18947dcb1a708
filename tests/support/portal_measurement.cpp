// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/portal_measurement.h"

#include <algorithm>
#include <limits>

#include "io/meshes/mesh_ply.h"
#include "libcgs/render/support.h"
#include "tests/support/exr_channel.h"

namespace cgs::test {

namespace {

// Z of the file with its zeros, which stand for unknown, as NaN.
DepthMap depth_of(const ExrImage& image, const std::filesystem::path& path) {
  DepthMap depth(image.width, image.height, 0);
  depth.data = channel(image, "Z", path);
  for (float& z : depth.data) {
    if (z == 0) z = std::numeric_limits<float>::quiet_NaN();
  }
  return depth;
}

MaskMap holes_of(const ExrImage& image, const std::filesystem::path& path) {
  MaskMap holes(image.width, image.height, 0);
  const std::vector<float>& values = channel(image, "hole.Y", path);
  for (size_t i = 0; i < values.size(); ++i) holes.data[i] = values[i] > 0.5f;
  return holes;
}

// The mask of a surface that lies where it truly does, judged by input views whose depth is exact.
MaskMap holes_with_exact_depth(const ViewTruth& truth,
                               const Camera& camera,
                               std::span<const SupportView> inputs) {
  RenderBuffers buffers;
  buffers.alpha = Raster<float>(camera.width, camera.height, 1.0f);
  buffers.depth = truth.depth;
  buffers.median_depth = truth.depth;
  annotate_support(buffers, camera, inputs);
  MaskMap holes(camera.width, camera.height, 0);
  for (size_t i = 0; i < holes.data.size(); ++i) holes.data[i] = is_hole(buffers.hole.data[i]);
  return holes;
}

double fraction(const MaskMap& mask) {
  size_t set = 0;
  for (const uint8_t value : mask.data) set += value;
  return double(set) / double(mask.data.size());
}

// 1 where the 5 x 5 pixels around hold both set and unset ones.
MaskMap border_band(const MaskMap& mask) {
  MaskMap band(mask.width, mask.height, 0);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      for (int v = std::max(y - 2, 0); v <= std::min(y + 2, mask.height - 1); ++v) {
        for (int u = std::max(x - 2, 0); u <= std::min(x + 2, mask.width - 1); ++u) {
          band(x, y) |= mask(u, v) != mask(x, y);
        }
      }
    }
  }
  return band;
}

// 1 for set pixels that no 3 x 3 block of set pixels covers.
MaskMap narrow_parts(const MaskMap& mask) {
  MaskMap narrow = mask;
  for (int y = 1; y + 1 < mask.height; ++y) {
    for (int x = 1; x + 1 < mask.width; ++x) {
      bool whole = true;
      for (int k = 0; k < 9; ++k) whole = whole && mask(x - 1 + k % 3, y - 1 + k / 3) != 0;
      if (!whole) continue;
      for (int k = 0; k < 9; ++k) narrow(x - 1 + k % 3, y - 1 + k / 3) = 0;
    }
  }
  return narrow;
}

/// Masks found and expected, and what they share, in pixels summed over views.
struct Overlap {
  size_t found = 0;
  size_t expected = 0;
  size_t both = 0;
  double iou() const { return share_of(found + expected - both); }
  double precision() const { return share_of(found); }
  double recall() const { return share_of(expected); }

 private:
  double share_of(size_t pixels) const { return pixels == 0 ? 1 : double(both) / double(pixels); }
};

void add_overlap(Overlap& sum,
                 const MaskMap& found,
                 const MaskMap& expected,
                 const MaskMap* ignored) {
  for (size_t i = 0; i < found.data.size(); ++i) {
    if (ignored != nullptr && ignored->data[i] != 0) continue;
    sum.found += found.data[i];
    sum.expected += expected.data[i];
    sum.both += found.data[i] & expected.data[i];
  }
}

TriangleMesh in_world(MeshFile file) {
  for (Eigen::Vector3f& v : file.mesh.vertices) {
    v = file.frame.world_from_internal(v.cast<double>()).cast<float>();
  }
  return std::move(file.mesh);
}

}  // namespace

PortalMeasurement measure_portal(const std::filesystem::path& run_folder) {
  const PortalScene scene = portal_scene();
  const std::vector<CaptureView> views = capture_views();
  const std::vector<Camera> inputs = input_cameras(views);
  std::vector<SupportView> exact;
  for (const Camera& camera : inputs) exact.push_back({camera, exact_depth(scene, camera), {}, {}});
  PortalMeasurement out;
  Overlap all;
  Overlap best;
  Overlap inside;
  Overlap wide;
  double narrow_area = 0;
  double hole_area = 0;
  for (const CaptureView& view : views) {
    const std::filesystem::path path = run_folder / "views" / (view.name + ".exr");
    const ExrImage image = read_exr(path);
    const ViewTruth truth = view_truth(scene, view.camera, inputs);
    if (view.input) {
      out.inputs.push_back({view.name, depth_accuracy(depth_of(image, path), truth)});
      out.depth_within_1_percent += out.inputs.back().depth_within_1_percent / 3;
      continue;
    }
    const MaskMap holes = holes_of(image, path);
    const MaskMap expected = true_holes(truth);
    out.held_out.push_back(
        {view.name, fraction(expected), fraction(holes), mask_iou(holes, expected)});
    const MaskMap band = border_band(expected);
    add_overlap(all, holes, expected, nullptr);
    add_overlap(best, holes_with_exact_depth(truth, view.camera, exact), expected, nullptr);
    add_overlap(inside, holes, expected, &band);
    const MaskMap narrow = narrow_parts(expected);
    add_overlap(wide, holes, expected, &narrow);
    narrow_area += fraction(narrow);
    hole_area += fraction(expected);
  }
  out.hole_iou = all.iou();
  out.hole_precision = all.precision();
  out.hole_recall = all.recall();
  out.hole_iou_of_exact_depth = best.iou();
  out.hole_iou_inside = inside.iou();
  out.hole_iou_wide = wide.iou();
  out.narrow_hole_share = narrow_area / hole_area;
  out.volume = observed_volume_error(
      scene, inputs, in_world(read_mesh_ply(run_folder / "mesh/watertight.ply")));
  return out;
}

}  // namespace cgs::test
