// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/edit/smoothing.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kGrain = 4096;

/// Neighbours of every vertex: those of v are to[first[v] ... first[v + 1]); none if it is locked.
struct Neighborhood {
  std::vector<uint32_t> first;
  std::vector<uint32_t> to;
  size_t locked = 0;
};

// Sides of faces by their first corner: the other corner, doubled, plus 1 for evidence. An edge
// inside a patch stands there twice, with the same number.
Neighborhood sides_of(const TriangleMesh& mesh) {
  Neighborhood out;
  out.first.assign(mesh.vertices.size() + 1, 0);
  for (const auto& face : mesh.faces) {
    for (const uint32_t v : face) out.first[v + 1] += 2;
  }
  for (size_t v = 1; v < out.first.size(); ++v) out.first[v] += out.first[v - 1];
  out.to.resize(out.first.back());
  std::vector<uint32_t> next(out.first.begin(), out.first.end() - 1);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const uint32_t seen = !mesh.provenance.empty() && was_seen(mesh.provenance[f]) ? 1 : 0;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = mesh.faces[f][k];
      out.to[next[v]++] = 2 * mesh.faces[f][(k + 1) % 3] + seen;
      out.to[next[v]++] = 2 * mesh.faces[f][(k + 2) % 3] + seen;
    }
  }
  return out;
}

// Sorts the sides of a vertex and keeps each neighbour once; \return their number, 0 = locked.
uint32_t tidy(uint32_t* begin, uint32_t* end) {
  std::sort(begin, end);
  uint32_t count = 0;
  for (const uint32_t* s = begin; s != end; s += 2) {
    const bool inside = s[0] == s[1] && (s + 2 == end || s[2] / 2 != s[0] / 2);
    if (!inside) return 0;
    begin[count++] = s[0] / 2;
  }
  return count;
}

Neighborhood neighborhood(const TriangleMesh& mesh) {
  Neighborhood sides = sides_of(mesh);
  std::vector<uint32_t> count(mesh.vertices.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count.size(), kGrain), [&](const auto& range) {
    for (size_t v = range.begin(); v != range.end(); ++v) {
      count[v] = tidy(sides.to.data() + sides.first[v], sides.to.data() + sides.first[v + 1]);
    }
  });
  uint32_t end = 0;
  for (size_t v = 0; v < count.size(); ++v) {
    const auto from = sides.to.begin() + sides.first[v];
    std::copy(from, from + count[v], sides.to.begin() + end);
    sides.first[v] = end;
    end += count[v];
    if (count[v] == 0) ++sides.locked;
  }
  sides.first.back() = end;
  sides.to.resize(end);
  return sides;
}

using Points = std::vector<Eigen::Vector3f>;

constexpr float kNoLength = 1e-12f;  // keeps the weight of an edge of length 0 finite

// Every vertex `share` of the way to the mean of its neighbours, all at once.
void step(const Neighborhood& around, float share, const Points& from, Points& to) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, from.size(), kGrain), [&](const auto& range) {
    for (size_t v = range.begin(); v != range.end(); ++v) {
      const uint32_t begin = around.first[v];
      const uint32_t end = around.first[v + 1];
      if (begin == end) {
        to[v] = from[v];
        continue;
      }
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float weights = 0;
      for (uint32_t k = begin; k < end; ++k) {
        const Eigen::Vector3f edge = from[around.to[k]] - from[v];
        const float weight = 1 / (edge.norm() + kNoLength);
        sum += weight * edge;
        weights += weight;
      }
      to[v] = from[v] + share / weights * sum;
    }
  });
}

}  // namespace

void SmoothingOptions::validate() const {
  constexpr size_t kMost = 10000;
  require(iterations >= 1 && iterations <= kMost,
          "SmoothingOptions.iterations must be in 1 ... 10000",
          iterations);
  require(inward > 0 && inward <= 1, "SmoothingOptions.inward must be in (0, 1]", inward);
  require(outward >= 0 && outward <= 1, "SmoothingOptions.outward must be in [0, 1]", outward);
}

SmoothedMesh smoothed(const TriangleMesh& mesh,
                      const SmoothingOptions& options,
                      const Progress& progress) {
  options.validate();
  constexpr uint32_t kMostVertices = 0x7fffffff;
  require(mesh.vertices.size() <= kMostVertices,
          "the number of vertices to smooth must be <= 2^31 - 1",
          mesh.vertices.size());
  const Neighborhood around = neighborhood(mesh);
  SmoothedMesh out{mesh, around.locked, 0, 0};
  Points& points = out.mesh.vertices;
  Points moved(points.size());
  for (size_t i = 0; i < options.iterations; ++i) {
    report(progress, double(i) / double(options.iterations));
    step(around, static_cast<float>(options.inward), points, moved);
    points.swap(moved);
    if (options.outward == 0) continue;
    step(around, static_cast<float>(-options.outward), points, moved);
    points.swap(moved);
  }
  double squares = 0;
  for (size_t v = 0; v < points.size(); ++v) {
    const double square = (points[v] - mesh.vertices[v]).cast<double>().squaredNorm();
    squares += square;
    float* sigma = mesh.sigma.empty() ? nullptr : &out.mesh.sigma[v];
    if (sigma != nullptr && square > 0) {
      *sigma = static_cast<float>(std::hypot(double{*sigma}, std::sqrt(square)));
    }
    out.most = std::max(out.most, std::sqrt(square));
  }
  const size_t free = points.size() - around.locked;
  if (free > 0) out.rms = std::sqrt(squares / static_cast<double>(free));
  if (!mesh.normals.empty()) out.mesh.normals = vertex_normals(out.mesh);
  return out;
}

}  // namespace cgs
