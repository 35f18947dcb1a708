// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/face_views.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/textured_cube.h"

namespace cgs::face_views_test {
namespace {

using Eigen::Vector3d;

View view_at(const Vector3d& eye, const Vector3d& target = Vector3d::Zero()) {
  View view;
  view.camera = test::camera_at(eye, target);
  return view;
}

Vector3d middle(const TriangleMesh& mesh, size_t f) {
  Vector3d sum = Vector3d::Zero();
  for (const uint32_t v : mesh.faces[f]) sum += mesh.vertices[v].cast<double>();
  return sum / 3;
}

Vector3d normal(const TriangleMesh& mesh, size_t f) {
  const Vector3d a = mesh.vertices[mesh.faces[f][0]].cast<double>();
  const Vector3d b = mesh.vertices[mesh.faces[f][1]].cast<double>();
  const Vector3d c = mesh.vertices[mesh.faces[f][2]].cast<double>();
  return (b - a).cross(c - a).normalized();
}

TEST(FaceScores, AreProjectedAreaTimesCosine) {
  const TriangleMesh mesh = test::box(8);
  const std::vector<View> views = {view_at({0.9, 0.7, -1.2})};
  const FaceScores scores = face_scores(mesh, views);
  const Camera& camera = views[0].camera;
  size_t shown = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const Vector3d p = middle(mesh, f);
    const Vector3d to_eye = camera.center() - p;
    const double cosine = normal(mesh, f).dot(to_eye.normalized());
    EXPECT_EQ(scores(f, 0) > 0, cosine > 0.1) << f;
    if (!(cosine > 0.1)) continue;
    ++shown;
    // Image area per surface area of a small patch: fx fy cos(angle) distance / z^3.
    const double z = camera.project(p).z();
    const double density = camera.fx * camera.fy * cosine * to_eye.norm() / (z * z * z);
    EXPECT_NEAR(scores(f, 0) / (density * cosine), 1, 0.08) << f;
  }
  EXPECT_EQ(shown, 3 * 2 * 8 * 8u);
}

TEST(FaceScores, NeverShowAFaceBehindAnother) {
  // A small box floats before a side of a large one; which faces it hides is found by rays.
  TriangleMesh mesh = test::box(24);
  const TriangleMesh occluder = test::box(4);
  const Eigen::Vector3f place(0.1f, 0.05f, -0.6f);
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (const auto& v : occluder.vertices) mesh.vertices.push_back(place + 0.3f * v);
  for (const auto& f : occluder.faces) {
    mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  mesh.provenance.assign(mesh.faces.size(), Provenance::Observed);
  const Eigen::AlignedBox3d bounds((place.array() - 0.06f).matrix().cast<double>(),
                                   (place.array() + 0.06f).matrix().cast<double>());
  const std::vector<View> views = {view_at({0, 0, -1.5}), view_at({0.5, 0.2, -1.4})};
  const FaceScores scores = face_scores(mesh, views);
  size_t hidden = 0;
  size_t clear_and_shown = 0;
  size_t clear = 0;
  for (size_t f = 0; f < 2 * 6 * 24 * 24; ++f) {
    for (size_t v = 0; v < 2; ++v) {
      const Vector3d eye = views[v].camera.center();
      if (!(normal(mesh, f).dot((eye - middle(mesh, f)).normalized()) > 0.1)) continue;
      bool blocked = false;
      bool near_shadow = false;
      for (const uint32_t corner : mesh.faces[f]) {
        const Vector3d to = mesh.vertices[corner].cast<double>() - eye;
        blocked = blocked || test::hit_box(eye, to, bounds) < 1;
        const Eigen::AlignedBox3d larger(bounds.min().array() - 0.01, bounds.max().array() + 0.01);
        near_shadow = near_shadow || test::hit_box(eye, to, larger) < 1;
      }
      if (blocked) {
        ++hidden;
        EXPECT_EQ(scores(f, v), 0) << f << " " << v;
      } else if (!near_shadow) {
        ++clear;
        clear_and_shown += scores(f, v) > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(hidden, 100u);
  EXPECT_GT(clear, 1000u);
  EXPECT_EQ(clear_and_shown, clear);
}

TEST(FaceScores, NeverShowAFaceBehindOneThatReachesBehindTheCamera) {
  TriangleMesh mesh;
  mesh.vertices = {{-0.1f, -0.1f, 2}, {0, 0.1f, 2}, {0.1f, -0.1f, 2}};
  mesh.faces = {{0, 1, 2}};
  const std::vector<View> views = {view_at({0, 0, 0}, {0, 0, 1})};
  EXPECT_GT(face_scores(mesh, views)(0, 0), 0);
  mesh.vertices.insert(mesh.vertices.end(), {{-3, -3, -2}, {-3, 3, -2}, {3, 0, 4}});
  mesh.faces.push_back({3, 4, 5});  // 1 before the camera, and 2 behind it
  EXPECT_EQ(face_scores(mesh, views)(0, 0), 0);
}

TEST(FaceScores, LargeFacesAreNotShownWhereOnlyTheirMiddleIsHidden) {
  TriangleMesh mesh = test::box(1);  // sides of two triangles
  const TriangleMesh occluder = test::box(4);
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (const auto& v : occluder.vertices) {
    mesh.vertices.push_back(Eigen::Vector3f(-0.05f, -0.05f, -0.4f) + 0.1f * v);
  }
  for (const auto& f : occluder.faces) {
    mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  mesh.provenance.clear();
  const FaceScores scores = face_scores(mesh, {view_at({0, 0, -1.5})});
  int shown = 0;
  for (size_t f = 8; f < 10; ++f) shown += scores(f, 0) > 0 ? 1 : 0;  // the side towards -z
  EXPECT_EQ(shown, 1);
}

TEST(FaceScores, WantTheWholeFaceInTheValidPicture) {
  const TriangleMesh mesh = test::box(8);
  View half = view_at({0.22, 0.5, -0.65}, {0.22, 0.15, 0});
  const FaceScores all = face_scores(mesh, {half});
  half.valid = MaskMap(320, 240, 1);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 160; ++x) half.valid(x, y) = 0;
  }
  const FaceScores masked = face_scores(mesh, {half});
  int outside = 0;
  int invalid = 0;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!(normal(mesh, f).dot((half.camera.center() - middle(mesh, f)).normalized()) > 0.1)) {
      continue;
    }
    bool inside = true;
    bool right = true;
    for (const uint32_t v : mesh.faces[f]) {
      const Vector3d uvz = half.camera.project(mesh.vertices[v].cast<double>());
      inside = inside && uvz.x() >= 0.5 && uvz.x() <= 319.5 && uvz.y() >= 0.5 && uvz.y() <= 239.5;
      right = right && uvz.x() >= 160;
    }
    EXPECT_EQ(all(f, 0) > 0, inside) << f;
    EXPECT_EQ(masked(f, 0) > 0, inside && right) << f;
    outside += inside ? 0 : 1;
    invalid += inside && !right ? 1 : 0;
  }
  EXPECT_GT(outside, 10);
  EXPECT_GT(invalid, 10);
}

TEST(FaceScores, ShowNoInventedSurface) {
  TriangleMesh mesh = test::box(2);
  const std::vector<View> views = {view_at({0, 0, -1.5})};
  const FaceScores seen = face_scores(mesh, views);
  mesh.provenance.assign(mesh.faces.size(), Provenance::Inferred);
  mesh.provenance[32] = Provenance::Interpolated;
  mesh.provenance[33] = Provenance::SingleView;
  const FaceScores scores = face_scores(mesh, views);
  for (size_t f = 0; f < mesh.faces.size(); ++f) EXPECT_EQ(scores(f, 0) > 0, f == 33) << f;
  EXPECT_GT(seen(32, 0), 0);
}

TEST(ChooseFaceViews, GivesEverySideOfABoxTheCameraThatFacesIt) {
  const TriangleMesh mesh = test::box(8);
  std::vector<View> views;
  for (int side = 0; side < 6; ++side) {
    // Not straight on, so that most sides are seen by several cameras.
    Vector3d eye(0.25, 0.3, -0.2);
    eye[side / 2] = side % 2 == 0 ? -1.5 : 1.5;
    views.push_back(view_at(eye));
  }
  const FaceScores scores = face_scores(mesh, views);
  const FaceViews chosen = choose_face_views(mesh, scores);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    EXPECT_EQ(chosen.of_face[f], static_cast<int>(f / (2 * 8 * 8))) << f;
  }
}

// A flat square of n x n cells, and scores of two views whose order changes at x = 0.5 with noise.
struct NoisyPlane {
  TriangleMesh mesh;
  FaceScores scores;
  explicit NoisyPlane(int n) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        mesh.vertices.emplace_back(
            static_cast<float>(i) / float(n), static_cast<float>(j) / float(n), 0.0f);
      }
    }
    const auto at = [&](int i, int j) { return static_cast<uint32_t>(j * (n + 1) + i); };
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0, 0.3f);
    scores.views = 3;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        for (const std::array<uint32_t, 3>& f :
             {std::array{at(i, j), at(i + 1, j), at(i, j + 1)},
              std::array{at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}}) {
          mesh.faces.push_back(f);
          const float right = static_cast<float>(i) / float(n) - 0.5f;
          scores.score.push_back(1e4f * std::exp(-right + noise(random)));
          scores.score.push_back(1e4f * std::exp(right + noise(random)));
          scores.score.push_back(0);
        }
      }
    }
  }
};

TEST(ChooseFaceViews, MakesSeamsShortAndNeverTakesAViewThatShowsNothing) {
  NoisyPlane plane(60);
  plane.scores.score[3 * 17] = 0;  // one face that only the wrong view shows,
  plane.scores.score[3 * 51] = plane.scores.score[3 * 51 + 1] = 0;  // and one that none does
  const FaceViews best = choose_face_views(plane.mesh, plane.scores, {.seam_cost = 0});
  const FaceViews chosen = choose_face_views(plane.mesh, plane.scores, {.seam_cost = 5});
  EXPECT_EQ(best.seam_length, best.best_seam_length);
  EXPECT_EQ(chosen.best_seam_length, best.best_seam_length);
  EXPECT_GT(best.best_seam_length, 20);  // noise
  EXPECT_LT(chosen.seam_length, 3);      // the shortest has length 1
  for (size_t f = 0; f < plane.mesh.faces.size(); ++f) {
    const int view = chosen.of_face[f];
    if (f == 51) {
      EXPECT_EQ(view, -1);
      continue;
    }
    ASSERT_GE(view, 0);
    EXPECT_GT(plane.scores(f, static_cast<size_t>(view)), 0);
    const float x = plane.mesh.vertices[plane.mesh.faces[f][0]].x();
    if (std::abs(x - 0.5f) > 0.2f && f != 17) EXPECT_EQ(view, x > 0.5f ? 1 : 0) << f;
  }
  EXPECT_EQ(chosen.of_face[17], 1);
}

TEST(ChooseFaceViews, TakesOneViewWhereSeamsCostMoreThanTheyGain) {
  const NoisyPlane plane(20);
  const FaceViews chosen = choose_face_views(plane.mesh, plane.scores, {.seam_cost = 1e4});
  EXPECT_EQ(chosen.seam_length, 0);
}

TEST(ChooseFaceViews, ToleratesMeshesThatNoViewShows) {
  const TriangleMesh mesh = test::box(2);
  const FaceViews chosen = choose_face_views(mesh, face_scores(mesh, {}));
  for (const int view : chosen.of_face) EXPECT_EQ(view, -1);
  EXPECT_EQ(chosen.seam_length, 0);
}

TEST(ChooseFaceViews, RefusesOptionsAndScoresThatDoNotFit) {
  const TriangleMesh mesh = test::box(2);
  EXPECT_THROW(choose_face_views(mesh, face_scores(mesh, {}), {.seam_cost = -1}), InvalidInput);
  EXPECT_THROW(choose_face_views(mesh, face_scores(mesh, {}), {.seam_cost = std::nan("")}),
               InvalidInput);
  EXPECT_THROW(choose_face_views(mesh, FaceScores{2, {1, 2}}), InvalidInput);
}

}  // namespace
}  // namespace cgs::face_views_test
