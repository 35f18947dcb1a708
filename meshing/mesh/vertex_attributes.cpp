// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/vertex_attributes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "libcgs/core/nan.h"
#include "meshing/mesh/components.h"

namespace cgs {

namespace {

// Appends the array of a second mesh; one that states nothing counts as `missing` throughout.
template <typename T>
void append_or(std::vector<T>& a,
               const std::vector<T>& b,
               std::pair<size_t, size_t> counts,
               const T& missing) {
  if (a.empty() && b.empty()) return;
  a.resize(counts.first, missing);
  a.insert(a.end(), b.begin(), b.end());
  a.resize(counts.first + counts.second, missing);
}

}  // namespace

void append_vertex(TriangleMesh& to, const TriangleMesh& from, uint32_t v) {
  const auto copy = [v](auto& out, const auto& in) {
    if (!in.empty()) out.push_back(in[v]);
  };
  copy(to.vertices, from.vertices);
  copy(to.normals, from.normals);
  copy(to.colors, from.colors);
  copy(to.support, from.support);
  copy(to.sigma, from.sigma);
}

void append_blend(TriangleMesh& to, const TriangleMesh& from, std::span<const VertexShare> shares) {
  Eigen::Vector3f place = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  float support = std::numeric_limits<float>::infinity();
  float sigma = 0;
  // Against the first vertex, so that equal values stay exactly what they are.
  const uint32_t first = shares.front().vertex;
  for (const auto& [v, weight] : shares) {
    if (!(weight > 0)) continue;
    place += weight * (from.vertices[v] - from.vertices[first]);
    if (!from.normals.empty()) normal += weight * from.normals[v];
    if (!from.colors.empty()) color += weight * (from.colors[v] - from.colors[first]);
    if (!from.support.empty()) support = std::min(support, from.support[v]);
    if (!from.sigma.empty()) sigma += weight * (from.sigma[v] - from.sigma[first]);
  }
  to.vertices.emplace_back(from.vertices[first] + place);
  const float length = normal.norm();
  if (!from.normals.empty()) {
    to.normals.emplace_back(length > 0 ? Eigen::Vector3f(normal / length)
                                       : Eigen::Vector3f(Eigen::Vector3f::Zero()));
  }
  if (!from.colors.empty()) to.colors.emplace_back(from.colors[first] + color);
  if (!from.support.empty()) to.support.push_back(support);
  if (!from.sigma.empty()) to.sigma.push_back(from.sigma[first] + sigma);
}

void take_weaker_claims(TriangleMesh& mesh, uint32_t kept, uint32_t other) {
  if (!mesh.support.empty()) {
    mesh.support[kept] = std::min(mesh.support[kept], mesh.support[other]);
  }
  if (mesh.sigma.empty() || mesh.sigma[other] <= mesh.sigma[kept]) return;
  if (!std::isnan(mesh.sigma[kept])) mesh.sigma[kept] = mesh.sigma[other];  // NaN takes over
}

bool are_of_other_colors(const TriangleMesh& mesh, uint32_t a, uint32_t b) {
  constexpr float kOther = 0.1f;
  return !mesh.colors.empty() &&
         !((mesh.colors[a] - mesh.colors[b]).cwiseAbs().maxCoeff() <= kOther);
}

TriangleMesh with_vertices(const TriangleMesh& mesh, const std::vector<uint8_t>& keep) {
  assert(keep.size() == mesh.vertices.size());
  if (!mesh.faces.empty()) {
    std::vector<uint8_t> keep_face;
    keep_face.reserve(mesh.faces.size());
    for (const auto& [a, b, c] : mesh.faces) keep_face.push_back(keep[a] & keep[b] & keep[c]);
    return with_faces(mesh, keep_face);
  }
  TriangleMesh out;
  for (uint32_t v = 0; v < keep.size(); ++v) {
    if (keep[v] != 0) append_vertex(out, mesh, v);
  }
  return out;
}

TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b) {
  const std::pair<size_t, size_t> vertices(a.vertices.size(), b.vertices.size());
  const std::pair<size_t, size_t> faces(a.faces.size(), b.faces.size());
  TriangleMesh out = a;
  if (!a.normals.empty() || !b.normals.empty()) {
    if (a.normals.empty()) out.normals = vertex_normals(a);
    const auto more = b.normals.empty() ? vertex_normals(b) : b.normals;
    out.normals.insert(out.normals.end(), more.begin(), more.end());
  }
  const Eigen::Vector3f grey = Eigen::Vector3f::Constant(0.5f);
  append_or(out.colors, b.colors, vertices, grey);
  append_or(out.support, b.support, vertices, 0.0f);
  append_or(out.sigma, b.sigma, vertices, kNaN);
  append_or(out.provenance, b.provenance, faces, Provenance::Inferred);
  out.vertices.insert(out.vertices.end(), b.vertices.begin(), b.vertices.end());
  const auto shift = static_cast<uint32_t>(a.vertices.size());
  for (const auto& f : b.faces) out.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  return out;
}

}  // namespace cgs
