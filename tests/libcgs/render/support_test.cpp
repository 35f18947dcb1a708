// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/render/rasterizer.h"

namespace cgs::support_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A wall and a floor with a box in front of the wall, in closed form.
struct WallAndBox {
  double wall_z = 1.0;
  double floor_y = 0.15;
  Eigen::AlignedBox3d box{Eigen::Vector3d(-0.12, -0.1, 0.55), Eigen::Vector3d(0.1, 0.12, 0.7)};

  // Parameter of the first hit of origin + s * direction, direction.z > 0.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Array3d inverse = direction.array().inverse();
    const Eigen::Array3d a = (box.min() - origin).array() * inverse;
    const Eigen::Array3d b = (box.max() - origin).array() * inverse;
    const double enter = a.min(b).maxCoeff();
    const double leave = a.max(b).minCoeff();
    if (enter <= leave && enter > 0) return enter;
    const double wall = (wall_z - origin.z()) / direction.z();
    const double floor = direction.y() > 0 ? (floor_y - origin.y()) / direction.y() : wall;
    return std::min(wall, floor);
  }

  double depth(const Camera& camera, double u, double v) const {
    // The direction has z = 1 in camera axes, so the parameter is the z-depth.
    return first_hit(camera.center(), camera.world_from_cam.linear() * camera.ray_in_cam(u, v));
  }

  bool visible(const Camera& camera, const Eigen::Vector3d& point) const {
    if (!camera.sees(camera.project(point))) return false;
    return first_hit(camera.center(), point - camera.center()) > 1 - 1e-9;
  }
};

Camera camera_at(const Eigen::Vector3d& center, double yaw = 0) {
  Camera camera{.width = 252, .height = 189, .fx = 210, .fy = 210, .cx = 126, .cy = 94.5};
  camera.world_from_cam.translation() = center;
  camera.world_from_cam.linear() =
      Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return camera;
}

SupportView view_of(const WallAndBox& scene, const Camera& camera) {
  SupportView view{camera, DepthMap(camera.width, camera.height, kNan), {}};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      view.depth(x, y) = float(scene.depth(camera, x + 0.5, y + 0.5));
    }
  }
  return view;
}

// One ball per pixel, as a coherent set starts out.
void add_pixels(const SupportView& view, Gaussians& g) {
  for (int y = 0; y < view.depth.height; ++y) {
    for (int x = 0; x < view.depth.width; ++x) {
      const double z = view.depth(x, y);
      g.position.push_back(view.camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
      g.scale.push_back(Eigen::Vector3f::Constant(float(0.6 * z / view.camera.fx)));
      g.rotation.emplace_back(1, 0, 0, 0);
      g.opacity.push_back(0.5f);
      g.sh.emplace_back(0, 0, 0);
    }
  }
}

// What input views from these cameras see, and the Gaussians of their pixels.
struct Inputs {
  std::vector<SupportView> views;
  Gaussians gaussians;
};

Inputs inputs_of(const WallAndBox& scene, const std::vector<Camera>& cameras) {
  Inputs out;
  for (const Camera& camera : cameras) {
    out.views.push_back(view_of(scene, camera));
    add_pixels(out.views.back(), out.gaussians);
  }
  return out;
}

struct HoleScore {
  double iou = 0;
  size_t truth = 0;
  size_t missed = 0;
  size_t invented = 0;
};

HoleScore score_holes(const std::vector<Camera>& inputs, const Camera& novel) {
  const WallAndBox scene;
  const auto [views, g] = inputs_of(scene, inputs);
  RenderBuffers buffers = rasterize(g, novel);
  annotate_support(buffers, novel, views);
  HoleScore score;
  size_t both = 0;
  for (int y = 0; y < novel.height; ++y) {
    for (int x = 0; x < novel.width; ++x) {
      const Eigen::Vector3d point =
          novel.unproject(x + 0.5, y + 0.5, scene.depth(novel, x + 0.5, y + 0.5));
      bool seen = false;
      for (const Camera& camera : inputs) seen = seen || scene.visible(camera, point);
      const bool hole = buffers.hole(x, y) != Hole::None;
      score.truth += seen ? 0 : 1;
      both += !seen && hole ? 1 : 0;
      score.missed += !seen && !hole ? 1 : 0;
      score.invented += seen && hole ? 1 : 0;
    }
  }
  score.iou = double(both) / double(both + score.missed + score.invented);
  return score;
}

std::vector<Camera> three_in_a_row() {
  return {camera_at({-0.06, 0, 0}), camera_at({0, 0, 0}), camera_at({0.06, 0, 0})};
}

// Novel views in which a good part of the picture was never seen.
TEST(AnnotateSupport, FindsTheHolesOfExactVisibility) {
  const std::vector<std::pair<std::string, Camera>> novels = {
      {"above", camera_at({0, 0.05, 0})},
      {"far above", camera_at({0.02, 0.1, 0})},
      {"beside", camera_at({0.12, 0, 0})},
      {"between", camera_at({0.03, 0.01, 0})},
      {"along the floor", camera_at({0.01, 0.12, 0})},
      {"closer", camera_at({0.01, 0.14, 0.1})},
      {"farther", camera_at({0.01, 0.04, -0.2})},
      {"turned", camera_at({0.15, 0.03, 0}, -0.2)},
  };
  for (const auto& [name, camera] : novels) {
    const HoleScore score = score_holes(three_in_a_row(), camera);
    EXPECT_GT(score.truth, 1000U) << name;
    EXPECT_GT(score.iou, 0.94) << name << ": " << score.missed << " missed, " << score.invented
                               << " invented of " << score.truth;
  }
}

TEST(AnnotateSupport, InventsNoHolesWhereEverythingWasSeen) {
  EXPECT_EQ(score_holes(three_in_a_row(), camera_at({0, 0, 0})).invented, 0U);
  for (const Camera& novel : {camera_at({0.01, 0.04, 0.2}), camera_at({0.01, 0.04, 0.3})}) {
    const HoleScore score = score_holes(three_in_a_row(), novel);
    EXPECT_EQ(score.truth, 0U);
    // Nearer by: half a pixel of an input along a silhouette of the box is a pixel here.
    EXPECT_LE(score.invented, 252U);
  }
}

// Gaussians, their rims and what a slanted surface changes over one of them grow with the picture.
TEST(AnnotateSupport, InventsHardlyAHoleInALargerPictureOfAnInputView) {
  EXPECT_LE(score_holes(three_in_a_row(), resized(camera_at({0, 0, 0}), 1008, 756)).invented, 20U);
}

TEST(AnnotateSupport, CountsTheViewsThatSeeTheSurface) {
  const WallAndBox scene;
  const auto [views, g] = inputs_of(scene, three_in_a_row());
  const Camera novel = camera_at({0.02, 0.01, 0});
  RenderBuffers buffers = rasterize(g, novel);
  annotate_support(buffers, novel, views);
  int wrong = 0;
  for (int y = 0; y < novel.height; ++y) {
    for (int x = 0; x < novel.width; ++x) {
      const Eigen::Vector3d point =
          novel.unproject(x + 0.5, y + 0.5, scene.depth(novel, x + 0.5, y + 0.5));
      const auto seen_by = std::count_if(views.begin(), views.end(), [&](const SupportView& view) {
        return scene.visible(view.camera, point);
      });
      if (buffers.support(x, y) != seen_by) ++wrong;
    }
  }
  // What remains are silhouettes, a pixel wide.
  EXPECT_LT(wrong, 0.02 * novel.width * novel.height);
}

// A rendered view and one witness, both of constant depth, from the same place.
struct Facing {
  Camera camera = camera_at({0, 0, 0});
  RenderBuffers buffers;
  SupportView view;

  Facing(float drawn, float seen) {
    const int w = camera.width;
    const int h = camera.height;
    buffers.alpha = Raster<float>(w, h, 1);
    buffers.depth = DepthMap(w, h, drawn);
    buffers.median_depth = DepthMap(w, h, drawn);
    view = {camera, DepthMap(w, h, seen), {}};
  }
  Hole judged(const SupportOptions& options = {}) {
    annotate_support(buffers, camera, std::span(&view, 1), options);
    EXPECT_EQ(buffers.support(9, 7), buffers.hole(9, 7) == Hole::None ? 1 : 0);
    return buffers.hole(9, 7);
  }
};

TEST(AnnotateSupport, DependsOnTheDepthOfTheWitness) {
  EXPECT_EQ(Facing(1, 1).judged(), Hole::None);
  EXPECT_EQ(Facing(0.995f, 1).judged(), Hole::None);
  EXPECT_EQ(Facing(0.9f, 1).judged(), Hole::Occluded);  // would have hidden what it saw
  EXPECT_EQ(Facing(1.1f, 1).judged(), Hole::Occluded);  // hidden from it
  EXPECT_EQ(Facing(1, kNan).judged(), Hole::Occluded);
  EXPECT_EQ(Facing(1.1f, 1).judged({.relative_tolerance = 0.2f}), Hole::None);
}

TEST(AnnotateSupport, BelievesAnUncertainWitnessMore) {
  Facing facing(1.1f, 1);
  facing.view.sigma = DepthMap(facing.camera.width, facing.camera.height, 0.05f);
  EXPECT_EQ(facing.judged(), Hole::None);
  EXPECT_EQ(facing.judged({.sigma_factor = 1}), Hole::Occluded);
  for (float& sigma : facing.view.sigma.data) sigma = kNan;  // no statement
  EXPECT_EQ(facing.judged(), Hole::Occluded);
}

TEST(AnnotateSupport, CallsPixelsWithoutASurfaceTransparent) {
  Facing facing(1, 1);
  facing.buffers.alpha(9, 7) = 0.49f;
  EXPECT_EQ(facing.judged(), Hole::Transparent);
  EXPECT_EQ(facing.judged({.min_alpha = 0.4f}), Hole::None);
  facing.buffers.median_depth(9, 7) = kNan;
  EXPECT_EQ(facing.judged({.min_alpha = 0.4f}), Hole::None);  // by its mean depth
  facing.buffers.depth(9, 7) = kNan;
  EXPECT_EQ(facing.judged({.min_alpha = 0.4f}), Hole::Transparent);
}

TEST(AnnotateSupport, TellsWhatNoPictureHoldsFromWhatWasNotReconstructed) {
  Facing facing(1, 1);
  facing.buffers.alpha(9, 7) = 0;
  facing.view.camera.world_from_cam.translation() << 5, 0, 0;
  EXPECT_EQ(facing.judged(), Hole::Transparent);  // far away the ray is in its picture
  facing.view.camera.world_from_cam.rotate(
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(facing.judged(), Hole::Outside);
}

TEST(AnnotateSupport, DoesNotTakeAFloaterForASurface) {
  // Three pixels that nobody saw, in front of a wall that everybody saw.
  Facing facing(1, 1);
  for (int x = 8; x <= 10; ++x) facing.buffers.median_depth(x, 7) = 0.6f;
  EXPECT_EQ(facing.judged(), Hole::Occluded);
  EXPECT_EQ(facing.buffers.hole(12, 7), Hole::None);
}

TEST(AnnotateSupport, CountsAdjoiningDepthOfSeveralViewsAsOneView) {
  Facing facing(1, 1);
  std::vector<SupportView> views(3, facing.view);
  const auto support = [&] {
    annotate_support(facing.buffers, facing.camera, views);
    return int(facing.buffers.support(9, 7));
  };
  EXPECT_EQ(support(), 3);
  const EvidenceMap adjoining(facing.camera.width, facing.camera.height, DepthEvidence::Adjoining);
  views[0].evidence = adjoining;
  EXPECT_EQ(support(), 2) << "it adds nothing to what views know";
  views[1].evidence = views[2].evidence = adjoining;
  EXPECT_EQ(support(), 1);
  EXPECT_EQ(facing.buffers.hole(9, 7), Hole::None);
  views[2].evidence = EvidenceMap(3, 3, DepthEvidence::Adjoining);
  EXPECT_THROW(support(), InvalidInput);
}

EvidenceMap everywhere(const Camera& camera, DepthEvidence evidence) {
  return {camera.width, camera.height, evidence};
}

TEST(AnnotateSupport, WhatAnEstimateOrSkyShowsHasNoSupportAndIsNoHole) {
  for (const auto& [evidence, kind] :
       {std::pair(DepthEvidence::Estimated, Hole::Estimated), {DepthEvidence::Sky, Hole::Sky}}) {
    Facing facing(1, 1);
    facing.view.evidence = everywhere(facing.camera, evidence);
    EXPECT_EQ(facing.judged(), kind);
    EXPECT_EQ(facing.buffers.support(9, 7), 0);
    EXPECT_FALSE(is_hole(kind));
    facing.buffers.median_depth(9, 7) = 0.8f;  // before all that it shows
    EXPECT_EQ(facing.judged(), Hole::Occluded);
  }
}

// Its sigma is half of its depth, as that of depth filled in far from anything measured.
TEST(AnnotateSupport, UncertainDepthThatWasFilledInVouchesForWhatIsDrawnNearIt) {
  const auto judged = [](float drawn, DepthEvidence evidence) {
    Facing facing(drawn, 1);
    facing.view.sigma = DepthMap(facing.camera.width, facing.camera.height, 0.5f);
    facing.view.evidence = everywhere(facing.camera, evidence);
    annotate_support(facing.buffers, facing.camera, std::span(&facing.view, 1));
    return facing.buffers.hole(9, 7);
  };
  for (const auto& [evidence, shown] : {std::pair(DepthEvidence::Estimated, Hole::Estimated),
                                        {DepthEvidence::Adjoining, Hole::None}}) {
    EXPECT_EQ(judged(0.8f, evidence), shown);
    EXPECT_EQ(judged(1.2f, evidence), shown);
    EXPECT_EQ(judged(0.7f, evidence), Hole::Occluded);
    EXPECT_EQ(judged(1.3f, evidence), Hole::Occluded);
  }
  EXPECT_EQ(judged(0.7f, DepthEvidence::Measured), Hole::None) << "a measurement says what it says";
}

TEST(AnnotateSupport, SkyVouchesForNothingNearerThanHalfItsBackdrop) {
  for (const auto& [drawn, hole] :
       {std::pair(0.6f, Hole::Sky), {1.6f, Hole::Sky}, {0.4f, Hole::Occluded}}) {
    Facing facing(drawn, 1);
    facing.view.sigma = DepthMap(facing.camera.width, facing.camera.height, 0.5f);
    facing.view.evidence = everywhere(facing.camera, DepthEvidence::Sky);
    EXPECT_EQ(facing.judged(), hole) << drawn;
  }
}

TEST(AnnotateSupport, AnEstimateAddsNothingToWhatOthersMeasured) {
  Facing facing(1, 1);
  std::vector<SupportView> views(3, facing.view);
  const auto judged = [&](DepthEvidence first, DepthEvidence second, DepthEvidence third) {
    views[0].evidence = everywhere(facing.camera, first);
    views[1].evidence = everywhere(facing.camera, second);
    views[2].evidence = everywhere(facing.camera, third);
    annotate_support(facing.buffers, facing.camera, views);
    return std::pair(int(facing.buffers.support(9, 7)), facing.buffers.hole(9, 7));
  };
  using enum DepthEvidence;
  EXPECT_EQ(judged(Estimated, Measured, Estimated), std::pair(1, Hole::None));
  EXPECT_EQ(judged(Sky, Measured, Measured), std::pair(2, Hole::None));
  EXPECT_EQ(judged(Estimated, Adjoining, Sky), std::pair(1, Hole::None));
  EXPECT_EQ(judged(Sky, Sky, Estimated), std::pair(0, Hole::Estimated));
  EXPECT_EQ(judged(Sky, Sky, Sky), std::pair(0, Hole::Sky));
}

TEST(AnnotateSupport, FindsNoWitnessBehindOrBesideItsImage) {
  Facing facing(1, 1);
  facing.view.camera.world_from_cam.translation().z() = 2;
  EXPECT_EQ(facing.judged(), Hole::Outside);
  facing.view.camera.world_from_cam.translation() << 5, 0, 0;
  EXPECT_EQ(facing.judged(), Hole::Outside);
}

TEST(AnnotateSupport, IsTheSameOfViewsThatAreLinkedOnceForAll) {
  const WallAndBox scene;
  auto [views, g] = inputs_of(scene, three_in_a_row());
  for (SupportView& view : views) {
    view.sigma = DepthMap(view.camera.width, view.camera.height, 0.01f);  // widens gaps
    view.depth(50, 60) = kNan;
  }
  const Camera novel = camera_at({0.12, 0.05, 0.1});
  RenderBuffers expected = rasterize(g, novel);
  RenderBuffers buffers = expected;
  annotate_support(expected, novel, views);
  for (SupportView& view : views) link_pixels(view);
  annotate_support(buffers, novel, views);
  EXPECT_EQ(buffers.support.data, expected.support.data);
  EXPECT_EQ(buffers.hole.data, expected.hole.data);
  views[0].links = SurfaceLinks(3, 3, 0);
  EXPECT_THROW(annotate_support(buffers, novel, views), InvalidInput);
}

TEST(AnnotateSupport, RefusesSizesThatDisagreeAndOptionsOutOfRange) {
  Facing facing(1, 1);
  EXPECT_NO_THROW(SupportOptions{}.validate());
  EXPECT_THROW((SupportOptions{.min_alpha = 0}.validate()), InvalidInput);
  EXPECT_THROW((SupportOptions{.sigma_factor = -1}.validate()), InvalidInput);
  EXPECT_THROW((SupportOptions{.relative_tolerance = kNan}.validate()), InvalidInput);
  facing.view.sigma = DepthMap(3, 3, 1);
  EXPECT_THROW(facing.judged(), InvalidInput);
  facing.view.sigma = {};
  const Camera other = resized(facing.camera, 10, 10);
  EXPECT_THROW(annotate_support(facing.buffers, other, {}), InvalidInput);
}

}  // namespace
}  // namespace cgs::support_test
