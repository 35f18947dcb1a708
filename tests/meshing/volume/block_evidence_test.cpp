// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/block_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/srgb.h"
#include "meshing/volume/depth_field.h"
#include "tests/support/depth_scenes.h"
#include "tests/support/fused_volumes.h"

namespace cgs::block_evidence_test {
namespace {

using Eigen::Vector3d;
using test::expect_same;
using test::source_of;

// What all views say about a voxel, one after the other, as tsdf.h defines it.
struct SlowVoxel {
  double weight = 0, distance = 0, spread = 0, variance = 0, color_weight = 0;
  Vector3d color = Vector3d::Zero();
  float free_weight = 0;
  int count = 0, known = 0, known_behind = 0;
  bool is_free = false, is_hidden = false, is_measured = false;
  bool is_adjoining = false, is_estimated = false, has_sigma = true;

  // Whether it adds to what is measured.
  bool takes(const PointObservation& s) const {
    return s.sight == Sight::Band && !(s.is_assumed && is_measured);
  }
  void add(const PointObservation& s, const TsdfView& view, bool is_behind) {
    is_free |= s.sight == Sight::Free;
    is_hidden |= s.sight == Sight::Hidden;
    if (s.sight == Sight::Free) free_weight += s.weight;
    if (!takes(s)) return;
    if (!s.is_assumed && !is_measured) {
      *this = {.free_weight = free_weight, .is_free = is_free, .is_hidden = is_hidden};
      is_measured = true;
    }
    const auto w = double(s.weight);
    const auto d = double(s.distance);
    const auto sigma = double(s.sigma);
    const DepthEvidence evidence =
        view.evidence.empty() ? DepthEvidence::Measured : view.evidence(s.x, s.y);
    weight += w;
    distance += w * d;
    spread += w * d * d;
    variance += w * w * sigma * sigma;
    ++count;
    (is_behind ? known_behind : known) +=
        !view.is_virtual && evidence == DepthEvidence::Measured ? 1 : 0;
    is_adjoining |= evidence == DepthEvidence::Adjoining;
    is_estimated |= evidence == DepthEvidence::Estimated;
    has_sigma &= sigma > 0;
    if (view.color.empty()) return;
    color_weight += w;
    color += w * view.color(s.x, s.y).cast<double>();
  }
  bool is_seen() const { return weight > 0; }
  int support() const { return std::max({known, known_behind, is_adjoining ? 1 : 0}); }
  bool is_estimate() const { return is_estimated && support() == 0; }
  bool is_carved() const { return is_seen() && distance < 0 && double(free_weight) > weight; }
  double sigma() const {
    const double promised = variance / (weight * weight);
    if (count < 2) return std::sqrt(promised);
    const double mean = distance / weight;
    const double between = std::max(0.0, spread / weight - mean * mean) / (count - 1);
    return std::sqrt(std::max(promised, between));
  }
};

void expect_voxel(const Volume& volume, const openvdb::Coord& at, const SlowVoxel& slow) {
  const auto state = static_cast<VoxelState>(volume.state->tree().getValue(at));
  const bool is_occupied = slow.is_seen() && !slow.is_carved();
  ASSERT_EQ(volume.tsdf->tree().isValueOn(at), is_occupied);
  if (!is_occupied) {
    const bool is_hidden = slow.is_hidden || (slow.is_seen() && slow.distance < 0);
    ASSERT_EQ(state, slow.is_free ? VoxelState::Free : VoxelState::NeverSeen);
    ASSERT_EQ(volume.state->tree().isValueOn(at), slow.is_free || is_hidden);
    return;
  }
  ASSERT_EQ(state, slow.is_estimate() ? VoxelState::Estimated : VoxelState::Occupied);
  ASSERT_EQ(volume.tsdf->tree().getValue(at), static_cast<float>(slow.distance / slow.weight));
  ASSERT_EQ(volume.weight->tree().getValue(at), static_cast<float>(slow.weight));
  ASSERT_EQ(volume.support->tree().getValue(at), slow.support());
  const bool has_sigma = slow.has_sigma && !slow.is_estimate();
  ASSERT_EQ(volume.sigma->tree().isValueOn(at), has_sigma);
  if (has_sigma) {
    ASSERT_EQ(volume.sigma->tree().getValue(at), static_cast<float>(slow.sigma()));
  }
  ASSERT_EQ(volume.color->tree().isValueOn(at), slow.color_weight > 0);
  if (slow.color_weight <= 0) return;
  const Eigen::Vector3f c = (slow.color / slow.color_weight).cast<float>();
  ASSERT_EQ(
      volume.color->tree().getValue(at),
      openvdb::Vec3f(linear_from_srgb(c.x()), linear_from_srgb(c.y()), linear_from_srgb(c.z())));
}

// A thin sheet, a ball and a wall, from random places, with noise, holes, masks, depth of one view
// alone and a patch in front that the other views see through.
std::vector<TsdfView> random_views(uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * double(random()) / 4294967296.0;
  };
  const auto shape = test::nearest({test::box({-0.25, -0.2, 0.1}, {0.25, 0.2, 0.112}),
                                    test::sphere({uniform(-0.1, 0.1), 0, -0.1}, 0.12),
                                    test::plane({0.1, 0.1, 1}, 0.35)});
  std::vector<TsdfView> views;
  for (int i = 0; i < 6; ++i) {
    const Vector3d eye(uniform(-0.8, 0.8), uniform(-0.5, 0.5), i == 5 ? 0.3 : -0.8);
    views.push_back(test::photographed(shape, test::camera_at(eye, {0, 0, 0.1}, 60 + i)));
    TsdfView& view = views.back();
    const auto raster = [&](auto value) {
      return Raster<decltype(value)>(view.camera.width, view.camera.height, value);
    };
    test::spoil(view, 0.01, random());
    if (i % 2 == 0) view.sigma = raster(0.006f);
    if (i == 1) view.color = {};
    if (i == 2) view.is_virtual = true;
    if (i == 3 || i == 5) {
      view.evidence = raster(DepthEvidence::Measured);
      for (int y = 0; y < view.camera.height; ++y) {
        for (int x = 32; x < view.camera.width; ++x) {
          view.evidence(x, y) = DepthEvidence::Estimated;
        }
      }
    }
    if (i == 4) view.usable = raster(uint8_t{1});
    for (int y = 10; y < 20; ++y) {
      for (int x = 15; x < 30; ++x) {
        if (i == 0) view.depth(x, y) *= 0.8f;
        if (i == 3) view.evidence(x, y) = DepthEvidence::Adjoining;
        if (i == 4) view.usable(x, y) = 0;
        if (i == 5) view.depth(x, y) = INFINITY;
        if (i == 1 && x < 19) view.depth(x, y) = std::nanf("");
      }
    }
  }
  return views;
}

// Which views look at a block of voxels from the other side than the first photograph that measures
// in it.
std::vector<bool> views_from_behind(const openvdb::Coord& origin,
                                    double voxel,
                                    const std::vector<TsdfView>& views,
                                    std::vector<DepthField>& fields) {
  const auto position = [&](int x, int y, int z) -> Eigen::Vector3f {
    return (voxel * Vector3d(origin.x() + x, origin.y() + y, origin.z() + z)).cast<float>();
  };
  const auto direction = [&](size_t i) {
    return (position(4, 4, 4) - views[i].camera.center().cast<float>()).stableNormalized().eval();
  };
  std::vector<SlowVoxel> voxels(512);
  std::vector<bool> out(views.size(), false);
  std::optional<size_t> first;
  for (size_t i = 0; i < views.size(); ++i) {
    bool measures = false;
    for (int n = 0; n < 512; ++n) {
      const PointObservation s = fields[i].at(position(n / 64, n / 8 % 8, n % 8));
      measures = measures || voxels[size_t(n)].takes(s);
      voxels[size_t(n)].add(s, views[i], false);
    }
    if (!first && measures && !views[i].is_virtual) first = i;
    out[i] = first && direction(i).dot(direction(*first)) < -0.5f;
  }
  return out;
}

TEST(BlockEvidence, IsWhatEveryViewSaysOfEveryVoxelToTheBit) {
  size_t estimated = 0;
  for (const uint32_t seed : {1U, 2U, 3U}) {
    const std::vector<TsdfView> views = random_views(seed);
    const TsdfOptions options = {.voxel_size = 0.011 + 0.002 * seed, .depth_trunc = 1.4};
    const FusedVolume fused = fuse(views, options);
    const double voxel = fused.report.voxel_size;
    std::vector<DepthField> fields;
    for (const TsdfView& view : views) fields.emplace_back(view, options, voxel);
    TsdfReport slow_report;
    std::map<openvdb::Coord, std::vector<bool>> from_behind;  // by block
    const auto block = [&](double at) { return 8 * int(std::floor(at / (8 * voxel))); };
    const Eigen::AlignedBox3d& b = fused.report.bounds;
    for (int x = block(b.min().x()); x < block(b.max().x()) + 8; ++x) {
      for (int y = block(b.min().y()); y < block(b.max().y()) + 8; ++y) {
        for (int z = block(b.min().z()); z < block(b.max().z()) + 8; ++z) {
          const Eigen::Vector3f p = (voxel * Vector3d(x, y, z)).cast<float>();
          const openvdb::Coord origin(x & ~7, y & ~7, z & ~7);
          auto& behind = from_behind[origin];
          if (behind.empty()) behind = views_from_behind(origin, voxel, views, fields);
          SlowVoxel slow;
          for (size_t i = 0; i < views.size(); ++i) slow.add(fields[i].at(p), views[i], behind[i]);
          ASSERT_NO_FATAL_FAILURE(expect_voxel(fused.volume, {x, y, z}, slow)) << p.transpose();
          const bool is_conflict = slow.is_seen() && slow.free_weight > 0 &&
                                   std::abs(slow.distance / slow.weight) < voxel;
          ++slow_report.voxels;
          slow_report.conflicts += is_conflict;
          slow_report.carved += is_conflict && slow.is_carved();
          const bool is_occupied = slow.is_seen() && !slow.is_carved();
          slow_report.occupied += is_occupied && !slow.is_estimate();
          slow_report.estimated += is_occupied && slow.is_estimate();
        }
      }
    }
    EXPECT_EQ(fused.report.voxels, slow_report.voxels);
    EXPECT_EQ(fused.report.conflicts, slow_report.conflicts);
    EXPECT_EQ(fused.report.carved, slow_report.carved);
    EXPECT_EQ(fused.report.occupied, slow_report.occupied);
    EXPECT_EQ(fused.report.estimated, slow_report.estimated);
    estimated += fused.report.estimated;
    EXPECT_GT(fused.report.carved, 10U);
    EXPECT_GT(fused.report.hidden, 1000U);
    expect_same(fused, fuse_streamed(source_of(views), options, {}, 1));
  }
  EXPECT_GT(estimated, 10U);
}

// Lengths that are twice as long are not rounded otherwise.
TEST(BlockEvidence, GivesTheSameBitsAtTwiceTheScale) {
  std::vector<TsdfView> views = random_views(4);
  const FusedVolume one = fuse(views, {.voxel_size = 0.0125});
  for (TsdfView& view : views) {
    view.camera.world_from_cam.translation() *= 2;
    for (float& d : view.depth.data) d *= 2;
    for (float& s : view.sigma.data) s *= 2;
  }
  const FusedVolume two = fuse(views, {.voxel_size = 0.025});
  expect_same(*one.volume.state, *two.volume.state);
  expect_same(*one.volume.weight, *two.volume.weight);
  EXPECT_EQ(one.report.conflicts, two.report.conflicts);
  for (auto it = one.volume.tsdf->cbeginValueOn(); it; ++it) {
    ASSERT_EQ(2 * *it, two.volume.tsdf->tree().getValue(it.getCoord()));
  }
}

}  // namespace
}  // namespace cgs::block_evidence_test
