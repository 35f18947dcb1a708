// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_loss.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/splat_shapes.h"

namespace cgs::splat_loss_test {
namespace {

Gaussians ball() {
  Gaussians out;
  test::add_sphere(out, {0, 0, 2}, 0.5, 2000);
  return out;
}

TEST(SplatLoss, IsNothingForTheSameSplats) {
  const SplatLoss loss = splat_loss(ball(), ball(), {});
  EXPECT_EQ(loss.largest_move, 0.0);
  EXPECT_EQ(loss.rms_move, 0.0);
  EXPECT_TRUE(std::isinf(loss.psnr.value()));
  EXPECT_GT(loss.views, 0u);
  const nlohmann::ordered_json json = splat_loss_to_json(loss, Frame{});
  EXPECT_EQ(json["pictures"]["psnr"], "same");
  EXPECT_EQ(splat_loss_line(loss, Frame{}),
            "the file reads back with centres as they were; " + std::to_string(loss.views) +
                " pictures are the same");
}

TEST(SplatLoss, KnowsMovesWhateverTheOrder) {
  const Gaussians source = ball();
  Gaussians written = source;
  std::vector<uint32_t> order(source.size());
  for (size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<uint32_t>(order.size() - 1 - i);
    written.position[i] = source.position[order[i]];
    written.scale[i] = source.scale[order[i]];
    written.rotation[i] = source.rotation[order[i]];
    written.sh[i] = source.sh[order[i]];
  }
  written.position[7].x() += 0.25f;
  Frame frame;
  frame.scale = 4;
  const SplatLoss loss = splat_loss(source, written, order);
  EXPECT_NEAR(loss.largest_move.value(), 0.25, 1e-6);
  EXPECT_NEAR(loss.rms_move.value(), 0.25 / std::sqrt(2000.0), 1e-6);
  EXPECT_NEAR(loss.extent, 1, 0.2);
  EXPECT_NEAR(splat_loss_to_json(loss, frame)["centres"]["largest_move"].get<double>(), 1, 1e-5);
}

// A colour that is off by a tenth everywhere: 20 dB, whatever the cameras see.
TEST(SplatLoss, MeasuresColoursWhereSplatsAre) {
  Gaussians source = ball();
  for (Eigen::Vector3f& c : source.sh) c = Eigen::Vector3f::Constant(-0.2f / kShC0);
  Gaussians written = source;
  for (Eigen::Vector3f& c : written.sh) c = Eigen::Vector3f::Constant(-0.1f / kShC0);
  EXPECT_NEAR(splat_loss(source, written, {}).psnr.value(), 20, 1);
}

TEST(SplatLoss, DoesNotJudgePicturesThatShowNothing) {
  Gaussians faint = ball();
  for (float& alpha : faint.opacity) alpha = 1e-5f;
  const SplatLoss loss = splat_loss(faint, faint, {});
  EXPECT_FALSE(loss.psnr.has_value());
  EXPECT_TRUE(splat_loss_to_json(loss, Frame{})["pictures"]["psnr"].is_null());
  EXPECT_NE(splat_loss_line(loss, Frame{}).find("show too little"), std::string::npos);
}

TEST(SplatLoss, SaysThatLabelsAreGone) {
  Gaussians source = ball();
  source.provenance.assign(source.size(), Provenance::Estimated);
  const auto line = [&](const Gaussians& written) {
    return splat_loss_line(splat_loss(source, written, {}), Frame{});
  };
  EXPECT_EQ(line(source).find("provenance"), std::string::npos);
  EXPECT_NE(line(ball()).find("centres as they were, without provenance; "), std::string::npos);
  const auto json = splat_loss_to_json(splat_loss(source, ball(), {}), Frame{});
  EXPECT_EQ(json["provenance"]["before"], true);
  EXPECT_EQ(json["provenance"]["after"], false);
}

TEST(SplatLoss, SaysWhatIsMissing) {
  const Gaussians source = ball();
  Gaussians written = source;
  written.position.pop_back();
  written.scale.pop_back();
  written.rotation.pop_back();
  written.opacity.pop_back();
  written.sh.pop_back();
  const SplatLoss loss = splat_loss(source, written, {});
  EXPECT_EQ(loss.dropped, 1u);
  EXPECT_FALSE(loss.largest_move.has_value());
  EXPECT_TRUE(splat_loss_to_json(loss, Frame{})["centres"].is_null());
  EXPECT_NE(splat_loss_line(loss, Frame{}).find("1 splats missing"), std::string::npos);
}

}  // namespace
}  // namespace cgs::splat_loss_test
