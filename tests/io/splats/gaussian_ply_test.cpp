// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/gaussian_ply.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/splat_ply.h"

namespace cgs::gaussian_ply_test {
namespace {

Frame exact_frame() {
  Frame frame = test::centimetre_frame();
  frame.file_origin = frame.origin;
  return frame;
}

Gaussians sample(int degree, int count = 20) {
  Gaussians g;
  g.sh_degree = degree;
  for (int i = 0; i < count; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(count);
    g.position.emplace_back(0.4f * std::cos(9 * t), 0.4f * std::sin(7 * t), 0.4f * t);
    g.scale.emplace_back(0.001f + 0.01f * t, 0.003f, 0.0001f);
    g.rotation.push_back(Eigen::Vector4f(1, t, -t, 0.3f).normalized());
    g.opacity.push_back(0.01f + 0.98f * t);
    for (int k = 0; k < g.sh_count(); ++k) {
      g.sh.emplace_back(t - 0.5f, 0.1f * static_cast<float>(k), -t);
    }
  }
  return g;
}

/// A splat as a file of the reference implementation has it, with values to be spoiled.
struct RawSplat {
  float x = 0, y = 0, z = 0, dc = 0.5f, opacity = -1, scale = -4;
  Eigen::Vector4f rotation = {1, 0, 0, 0};
};

std::string raw_file(const std::vector<RawSplat>& splats) {
  std::string out = test::splat_ply_header("binary_little_endian", splats.size());
  for (const RawSplat& s : splats) {
    for (const float v : {s.x, s.y, s.z, s.dc, s.dc, s.dc, s.opacity}) append_bytes(out, v);
    for (const float v : {s.scale, s.scale - 1, s.scale - 2}) append_bytes(out, v);
    for (const float v : s.rotation) append_bytes(out, v);
  }
  return out;
}

/// Ten good splats on a line of length 9 and the one in question.
GaussianFile read_with(const RawSplat& odd) {
  std::vector<RawSplat> splats(11);
  for (size_t i = 0; i < 10; ++i) splats[i].x = static_cast<float>(i);
  splats[10] = odd;
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply", raw_file(splats));
  return read_gaussian_ply(dir / "a.ply");
}

bool warns(const GaussianFile& file, const std::string& text) {
  for (const std::string& warning : file.warnings) {
    if (warning.find(text) != std::string::npos) return true;
  }
  return false;
}

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read_gaussian_ply(path); });
}

std::string without_line(std::string bytes, const std::string& line) {
  const size_t at = bytes.find(line);
  EXPECT_NE(at, std::string::npos);
  return bytes.erase(at, line.size());
}

TEST(GaussianPly, ComesBackAtEveryDegree) {
  for (int degree = 0; degree <= 3; ++degree) {
    const test::TempDir dir;
    const Gaussians g = sample(degree);
    write_gaussian_ply(dir / "a.ply", g, exact_frame());
    const GaussianFile back = read_gaussian_ply(dir / "a.ply", exact_frame());
    EXPECT_TRUE(back.warnings.empty());
    EXPECT_EQ(back.gaussians.sh_degree, degree);
    EXPECT_EQ(back.gaussians.position, g.position);
    EXPECT_EQ(back.gaussians.rotation, g.rotation);
    EXPECT_EQ(back.gaussians.sh, g.sh);
    ASSERT_EQ(back.gaussians.size(), g.size());
    for (size_t i = 0; i < g.size(); ++i) {  // the file holds their logarithms
      EXPECT_NEAR(back.gaussians.opacity[i], g.opacity[i], 2e-7f * g.opacity[i]);
      const Eigen::Array3f ratio = back.gaussians.scale[i].array() / g.scale[i].array();
      EXPECT_LT((ratio - 1).abs().maxCoeff(), 1e-6f);
    }
  }
}

Gaussians labelled(Gaussians g) {
  for (size_t i = 0; i < g.size(); ++i) {
    g.provenance.push_back(static_cast<Provenance>(i % kProvenanceCount));
  }
  return g;
}

TEST(GaussianPly, BringsLabelsBackAndIsTheSameWithoutThem) {
  const test::TempDir dir;
  const Gaussians g = labelled(sample(1));
  write_gaussian_ply(dir / "a.ply", g, exact_frame());
  const GaussianFile back = read_gaussian_ply(dir / "a.ply", exact_frame());
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.gaussians.provenance, g.provenance);
  EXPECT_EQ(back.gaussians.sh, g.sh);
  write_gaussian_ply(dir / "again.ply", back.gaussians, exact_frame());
  EXPECT_EQ(read_gaussian_ply(dir / "again.ply", exact_frame()).gaussians.provenance, g.provenance);
  const std::string head = test::read_bytes(dir / "a.ply");
  EXPECT_NE(head.find("property float rot_3\nproperty float provenance\nend_header\n"),
            std::string::npos);
  write_gaussian_ply(dir / "bare.ply", sample(1), exact_frame());
  EXPECT_EQ(test::read_bytes(dir / "bare.ply").find("provenance"), std::string::npos);
  EXPECT_TRUE(read_gaussian_ply(dir / "bare.ply").gaussians.provenance.empty());
}

// Their logits lie between 0 and 1, as probabilities would.
TEST(GaussianPly, OurOwnHalfOpaqueSplatsAreNotTakenForProbabilities) {
  const test::TempDir dir;
  Gaussians g = sample(0);
  for (size_t i = 0; i < g.size(); ++i) g.opacity[i] = 0.51f + 0.01f * static_cast<float>(i);
  write_gaussian_ply(dir / "a.ply", g, exact_frame());
  const GaussianFile back = read_gaussian_ply(dir / "a.ply", exact_frame());
  EXPECT_TRUE(back.warnings.empty());
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_NEAR(back.gaussians.opacity[i], g.opacity[i], 1e-6f);
  }
}

TEST(GaussianPly, FileIsLaidOutAsTheReferenceDoes) {
  const test::TempDir dir;
  Gaussians g = sample(3, 1);
  g.scale[0] = {0.5f, 0.25f, 0.125f};
  g.opacity[0] = 0.75f;
  for (int k = 0; k < 16; ++k) {
    const auto c = static_cast<float>(k);
    g.sh[static_cast<size_t>(k)] = {c, c + 100, c + 200};
  }
  write_gaussian_ply(dir / "a.ply", g, exact_frame());
  const std::string bytes = test::read_bytes(dir / "a.ply");
  const size_t data = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size() - data, 62 * sizeof(float));
  std::array<float, 62> v{};
  std::memcpy(v.data(), bytes.data() + data, sizeof(v));
  EXPECT_EQ(v[0], 64 * g.position[0].x());
  EXPECT_EQ(v[3], 0.0f);
  EXPECT_EQ(v[7], 100.0f);       // f_dc_1
  EXPECT_EQ(v[9], 1.0f);         // f_rest_0: red of the first band
  EXPECT_EQ(v[9 + 14], 15.0f);   // f_rest_14: last red
  EXPECT_EQ(v[9 + 15], 101.0f);  // f_rest_15: first green
  EXPECT_EQ(v[9 + 44], 215.0f);  // f_rest_44: last blue
  EXPECT_FLOAT_EQ(v[54], std::log(3.0f));
  EXPECT_FLOAT_EQ(v[55], std::log(32.0f));
  EXPECT_FLOAT_EQ(v[57], std::log(8.0f));
  EXPECT_EQ(v[58], g.rotation[0][0]);
  const std::string head = bytes.substr(0, data);
  EXPECT_LT(head.find("property float nz"), head.find("property float f_dc_0"));
  EXPECT_LT(head.find("property float f_rest_44"), head.find("property float opacity"));
  EXPECT_LT(head.find("property float scale_2"), head.find("property float rot_0"));
}

TEST(GaussianPly, WithoutAFrameTheWorldStaysWhereItWas) {
  const test::TempDir dir;
  const Gaussians g = sample(1);
  const Frame frame = test::centimetre_frame();
  write_gaussian_ply(dir / "a.ply", g, frame);
  const GaussianFile back = read_gaussian_ply(dir / "a.ply");
  EXPECT_EQ(back.frame.unit_name(), "cm");
  for (size_t i = 0; i < g.size(); ++i) {
    const Eigen::Vector3d a = frame.world_from_internal(g.position[i].cast<double>());
    const Eigen::Vector3d b =
        back.frame.world_from_internal(back.gaussians.position[i].cast<double>());
    EXPECT_LT((a - b).norm(), 64 * 1e-6);
    EXPECT_NEAR(back.gaussians.scale[i].x() * back.frame.scale, g.scale[i].x() * frame.scale, 1e-5);
  }
}

TEST(GaussianPly, DropsWhatCannotBeDrawn) {
  const float nan = std::nanf("");
  const float inf = std::numeric_limits<float>::infinity();
  const auto dropped = [](const RawSplat& odd) {
    const GaussianFile out = read_with(odd);
    return out.gaussians.size() == 10 && warns(out, "dropped 1 splat") &&
           out.gaussians.sh.size() == 10;
  };
  EXPECT_TRUE(dropped({.x = nan}));
  EXPECT_TRUE(dropped({.y = inf}));
  EXPECT_TRUE(dropped({.dc = nan}));
  EXPECT_TRUE(dropped({.opacity = nan}));
  EXPECT_TRUE(dropped({.opacity = -inf}));
  EXPECT_TRUE(dropped({.scale = nan}));
  EXPECT_TRUE(dropped({.scale = 95}));
  EXPECT_TRUE(dropped({.rotation = Eigen::Vector4f::Zero()}));
  EXPECT_FALSE(dropped({}));
}

TEST(GaussianPly, ClampsWhatItCan) {
  const GaussianFile opaque = read_with({.opacity = std::numeric_limits<float>::infinity()});
  EXPECT_EQ(opaque.gaussians.opacity[10], 0.99f);
  EXPECT_TRUE(warns(opaque, "clamped opacity or scale of 1 splat"));
  const GaussianFile nearly = read_with({.opacity = 40});
  EXPECT_LT(nearly.gaussians.opacity[10], 1.0f);
  const GaussianFile tiny = read_with({.scale = -104});
  ASSERT_EQ(tiny.gaussians.size(), 11u);
  EXPECT_GT(tiny.gaussians.scale[10].cwiseAbs2().minCoeff(), 0.0f);
  EXPECT_TRUE(warns(tiny, "clamped"));
}

TEST(GaussianPly, NormalisesQuaternionsOfAnyLength) {
  const Eigen::Vector4f unit = Eigen::Vector4f(1, 2, -3, 4).normalized();
  for (const float length : {1e20f, 1e-23f, 7.0f}) {
    const GaussianFile out = read_with({.rotation = length * unit});
    ASSERT_EQ(out.gaussians.size(), 11u);
    EXPECT_LT((out.gaussians.rotation[10] - unit).norm(), 1e-6f) << length;
  }
}

TEST(GaussianPly, IsNotMisledByStraySplats) {
  std::vector<RawSplat> splats(1000);
  for (size_t i = 0; i < splats.size(); ++i) splats[i].x = 0.01f * static_cast<float>(i) - 5;
  for (size_t i = 0; i < 10; ++i) splats[i * 97].x = i % 2 == 0 ? 2e7f : -2e7f;
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply", raw_file(splats));
  const GaussianFile out = read_gaussian_ply(dir / "a.ply");
  EXPECT_EQ(out.gaussians.size(), 1000u);
  EXPECT_EQ(out.frame.scale, 16);
}

TEST(GaussianPly, SaysWhatLooksOdd) {
  std::vector<RawSplat> splats(1000);
  for (size_t i = 0; i < splats.size(); ++i) splats[i].x = static_cast<float>(i);
  const auto read = [&] {
    const test::TempDir dir;
    test::write_bytes(dir / "a.ply", raw_file(splats) + "xyz");
    return read_gaussian_ply(dir / "a.ply");
  };
  EXPECT_TRUE(warns(read(), "trailing 3 bytes"));
  EXPECT_FALSE(warns(read(), "linear"));
  for (RawSplat& s : splats) s.scale = 9;  // absurd as logarithms, not as lengths
  const GaussianFile lengths = read();
  EXPECT_TRUE(warns(lengths, "read as lengths"));
  EXPECT_TRUE(lengths.findings.linear_scales);
  EXPECT_NEAR(lengths.gaussians.scale[0].x() * lengths.frame.scale, 9, 1e-4);
  EXPECT_NEAR(lengths.gaussians.scale[0].z() * lengths.frame.scale, 7, 1e-4);
  for (RawSplat& s : splats) s.x *= 1e-3f;  // absurd as both
  EXPECT_TRUE(warns(read(), "fill ratio"));
  for (RawSplat& s : splats) s.x *= 1e3f;
  for (RawSplat& s : splats) s.scale = 2.5f;
  for (RawSplat& s : splats) s.opacity = 0.5f;
  EXPECT_TRUE(warns(read(), "scale_* look linear"));
  EXPECT_TRUE(warns(read(), "probability"));
}

TEST(GaussianPly, NamesWhatIsMissing) {
  const std::string good = raw_file(std::vector<RawSplat>(3));
  EXPECT_EQ(defect(good), "OK");
  for (const char* name : {"x", "scale_1", "rot_3", "opacity", "f_dc_2"}) {
    EXPECT_EQ(defect(without_line(good, std::string("property float ") + name + "\n")), "SCHEMA");
  }
  EXPECT_EQ(defect("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n"),
            "EMPTY");
  RawSplat bad;
  bad.x = std::nanf("");
  EXPECT_EQ(defect(raw_file({bad, bad})), "VALUE");
  const test::TempDir dir;
  write_gaussian_ply(dir / "a.ply", sample(3, 2), exact_frame());
  const std::string full = test::read_bytes(dir / "a.ply");
  EXPECT_EQ(defect(without_line(full, "property float f_rest_44\n")), "SCHEMA");
  std::string gap = full;
  gap.replace(gap.find("f_rest_1\n"), 9, "f_rest_x\n");
  EXPECT_EQ(defect(gap), "SCHEMA");
}

/// The same splat in the words of other programs.
GaussianFile read_dialect(const std::string& properties, const std::string& row) {
  const test::TempDir dir;
  test::write_bytes(dir / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 2\n" + properties + "end_header\n" +
                        row + "\n" + row + "\n");
  return read_gaussian_ply(dir / "a.ply", Frame{});
}

std::string lines_of(const std::vector<std::string>& names, const std::string& type = "float") {
  std::string out;
  for (const std::string& name : names) out.append("property " + type + " " + name + "\n");
  return out;
}

TEST(GaussianPly, ReadsPropertiesInAnyOrderAndType) {
  const GaussianFile out =
      read_dialect(lines_of({"rot_3", "rot_2", "rot_1", "rot_0", "opacity"}, "double") +
                       lines_of({"scale_2", "scale_1", "scale_0", "z", "y", "x", "label"}) +
                       lines_of({"f_dc_2", "f_dc_1", "f_dc_0"}),
                   "0 0 0 2e200 -1 -3 -2 -1 0.3 0.2 0.1 7 6 5 4");
  const Gaussians& g = out.gaussians;
  ASSERT_EQ(g.size(), 2u);
  EXPECT_EQ(g.position[0], Eigen::Vector3f(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(g.rotation[0], Eigen::Vector4f(1, 0, 0, 0));
  EXPECT_EQ(g.sh[0], Eigen::Vector3f(4, 5, 6));
  EXPECT_FLOAT_EQ(g.scale[0].x(), std::exp(-1.0f));
  EXPECT_FLOAT_EQ(g.scale[0].z(), std::exp(-3.0f));
  EXPECT_FLOAT_EQ(g.opacity[0], 1 / (1 + std::exp(1.0f)));
}

TEST(GaussianPly, ReadsLabelsOfAnyTypeAndLeavesOutWhatIsNone) {
  const auto read = [](const std::string& property, const std::string& value) {
    return read_dialect(
        property + "\n" + lines_of({"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"}) +
            lines_of({"scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}),
        value + " 0 0 0 0 0 0 2 -3 -4 -5 1 0 0 0");
  };
  const std::vector<Provenance> estimated(2, Provenance::Estimated);
  for (const std::string type : {"uchar", "int", "float", "double"}) {
    EXPECT_EQ(read("property " + type + " provenance", "5").gaussians.provenance, estimated)
        << type;
  }
  for (const std::string value : {"6", "-1", "0.5", "nan", "1e300"}) {
    const GaussianFile out = read("property double provenance", value);
    EXPECT_TRUE(out.gaussians.provenance.empty()) << value;
    EXPECT_TRUE(warns(out, "provenance of the splats left out")) << value;
    EXPECT_EQ(out.gaussians.size(), 2u) << value;
  }
  const GaussianFile others = read("property list uchar float provenance", "1 7");
  EXPECT_TRUE(others.gaussians.provenance.empty());
  EXPECT_FALSE(warns(others, "provenance"));
}

TEST(GaussianPly, BringsTagsOfWhatIsMadeUpBackAlsoAfterItsFrameIsToldAnew) {
  const test::TempDir dir;
  Gaussians g = labelled(sample(1));
  g.synthetic.assign(g.size(), 0);
  g.synthetic[1] = 2;
  g.synthetic[3] = 1;
  g.synthetic_sources = {{"hole 1.png", std::string(64, 'a')}, {"b.jpg", std::string(64, '7')}};
  Frame frame = exact_frame();
  write_gaussian_ply(dir / "a.ply", g, frame);
  const std::string head = test::read_bytes(dir / "a.ply");
  EXPECT_NE(head.find("comment synthetic 1 sha256:" + std::string(64, 'a') + " hole 1.png\n"),
            std::string::npos);
  EXPECT_NE(head.find("property float provenance\nproperty float synthetic\nend_header\n"),
            std::string::npos);
  frame.metres_per_unit = 0.025;
  EXPECT_TRUE(restate_gaussian_ply(dir / "a.ply", frame));
  const GaussianFile back = read_gaussian_ply(dir / "a.ply", frame);
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.gaussians.synthetic, g.synthetic);
  EXPECT_EQ(back.gaussians.synthetic_sources, g.synthetic_sources);
  EXPECT_EQ(back.gaussians.provenance, g.provenance);
}

// plyfile of Python refuses a header with any other byte.
TEST(GaussianPly, NamesOfPaintedPicturesAreAsciiInTheHeader) {
  const test::TempDir dir;
  Gaussians g = sample(1);
  g.synthetic.assign(g.size(), 1);
  g.synthetic_sources = {{"h\xC3\xB6hle 50% of%20it.png", std::string(64, 'a')}};
  write_gaussian_ply(dir / "a.ply", g, exact_frame());
  const std::string bytes = test::read_bytes(dir / "a.ply");
  const std::string head = bytes.substr(0, bytes.find("end_header"));
  EXPECT_TRUE(std::all_of(head.begin(), head.end(), [](char c) { return c > 0; }));
  EXPECT_NE(head.find(" h%C3%B6hle 50%25 of%2520it.png\n"), std::string::npos) << head;
  EXPECT_EQ(read_gaussian_ply(dir / "a.ply").gaussians.synthetic_sources, g.synthetic_sources);
}

// Whoever took the list of pictures away did not make a photograph of it.
TEST(GaussianPly, KeepsTagsWhosePictureNobodyNames) {
  const auto read = [](const std::string& value) {
    return read_dialect("property double synthetic\n" +
                            lines_of({"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"}) +
                            lines_of({"scale_0", "scale_1", "scale_2"}) +
                            lines_of({"rot_0", "rot_1", "rot_2", "rot_3"}),
                        value + " 0 0 0 0 0 0 2 -3 -4 -5 1 0 0 0")
        .gaussians;
  };
  EXPECT_TRUE(read("0").synthetic.empty());
  const Gaussians third = read("3");
  EXPECT_EQ(third.synthetic, (std::vector<uint8_t>{3, 3}));
  EXPECT_EQ(third.synthetic_sources, std::vector<SyntheticSource>(3));
  for (const std::string value : {"256", "-1", "0.5", "nan", "1e300"}) {
    EXPECT_EQ(synthetic_count(read(value)), 2u) << value;
  }
}

TEST(GaussianPly, Reads2DSplatsAsThinOnes) {
  const GaussianFile out =
      read_dialect(lines_of({"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"}) +
                       lines_of({"scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3"}),
                   "0 0 0 0 0 0 2 -3 -4 1 0 0 0");
  EXPECT_EQ(out.format, "2DGS PLY");
  EXPECT_TRUE(warns(out, "2D splats"));
  EXPECT_NEAR(out.gaussians.scale[0].z(), std::exp(-4.0f) / 1000, 1e-8f);
}

TEST(GaussianPly, AppliesTheSmoothingFilterThatSplatsState) {
  const std::string properties = lines_of({"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"}) +
                                 lines_of({"opacity", "scale_0", "scale_1", "scale_2"}) +
                                 lines_of({"rot_0", "rot_1", "rot_2", "rot_3", "filter_3D"});
  const std::string row = "0 0 0 0 0 0 0.5 0 -1 -2 1 0 0 0 ";
  const GaussianFile out = read_dialect(properties, row + "0.25");
  EXPECT_TRUE(warns(out, "smoothing filter"));
  double opacity = 1 / (1 + std::exp(-0.5));
  for (int k = 0; k < 3; ++k) {
    const double blurred = std::hypot(std::exp(-k), 0.25);
    opacity *= std::exp(-k) / blurred;
    EXPECT_NEAR(out.gaussians.scale[0][k], blurred, 1e-6) << k;
  }
  EXPECT_NEAR(out.gaussians.opacity[0], opacity, 1e-6);
  const GaussianFile none = read_dialect(properties, row + "0");
  EXPECT_FLOAT_EQ(none.gaussians.scale[0].y(), std::exp(-1.0f));
  EXPECT_THROW(read_dialect(properties, row + "nan"), BadInput);
  EXPECT_THROW(read_dialect(properties, row + "-1"), BadInput);
}

TEST(GaussianPly, ReadsColourInsteadOfHarmonics) {
  const std::string before = lines_of({"x", "y", "z", "opacity", "scale_0", "scale_1", "scale_2"});
  const std::string after = lines_of({"rot_0", "rot_1", "rot_2", "rot_3"});
  const GaussianFile bytes =
      read_dialect(before + lines_of({"red", "green", "blue"}, "uchar") + after,
                   "0 0 0 2 -3 -3 -3 255 0 51 1 0 0 0");
  const Eigen::Vector3f color = bytes.gaussians.sh[0].array() * kShC0 + 0.5f;
  EXPECT_LT((color - Eigen::Vector3f(1, 0, 0.2f)).norm(), 1e-6f);
  const GaussianFile ints = read_dialect(before + lines_of({"red", "green", "blue"}, "int") + after,
                                         "0 0 0 2 -3 -3 -3 255 0 51 1 0 0 0");
  EXPECT_LT((ints.gaussians.sh[0] - bytes.gaussians.sh[0]).norm(), 1e-6f);
  const GaussianFile floats = read_dialect(before + lines_of({"red", "green", "blue"}) + after,
                                           "0 0 0 2 -3 -3 -3 1 0 0.2 1 0 0 0");
  EXPECT_LT((floats.gaussians.sh[0] - bytes.gaussians.sh[0]).norm(), 1e-6f);
  const auto up_to_255 = lines_of({"diffuse_red", "diffuse_green", "diffuse_blue"});
  const GaussianFile large =
      read_dialect(before + up_to_255 + after, "0 0 0 2 -3 -3 -3 255 0 51 1 0 0 0");
  EXPECT_LT((large.gaussians.sh[0] - bytes.gaussians.sh[0]).norm(), 1e-5f);
  EXPECT_TRUE(warns(large, "colours above 2"));
  const GaussianFile letters = read_dialect(before + lines_of({"r", "g", "b"}, "uchar") + after,
                                            "0 0 0 2 -3 -3 -3 255 0 51 1 0 0 0");
  EXPECT_EQ(letters.gaussians.sh[0], bytes.gaussians.sh[0]);
}

TEST(GaussianPly, LeavesOutHarmonicsOfDegreeFour) {
  std::vector<std::string> names = {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"};
  std::string row = "0 0 0 9 9 9";
  for (int i = 0; i < 72; ++i) {
    names.push_back("f_rest_" + std::to_string(i));
    row += " " + std::to_string(i);
  }
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2"}) names.emplace_back(name);
  for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) names.emplace_back(name);
  const GaussianFile out = read_dialect(lines_of(names), row + " 2 -3 -3 -3 1 0 0 0");
  EXPECT_TRUE(warns(out, "degree 4"));
  ASSERT_EQ(out.gaussians.sh.size(), 32u);
  EXPECT_EQ(out.gaussians.sh[15], Eigen::Vector3f(14, 24 + 14, 48 + 14));
}

TEST(GaussianPly, RefusesEveryTruncation) {
  const test::TempDir dir;
  write_gaussian_ply(dir / "a.ply", sample(1, 3), exact_frame());
  test::expect_every_truncation_is_refused(test::read_bytes(dir / "a.ply"),
                                           [](const auto& path) { (void)read_gaussian_ply(path); });
}

TEST(GaussianPly, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_gaussian_ply(path, sample(3), exact_frame()); });
}

TEST(GaussianPly, KeepsTheBytesOfSplatsWhenItsFrameIsToldAnew) {
  const test::TempDir dir;
  Frame frame = exact_frame();
  const Gaussians g = labelled(sample(1, 5000));
  write_gaussian_ply(dir / "told.ply", g, frame);
  frame.up = Eigen::Vector3d(0.1, 0.2, 0.3).normalized();
  frame.metres_per_unit = 0.025;
  write_gaussian_ply(dir / "wanted.ply", g, frame);
  EXPECT_TRUE(restate_gaussian_ply(dir / "told.ply", frame));
  EXPECT_TRUE(test::read_bytes(dir / "told.ply") == test::read_bytes(dir / "wanted.ply"));
  std::string other = raw_file(std::vector<RawSplat>(3));
  test::write_bytes(dir / "other.ply", other);
  EXPECT_FALSE(restate_gaussian_ply(dir / "other.ply", frame));
  other = test::read_bytes(dir / "told.ply");
  other.replace(other.find("little"), 6, "big");
  test::write_bytes(dir / "other.ply", other);
  EXPECT_FALSE(restate_gaussian_ply(dir / "other.ply", frame));
  EXPECT_EQ(test::read_bytes(dir / "other.ply"), other);
}

TEST(GaussianPly, SaysWhatItsSplatsRestOnAlsoAfterItsFrameIsToldAnew) {
  const test::TempDir dir;
  const std::string words = "82 % measured, 18 % made up; element vertex 5";
  Frame frame = exact_frame();
  write_gaussian_ply(dir / "a.ply", sample(1), frame, words);
  EXPECT_EQ(read_gaussian_ply(dir / "a.ply").evidence, words);
  frame.metres_per_unit = 0.025;
  EXPECT_TRUE(restate_gaussian_ply(dir / "a.ply", frame));
  const GaussianFile back = read_gaussian_ply(dir / "a.ply");
  EXPECT_EQ(back.evidence, words);
  EXPECT_EQ(back.frame.metres_per_unit, 0.025);
  EXPECT_EQ(back.gaussians.size(), sample(1).size());
  write_gaussian_ply(dir / "silent.ply", sample(1), frame);
  EXPECT_EQ(read_gaussian_ply(dir / "silent.ply").evidence, "");
}

TEST(GaussianPly, RefusesToWriteWhatItCouldNotRead) {
  const test::TempDir dir;
  const auto refused = [&](const auto& damage) {
    Gaussians g = sample(2);
    damage(g);
    EXPECT_THROW(write_gaussian_ply(dir / "a.ply", g, exact_frame()), InvalidInput);
  };
  refused([](Gaussians& g) { g.opacity[3] = 1; });
  refused([](Gaussians& g) { g.opacity[3] = std::nanf(""); });
  refused([](Gaussians& g) { g.scale[3].y() = 0; });
  refused([](Gaussians& g) { g.position[3].y() = std::nanf(""); });
  refused([](Gaussians& g) { g.sh.pop_back(); });
  refused([](Gaussians& g) { g.rotation.pop_back(); });
  refused([](Gaussians& g) { g.sh_degree = 4; });
  refused([](Gaussians& g) { g.provenance.assign(3, Provenance::Observed); });
  EXPECT_EQ(test::entries(dir.path()), 0);
}

}  // namespace
}  // namespace cgs::gaussian_ply_test
