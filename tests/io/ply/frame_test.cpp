// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/frame.h"

#include <gtest/gtest.h>

#include "tests/support/sample_mesh.h"

namespace cgs::ply_frame_test {
namespace {

std::vector<std::string> comments_of(const Frame& frame) {
  std::vector<std::string> out;
  std::string text = ply_frame_comments(frame);
  for (size_t end = 0; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1)) {
    EXPECT_EQ(text.substr(0, 8), "comment ");
    out.push_back(text.substr(8, end - 8));
  }
  return out;
}

const std::vector<Eigen::Vector3d> kBounds = {{-1, -2, -3}, {4, 5, 6}};

TEST(PlyFrame, CommentsCarryUnitScaleSourceAndOriginExactly) {
  Frame frame = test::centimetre_frame();
  frame.metres_per_unit = 0.1 + 0.2;
  frame.file_origin = {1.0 / 3, -1e-300, 5.4e6};
  const PlyPlacement back = ply_placement(comments_of(frame), kBounds, {});
  EXPECT_EQ(back.frame.metres_per_unit, frame.metres_per_unit);
  EXPECT_EQ(back.frame.metres_sigma, frame.metres_sigma);
  EXPECT_EQ(back.frame.scale_source, frame.scale_source);
  EXPECT_EQ(back.frame.file_origin, frame.file_origin);
  EXPECT_TRUE(back.warnings.empty());
}

TEST(PlyFrame, CommentsSayWhatIsUpWhereThatIsKnown) {
  Frame frame = test::centimetre_frame();
  EXPECT_FALSE(ply_placement(comments_of(frame), kBounds, {}).frame.knows_up());
  frame.up = Eigen::Vector3d(0.2, -0.9, 0.1).normalized();
  const Frame back = ply_placement(comments_of(frame), kBounds, {}).frame;
  EXPECT_LT((back.up - frame.up).norm(), 1e-15);
  EXPECT_FALSE(ply_placement({"up 0 0 0"}, kBounds, {}).frame.knows_up());
  EXPECT_FALSE(ply_placement({"up and away"}, kBounds, {}).frame.knows_up());
}

TEST(PlyEvidence, IsOneLineOfBoundedLength) {
  EXPECT_EQ(ply_evidence_comment(""), "");
  EXPECT_EQ(ply_evidence_comment("82 % measured"), "comment evidence 82 % measured\n");
  EXPECT_EQ(ply_evidence_comment("a\nend_header\n"), "comment evidence a\\x0aend_header\\x0a\n");
  EXPECT_LT(ply_evidence_comment(std::string(5000, 'a')).size(), 1024u);
  std::string accents = "a";
  for (int i = 0; i < 1000; ++i) accents += "é";
  EXPECT_TRUE(ply_evidence_comment(accents).ends_with("é...\n"));
}

TEST(PlyEvidence, IsReadFromFilesOfOursAlone) {
  EXPECT_EQ(ply_evidence({"generator cgs", "unit m", "evidence 82 % measured"}), "82 % measured");
  EXPECT_EQ(ply_evidence({"generator cgs", "unit m"}), "");
  EXPECT_EQ(ply_evidence({"evidence of another kind"}), "");
}

TEST(PlyFrame, CommentsOfNerfstudioAndBrushSayWhatIsUp) {
  const auto up = [](const char* comment) {
    return ply_placement({comment}, kBounds, {}).frame.up;
  };
  EXPECT_EQ(up("Vertical Axis: z"), Eigen::Vector3d::UnitZ());
  EXPECT_EQ(up("Vertical axis: y"), Eigen::Vector3d::UnitY());
  EXPECT_EQ(up("Vertical axis: 0 -2 0"), -Eigen::Vector3d::UnitY());
  EXPECT_EQ(up("Vertical axis: w"), Eigen::Vector3d::Zero());
  EXPECT_EQ(up("Vertical axis:"), Eigen::Vector3d::Zero());
}

TEST(PlyFrame, PlacesContentInTheWorld) {
  const PlyPlacement back = ply_placement(comments_of(test::centimetre_frame()), kBounds, {});
  const Eigen::Vector3d in_file(0.5, 1.5, -2.5);
  const Eigen::Vector3d in_world = in_file + test::centimetre_frame().file_origin;
  EXPECT_LT((back.frame.world_from_internal(back.internal(in_file)) - in_world).norm(), 1e-12);
  EXPECT_EQ(back.frame.scale, 16);  // the largest side is 9
}

TEST(PlyFrame, FilesOfContentFarFromTheStatedOriginGetAnother) {
  const Eigen::Vector3d corner(21.8, -6, -0.7);
  const std::vector<Eigen::Vector3d> bounds = {corner, corner + Eigen::Vector3d(0, 0, 1e-5)};
  const PlyPlacement out = ply_placement({"file_origin 1024 -2048 512"}, bounds, {});
  EXPECT_EQ(out.file_origin, Eigen::Vector3d(1024, -2048, 512));
  for (const Eigen::Vector3d& p : bounds) {
    const Eigen::Vector3d in_written_file = out.frame.file_from_internal(out.internal(p));
    EXPECT_LT(in_written_file.norm(), 256 * 2e-5);
    EXPECT_LT((in_written_file + out.frame.file_origin - out.file_origin - p).norm(), 1e-12);
  }
}

TEST(PlyFrame, IgnoresAnOriginWhereDoubleCoordinatesWouldLoseTheContent) {
  const std::vector<Eigen::Vector3d> bounds = {{0, 0, 0}, {0, 0, 1e-5}};
  const PlyPlacement out = ply_placement({"file_origin 1e14 0 0"}, bounds, {});
  EXPECT_EQ(out.file_origin, Eigen::Vector3d::Zero());
  EXPECT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(ply_placement({"file_origin 1e4 0 0"}, bounds, {}).file_origin.x(), 1e4);
}

TEST(PlyFrame, ReadsIntoAGivenFrame) {
  const Frame frame = test::centimetre_frame();
  const PlyPlacement plain = ply_placement({}, kBounds, frame);
  EXPECT_EQ(plain.internal({3, 4, 5}), frame.internal_from_file({3, 4, 5}));
  Frame elsewhere = frame;
  elsewhere.file_origin.setZero();
  const PlyPlacement moved = ply_placement(comments_of(elsewhere), kBounds, frame);
  EXPECT_EQ(moved.internal({3, 4, 5}), frame.internal_from_world({3, 4, 5}));
}

TEST(PlyFrame, WarnsIfTheUnitIsAnother) {
  Frame millimetres = test::centimetre_frame();
  millimetres.metres_per_unit = 0.001;
  const PlyPlacement out =
      ply_placement(comments_of(millimetres), kBounds, test::centimetre_frame());
  EXPECT_EQ(out.warnings.size(), 1u);
}

TEST(PlyFrame, IgnoresCommentsItDidNotWrite) {
  const PlyPlacement out = ply_placement(
      {"file_origin 1 2", "metres_per_unit nan", "unit parsec", "metres_per_unit -1", ""},
      kBounds,
      {});
  EXPECT_FALSE(out.frame.has_metric_scale());
  EXPECT_EQ(out.file_origin, Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace cgs::ply_frame_test
