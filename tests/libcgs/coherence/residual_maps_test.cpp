// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/residual_maps.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::residual_maps_test {
namespace {

constexpr int kSide = 12;

// Two views of two layers each.
std::vector<Raster<uint8_t>> two_views() {
  std::vector<Raster<uint8_t>> out(2, Raster<uint8_t>(kSide, kSide, 0));
  for (size_t i = 0; i < out[0].data.size(); ++i) {
    out[0].data[i] = i % kSide < 5 ? 0 : 1;
    out[1].data[i] = i < 40 ? 1 : 0;
  }
  return out;
}

const LayeredLatticeOptions kLattice = {.spacing = {8, 4}};
const ConvDecoderOptions kNetwork = {.width = 2, .layers = 2, .seed = 3};

std::vector<ResidualMaps> both_kinds() {
  std::vector<ResidualMaps> out;
  out.emplace_back(two_views(), kLattice);
  out.emplace_back(two_views(), kNetwork, 2.0f);
  return out;
}

// Some other parameters than those that training begins with.
void move(std::vector<ParameterBlock>& blocks) {
  for (ParameterBlock& block : blocks) {
    for (size_t i = 0; i < block.value.size(); ++i) block.value[i] += 0.01f * float(i % 7) - 0.02f;
  }
}

TEST(ResidualMaps, AreZeroAtFirstAndNotAfterwards) {
  for (ResidualMaps& maps : both_kinds()) {
    std::vector<ParameterBlock> blocks = maps.initial_blocks(ParameterRole::Shape);
    for (const ParameterBlock& block : blocks) {
      EXPECT_EQ(block.role, ParameterRole::Shape);
      EXPECT_EQ(block.gradient, std::vector<float>(block.value.size(), 0));
    }
    std::vector<Raster<float>> value;
    maps.evaluate(blocks, value);
    ASSERT_EQ(value.size(), 2u);
    for (const Raster<float>& map : value) {
      EXPECT_EQ(map.data, std::vector<float>(size_t{kSide} * kSide, 0));
    }
    move(blocks);
    maps.evaluate(blocks, value);
    for (const Raster<float>& map : value) {
      EXPECT_NE(*std::max_element(map.data.begin(), map.data.end()), 0);
    }
  }
}

TEST(ResidualMaps, HaveABlockPerViewOfLatticesAndOneOfANetwork) {
  std::vector<ResidualMaps> maps = both_kinds();
  std::vector<ParameterBlock> lattices = maps[0].initial_blocks(ParameterRole::Depth);
  std::vector<ParameterBlock> network = maps[1].initial_blocks(ParameterRole::Depth);
  EXPECT_EQ(lattices.size(), 2u);
  EXPECT_EQ(network.size(), 1u);
  move(lattices);
  move(network);
  EXPECT_GT(maps[0].add_bending(1, lattices), 0);
  EXPECT_EQ(maps[1].add_bending(1, network), 0);
}

// A gain of two doubles values and derivatives to the bit.
TEST(ResidualMaps, OfANetworkGrowWithTheGain) {
  std::vector<std::vector<Raster<float>>> values(2);
  std::vector<std::vector<ParameterBlock>> blocks;
  for (size_t k = 0; k < 2; ++k) {
    ResidualMaps maps(two_views(), kNetwork, k == 0 ? 1.0f : 2.0f);
    blocks.push_back(maps.initial_blocks(ParameterRole::Depth));
    move(blocks[k]);
    maps.evaluate(blocks[k], values[k]);
    maps.add_gradient(std::vector(2, Raster<float>(kSide, kSide, 0.25f)), blocks[k]);
  }
  for (size_t n = 0; n < 2; ++n) {
    for (size_t i = 0; i < values[0][n].data.size(); ++i) {
      ASSERT_EQ(values[1][n].data[i], 2 * values[0][n].data[i]) << n << ' ' << i;
    }
  }
  const std::vector<float>& once = blocks[0][0].gradient;
  EXPECT_NE(once, std::vector<float>(once.size(), 0));
  for (size_t i = 0; i < once.size(); ++i) {
    ASSERT_EQ(blocks[1][0].gradient[i], 2 * once[i]) << i;
  }
}

TEST(ResidualMaps, RefuseANetworkOfNoViews) {
  EXPECT_THROW(ResidualMaps({}, kNetwork, 1), InvalidInput);
}

}  // namespace
}  // namespace cgs::residual_maps_test
