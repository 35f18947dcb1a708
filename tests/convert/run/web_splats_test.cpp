// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/web_splats.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/bytes/sha256.h"
#include "io/splats/splat_reader.h"
#include "tests/support/panel_model.h"
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

TEST(WriteWebSplats, FillsHolesWithSplatsThatAreTagged) {
  const test::TempDir dir;
  Model model = test::panel_model();
  for (View& view : model.scene.views) view.image_path.clear();  // none to thin by
  const size_t before = model.gaussians.size();
  const WebSplats made = write_web_splats(dir.path(), model, {.fill = HoleFill::Around});
  ASSERT_TRUE(made.fill.has_value());
  EXPECT_EQ(model.gaussians.size(), before);
  const size_t count = made.fill->splats.size();
  EXPECT_GT(count, 100u);
  const GaussianFile file = read_splats(dir / "splats.glb");
  EXPECT_EQ(file.gaussians.size(), before + count);
  EXPECT_EQ(synthetic_count(file.gaussians), count);
  for (const auto& [name, hash] : file.gaussians.synthetic_sources) {
    EXPECT_EQ(sha256(test::read_bytes(dir / name)), hash);
  }
  EXPECT_NE(file.evidence.find(std::to_string(count) + " synthetic"), std::string::npos);
  EXPECT_EQ(web_splats_to_json(made)["fill"]["splats"], count);

  const Gaussians fill = read_web_fill(dir.path(), model.scene.frame);
  ASSERT_EQ(fill.size(), count);
  for (size_t i = 0; i < count; ++i) {
    ASSERT_LT((fill.position[i] - made.fill->splats.position[i]).norm(), 1e-5f);
  }

  write_web_splats(dir.path(), model);
  EXPECT_EQ(synthetic_count(read_splats(dir / "splats.glb").gaussians), 0u);
  EXPECT_EQ(read_web_fill(dir.path(), model.scene.frame).size(), 0u);
  EXPECT_FALSE(std::filesystem::exists(dir / "surroundings"));
}

}  // namespace
}  // namespace cgs::web_splats_test
