// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/portal_measurement.h"

#include <limits>

#include "io/exr.h"
#include "io/mesh_ply.h"
#include "libcgs/core/error.h"

namespace cgs::test {

namespace {

const std::vector<float>& channel(const ExrImage& image,
                                  const std::string& name,
                                  const std::filesystem::path& path) {
  const std::vector<float>* values = image.find(name);
  if (values == nullptr) throw BadInput(Defect::Schema, path, "has no channel " + name);
  return *values;
}

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

double fraction(const MaskMap& mask) {
  size_t set = 0;
  for (const uint8_t value : mask.data) set += value;
  return double(set) / double(mask.data.size());
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
  PortalMeasurement out;
  MaskMap all_true(views[0].camera.width, 0, 0);
  MaskMap all_found = all_true;
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
    all_true.data.insert(all_true.data.end(), expected.data.begin(), expected.data.end());
    all_found.data.insert(all_found.data.end(), holes.data.begin(), holes.data.end());
    all_true.height += expected.height;
    all_found.height += holes.height;
  }
  out.hole_iou = mask_iou(all_true, all_found);
  out.volume = observed_volume_error(
      scene, inputs, in_world(read_mesh_ply(run_folder / "mesh/watertight.ply")));
  return out;
}

}  // namespace cgs::test
