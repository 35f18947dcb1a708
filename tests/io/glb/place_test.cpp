// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/place.h"

#include <cmath>
#include <cstring>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "io/meshes/glb_reader.h"
#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_reader.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/glb_file.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"
#include "tests/support/temp_dir.h"
#include "tests/support/triangle_glb.h"

namespace cgs::place_test {
namespace {

using Json = nlohmann::json;

/// A scene in feet on the grid of a country, its second axis up.
Frame national_grid() {
  Frame out;
  out.scale = 64;
  out.origin = {512345.678, 5403210.125, 287.5};
  out.file_origin = out.origin;
  out.metres_per_unit = 0.3048;
  out.scale_source = ScaleSource::Assumed;
  out.up = Eigen::Vector3d::UnitY();
  return out;
}

Json json_of(const std::string& bytes) {
  uint32_t size = 0;
  std::memcpy(&size, bytes.data() + 12, sizeof size);
  return Json::parse(bytes.substr(20, size));
}

/// What a reader that knows glTF alone makes of the corners of POSITION: of all nodes, as the
/// specification has it, with its bounds as stored.
Eigen::AlignedBox3d box_by_nodes(const Json& json) {
  Eigen::AlignedBox3d out;
  for (const Json& node : json["nodes"]) {
    const auto numbers = [&](const char* key, std::vector<double> otherwise) {
      return node.value(key, std::move(otherwise));
    };
    const auto t = numbers("translation", {0, 0, 0});
    const auto r = numbers("rotation", {0, 0, 0, 1});
    const auto s = numbers("scale", {1, 1, 1});
    const Eigen::Affine3d matrix = Eigen::Translation3d(t[0], t[1], t[2]) *
                                   Eigen::Quaterniond(r[3], r[0], r[1], r[2]) *
                                   Eigen::Scaling(s[0], s[1], s[2]);
    for (const Json& primitive : json["meshes"][node["mesh"].get<size_t>()]["primitives"]) {
      const Json& a = json["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
      for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d p;
        for (int k = 0; k < 3; ++k) p[k] = a[(corner >> k & 1) != 0 ? "max" : "min"][size_t(k)];
        out.extend(matrix * p);
      }
    }
  }
  return out;
}

// The sphere has radius 0.4 around (0.05, -0.1, 0.15); glTF is in metres.
void expect_sphere(const Eigen::AlignedBox3d& found, const Frame& frame, double tolerance) {
  const Eigen::Vector3d middle = frame.world_from_internal({0.05, -0.1, 0.15});
  const double unit = frame.metres_per_unit;
  EXPECT_LT((found.center() - unit * middle).norm(), tolerance);
  EXPECT_LT((found.sizes() / 2 - Eigen::Vector3d::Constant(unit * frame.scale * 0.4)).norm(),
            tolerance);
}

TEST(GlbPlace, MeshesLieWhereTheirNodeSaysInEveryEncoding) {
  const test::TempDir dir;
  const Frame frame = national_grid();
  for (const auto& [name, encoding] : glb_encodings()) {
    write_glb(dir / "a.glb", test::labelled_sphere(), frame, {.encoding = encoding});
    const Json json = json_of(test::read_bytes(dir / "a.glb"));
    const bool is_exact = encoding == GlbEncoding::Plain;
    expect_sphere(box_by_nodes(json), frame, is_exact ? 3e-6 : 16 * 0.3048 / 8192);
    const Json zero = {0.0, 0.0, 0.0};
    EXPECT_EQ(json["asset"]["extras"]["origin_in_world"], zero) << name;
    const MeasurableFile back = read_mesh_file(dir / "a.glb");
    for (const Eigen::Vector3d& p : back.content.points) {
      const Eigen::Vector3d q =
          frame.internal_from_world(back.content.frame.world_from_internal(p));
      EXPECT_NEAR((q - Eigen::Vector3d(0.05, -0.1, 0.15)).norm(), 0.4, is_exact ? 2e-7 : 1e-4);
    }
  }
}

// What a micrometre is there: 5.4 million feet are 2^21 m, whose doubles are 2^-31 m apart.
TEST(GlbPlace, NationalCoordinatesKeepMicrometres) {
  const test::TempDir dir;
  const Frame frame = national_grid();
  write_glb(dir / "a.glb", test::labelled_sphere(), frame, {.encoding = GlbEncoding::Plain});
  const test::Glb glb = test::parse_glb(test::read_bytes(dir / "a.glb"));
  const TriangleMesh mesh = test::labelled_sphere();
  double worst = 0;
  for (const auto& position : glb.parts[0].values.at("POSITION")) {
    double nearest = 1e300;
    for (const Eigen::Vector3f& v : mesh.vertices) {
      const Eigen::Vector3d wanted = 0.3048 * frame.world_from_internal(v.cast<double>());
      nearest = std::min(nearest, (test::placed(glb, position) - wanted).norm());
    }
    worst = std::max(worst, nearest);
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(GlbPlace, SplatsLieOnTheMeshOfTheirScene) {
  const test::TempDir dir;
  const Frame frame = national_grid();
  const Eigen::Matrix3d y_up = y_up_from(Eigen::Vector3d::UnitZ());
  TriangleMesh mesh = test::labelled_sphere();
  Gaussians splats = test::varied_splats(int(mesh.vertices.size()), 0);
  splats.position = mesh.vertices;
  for (const bool local_origin : {false, true}) {
    write_splat_glb(dir / "s.glb", splats, frame, {.y_up = y_up, .local_origin = local_origin});
    write_glb(dir / "m.glb",
              mesh,
              frame,
              {.encoding = GlbEncoding::Plain, .y_up = y_up, .local_origin = local_origin});
    // The splats' node turns them, so that the corners of their box are those of a larger one.
    const Eigen::Vector3d s = box_by_nodes(json_of(test::read_bytes(dir / "s.glb"))).center();
    const Eigen::Vector3d m = box_by_nodes(json_of(test::read_bytes(dir / "m.glb"))).center();
    EXPECT_LT((s - m).norm(), 1e-5);
    EXPECT_EQ(m.norm() < 100, local_origin);
    for (const auto& p : read_splats(dir / "s.glb", frame).gaussians.position) {
      EXPECT_NEAR((p - Eigen::Vector3f(0.05f, -0.1f, 0.15f)).norm(), 0.4f, 1e-6f);
    }
  }
}

// So that viewers in single precision can show it; the file states where it is from.
TEST(GlbPlace, ALocalOriginIsThatOfTheFrame) {
  const test::TempDir dir;
  const Frame frame = national_grid();
  for (const auto& [name, encoding] : glb_encodings()) {
    write_glb(dir / "a.glb",
              test::labelled_sphere(),
              frame,
              {.encoding = encoding, .local_origin = true});
    const Json json = json_of(test::read_bytes(dir / "a.glb"));
    Frame near = frame;
    near.origin.setZero();
    expect_sphere(box_by_nodes(json), near, 16 * 0.3048 / 8192);
    const Json& stated = json["asset"]["extras"]["origin_in_world"];
    for (int k = 0; k < 3; ++k) EXPECT_EQ(stated[size_t(k)], frame.origin[k]) << name;
    const MeasurableFile back = read_mesh_file(dir / "a.glb");
    const Eigen::Vector3d p = back.content.frame.world_from_internal(back.content.points[0]);
    EXPECT_NEAR(
        (frame.internal_from_world(p) - Eigen::Vector3d(0.05, -0.1, 0.15)).norm(), 0.4, 1e-4)
        << name;
  }
}

/// The triangle as versions up to now wrote it: about its middle, its place in extras alone.
test::TriangleGlb of_before() {
  test::TriangleGlb out;
  out.json["asset"]["extras"] = {{"units", "m"},
                                 {"metres_per_unit", 0.5},
                                 {"metres_sigma", 0},
                                 {"scale_source", "assumed"},
                                 {"origin_in_world", {100, 200, 300}},
                                 {"gltf_from_world", {1, 0, 0, 0, 0, 1, 0, -1, 0}}};
  return out;
}

TEST(GlbPlace, FilesOfBeforeReturnToTheirPlace) {
  const auto second = [](const test::TriangleGlb& file) {
    return parse_glb(file.bytes(), "a.glb").parsed.positions[2];
  };
  // (0, 2, 0) m is up, +z of the world, whose unit is half a metre: 4 units.
  test::TriangleGlb plain = of_before();
  EXPECT_LT((second(plain) - Eigen::Vector3d(100, 200, 304)).norm(), 1e-12);
  // Quantised ones had a node already, which says where the grid lies.
  plain.json["nodes"][0]["translation"] = {1, 0, 0};
  plain.json["nodes"][0]["scale"] = {0.25, 0.25, 0.25};
  EXPECT_LT((second(plain) - Eigen::Vector3d(102, 200, 301)).norm(), 1e-12);
  // The same place as it is written now.
  plain.json["asset"]["extras"]["origin_in_world"] = {0, 0, 0};
  plain.json["nodes"][0]["translation"] = {51, 150, -100};
  EXPECT_LT((second(plain) - Eigen::Vector3d(102, 200, 301)).norm(), 1e-12);
}

}  // namespace
}  // namespace cgs::place_test
