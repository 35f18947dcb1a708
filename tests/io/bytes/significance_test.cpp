// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/significance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "io/meshes/mesh_file.h"
#include "io/splats/splat_reader.h"
#include "tests/support/scene_files.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/splat_ply.h"
#include "tests/support/temp_dir.h"

namespace cgs::significance_test {
namespace {

using test::defect_of;
using test::message_of;

const Eigen::Vector3d kUtm(4.5e5, 5.4e6, 100);

Eigen::AlignedBox3d box_at(double extent, const Eigen::Vector3d& place) {
  return {place, place + Eigen::Vector3d::Constant(extent)};
}

TEST(CheckSignificance, RefusesAtTheNumberOfStepsThatFitIntoTheBox) {
  // 5.4e6 is stored in steps of 2^-30: 2^20 of them are 2^-10.
  for (const double factor : {0.99, 0.5, 1e-3}) {
    const auto check = [&] { check_significance("a", box_at(factor * 0x1p-10, kUtm), 53); };
    EXPECT_EQ(defect_of(check), "VALUE") << factor;
    EXPECT_NE(message_of(check).find("significant bits"), std::string::npos);
  }
  EXPECT_EQ(check_significance("a", box_at(1.01 * 0x1p-10, kUtm), 53), "");
  const auto message = message_of([] { check_significance("a", box_at(0x1p-18, kUtm), 53); });
  EXPECT_NE(message.find("only 12 significant bits"), std::string::npos) << message;
}

TEST(CheckSignificance, WarnsOfFloatsBeforeItRefusesThem) {
  // In steps of 1/2.
  EXPECT_EQ(defect_of([] { check_significance("a", box_at(500, kUtm), 24); }), "VALUE");
  EXPECT_NE(check_significance("a", box_at(2000, kUtm), 24).find("only 11 significant bits"),
            std::string::npos);
  EXPECT_EQ(check_significance("a", box_at(10000, kUtm), 24), "");
}

TEST(CheckSignificance, PassesWhatLiesAtTheOriginAndWhatHasNoExtent) {
  for (const double extent : {1e-30, 1e-6, 1.0, 1e12}) {
    EXPECT_EQ(check_significance("a", box_at(extent, Eigen::Vector3d::Zero()), 24), "");
    EXPECT_EQ(check_significance("a", box_at(extent, extent * kUtm.normalized()), 24), "");
  }
  EXPECT_EQ(check_significance("a", box_at(0, kUtm), 24), "");
  EXPECT_EQ(check_significance("a", box_at(0, Eigen::Vector3d::Zero()), 24), "");
}

// The same sphere of half a metre in the formats that meshes come in, where 2 m are worth 4 floats.
TEST(CheckSignificance, KnowsHowFormatsStoreCoordinates) {
  const test::TempDir dir;
  const auto sphere = test::sphere_mesh(1, 8, 16);
  std::string off = "OFF\n" + std::to_string(sphere.points.size()) + " " +
                    std::to_string(sphere.mesh.faces.size()) + " 0\n";
  std::string singles;
  std::string doubles;
  for (const Eigen::Vector3d& p : sphere.points) {
    const Eigen::Vector3d q = p + kUtm;
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "%.17g %.17g %.17g\n", q.x(), q.y(), q.z());
    off += line.data();
    singles += test::packed(float(q.x()), float(q.y()), float(q.z()));
    doubles += test::packed(q.x(), q.y(), q.z());
  }
  std::string faces;
  std::string facets;
  for (const auto& f : sphere.mesh.faces) {
    off += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
           "\n";
    faces += test::packed(uint8_t{3}, f[0], f[1], f[2]);
    facets += std::string(12, '\0');
    for (const uint32_t corner : f) facets += singles.substr(12 * size_t{corner}, 12);
    facets += std::string(2, '\0');
  }
  const auto ply = [&](const std::string& type, const std::string& vertices) {
    return "ply\nformat binary_little_endian 1.0\nelement vertex " +
           std::to_string(sphere.points.size()) + "\nproperty " + type + " x\nproperty " + type +
           " y\nproperty " + type + " z\nelement face " + std::to_string(sphere.mesh.faces.size()) +
           "\nproperty list uchar int vertex_index\nend_header\n" + vertices + faces;
  };
  test::write_bytes(dir / "text.off", off);
  test::write_bytes(dir / "doubles.ply", ply("double", doubles));
  test::write_bytes(dir / "singles.ply", ply("float", singles));
  test::write_bytes(
      dir / "singles.stl",
      std::string(80, ' ') + test::packed(uint32_t(sphere.mesh.faces.size())) + facets);
  EXPECT_EQ(defect_of([&] { read_mesh_file(dir / "singles.ply"); }), "VALUE");
  EXPECT_EQ(defect_of([&] { read_mesh_file(dir / "singles.stl"); }), "VALUE");
  EXPECT_TRUE(read_mesh_file(dir / "doubles.ply").warnings.empty());
  EXPECT_TRUE(read_mesh_file(dir / "text.off").warnings.empty());
}

// Splats as other programs would write them where no origin is told.
std::string splats_at(const Eigen::Vector3d& place, double extent) {
  std::string out = test::splat_ply_header("binary_little_endian", 27);
  const auto log_scale = float(std::log(extent / 10));
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d p = place + extent / 2 * Eigen::Vector3d(i % 3, i / 3 % 3, i / 9);
    out +=
        test::packed(float(p.x()), float(p.y()), float(p.z()), 0.1f, 0.2f, 0.3f, 2.0f * float(i));
    out += test::packed(log_scale, log_scale, log_scale, 1.0f, 0.0f, 0.0f, 0.0f);
  }
  return out;
}

TEST(CheckSignificance, KnowsSplatsThatRoundingHasMoved) {
  const test::TempDir dir;
  for (const double extent : {1e-6, 1e-3, 1.0, 100.0}) {
    test::write_bytes(dir / "far.ply", splats_at(kUtm, extent));
    EXPECT_EQ(defect_of([&] { read_splats(dir / "far.ply"); }), "VALUE") << extent;
    test::write_bytes(dir / "near.ply", splats_at(extent * Eigen::Vector3d(1, 2, 3), extent));
    for (const std::string& warning : read_splats(dir / "near.ply").warnings) {
      EXPECT_EQ(warning.find("significant"), std::string::npos) << warning;
    }
  }
}

}  // namespace
}  // namespace cgs::significance_test
