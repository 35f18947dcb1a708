// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/simplify.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "libcgs/core/error.h"
#include "meshing/edit/edge_collapse.h"
#include "meshing/mesh/certificate.h"

namespace cgs::simplify_test {
namespace {

using Eigen::Vector3f;

// A grid of cells in parameter space as two triangles each, optionally closed in either direction.
TriangleMesh grid(
    int nu, int nv, bool wrap_u, bool wrap_v, const std::function<Vector3f(float, float)>& at) {
  TriangleMesh mesh;
  const int columns = wrap_u ? nu : nu + 1;
  const int rows = wrap_v ? nv : nv + 1;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      mesh.vertices.push_back(at(float(i) / float(nu), float(j) / float(nv)));
    }
  }
  const auto id = [&](int i, int j) {
    return static_cast<uint32_t>((j % rows) * columns + i % columns);
  };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      mesh.faces.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.faces.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  return mesh;
}

constexpr double kTau = 2 * M_PI;
constexpr double kBigRadius = 0.3;
constexpr double kSmallRadius = 0.1;

TriangleMesh torus(int n) {
  return grid(3 * n, n, true, true, [](float u, float v) {
    const double around = kTau * double(u);
    const double tube = kTau * double(v);
    const double r = kBigRadius + kSmallRadius * std::cos(tube);
    return Vector3f(float(r * std::cos(around)),
                    float(r * std::sin(around)),
                    float(kSmallRadius * std::sin(tube)));
  });
}

double distance_to_torus(const Vector3f& p) {
  const double ring = std::hypot(double(p.x()), double(p.y())) - kBigRadius;
  return std::abs(std::hypot(ring, double(p.z())) - kSmallRadius);
}

// The surface of the unit cube, every side an n x n grid.
TriangleMesh cube(int n) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, uint32_t> known;
  const auto id = [&](const std::array<int, 3>& at) {
    const auto [it, added] = known.try_emplace(at, uint32_t(mesh.vertices.size()));
    if (added) mesh.vertices.emplace_back(Vector3f(at[0], at[1], at[2]) / float(n));
    return it->second;
  };
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const int side : {0, n}) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          const auto corner = [&](int du, int dv) {
            std::array<int, 3> at{};
            at.at(axis) = side;
            at.at((axis + 1) % 3) = i + du;
            at.at((axis + 2) % 3) = j + dv;
            return id(at);
          };
          std::array<uint32_t, 3> f = {corner(0, 0), corner(1, 0), corner(1, 1)};
          std::array<uint32_t, 3> g = {corner(0, 0), corner(1, 1), corner(0, 1)};
          if (side == 0) {
            std::swap(f[1], f[2]);
            std::swap(g[1], g[2]);
          }
          mesh.faces.push_back(f);
          mesh.faces.push_back(g);
        }
      }
    }
  }
  return mesh;
}

// A flat square [0, 1] x [0, 1]; faces left of the line x = border(y) are Observed.
TriangleMesh labelled_square(int n, const std::function<float(float)>& border) {
  TriangleMesh mesh =
      grid(n, n, false, false, [](float u, float v) { return Vector3f(u, v, 0.25f); });
  for (const auto& f : mesh.faces) {
    const Vector3f c = (mesh.vertices[f[0]] + mesh.vertices[f[1]] + mesh.vertices[f[2]]) / 3;
    mesh.provenance.push_back(c.x() < border(c.y()) ? Provenance::Observed : Provenance::Inferred);
  }
  return mesh;
}

using Segment = std::pair<Vector3f, Vector3f>;

// Edges between faces of different labels, or with one face only, by brute counting.
std::vector<Segment> border_segments(const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, std::vector<int>> labels;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const auto edge = std::minmax(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]);
      labels[edge].push_back(mesh.provenance.empty() ? 0 : int(mesh.provenance[f]));
    }
  }
  std::vector<Segment> out;
  for (const auto& [edge, of] : labels) {
    if (of.size() != 2 || of[0] != of[1]) {
      out.emplace_back(mesh.vertices[edge.first], mesh.vertices[edge.second]);
    }
  }
  return out;
}

double distance_to_segments(const Vector3f& p, const std::vector<Segment>& segments) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : segments) {
    const float t = std::clamp((b - a).dot(p - a) / (b - a).squaredNorm(), 0.0f, 1.0f);
    nearest = std::min(nearest, double((p - a - t * (b - a)).norm()));
  }
  return nearest;
}

// Largest distance from points along one set of segments to the other set.
double one_sided(const std::vector<Segment>& from, const std::vector<Segment>& to) {
  double most = 0;
  for (const auto& [a, b] : from) {
    for (const float t : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
      most = std::max(most, distance_to_segments(a + t * (b - a), to));
    }
  }
  return most;
}

TEST(Simplify, StaysWithinTheErrorOfATorusAndKeepsItsHandle) {
  const TriangleMesh mesh = torus(40);
  const double max_error = 2e-3;
  const double chord = kSmallRadius * (1 - std::cos(M_PI / 40)) + 4e-4;  // of the input itself
  const SimplifyResult result = simplify(mesh, {.max_error = max_error});
  EXPECT_LT(result.faces_after, result.faces_before / 2);
  EXPECT_EQ(result.faces_after, result.mesh.faces.size());
  const Certificate certificate = certify(result.mesh);
  EXPECT_TRUE(certificate.passed());
  EXPECT_EQ(certificate.genus, 1);
  for (const Vector3f& p : sample_surface(result.mesh, 20000)) {
    ASSERT_LT(distance_to_torus(p), max_error + chord);
  }
  EXPECT_LE(result.evidence.hausdorff(), max_error);
  EXPECT_NEAR(certificate.area / certify(mesh).area, 1, 0.01);
}

// Stones in a wall: plane faces with sharp edges, so that edges of both meshes cross far apart.
TriangleMesh wall(float size) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> height(0, 0.02f);
  std::vector<float> heights(40 * 40);
  for (float& h : heights) h = height(random);
  return grid(119, 119, false, false, [&](float u, float v) {
    const auto stone = size_t(std::lround(119 * v)) / 3 * 40 + size_t(std::lround(119 * u)) / 3;
    return Vector3f(size * u, size * v, size * heights[stone]);
  });
}

TEST(Simplify, IsNowhereFartherThanItStates) {
  constexpr double kMaxError = 0.004;
  SimplifyResult at_one;
  for (const int exponent : {0, -20, 20}) {
    const double scale = std::ldexp(1.0, exponent);
    const TriangleMesh mesh = wall(float(scale));
    const SimplifyResult result = simplify(mesh, {.max_error = scale * kMaxError});
    EXPECT_LT(result.faces_after, result.faces_before * 9 / 10);
    const MeshDistance dense = mesh_distance(result.mesh, mesh, 1'000'000);
    EXPECT_LE(dense.hausdorff(), result.evidence.hausdorff() * (1 + 1e-6)) << exponent;
    EXPECT_LE(result.evidence.hausdorff(), scale * kMaxError * (1 + 1e-6)) << exponent;
    if (exponent == 0) at_one = result;
    EXPECT_EQ(result.faces_after, at_one.faces_after) << exponent;
    EXPECT_EQ(result.evidence.hausdorff(), scale * at_one.evidence.hausdorff()) << exponent;
  }
}

TEST(Simplify, GivesFewerFacesForALargerError) {
  const TriangleMesh mesh = torus(30);
  size_t last = mesh.faces.size();
  for (const double max_error : {6e-4, 2e-3, 6e-3}) {
    const SimplifyResult result = simplify(mesh, {.max_error = max_error});
    EXPECT_LT(result.faces_after, last);
    EXPECT_LE(result.evidence.hausdorff(), max_error);
    last = result.faces_after;
  }
}

TEST(Simplify, LeavesOfACubeItsTwelveFacesAndItsVolume) {
  const SimplifyResult result = simplify(cube(12), {.max_error = 1e-3});
  EXPECT_EQ(result.faces_after, 12U);
  const Certificate certificate = certify(result.mesh);
  EXPECT_TRUE(certificate.passed());
  EXPECT_NEAR(certificate.volume, 1, 1e-2);
}

TEST(Simplify, StopsAtTheTarget) {
  const SimplifyResult result = simplify(torus(30), {.max_error = 0.01, .target_faces = 2000});
  EXPECT_LE(result.faces_after, 2000U);
  EXPECT_GE(result.faces_after, 1990U);
}

// A disc whose faces all meet in its middle, as CAD programs write lids.
TEST(Simplify, ManyFacesMayMeetInAVertex) {
  constexpr uint32_t kRim = 5000;
  TriangleMesh disc;
  disc.vertices.emplace_back(0, 0, 0);
  for (uint32_t i = 0; i < kRim; ++i) {
    const double turn = 2 * std::numbers::pi * i / kRim;
    disc.vertices.emplace_back(float(std::cos(turn)), float(std::sin(turn)), 0);
    disc.faces.push_back({0, 1 + i, 1 + (i + 1) % kRim});
  }
  const SimplifyResult result = simplify(disc, {.max_error = 1e-3});
  EXPECT_LT(result.faces_after, 200U);
  EXPECT_LT(result.evidence.hausdorff(), 1e-3);
}

TEST(Simplify, KeepsTheBorderBetweenLabelsWhereItIs) {
  const auto wavy = [](float y) { return 0.5f + 0.2f * std::sin(6 * y); };
  const TriangleMesh mesh = labelled_square(48, wavy);
  const double max_error = 5e-3;
  const SimplifyResult result = simplify(mesh, {.max_error = max_error});
  EXPECT_LT(result.faces_after, result.faces_before / 2);
  const auto before = border_segments(mesh);
  const auto after = border_segments(result.mesh);
  EXPECT_LT(after.size(), before.size());
  EXPECT_LE(one_sided(before, after), 1.5 * max_error);
  EXPECT_LE(one_sided(after, before), 1.5 * max_error);
  EXPECT_NEAR(result.area_after[size_t(Provenance::Observed)] /
                  result.area_before[size_t(Provenance::Observed)],
              1,
              0.01);
}

TEST(Simplify, MovesAStraightBorderNotAtAllAndNoFaceAcrossIt) {
  const TriangleMesh mesh = labelled_square(32, [](float) { return 0.5f; });
  const SimplifyResult result = simplify(mesh, {.max_error = 0.05, .max_error_inferred = 0.2});
  EXPECT_LT(result.faces_after, 40U);
  for (size_t f = 0; f < result.mesh.faces.size(); ++f) {
    for (const uint32_t v : result.mesh.faces[f]) {
      const float x = result.mesh.vertices[v].x();
      if (result.mesh.provenance[f] == Provenance::Observed) {
        EXPECT_LE(x, 0.5f + 1e-6f);
      } else {
        EXPECT_GE(x, 0.5f - 1e-6f);
      }
    }
  }
}

// Half observed, half not, and rough.
TriangleMesh rough_square() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> noise(-2e-3f, 2e-3f);
  TriangleMesh mesh = labelled_square(48, [](float) { return 0.5f; });
  for (Vector3f& p : mesh.vertices) p.z() += noise(random);
  return mesh;
}

TEST(Simplify, TakesEstimatedFacesAsItTakesInferredOnes) {
  TriangleMesh mesh = rough_square();
  const SimplifyOptions options = {.max_error = 3e-4, .max_error_inferred = 6e-3};
  const SimplifyResult inferred = simplify(mesh, options);
  std::replace(
      mesh.provenance.begin(), mesh.provenance.end(), Provenance::Inferred, Provenance::Estimated);
  const SimplifyResult estimated = simplify(mesh, options);
  EXPECT_EQ(estimated.mesh.vertices, inferred.mesh.vertices);
  EXPECT_EQ(estimated.mesh.faces, inferred.mesh.faces);
  EXPECT_EQ(estimated.inferred.hausdorff(), inferred.inferred.hausdorff());
  EXPECT_EQ(estimated.area_after[size_t(Provenance::Estimated)],
            inferred.area_after[size_t(Provenance::Inferred)]);
  EXPECT_EQ(estimated.area_after[size_t(Provenance::Inferred)], 0);
}

TEST(Simplify, IsLooserOnlyWhereInferred) {
  const TriangleMesh mesh = rough_square();
  const SimplifyResult result = simplify(mesh, {.max_error = 3e-4, .max_error_inferred = 6e-3});
  std::array<size_t, 4> before{};
  std::array<size_t, 4> after{};
  for (const Provenance label : mesh.provenance) ++before.at(size_t(label));
  for (const Provenance label : result.mesh.provenance) ++after.at(size_t(label));
  EXPECT_GT(after[size_t(Provenance::Observed)], before[size_t(Provenance::Observed)] / 2);
  EXPECT_LT(after[size_t(Provenance::Inferred)], before[size_t(Provenance::Inferred)] / 2);
  EXPECT_LE(result.evidence.hausdorff(), 3e-4);
  EXPECT_LE(result.inferred.hausdorff(), 6e-3);
  EXPECT_GT(result.inferred.hausdorff(), 3e-4);
}

TEST(Simplify, KeepsAnOpenRim) {
  const TriangleMesh mesh = grid(64, 16, true, false, [](float u, float v) {
    const double around = kTau * double(u);
    return Vector3f(float(0.3 * std::cos(around)), float(0.3 * std::sin(around)), v);
  });
  const double max_error = 2e-3;
  const SimplifyResult result = simplify(mesh, {.max_error = max_error});
  EXPECT_LT(result.faces_after, result.faces_before / 2);
  const auto before = border_segments(mesh);
  const auto after = border_segments(result.mesh);
  EXPECT_LE(one_sided(before, after), 1.5 * max_error);
  EXPECT_LE(one_sided(after, before), 1.5 * max_error);
  const Certificate certificate = certify(result.mesh);
  EXPECT_TRUE(certificate.edge_manifold && certificate.vertex_manifold);
  EXPECT_EQ(certificate.self_intersections, 0U);
}

TEST(Simplify, InterpolatesAttributesThatAreLinear) {
  TriangleMesh mesh = labelled_square(32, [](float) { return 2.0f; });
  for (const Vector3f& p : mesh.vertices) {
    mesh.colors.emplace_back(p.x(), p.y(), 0.5f);
    mesh.sigma.push_back(1 + p.x());
    mesh.support.push_back(2);
  }
  mesh.normals = vertex_normals(mesh);
  const SimplifyResult result = simplify(mesh, {.max_error = 1e-3});
  EXPECT_LT(result.faces_after, 300U);
  ASSERT_EQ(result.mesh.colors.size(), result.mesh.vertices.size());
  for (size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    const Vector3f& p = result.mesh.vertices[v];
    EXPECT_NEAR(result.mesh.colors[v].x(), p.x(), 0.03f);
    EXPECT_NEAR(result.mesh.colors[v].y(), p.y(), 0.03f);
    EXPECT_NEAR(result.mesh.sigma[v], 1 + p.x(), 0.05f);
    EXPECT_EQ(result.mesh.support[v], 2);
    EXPECT_NEAR(result.mesh.normals[v].z(), 1, 1e-6f);
  }
}

// A vertex between one that is known and one that is not is not known, nor does it keep the better
// support of the two: where known ones are far apart, only they themselves stay known.
TEST(Simplify, KnowledgeDoesNotSpread) {
  TriangleMesh mesh = labelled_square(32, [](float) { return 2.0f; });
  std::vector<Vector3f> known;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    Vector3f& p = mesh.vertices[v];
    p.z() = 0.02f * std::sin(9 * p.x()) * std::cos(7 * p.y());
    const bool is_known = v % 7 == 3;
    if (is_known) known.push_back(p);
    mesh.sigma.push_back(is_known ? 0.1f : std::nanf(""));
    mesh.support.push_back(is_known ? 5 : 2);
  }
  const SimplifyResult result = simplify(mesh, {.max_error = 5e-4});
  EXPECT_LT(result.faces_after, result.faces_before * 2 / 3);
  size_t kept = 0;
  for (size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    const bool is_known = result.mesh.support[v] > 2;
    EXPECT_EQ(is_known, !std::isnan(result.mesh.sigma[v])) << v;
    if (!is_known) continue;
    ++kept;
    EXPECT_TRUE(std::any_of(known.begin(), known.end(), [&](const Vector3f& p) {
      return (p - result.mesh.vertices[v]).norm() < 1e-6f;
    })) << v;
  }
  EXPECT_GT(kept, 10U);
}

TEST(Simplify, KeepsColoursThatTheFacesCarry) {
  TriangleMesh mesh = labelled_square(40, [](float) { return 0.5f; });
  for (const Vector3f& p : mesh.vertices) {
    mesh.colors.emplace_back(Vector3f::Constant(0.5f + 0.3f * std::sin(40 * p.x())));
  }
  const SimplifyResult kept = simplify(mesh, {.max_error = 1e-3, .max_color_error = 0.05});
  const SimplifyResult lost = simplify(mesh, {.max_error = 1e-3, .max_color_error = 1});
  std::array<size_t, 4> faces{};
  for (const Provenance label : kept.mesh.provenance) ++faces.at(size_t(label));
  EXPECT_GT(faces[size_t(Provenance::Observed)], 4 * faces[size_t(Provenance::Inferred)]);
  EXPECT_GT(kept.faces_after, 4 * lost.faces_after);
}

// Bumpy sheets a thousandth apart: simplified on their own they would cross.
TriangleMesh near_sheets() {
  const auto bumpy = [](float lift) {
    return grid(32, 32, false, false, [lift](float u, float v) {
      return Vector3f(u, v, lift + 8e-3f * std::sin(40 * u) * std::sin(33 * v));
    });
  };
  TriangleMesh mesh = bumpy(0);
  const TriangleMesh upper = bumpy(1e-3f);
  const auto n = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), upper.vertices.begin(), upper.vertices.end());
  for (const auto& f : upper.faces) mesh.faces.push_back({f[0] + n, f[1] + n, f[2] + n});
  mesh.provenance.assign(mesh.faces.size(), Provenance::Inferred);
  return mesh;
}

TEST(Simplify, DoesNotLetTwoNearSheetsIntersect) {
  const SimplifyResult result = simplify(near_sheets(), {.max_error = 8e-3});
  EXPECT_EQ(certify(result.mesh).self_intersections, 0U);
  EXPECT_LT(result.faces_after, result.faces_before);
  EXPECT_GT(result.rounds, 1);
}

// Neither where the error has no bound, and what crosses is first found by looking.
TEST(Simplify, DoesNotLetTwoNearSheetsIntersectForANumberOfFaces) {
  const TriangleMesh mesh = near_sheets();
  const SimplifyResult result =
      simplify(mesh, {.max_error = 4, .max_color_error = 1, .target_faces = mesh.faces.size() / 8});
  EXPECT_EQ(certify(result.mesh).self_intersections, 0U);
  EXPECT_LT(result.faces_after, result.faces_before / 2);
  EXPECT_GT(result.rounds, 1);
}

// What the input has cannot be mended here, and is no reason to leave the rest as it is.
TEST(Simplify, KeepsWhereTheInputCutsItselfAndSimplifiesTheRest) {
  const TriangleMesh ring = torus(32);
  const auto with_face = [&](const Vector3f& a, const Vector3f& b, const Vector3f& c) {
    TriangleMesh out = ring;
    const auto n = static_cast<uint32_t>(out.vertices.size());
    out.vertices.insert(out.vertices.end(), {a, b, c});
    out.faces.push_back({n, n + 1, n + 2});
    return out;
  };
  const TriangleMesh pierced =
      with_face({0.39f, 0.008f, 0.003f}, {0.41f, 0.009f, 0.003f}, {0.41f, 0.012f, 0.005f});
  const float within = 0.3997f;  // a little below the surface
  const TriangleMesh with_flat_face =
      with_face({within, 0.002f, 0}, {within, 0.003f, 0}, {within, 0.004f, 0});
  for (const TriangleMesh& mesh : {pierced, with_flat_face}) {
    const size_t given = certify(mesh).self_intersections;
    ASSERT_GT(given, 0U);
    const SimplifyResult result = simplify(mesh, {.max_error = 2e-3});
    EXPECT_LT(result.faces_after, result.faces_before / 2);
    EXPECT_LT(result.rounds, 10);
    EXPECT_LE(certify(result.mesh).self_intersections, given);
  }
}

TEST(Simplify, LeavesANonManifoldEdgeAlone) {
  TriangleMesh mesh = grid(8, 8, false, false, [](float u, float v) { return Vector3f(u, v, 0); });
  const auto n = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.5f, 0.5f, 0.5f);
  mesh.faces.push_back({9 * 4 + 4, 9 * 4 + 5, n});  // a fin on an inner edge
  const SimplifyResult result = simplify(mesh, {.max_error = 1e-3});
  EXPECT_LT(result.faces_after, result.faces_before);
  const auto segments = border_segments(result.mesh);
  EXPECT_LT(distance_to_segments(mesh.vertices[n], segments), 1e-7);
}

TEST(Simplify, TakesMeshesWithLittleInThem) {
  EXPECT_TRUE(simplify({}, {.max_error = 1}).mesh.faces.empty());
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.faces = {{0, 1, 2}};
  EXPECT_EQ(simplify(one, {.max_error = 0.01}).mesh.faces.size(), 1U);
  TriangleMesh line = one;  // without area
  line.vertices[2] = {2, 0, 0};
  EXPECT_EQ(simplify(line, {.max_error = 0.01}).mesh.faces.size(), 1U);
  TriangleMesh tetrahedron;
  tetrahedron.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_TRUE(certify(simplify(tetrahedron, {.max_error = 10}).mesh).passed());
}

TEST(Simplify, GivesTheSameBitsForAnyNumberOfThreads) {
  const TriangleMesh mesh = torus(40);
  TriangleMesh first;
  for (const size_t threads : {1, 2, 3, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const TriangleMesh result = simplify(mesh, {.max_error = 1e-3}).mesh;
    if (threads == 1) first = result;
    EXPECT_EQ(result.faces, first.faces);
    EXPECT_EQ(result.vertices, first.vertices);
  }
}

// One at a time is what the order of collapses means.
// An open tube with labels, colours, sigma and support.
TriangleMesh labelled_tube() {
  TriangleMesh mesh = grid(60, 40, false, true, [](float u, float v) {
    const float r = 0.2f + 0.03f * std::sin(20 * u) * std::cos(float(3 * kTau) * v);
    return Vector3f(u, r * std::cos(float(kTau) * v), r * std::sin(float(kTau) * v));
  });
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    mesh.provenance.push_back(f / 7 % 5 == 0 ? Provenance::Inferred : Provenance::Observed);
  }
  for (const Vector3f& p : mesh.vertices) {
    mesh.colors.push_back((Vector3f(0.5f, 0.5f, 0.5f) + p).cwiseMax(0).cwiseMin(1));
    mesh.sigma.push_back(0.01f + p.y() * p.y());
  }
  mesh.support.assign(mesh.vertices.size(), 2);
  return mesh;
}

TEST(CollapseEdges, GiveTheSameBitsTriedOneByOneOrManyAtOnce) {
  const TriangleMesh mesh = labelled_tube();
  for (const float tolerance : {0.01f, 100.0f}) {  // the second looks at no distances
    CollapseLimits limits;
    limits.tolerance.assign(mesh.vertices.size(), tolerance);
    limits.color = tolerance < 1 ? 0.1f : 1;
    limits.target_faces = 600;
    limits.batch = 1;
    const CollapsedMesh first = collapse_edges(mesh, limits);
    EXPECT_LT(first.mesh.faces.size(), mesh.faces.size() * 3 / 4);
    for (const size_t batch : {7, 100, 1 << 20}) {
      limits.batch = batch;
      const CollapsedMesh other = collapse_edges(mesh, limits);
      EXPECT_EQ(other.mesh.faces, first.mesh.faces) << batch;
      EXPECT_EQ(other.mesh.vertices, first.mesh.vertices) << batch;
      EXPECT_EQ(other.mesh.colors, first.mesh.colors) << batch;
      EXPECT_EQ(other.mesh.sigma, first.mesh.sigma) << batch;
      EXPECT_EQ(other.witness_of, first.witness_of) << batch;
    }
  }
}

TEST(CollapseEdges, RepeatToTheSameBits) {
  const TriangleMesh mesh = labelled_tube();
  for (const float tolerance : {0.01f, 100.0f}) {
    for (const size_t faces : {0, 600}) {
      CollapseLimits limits;
      limits.tolerance.assign(mesh.vertices.size(), tolerance);
      limits.color = tolerance < 1 ? 0.1f : 1;
      limits.target_faces = faces;
      const CollapsedMesh first = collapse_edges(mesh, limits);
      const CollapsedMesh again = collapse_edges(mesh, limits, &first.history);
      EXPECT_EQ(again.mesh.faces, first.mesh.faces);
      EXPECT_EQ(again.mesh.vertices, first.mesh.vertices);
      EXPECT_EQ(again.mesh.colors, first.mesh.colors);
      EXPECT_EQ(again.witness_of, first.witness_of);
      EXPECT_EQ(again.history.heirs, first.history.heirs);
    }
  }
}

// A spot is held nearer: there the input is met, far from it nothing changes.
TEST(CollapseEdges, RepeatDiffersOnlyWhereItIsHeldNearer) {
  const TriangleMesh mesh = labelled_tube();
  const Vector3f spot = mesh.vertices[mesh.vertices.size() / 2];
  const auto distance_to_spot = [&](const Vector3f& p) { return (p - spot).norm(); };
  CollapseLimits limits;
  limits.tolerance.assign(mesh.vertices.size(), 0.01f);
  const CollapsedMesh first = collapse_edges(mesh, limits);
  constexpr float kNear = 1e-4f;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (distance_to_spot(mesh.vertices[v]) < 0.05f) limits.tolerance[v] = kNear;
  }
  const CollapsedMesh again = collapse_edges(mesh, limits, &first.history);
  EXPECT_GT(again.mesh.faces.size(), first.mesh.faces.size());
  const auto farther_than = [&](const TriangleMesh& of, float least) {
    std::vector<std::array<Vector3f, 3>> out;
    for (const auto& f : of.faces) {
      const std::array<Vector3f, 3> corners = {
          of.vertices[f[0]], of.vertices[f[1]], of.vertices[f[2]]};
      if (std::all_of(corners.begin(), corners.end(), [&](const Vector3f& p) {
            return distance_to_spot(p) > least;
          })) {
        out.push_back(corners);
      }
    }
    return out;
  };
  EXPECT_EQ(farther_than(again.mesh, 0.6f), farther_than(first.mesh, 0.6f));
  EXPECT_GT(farther_than(first.mesh, 0.6f).size(), first.mesh.faces.size() / 4);
  const DistanceToMesh distance(again.mesh);
  size_t held = 0;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (limits.tolerance[v] != kNear) continue;
    ++held;
    EXPECT_LE(distance.of({mesh.vertices[v]}).front(), 1.001f * kNear);
  }
  EXPECT_GT(held, 4U);
}

// A label of ragged islands: smoothing their borders takes their area.
TEST(Simplify, HoldsTheAreaOfRaggedLabelsAtOnce) {
  TriangleMesh mesh = grid(60, 60, false, false, [](float u, float v) {
    return Vector3f(u, v, 1e-3f * std::sin(90 * u) * std::cos(70 * v));
  });
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const size_t row = f / 120;
    const size_t column = f % 120 / 2;
    const bool is_island = row % 10 < 4 + (column * 7 + row) % 3 && column % 12 < 5 + row % 2;
    mesh.provenance.push_back(is_island ? Provenance::SingleView : Provenance::Observed);
  }
  const SimplifyResult result = simplify(mesh, {.max_error = 0.02});
  EXPECT_EQ(result.rounds, 1);
  EXPECT_LT(result.faces_after, result.faces_before);
  for (const Provenance label : {Provenance::SingleView, Provenance::Observed}) {
    const double before = result.area_before.at(size_t(label));
    EXPECT_NEAR(result.area_after.at(size_t(label)), before, 0.01 * before);
  }
}

TEST(Simplify, RefusesVerticesThatAreNotFinite) {
  TriangleMesh mesh = torus(8);
  mesh.vertices[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(simplify(mesh, {.max_error = 1e-3}), InvalidInput);
}

TEST(SimplifyOptions, RefusesEveryFieldOutOfRange) {
  EXPECT_NO_THROW(SimplifyOptions{.max_error = 1}.validate());
  EXPECT_THROW(SimplifyOptions{}.validate(), InvalidInput);
  EXPECT_THROW(SimplifyOptions{.max_error = NAN}.validate(), InvalidInput);
  EXPECT_THROW((SimplifyOptions{.max_error = 1, .max_error_inferred = 0.5}.validate()),
               InvalidInput);
  EXPECT_THROW((SimplifyOptions{.max_error = 1, .max_color_error = 0}.validate()), InvalidInput);
  EXPECT_THROW((SimplifyOptions{.max_error = 1, .max_color_error = NAN}.validate()), InvalidInput);
  EXPECT_THROW((SimplifyOptions{.max_error = 1, .max_area_change = 0}.validate()), InvalidInput);
}

}  // namespace
}  // namespace cgs::simplify_test
