// SPDX-License-Identifier: GPL-3.0-or-later
// What a run calls evidence, against the truth of a scene that stereo cannot measure everywhere:
// sky, bars before it, a white wall, a room behind glass.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/measure/measured_file.h"
#include "meshing/mesh/mesh_distance.h"
#include "samples/capture/courtyard.h"
#include "samples/capture/files.h"
#include "tests/support/run_cgs.h"
#include "tests/support/temp_dir.h"

namespace cgs {
namespace {

using nlohmann::ordered_json;
using test::run_cgs;

// In metres, in the world of the scene.
struct Surface {
  TriangleMesh mesh;

  explicit Surface(const std::filesystem::path& path) {
    const MeasurableMesh file = read_measured(path, "").content;
    mesh = file.mesh;
    for (size_t v = 0; v < mesh.vertices.size(); ++v) {
      mesh.vertices[v] = file.frame.world_from_internal(file.points[v]).cast<float>();
    }
    for (float& sigma : mesh.sigma) sigma *= static_cast<float>(file.frame.scale);
  }
  double sigma(uint32_t face) const {
    double sum = 0;
    for (const uint32_t v : mesh.faces[face]) sum += double(mesh.sigma[v]) / 3;
    return sum;  // NaN where a corner states none
  }
};

struct Right {
  size_t count = 0;
  size_t right = 0;
  double share() const { return double(right) / double(count); }
};

// Places by label, and how many of them lie within 3 sigma or two voxels of the true surface.
std::array<Right, kProvenanceCount> judged(const Surface& surface,
                                           const TriangleMesh& truth,
                                           double voxel) {
  const SurfaceSamples samples = sample_faces(surface.mesh, 100'000);
  const std::vector<float> distances = DistanceToMesh(truth).of(samples.points);
  std::array<Right, kProvenanceCount> out;
  for (size_t i = 0; i < distances.size(); ++i) {
    const uint32_t face = samples.faces[i];
    Right& of_label = out.at(static_cast<size_t>(surface.mesh.provenance[face]));
    ++of_label.count;
    const double allowed = std::fmax(3 * surface.sigma(face), 2 * voxel);  // NaN counts for nothing
    of_label.right += double(distances[i]) <= allowed ? 1 : 0;
  }
  return out;
}

// Share of the vertices of an open surface that a view sees well within its true sky.
double share_before_sky(const TriangleMesh& mesh, const Camera& camera, const DepthMap& truth) {
  constexpr int kRim = 3;  // [pixels]
  size_t seen = 0;
  size_t in_sky = 0;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const Eigen::Vector3d uvz = camera.project(p.cast<double>());
    if (!camera.sees(uvz)) continue;
    ++seen;
    bool is_sky = true;
    for (int y = int(uvz.y()) - kRim; y <= int(uvz.y()) + kRim; ++y) {
      for (int x = int(uvz.x()) - kRim; x <= int(uvz.x()) + kRim; ++x) {
        is_sky = is_sky && (!truth.contains(x, y) || std::isnan(truth(x, y)));
      }
    }
    in_sky += is_sky ? 1 : 0;
  }
  return double(in_sky) / double(seen);
}

TEST(Evidence, IsRightInASceneThatStereoCannotMeasureEverywhere) {
  const test::TempDir dir;
  const std::filesystem::path folder = dir / "";
  const PortalScene scene = courtyard_scene();
  const std::vector<CaptureView> views = courtyard_views(2);
  write_capture(folder / "capture", scene, views, input_cameras(views));
  const std::string model = (folder / "model").string();
  const std::string volume = (folder / "volume.vdb").string();
  const auto trained =
      run_cgs("train " + (folder / "capture").string() +
              " --views view_01,view_02,view_03 --assume-unit m --set steps=0 -o " + model);
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  EXPECT_NE(trained.err.find("% is sky"), std::string::npos) << trained.err;
  const auto fused = run_cgs("fuse " + model + " --estimated keep --json -q -o " + volume);
  ASSERT_EQ(fused.exit_code, 0) << fused.err;
  const double voxel = ordered_json::parse(fused.out).at("voxel_size").get<double>();
  ASSERT_EQ(run_cgs("mesh " + volume + " -q -o " + (folder / "mesh").string()).exit_code, 0);

  const Surface closed(folder / "mesh/watertight.ply");
  const auto by_label = judged(closed, scene.mesh, voxel);
  const Right& observed = by_label.at(size_t(Provenance::Observed));
  const Right& single = by_label.at(size_t(Provenance::SingleView));
  const Right both{observed.count + single.count, observed.right + single.right};
  EXPECT_GE(both.share(), 0.98);
  EXPECT_GT(by_label.at(size_t(Provenance::Estimated)).count, 0U) << "of the white wall";
  const auto measured =
      run_cgs("measure " + (folder / "mesh/watertight.ply").string() + " --area --json");
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const ordered_json area = ordered_json::parse(measured.out).at("figures").at("area");
  const double value = area.at("value").get<double>();
  const double unmeasured = area.at("estimated").get<double>() + area.at("inferred").get<double>();
  EXPECT_LE(area.at("sigma_share").get<double>() * value, value - unmeasured + 1e-6 * value);

  const Surface open(folder / "mesh/surface.ply");
  for (const CaptureView& view : views) {
    if (!view.input) continue;
    const DepthMap truth = exact_depth(scene, view.camera);
    EXPECT_LE(share_before_sky(open.mesh, view.camera, truth), 0.01) << view.name;
  }
}

}  // namespace
}  // namespace cgs
