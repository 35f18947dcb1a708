// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/draco_codec.h"

#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/sample_mesh.h"

namespace cgs::draco_codec_test {
namespace {

GlbPrimitive sphere() {
  TriangleMesh mesh = test::labelled_sphere();
  mesh.provenance.clear();
  return glb_primitives(mesh, {}).front();
}

const DracoGrid kGrid{{-0.5f, -0.5f, -0.5f}, 1.25f, 14};

TEST(DracoCompress, StaysWithinHalfACell) {
  double previous = 1;
  for (int bits = 4; bits <= kMaxDracoBits; ++bits) {
    const DracoGrid grid{kGrid.origin, kGrid.range, bits};
    const DracoPrimitive out = draco_compress(sphere(), grid, 5);
    EXPECT_LE(out.max_error, 0.8661 * grid.step() + 1e-7) << bits;
    EXPECT_LT(out.max_error, previous) << bits;
    EXPECT_EQ(out.faces, sphere().faces.size());
    previous = out.max_error;
  }
}

TEST(DracoCompress, KeepsEveryFaceAtEverySpeed) {
  for (int speed = 0; speed <= 10; ++speed) {
    const DracoPrimitive out = draco_compress(sphere(), kGrid, speed);
    EXPECT_EQ(out.faces, sphere().faces.size());
    EXPECT_EQ(out.vertices, sphere().positions.size());
    EXPECT_EQ(out.attribute_ids.size(), 5u);
  }
}

TEST(DracoCompress, KeepsTextureCoordinatesWithinATenthOfAPixel) {
  GlbPrimitive part = sphere();
  part.colors.clear();
  for (const Eigen::Vector3f& n : part.normals) {
    part.texcoords.emplace_back(0.5f + 0.5f * n.x(), 0.5f - 0.5f * n.y());
  }
  for (const Eigen::Vector2i& size : {Eigen::Vector2i(16, 9), {504, 378}, {4000, 6000}}) {
    part.texture_size = size;
    for (int speed = 0; speed <= 10; speed += 5) {
      const DracoPrimitive out = draco_compress(part, kGrid, speed);
      EXPECT_LE(out.max_texture_error, kDracoTextureError);
      EXPECT_GT(out.max_texture_error, kDracoTextureError / 16);  // no bits wasted
      EXPECT_EQ(out.attribute_ids.count("TEXCOORD_0"), 1u);
    }
  }
}

TEST(DracoCompress, TakesNonManifoldAndRandomTriangles) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-0.4f, 0.4f);
  for (int round = 0; round < 20; ++round) {
    GlbPrimitive soup;
    soup.name = "soup";
    for (int i = 0; i < 30; ++i) {
      soup.positions.emplace_back(place(random), place(random), place(random));
      soup.normals.push_back(Eigen::Vector3f::UnitZ());
    }
    std::uniform_int_distribution<uint32_t> corner(0, 29);
    while (soup.faces.size() < 100) {
      const std::array<uint32_t, 3> f = {corner(random), corner(random), corner(random)};
      if (f[0] != f[1] && f[1] != f[2] && f[2] != f[0]) soup.faces.push_back(f);
    }
    const DracoPrimitive out = draco_compress(soup, kGrid, 5);
    EXPECT_EQ(out.faces, 100u);
    EXPECT_GE(out.vertices, 30u);
  }
}

TEST(DracoCompress, CollapsesOntoOneCellWithoutLosingAFace) {
  const DracoGrid coarse{kGrid.origin, kGrid.range, 1};
  EXPECT_EQ(draco_compress(sphere(), coarse, 5).faces, sphere().faces.size());
}

TEST(DracoCompress, KeepsFacesSmallerThanACell) {
  // Many vertices per cell, and many so close to the border of two that rounding decides.
  TriangleMesh mesh = test::labelled_sphere(60, 120);
  mesh.provenance.clear();
  const GlbPrimitive dense = glb_primitives(mesh, {}).front();
  for (const int bits : {3, 5, 6, 7, 8}) {
    const DracoGrid grid{{-0.35f, -0.5f, -0.25f}, 0.8f, bits};
    EXPECT_EQ(draco_compress(dense, grid, 5).faces, dense.faces.size()) << bits;
  }
}

TEST(DracoCompress, NoticesAVertexTheGridDoesNotHold) {
  const DracoGrid small{{0, 0, 0}, 0.1f, 10};
  EXPECT_THROW(draco_compress(sphere(), small, 5), NumericalError);
}

TEST(DracoCompress, GivesEqualBytesForEqualInput) {
  EXPECT_EQ(draco_compress(sphere(), kGrid, 5).bytes, draco_compress(sphere(), kGrid, 5).bytes);
}

}  // namespace
}  // namespace cgs::draco_codec_test
