// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/thickness_figures.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/meshes/mesh_ply.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs::thickness_figures_test {
namespace {

TEST(ThicknessFigures, AreInTheUnitAskedForAndNullWithoutSamples) {
  ThicknessSummary summary;
  summary.samples = 10;
  summary.seen = {1, 0.1, 0.2, 0.3, 0.35, 0.5, 0.6};
  const FigureUnit millimetres{"mm", 1000, 0};
  const auto json = thickness_json(summary, millimetres);
  EXPECT_DOUBLE_EQ(json["seen"]["median"].get<double>(), 300);
  EXPECT_DOUBLE_EQ(json["seen"]["share"].get<double>(), 1);
  EXPECT_TRUE(json["unseen"].is_null());
  EXPECT_EQ(thickness_text(summary.seen, millimetres),
            "median 300 mm, 5 % below 200 and 5 % above 500, 100 to 600 (100.0 % of the surface)");
  EXPECT_EQ(thickness_text(summary.unseen, millimetres), "none");
}

TEST(ThicknessFigures, ThePlyHasColoursAndScalarsInWorldUnits) {
  const test::TempDir dir;
  MeasurableMesh mesh = test::cube_mesh(0.5);
  mesh.frame.scale = 4;
  VertexThickness thickness;
  for (int i = 0; i < 8; ++i) thickness.value.push_back(0.1f * float(i));
  thickness.value[3] = std::nanf("");
  thickness.is_unseen = {0, 0, 0, 1, 0, 0, 0, 1};
  write_thickness_ply(dir / "a.ply", mesh, thickness);
  const std::string bytes = test::read_bytes(dir / "a.ply");
  EXPECT_NE(bytes.find("property float scalar_thickness\n"), std::string::npos);
  EXPECT_NE(bytes.find("property float scalar_thickness_unseen\n"), std::string::npos);
  const TriangleMesh read = read_mesh_ply(dir / "a.ply").mesh;
  ASSERT_EQ(read.colors.size(), 8U);
  EXPECT_GT(read.colors[0].x(), 2 * read.colors[0].y());       // thin is red
  EXPECT_GT(read.colors[7].y(), 0.9f);                         // thick is yellow
  EXPECT_NEAR(read.colors[3].x(), read.colors[3].z(), 0.01f);  // unknown is grey
}

}  // namespace
}  // namespace cgs::thickness_figures_test
