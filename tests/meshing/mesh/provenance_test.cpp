// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/provenance.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include <gtest/gtest.h>

#include "meshing/volume/fused_block.h"

namespace cgs::meshing_provenance_test {
namespace {

constexpr int kSide = 20;  // voxels
constexpr float kVoxel = 0.01f;
constexpr float kSigma = 0.002f;

// Of a column of voxels along z; nothing = no view shows it.
using Columns = std::function<std::optional<VoxelState>(int x, int y)>;

// A plane between the layers z = 0 and z = 1, by two photographs where it is occupied.
Volume planted(const Columns& state) {
  Volume out = empty_volume(kVoxel, {}, 3);
  for (int x = 0; x <= kSide; ++x) {
    for (int y = 0; y <= kSide; ++y) {
      const auto told = state(x, y);
      for (int z = -2; z <= 3 && told; ++z) {
        const openvdb::Coord at(x, y, z);
        out.tsdf->tree().setValueOn(at, (float(z) - 0.5f) * kVoxel);
        out.state->tree().setValueOn(at, int(*told));
        out.color->tree().setValueOn(at, openvdb::Vec3f(0.5f));
        const bool is_measured = *told == VoxelState::Occupied;
        out.support->tree().setValueOn(at, is_measured ? 2.0f : 0.0f);
        if (is_measured) out.sigma->tree().setValueOn(at, kSigma);
      }
    }
  }
  return out;
}

uint32_t vertex_at(int x, int y) { return uint32_t(y * kSide + x); }

// The plane, a vertex in the middle of every cell of voxels, looking along z.
TriangleMesh plane() {
  TriangleMesh out;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      out.vertices.emplace_back(kVoxel * Eigen::Vector3f(float(x) + 0.5f, float(y) + 0.5f, 0.5f));
      if (x + 1 == kSide || y + 1 == kSide) continue;
      const uint32_t far = vertex_at(x + 1, y + 1);
      out.faces.push_back({vertex_at(x, y), vertex_at(x + 1, y), far});
      out.faces.push_back({vertex_at(x, y), far, vertex_at(x, y + 1)});
    }
  }
  return out;
}

size_t count(const TriangleMesh& mesh, Provenance label) {
  return size_t(std::count(mesh.provenance.begin(), mesh.provenance.end(), label));
}

TEST(AnnotateVertices, EstimatedVoxelsGiveColourButNeitherSupportNorSigma) {
  TriangleMesh mesh = plane();
  const Volume volume = planted(
      [](int x, int) { return x < kSide / 2 ? VoxelState::Estimated : VoxelState::Occupied; });
  const VertexEvidence evidence = annotate_vertices(mesh, volume);
  for (const int x : {0, 5, 14, kSide - 1}) {
    const size_t v = vertex_at(x, 7);
    const bool is_estimated = x < kSide / 2;
    EXPECT_EQ(evidence.of_vertex[v], Evidence::Full) << x;
    EXPECT_EQ(evidence.is_estimated[v], is_estimated ? 1 : 0) << x;
    EXPECT_EQ(mesh.support[v], is_estimated ? 0 : 2) << x;
    EXPECT_EQ(std::isnan(mesh.sigma[v]), is_estimated) << x;
    EXPECT_TRUE(mesh.colors[v].allFinite());
  }
  // Between the two, sigma is a mean over what states one.
  for (const float sigma : mesh.sigma) EXPECT_TRUE(std::isnan(sigma) || sigma > 0.99f * kSigma);
}

TEST(AnnotateVertices, SigmaGrowsByHowFarAVertexLiesOffTheMeasuredSurface) {
  TriangleMesh mesh = plane();
  const uint32_t moved = vertex_at(5, 7);
  constexpr float kOff = 0.4f * kVoxel;
  mesh.vertices[moved].z() += kOff;
  annotate_vertices(mesh, planted([](int, int) { return VoxelState::Occupied; }));
  for (uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(mesh.sigma[v], v == moved ? std::hypot(kSigma, kOff) : kSigma, 1e-6f) << v;
  }
}

TEST(LabelFaces, OneEstimatedCornerMakesAFaceEstimated) {
  TriangleMesh mesh = plane();
  const Volume volume = planted(
      [](int x, int) { return x < kSide / 2 ? VoxelState::Estimated : VoxelState::Occupied; });
  const VertexEvidence evidence = annotate_vertices(mesh, volume);
  label_faces(mesh, evidence, 5 * kVoxel);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& face = mesh.faces[f];
    const bool is_estimated = std::any_of(
        face.begin(), face.end(), [&](uint32_t v) { return evidence.is_estimated[v] != 0; });
    ASSERT_EQ(mesh.provenance[f], is_estimated ? Provenance::Estimated : Provenance::Observed);
  }
  EXPECT_GT(count(mesh, Provenance::Estimated), mesh.faces.size() / 3);
  EXPECT_GT(count(mesh, Provenance::Observed), mesh.faces.size() / 3);
}

// How many faces of a plane with a small hole have each label, and how many bridge the hole.
struct Bridged {
  size_t bridging, interpolated, inferred;
};

Bridged bridged(const Columns& state) {
  const auto is_in_hole = [](int at) { return at >= 8 && at < 12; };
  TriangleMesh mesh = plane();
  const Volume volume = planted(
      [&](int x, int y) { return is_in_hole(x) && is_in_hole(y) ? std::nullopt : state(x, y); });
  const VertexEvidence evidence = annotate_vertices(mesh, volume);
  label_faces(mesh, evidence, 5 * kVoxel);
  Bridged out{0, count(mesh, Provenance::Interpolated), count(mesh, Provenance::Inferred)};
  for (const auto& face : mesh.faces) {
    out.bridging += std::any_of(face.begin(), face.end(), [&](uint32_t v) {
      return evidence.of_vertex[v] == Evidence::None;
    });
  }
  return out;
}

TEST(LabelFaces, WhatBridgesAHoleIsInterpolatedOnlyWhereItsWholeRimWasSeen) {
  const Bridged seen = bridged([](int, int) { return VoxelState::Occupied; });
  EXPECT_GT(seen.bridging, 20U);
  EXPECT_EQ(seen.interpolated, seen.bridging);
  EXPECT_EQ(seen.inferred, 0U);
  const Bridged estimated = bridged([](int, int) { return VoxelState::Estimated; });
  EXPECT_EQ(estimated.bridging, seen.bridging);
  EXPECT_EQ(estimated.inferred, estimated.bridging);
  EXPECT_EQ(estimated.interpolated, 0U);
  const Bridged half = bridged(
      [](int x, int) { return x < kSide / 2 ? VoxelState::Estimated : VoxelState::Occupied; });
  EXPECT_EQ(half.inferred, half.bridging);
  EXPECT_EQ(half.interpolated, 0U);
}

}  // namespace
}  // namespace cgs::meshing_provenance_test
