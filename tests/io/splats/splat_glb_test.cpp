// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_glb.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"

namespace cgs::splat_glb_test {
namespace {

/// The container as its specification describes it.
struct GlbFile {
  nlohmann::json json;
  std::string binary;

  explicit GlbFile(const std::string& bytes) {
    const auto number = [&](size_t at) {
      uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(number(4), 2u);
    EXPECT_EQ(number(8), bytes.size());
    const uint32_t length = number(12);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    EXPECT_EQ(length % 4, 0u);
    json = nlohmann::json::parse(bytes.substr(20, length));
    EXPECT_EQ(bytes.substr(24 + length, 4), std::string("BIN\0", 4));
    binary = bytes.substr(28 + length, number(20 + length));
    EXPECT_EQ(json["buffers"][0]["byteLength"], binary.size());
  }

  std::vector<float> attribute(const std::string& name) const {
    const auto& accessor =
        json["accessors"][json["meshes"][0]["primitives"][0]["attributes"].at(name).get<size_t>()];
    const auto& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
    EXPECT_EQ(accessor["componentType"], 5126);
    std::vector<float> out(view["byteLength"].get<size_t>() / 4);
    std::memcpy(out.data(), binary.data() + view["byteOffset"].get<size_t>(), 4 * out.size());
    return out;
  }
};

GlbFile written(const Gaussians& g, const Frame& frame, const Eigen::Vector3d& up) {
  const test::TempDir dir;
  const size_t bytes = write_splat_glb(dir / "a.glb", g, frame, {.y_up = y_up_from(up)});
  EXPECT_EQ(bytes, std::filesystem::file_size(dir / "a.glb"));
  return GlbFile(test::read_bytes(dir / "a.glb"));
}

TEST(SplatGlb, HoldsEveryAttributeAsTheExtensionNamesIt) {
  const Gaussians g = test::varied_splats(50, 3);
  const GlbFile file = written(g, Frame{}, -Eigen::Vector3d::UnitY());
  const auto& primitive = file.json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_EQ(primitive["extensions"]["KHR_gaussian_splatting"]["kernel"], "ellipse");
  EXPECT_EQ(primitive["extensions"]["KHR_gaussian_splatting"]["colorSpace"], "srgb_rec709_display");
  EXPECT_EQ(file.json["extensionsUsed"], nlohmann::json({"KHR_gaussian_splatting"}));
  EXPECT_EQ(primitive["attributes"].size(), 5u + 16u);
  const auto rotation = file.attribute("KHR_gaussian_splatting:ROTATION");
  const auto scale = file.attribute("KHR_gaussian_splatting:SCALE");
  const auto opacity = file.attribute("KHR_gaussian_splatting:OPACITY");
  const auto dc = file.attribute("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0");
  const auto last = file.attribute("KHR_gaussian_splatting:SH_DEGREE_3_COEF_6");
  const auto second = file.attribute("KHR_gaussian_splatting:SH_DEGREE_2_COEF_1");
  const auto color = file.attribute("COLOR_0");
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_NEAR(rotation[4 * i + 3], g.rotation[i][0], 1e-6f);  // w last
    EXPECT_NEAR(rotation[4 * i], g.rotation[i][1], 1e-6f);
    EXPECT_EQ(opacity[i], g.opacity[i]);
    EXPECT_EQ(color[4 * i + 3], g.opacity[i]);
    for (size_t k = 0; k < 3; ++k) {
      const auto c = static_cast<int>(k);
      EXPECT_EQ(scale[3 * i + k], g.scale[i][c]);
      EXPECT_EQ(dc[3 * i + k], g.sh[16 * i][c]);
      EXPECT_EQ(second[3 * i + k], g.sh[16 * i + 5][c]);
      EXPECT_EQ(last[3 * i + k], g.sh[16 * i + 15][c]);
      const double srgb = std::clamp(0.282094791773878 * g.sh[16 * i][c] + 0.5, 0.0, 1.0);
      const double linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
      EXPECT_NEAR(color[4 * i + k], linear, 1e-5);
    }
  }
}

TEST(SplatGlb, HoldsLabelsInAnAttributeOfItsOwn) {
  Gaussians g = test::varied_splats(3, 0);
  g.provenance = {Provenance::Observed, Provenance::Estimated, Provenance::Inferred};
  const GlbFile file = written(g, Frame{}, -Eigen::Vector3d::UnitY());
  EXPECT_EQ(file.json["meshes"][0]["primitives"][0]["attributes"].size(), 5u + 1u + 1u);
  EXPECT_EQ(file.attribute("_PROVENANCE"), (std::vector<float>{2, 5, 0}));
}

TEST(SplatGlb, StandsUprightInMetresAndKnowsItsPlace) {
  const Gaussians g = test::varied_splats(50, 0);
  const Frame frame = test::centimetre_frame();
  const Eigen::Vector3d up = Eigen::Vector3d(1, 2, -2).normalized();
  const GlbFile file = written(g, frame, up);
  const auto position = file.attribute("POSITION");
  const auto& q = file.json["nodes"][0]["rotation"];
  const Eigen::Quaterniond turn(
      q[3].get<double>(), q[0].get<double>(), q[1].get<double>(), q[2].get<double>());
  EXPECT_LT((turn * up - Eigen::Vector3d::UnitY()).norm(), 1e-9);
  const auto& extras = file.json["asset"]["extras"];
  EXPECT_EQ(extras["units"], "m");
  EXPECT_EQ(extras["origin_in_world"], nlohmann::json({0.0, 0.0, 0.0}));
  const auto& t = file.json["nodes"][0]["translation"];
  const Eigen::Vector3d shift(t[0].get<double>(), t[1].get<double>(), t[2].get<double>());
  Eigen::AlignedBox3f box;
  for (size_t i = 0; i < g.size(); ++i) {
    const Eigen::Vector3f p(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    box.extend(p);
    // Turned and moved by the node, back from there, and from metres to centimetres.
    const Eigen::Vector3d world = turn.inverse() * (shift + turn * p.cast<double>()) / 0.01;
    EXPECT_LT((world - frame.world_from_internal(g.position[i].cast<double>())).norm(), 1e-4);
  }
  const auto& bounds = file.json["accessors"][0];
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(bounds["min"][k].get<float>(), box.min()[static_cast<int>(k)]);
    EXPECT_EQ(bounds["max"][k].get<float>(), box.max()[static_cast<int>(k)]);
  }
}

TEST(SplatGlb, RefusesWhatGltfCannotHold) {
  const test::TempDir dir;
  EXPECT_THROW(write_splat_glb(dir / "a.glb", Gaussians{}, Frame{}), InvalidInput);
  const Gaussians g = test::varied_splats(3, 0);
  SplatGlbOptions mirrored;
  mirrored.y_up = -Eigen::Matrix3d::Identity();
  EXPECT_THROW(write_splat_glb(dir / "a.glb", g, Frame{}, mirrored), InvalidInput);
  Frame huge;
  huge.scale = 1e40;
  EXPECT_THROW(write_splat_glb(dir / "a.glb", g, huge), InvalidInput);
  test::expect_full_disk_is_noticed([&](const auto& path) { write_splat_glb(path, g, Frame{}); });
}

}  // namespace
}  // namespace cgs::splat_glb_test
