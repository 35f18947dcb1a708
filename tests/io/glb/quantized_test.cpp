// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/quantized.h"

#include <cmath>

#include <gtest/gtest.h>

#include "libcgs/core/srgb.h"
#include "tests/support/sample_mesh.h"

namespace cgs::glb_quantized_test {
namespace {

GlbPrimitive sphere_with_texture(const Eigen::Vector2i& size) {
  TriangleMesh mesh = test::labelled_sphere();
  mesh.provenance.clear();
  GlbPrimitive out = glb_primitives(mesh, {}).front();
  out.texture_size = size;
  for (const Eigen::Vector3f& n : out.normals) {
    out.texcoords.emplace_back(0.5f + 0.5f * n.x(), 0.5f - 0.5f * n.y());
  }
  return out;
}

Eigen::AlignedBox3f box_of(const GlbPrimitive& primitive) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : primitive.positions) box.extend(p);
  return box;
}

TEST(QuantizedGrid, IsTheCoarsestWithinTheError) {
  const GlbPrimitive sphere = sphere_with_texture({64, 64});
  const Eigen::AlignedBox3f box = box_of(sphere);
  for (const double wanted : {0.1, 3e-3, 1e-4}) {
    const QuantizedGrid grid = QuantizedGrid::within(wanted, box);
    const double half_diagonal = std::sqrt(3.0) / 2 * grid.step;
    EXPECT_LE(half_diagonal, wanted);
    EXPECT_GT(QuantizedGrid::around(box, grid.bits - 1).step * std::sqrt(3.0) / 2, wanted);
    EXPECT_LE(quantized(sphere, grid).max_error, half_diagonal + 1e-7);
  }
  EXPECT_EQ(QuantizedGrid::within(1e-9, box).bits, 16);  // as near as it goes
}

TEST(Quantized, LeavesLowBitsZeroThatNobodyNeeds) {
  for (const Eigen::Vector2i& size : {Eigen::Vector2i(16, 9), {504, 378}, {4000, 6000}}) {
    const GlbPrimitive sphere = sphere_with_texture(size);
    const QuantizedGrid grid = QuantizedGrid::around(box_of(sphere));
    const QuantizedPrimitive all = quantized(sphere, grid);
    const QuantizedPrimitive out = quantized(sphere, grid, {11, 0.1});
    EXPECT_LE(out.max_texture_error, 0.1);
    EXPECT_GT(out.max_texture_error, 0.1 / 8);
    for (size_t v = 0; v < out.colors.size(); ++v) {
      for (size_t k = 0; k < 4; ++k) {
        const int kept = out.colors[v].at(k);
        EXPECT_TRUE(kept % 32 == 0 || kept == 65535) << kept;
        const auto level = [](int value) { return 255 * srgb_from_linear(float(value) / 65535); };
        constexpr double kHalfPlaceOf11Bits = 0.81;  // at black
        EXPECT_NEAR(level(kept), level(all.colors[v].at(k)), kHalfPlaceOf11Bits);
      }
    }
    EXPECT_EQ(out.positions, all.positions);
  }
}

}  // namespace
}  // namespace cgs::glb_quantized_test
