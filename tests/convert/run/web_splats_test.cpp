// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/web_splats.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/splats/splat_reader.h"
#include "tests/support/sample_splats.h"
#include "tests/support/temp_dir.h"

namespace cgs::web_splats_test {
namespace {

// Without photographs none is left out.
TEST(WriteWebSplats, SaysWhatTheModelRestsOn) {
  const test::TempDir dir;
  Model model;
  model.gaussians = test::varied_splats(20, 0);
  model.scene.views.emplace_back();
  model.scene.input = {0};
  model.scene.frame.up = -Eigen::Vector3d::UnitY();
  write_web_splats(dir.path(), model);
  EXPECT_EQ(read_splats(dir / "splats.glb").evidence, "");
  model.evidence = "82 % measured";
  write_web_splats(dir.path(), model);
  EXPECT_EQ(read_splats(dir / "splats.glb").evidence, "82 % measured");
}

TEST(WriteWebSplats, KeepsTheLabelsOfTheModel) {
  const test::TempDir dir;
  Model model;
  model.gaussians = test::varied_splats(20, 0);
  model.gaussians.provenance.assign(20, Provenance::Observed);
  model.gaussians.provenance[3] = Provenance::Estimated;
  model.scene.views.emplace_back();
  model.scene.input = {0};
  model.scene.frame.up = -Eigen::Vector3d::UnitY();
  write_web_splats(dir.path(), model);
  EXPECT_EQ(read_splats(dir / "splats.glb").gaussians.provenance, model.gaussians.provenance);
}

}  // namespace
}  // namespace cgs::web_splats_test
