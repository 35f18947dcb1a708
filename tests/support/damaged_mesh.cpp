// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/damaged_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "meshing/mesh/components.h"
#include "meshing/mesh/vertex_attributes.h"
#include "tests/support/solid_meshes.h"

namespace cgs::test {

namespace {

using Eigen::Vector3f;

// Of one mesh and seed; std's distributions differ between libraries.
class Damager {
 public:
  Damager(TriangleMesh mesh, uint32_t seed) : mesh_(std::move(mesh)), random_(seed) {
    Eigen::AlignedBox3f box;
    for (const auto& p : mesh_.vertices) box.extend(p);
    diagonal_ = box.diagonal().norm();
    const auto& [a, b, c] = mesh_.faces[mesh_.faces.size() / 2];
    edge_ = ((mesh_.vertices[a] - mesh_.vertices[b]).norm() +
             (mesh_.vertices[b] - mesh_.vertices[c]).norm()) /
            2;
  }

  void make_holes(size_t count, double largest) {
    for (size_t i = 0; i < count; ++i) {
      const Vector3f at = some_place();
      const auto radius = static_cast<float>(between(0.2, 1) * largest * double(diagonal_));
      std::vector<uint8_t> keep;
      for (const auto& f : mesh_.faces) {
        keep.push_back((mesh_.vertices[f[0]] - at).norm() > radius ? 1 : 0);
      }
      if (std::count(keep.begin(), keep.end(), uint8_t(1)) > 100) mesh_ = with_faces(mesh_, keep);
    }
  }

  void flip_faces() {
    for (int i = 0; i < 3; ++i) {
      const Vector3f at = some_place();
      const auto radius = static_cast<float>(between(0.02, 0.1)) * diagonal_;
      for (auto& f : mesh_.faces) {
        if ((mesh_.vertices[f[0]] - at).norm() < radius) std::swap(f[1], f[2]);
      }
    }
    for (auto& f : mesh_.faces) {
      if (uniform() < 0.2) std::swap(f[1], f[2]);
    }
  }

  // The copy lies a little below the surface or, moved, goes through it.
  void double_shells(uint32_t which) {
    TriangleMesh copy = mesh_;
    if (which == 1 || which == 3) {
      const std::vector<Vector3f> normals = vertex_normals(mesh_);
      for (size_t v = 0; v < normals.size(); ++v) copy.vertices[v] -= 0.3f * edge_ * normals[v];
    }
    if (which == 2) {
      const Vector3f way = 0.001f * diagonal_ * direction();
      for (auto& p : copy.vertices) p += way;
    }
    if (which == 3) {  // a part of it
      const Vector3f at = some_place();
      std::vector<uint8_t> keep;
      for (const auto& p : mesh_.vertices) keep.push_back((p - at).norm() < 0.2f * diagonal_);
      copy = with_vertices(copy, keep);
    }
    mesh_ = joined(mesh_, copy);
  }

  void stick_in_balls(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      TriangleMesh ball = sphere_mesh(between(0.005, 0.015) * double(diagonal_), 12, 24).mesh;
      const Vector3f at = some_place();
      for (auto& p : ball.vertices) p += at;
      mesh_ = joined(mesh_, ball);
    }
  }

  void push_vertices(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      mesh_.vertices[some_vertex()] += static_cast<float>(between(1, 4)) * edge_ * direction();
    }
  }

  void hang_faces_on(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      const std::array<uint32_t, 3> f = mesh_.faces[some_face()];
      for (int fan = 0; fan < 3; ++fan) {
        const auto tip = static_cast<uint32_t>(mesh_.vertices.size());
        mesh_.vertices.push_back(mesh_.vertices[f[0]] + 2 * edge_ * direction());
        mesh_.faces.push_back({f[0], f[1], tip});
      }
    }
  }

  void join_vertices(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      const uint32_t a = some_vertex();
      const uint32_t b = nearest_stranger(a);
      for (auto& f : mesh_.faces) std::replace(f.begin(), f.end(), b, a);
    }
  }

  void add_degenerate_faces(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      const std::array<uint32_t, 3> f = mesh_.faces[some_face()];
      const auto middle = static_cast<uint32_t>(mesh_.vertices.size());
      mesh_.vertices.emplace_back((mesh_.vertices[f[0]] + mesh_.vertices[f[1]]) / 2);
      mesh_.vertices.push_back(some_place());  // nobody uses it
      const std::array<std::array<uint32_t, 3>, 4> faces = {
          {{f[0], f[1], middle}, {f[0], f[0], f[2]}, {f[1], f[2], f[0]}, {f[2], f[1], f[0]}}};
      mesh_.faces.push_back(faces.at(i % 4));
    }
  }

  // Faces whose side has a vertex that the neighbour over it does not know.
  void split_edges(size_t count) {
    for (size_t i = 0; i < count; ++i) {
      const size_t at = some_face();
      const std::array<uint32_t, 3> f = mesh_.faces[at];
      const auto middle = static_cast<uint32_t>(mesh_.vertices.size());
      mesh_.vertices.emplace_back((mesh_.vertices[f[0]] + mesh_.vertices[f[1]]) / 2);
      mesh_.faces[at] = {f[0], middle, f[2]};
      mesh_.faces.push_back({middle, f[1], f[2]});
    }
  }

  TriangleMesh result() && { return std::move(mesh_); }

 private:
  double uniform() { return double(random_()) / 4294967296.0; }
  double between(double a, double b) { return a + (b - a) * uniform(); }
  size_t some_face() { return static_cast<size_t>(uniform() * double(mesh_.faces.size())); }
  uint32_t some_vertex() { return mesh_.faces[some_face()][0]; }
  Vector3f some_place() { return mesh_.vertices[some_vertex()]; }
  Vector3f direction() {
    const double z = between(-1, 1);
    const double turn = between(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    return Eigen::Vector3d(r * std::cos(turn), r * std::sin(turn), z).cast<float>();
  }

  // The nearest vertex that is more than five edges away.
  uint32_t nearest_stranger(uint32_t a) const {
    uint32_t best = a;
    float least = diagonal_;
    for (uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      const float d = (mesh_.vertices[v] - mesh_.vertices[a]).norm();
      if (d < 5 * edge_ || d >= least) continue;
      best = v;
      least = d;
    }
    return best;
  }

  TriangleMesh mesh_;
  std::mt19937 random_;
  float diagonal_ = 0;
  float edge_ = 0;
};

}  // namespace

std::string_view damage_name(Damage damage) {
  constexpr std::array<std::string_view, kDamages.size()> kNames = {"holes",
                                                                    "flipped faces",
                                                                    "doubled shells",
                                                                    "self-intersections",
                                                                    "non-manifold",
                                                                    "degenerate faces",
                                                                    "everything"};
  return kNames.at(static_cast<size_t>(damage));
}

TriangleMesh damaged(const TriangleMesh& mesh, Damage damage, uint32_t seed) {
  Damager out(mesh, seed);
  const bool all = damage == Damage::Everything;
  if (damage == Damage::Holes) out.make_holes(12, 0.05);
  if (damage == Damage::FlippedFaces || all) out.flip_faces();
  if (damage == Damage::DoubledShells) out.double_shells(seed % 4);
  if (damage == Damage::SelfIntersections || all) out.stick_in_balls(all ? 1 : 3);
  if (damage == Damage::SelfIntersections || all) out.push_vertices(all ? 5 : 40);
  if (damage == Damage::NonManifold || all) out.hang_faces_on(all ? 10 : 100);
  if (damage == Damage::NonManifold || all) out.join_vertices(all ? 2 : 10);
  if (damage == Damage::DegenerateFaces || all) out.add_degenerate_faces(all ? 40 : 400);
  if (damage == Damage::DegenerateFaces || all) out.split_edges(all ? 10 : 100);
  if (all) out.make_holes(4, 0.04);
  return std::move(out).result();
}

}  // namespace cgs::test
