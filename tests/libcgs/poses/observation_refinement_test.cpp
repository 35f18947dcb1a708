// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/observation_refinement.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/stereo_scene.h"

namespace cgs::observation_refinement_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::TexturedPatch;

constexpr int kWidth = 240;
constexpr int kHeight = 180;

// A wall askew, turned by 20 degrees.
std::vector<TexturedPatch> wall() {
  return {{Vector3d(0, 0, 4), Vector3d(1, 0, 0.36).normalized(), Vector3d::UnitY()}};
}

/// Photographs of a wall, with features where noise puts them.
struct Photographed {
  std::vector<TexturedPatch> patches;
  std::vector<Camera> cameras;
  std::vector<UnposedPhoto> photos;
  Reconstruction scene;
};

Vector2d from_centre(const Camera& c, const Vector3d& uvz) {
  return {uvz.x() - 0.5 * c.width, uvz.y() - 0.5 * c.height};
}

Photographed photographed(double noise) {
  Photographed out;
  out.patches = wall();
  for (const double x : {-0.6, 0.0, 0.7}) {
    Camera c = test::looking_at({x, 0.2 * x, -0.3 * x}, {0.1 * x, 0, 4}, kWidth, kHeight, 220);
    c.world_from_cam.linear() *= Eigen::AngleAxisd(0.2 * x, Vector3d::UnitZ()).toRotationMatrix();
    out.cameras.push_back(c);
  }
  const Scene scene = test::photographed_scene(out.patches, out.cameras, 0.04);
  out.scene.lenses = {{220, 0, {0, 0}}};
  for (const View& view : scene.views) {
    UnposedPhoto photo;
    photo.width = kWidth;
    photo.height = kHeight;
    photo.features.picture = detect_features(view.image).picture;
    out.photos.push_back(std::move(photo));
    out.scene.lens_of.push_back(0);
    const Eigen::Isometry3d pose = view.camera.cam_from_world();
    out.scene.poses.push_back(PhotoPose{Eigen::Quaterniond(pose.rotation()), pose.translation()});
  }
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  for (int y = 30; y < kHeight - 30; y += 12) {
    for (int x = 40; x < kWidth - 40; x += 12) {
      const test::Hit hit = test::cast(out.patches, out.cameras[1], x, y);
      Track track;
      track.position = out.cameras[1].unproject(x, y, hit.depth);
      track.is_known = true;
      for (int i = 0; i < 3; ++i) {
        const Camera& camera = out.cameras[static_cast<size_t>(i)];
        const Vector2d off(normal(random), normal(random));
        const Vector2d at = from_centre(camera, camera.project(track.position)) + off;
        track.seen.push_back({i, static_cast<int>(out.scene.tracks.size()), at});
      }
      out.scene.tracks.push_back(track);
    }
  }
  return out;
}

// How far an observation is from where its photograph shows what the one that stays shows.
double error_of(const Photographed& photos, const Observation& fixed, const Observation& s) {
  const Vector2d at = fixed.at + Vector2d(0.5 * kWidth, 0.5 * kHeight);
  const Camera& from = photos.cameras[static_cast<size_t>(fixed.photo)];
  const test::Hit hit = test::cast(photos.patches, from, at.x(), at.y());
  const Camera& to = photos.cameras[static_cast<size_t>(s.photo)];
  return (from_centre(to, to.project(from.unproject(at.x(), at.y(), hit.depth))) - s.at).norm();
}

double median(std::vector<double> values) {
  std::nth_element(
      values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(ObservationRefinement, FindsWhatTheMiddlePhotographShowsToATwentiethOfAPixel) {
  Photographed photos = photographed(0.4);
  const std::vector<Track> before = photos.scene.tracks;
  refine_observations(photos.photos, photos.scene);
  std::vector<double> errors_before;
  std::vector<double> errors;
  size_t within_sigma = 0;
  for (size_t k = 0; k < before.size(); ++k) {
    const Track& track = photos.scene.tracks[k];
    EXPECT_EQ(track.seen[1].at, before[k].seen[1].at);
    for (const size_t i : {0u, 2u}) {
      errors_before.push_back(error_of(photos, before[k].seen[1], before[k].seen[i]));
      if (track.seen[i].at == before[k].seen[i].at) {
        EXPECT_EQ(track.seen[i].sigma, kFeatureSigma);
        continue;
      }
      errors.push_back(error_of(photos, track.seen[1], track.seen[i]));
      // Of two coordinates, 39 % lie within one sigma and 86 % within two.
      within_sigma += errors.back() < 2 * track.seen[i].sigma;
    }
  }
  EXPECT_GT(errors.size(), errors_before.size() * 9 / 10);
  EXPECT_GT(median(errors_before), 0.5);
  EXPECT_LT(median(errors), 0.05);
  EXPECT_GT(within_sigma, errors.size() * 8 / 10);
}

TEST(ObservationRefinement, BrightnessAndContrastDoNotMatter) {
  Photographed photos = photographed(0.4);
  Photographed darker = photos;
  for (uint8_t& level : darker.photos[0].features.picture.data)
    level = uint8_t(20 + level * 6 / 10);
  refine_observations(photos.photos, photos.scene);
  refine_observations(darker.photos, darker.scene);
  std::vector<double> differences;
  for (size_t k = 0; k < photos.scene.tracks.size(); ++k) {
    differences.push_back(
        (photos.scene.tracks[k].seen[0].at - darker.scene.tracks[k].seen[0].at).norm());
  }
  EXPECT_LT(median(differences), 0.03);
}

TEST(ObservationRefinement, WhatCannotBeToldStaysAsItWas) {
  Photographed photos = photographed(0.4);
  Photographed blank = photos;
  std::fill(blank.photos[0].features.picture.data.begin(),
            blank.photos[0].features.picture.data.end(),
            uint8_t(90));
  blank.photos[2].features.picture = {};
  const std::vector<Track> before = blank.scene.tracks;
  refine_observations(blank.photos, blank.scene);
  for (size_t k = 0; k < before.size(); ++k) {
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(blank.scene.tracks[k].seen[i].at, before[k].seen[i].at);
      EXPECT_EQ(blank.scene.tracks[k].seen[i].sigma, kFeatureSigma);
    }
  }
  // A match with another place is not moved there.
  Track& wrong = photos.scene.tracks[20];
  wrong.seen[0].at = before[25].seen[0].at;
  refine_observations(photos.photos, photos.scene);
  EXPECT_EQ(wrong.seen[0].at, before[25].seen[0].at);
  EXPECT_EQ(wrong.seen[0].sigma, kFeatureSigma);
}

TEST(ObservationRefinement, DoesNotDependOnTheNumberOfThreads) {
  Photographed several = photographed(0.4);
  Photographed single = several;
  refine_observations(several.photos, several.scene);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  refine_observations(single.photos, single.scene);
  for (size_t k = 0; k < several.scene.tracks.size(); ++k) {
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(several.scene.tracks[k].seen[i].at, single.scene.tracks[k].seen[i].at);
    }
  }
}

}  // namespace
}  // namespace cgs::observation_refinement_test
