// SPDX-License-Identifier: GPL-3.0-or-later
// Times what rests on OpenMesh's halfedges, or does not, against the other way of doing it, on a
// ball of a million triangles whose faces are in order and then in none. Prints the medians of
// seven runs each, taken in turn, in seconds, and their ratio.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <random>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/face_adjacency.h"
#include "meshing/edit/loop_subdivision.h"
#include "meshing/edit/smoothing.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/halfedges.h"
#include "tests/bench/bumpy_ball.h"

namespace cgs {
namespace {

using namespace halfedges;
using OpenMesh3 = OpenMesh::TriMesh_ArrayKernelT<>;

double seconds(const std::function<size_t()>& work) {
  const auto start = std::chrono::steady_clock::now();
  if (work() == 0) std::printf("nothing came out\n");
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void compare(const char* name,
             const std::function<size_t()>& here,
             const std::function<size_t()>& otherwise) {
  std::array<double, 7> ours{};
  std::array<double, 7> others{};
  for (size_t i = 0; i < ours.size(); ++i) {
    ours.at(i) = seconds(here);
    others.at(i) = seconds(otherwise);
  }
  std::sort(ours.begin(), ours.end());
  std::sort(others.begin(), others.end());
  std::printf("%-66s %8.3f %8.3f %7.2fx\n", name, ours[3], others[3], others[3] / ours[3]);
  std::fflush(stdout);
}

// Faces one by one, as OpenMesh makes them.
template <typename Mesh>
void add_faces(const TriangleMesh& mesh, Mesh& out) {
  for (const auto& f : mesh.faces) {
    const std::array<VertexHandle, 3> corners = {
        VertexHandle(int(f[0])), VertexHandle(int(f[1])), VertexHandle(int(f[2]))};
    out.OpenMesh::PolyConnectivity::add_face(corners.data(), corners.size());
  }
}

size_t halfedges_face_by_face(const TriangleMesh& mesh) {
  HalfedgeMesh out;
  out.reserve(mesh.vertices.size(), mesh.faces.size() * 3 / 2, mesh.faces.size());
  for (size_t v = 0; v < mesh.vertices.size(); ++v) out.new_vertex();
  add_faces(mesh, out);
  return out.n_edges();
}

size_t loop_by_openmesh(const TriangleMesh& mesh) {
  OpenMesh3 out;
  for (const auto& p : mesh.vertices) out.add_vertex({p.x(), p.y(), p.z()});
  add_faces(mesh, out);
  OpenMesh::Subdivider::Uniform::LoopT<OpenMesh3> loop;
  loop.attach(out);
  loop(1);
  loop.detach();
  return out.n_faces();
}

// smoothed(), its neighbours found by turning around each vertex, as often as it is moved.
size_t smoothed_by_turning(const TriangleMesh& mesh, size_t times) {
  const HalfedgeMesh links = halfedges_of(mesh);
  std::vector<Eigen::Vector3f> from = mesh.vertices;
  std::vector<Eigen::Vector3f> to = from;
  for (size_t i = 0; i < times; ++i) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, from.size(), 4096), [&](const auto& range) {
      for (size_t v = range.begin(); v != range.end(); ++v) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        float weights = 0;
        for (const auto w : links.vv_range(VertexHandle(int(v)))) {
          const Eigen::Vector3f edge = from[size_t(w.idx())] - from[v];
          const float weight = 1 / (edge.norm() + 1e-12f);
          sum += weight * edge;
          weights += weight;
        }
        to[v] = from[v] + 0.5f / weights * sum;
      }
    });
    from.swap(to);
  }
  return from.size();
}

size_t components_by_walking(const TriangleMesh& mesh) {
  const HalfedgeMesh links = halfedges_of(mesh);
  std::vector<uint8_t> seen(mesh.faces.size(), 0);
  size_t parts = 0;
  for (const auto start : links.faces()) {
    if (seen[size_t(start.idx())] != 0) continue;
    ++parts;
    std::vector<FaceHandle> front = {start};
    seen[size_t(start.idx())] = 1;
    while (!front.empty()) {
      const FaceHandle f = front.back();
      front.pop_back();
      for (const auto g : links.ff_range(f)) {
        if (seen[size_t(g.idx())] != 0) continue;
        seen[size_t(g.idx())] = 1;
        front.push_back(g);
      }
    }
  }
  return parts;
}

void compare_all(const TriangleMesh& mesh) {
  std::printf("%-66s %8s %8s %8s\n", "here | otherwise", "here", "other", "ratio");
  const auto halfedges = [&] { return halfedges_of(mesh).n_edges(); };
  compare("halfedges_of() | OpenMesh face by face", halfedges, [&] {
    return halfedges_face_by_face(mesh);
  });
  compare("halfedges_of() | sides sorted by edge (core)", halfedges, [&] {
    return sides_by_edge(mesh).size();
  });
  compare(
      "Loop subdivision once | OpenMesh's, without sharp edges, attributes",
      [&] { return loop_subdivided(mesh, 1).faces.size(); },
      [&] { return loop_by_openmesh(mesh); });
  compare(
      "smoothing, 10 times | the same turning around vertices",
      [&] { return smoothed(mesh, {.iterations = 10}).mesh.vertices.size(); },
      [&] { return smoothed_by_turning(mesh, 10); });
  compare(
      "components() | by walking over halfedges",
      [&] { return components(mesh).area.size(); },
      [&] { return components_by_walking(mesh); });
}

}  // namespace
}  // namespace cgs

int main() {
  cgs::TriangleMesh mesh = cgs::bench::bumpy_ball();
  std::printf("%zu faces in order\n", mesh.faces.size());
  cgs::compare_all(mesh);
  std::mt19937 random(1);
  std::shuffle(mesh.faces.begin(), mesh.faces.end(), random);
  std::printf("the same in no order\n");
  cgs::compare_all(mesh);
  return 0;
}
