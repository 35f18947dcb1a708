// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/provenance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/nan.h"
#include "libcgs/core/srgb.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/vertex_faces.h"
#include "meshing/volume/volume.h"

namespace cgs {

namespace {

// A weighted mean over those of the eight voxels that have a value.
template <typename T>
struct CellMean {
  T sum;
  float weight = 0;
  void add(const T& value, float w) {
    sum += w * value;
    weight += w;
  }
};

// The part of a voxel in a cell: 1 at its own corner, 0 at the three faces away from it.
float share_of(const Eigen::Vector3i& corner, const Eigen::Vector3f& t) {
  return (corner.x() != 0 ? t.x() : 1 - t.x()) * (corner.y() != 0 ? t.y() : 1 - t.y()) *
         (corner.z() != 0 ? t.z() : 1 - t.z());
}

class VolumeProbe {
 public:
  explicit VolumeProbe(const Volume& volume)
      : voxel_(volume.voxel_size),
        tsdf_(volume.tsdf->getConstAccessor()),
        support_(volume.support->getConstAccessor()),
        sigma_(volume.sigma->getConstAccessor()),
        color_(volume.color->getConstAccessor()),
        state_(volume.state->getConstAccessor()) {}

  struct Found {
    Evidence evidence = Evidence::None;
    bool is_estimated = false;
  };
  // Writes the attributes of vertex v; a missing colour becomes NaN.
  Found annotate(TriangleMesh& mesh, size_t v) {
    const Eigen::Vector3f index = mesh.vertices[v] / voxel_;
    const Eigen::Vector3f floor = index.array().floor();
    const Eigen::Vector3f t = index - floor;
    CellMean<float> distance{0};
    CellMean<float> off{0};  // the same, of nothing but where the vertex is
    CellMean<float> sigma{0};
    CellMean<Eigen::Vector3f> color{Eigen::Vector3f::Zero()};
    float nearest = std::numeric_limits<float>::max();
    float support = 0;
    bool is_estimated = false;
    int inside = 0;
    int outside = 0;
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3i d(k & 1, k >> 1 & 1, k >> 2 & 1);
      const openvdb::Coord at(
          int(floor.x()) + d.x(), int(floor.y()) + d.y(), int(floor.z()) + d.z());
      float value = 0;
      if (!tsdf_.probeValue(at, value)) continue;
      const float share = share_of(d, t);
      const float w = 1e-3f + share;  // keeps means defined on the faces of the cell
      distance.add(value, w);
      off.add(value, share);
      ++(value < 0 ? inside : outside);
      if (std::abs(value) < nearest) {
        nearest = std::abs(value);
        support = support_.getValue(at);
        is_estimated = state_.getValue(at) == int(VoxelState::Estimated);
      }
      float s = 0;
      if (sigma_.probeValue(at, s)) sigma.add(s, w);
      openvdb::Vec3f c(0);
      if (color_.probeValue(at, c)) color.add({c.x(), c.y(), c.z()}, w);
    }
    const bool crossing =
        inside > 0 && outside > 0 && std::abs(distance.sum) <= voxel_ * distance.weight;
    mesh.support[v] = crossing ? support : 0;
    const bool is_known = crossing && !is_estimated && sigma.weight > 0;
    // A level set that was smoothed may have its zero elsewhere: as much is not known better.
    const CellMean<float>& from_zero = off.weight > 0 ? off : distance;
    mesh.sigma[v] =
        is_known ? std::hypot(sigma.sum / sigma.weight, from_zero.sum / from_zero.weight) : kNaN;
    mesh.colors[v].setConstant(kNaN);
    if (crossing && color.weight > 0) {
      mesh.colors[v] = (color.sum / color.weight).unaryExpr(&srgb_from_linear);
    }
    if (!crossing) return {};
    return {inside + outside == 8 ? Evidence::Full : Evidence::Partial, is_estimated};
  }

 private:
  float voxel_;
  openvdb::FloatGrid::ConstAccessor tsdf_, support_, sigma_;
  openvdb::Vec3SGrid::ConstAccessor color_;
  openvdb::Int32Grid::ConstAccessor state_;
};

void spread_colors(TriangleMesh& mesh) {
  std::vector<uint32_t> front;
  for (uint32_t v = 0; v < mesh.colors.size(); ++v) {
    if (!std::isnan(mesh.colors[v].x())) front.push_back(v);
  }
  if (front.empty()) {
    mesh.colors.clear();
    return;
  }
  const VertexFaces around = faces_of_vertices(mesh.vertices.size(), mesh.faces);
  for (size_t i = 0; i < front.size(); ++i) {
    const uint32_t v = front[i];
    for (const uint32_t f : around.of(v)) {
      const auto& face = mesh.faces[f];
      const size_t at = face[0] == v ? 0 : face[1] == v ? 1 : 2;
      for (const uint32_t w : {face[(at + 1) % 3], face[(at + 2) % 3]}) {
        if (!std::isnan(mesh.colors[w].x())) continue;
        mesh.colors[w] = mesh.colors[v];
        front.push_back(w);
      }
    }
  }
  // Parts that no coloured vertex is joined to.
  for (auto& color : mesh.colors) {
    if (std::isnan(color.x())) color.setConstant(0.5f);
  }
}

// Faces without evidence that hang together over edges.
struct Patch {
  std::vector<uint32_t> faces;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // sum of area vectors
  Eigen::Vector3d rim_direction = Eigen::Vector3d::Zero();
  double area = 0;
  bool at_border = false;
  bool rim_is_unseen = false;  // nobody can vouch for what bridges it
};

class PatchLabeller {
 public:
  explicit PatchLabeller(TriangleMesh& mesh)
      : mesh_(mesh), links_(halfedges::halfedges_of(mesh)), seen_(mesh.faces.size(), 0) {}

  void label(double gap) {
    for (uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      if (seen_[f] != 0 || is_labelled(f)) continue;
      const Patch patch = patch_from(f);
      const bool alike = patch.direction.dot(patch.rim_direction) >
                         0.5 * patch.direction.norm() * patch.rim_direction.norm();
      if (patch.at_border || patch.rim_is_unseen || !(patch.area <= gap * gap) || !alike ||
          !is_disc(patch))
        continue;
      for (const uint32_t g : patch.faces) interpolated_.push_back(g);
    }
    for (const uint32_t f : interpolated_) mesh_.provenance[f] = Provenance::Interpolated;
  }

 private:
  bool is_labelled(uint32_t f) const { return mesh_.provenance[f] != Provenance::Inferred; }

  Patch patch_from(uint32_t start) {
    Patch patch;
    patch.faces = {start};
    seen_[start] = 1;
    for (size_t i = 0; i < patch.faces.size(); ++i) {
      const uint32_t f = patch.faces[i];
      const Eigen::Vector3d area = 0.5 * area_vector(mesh_, mesh_.faces[f]);
      patch.direction += area;
      patch.area += area.norm();
      for (const auto side : links_.fh_range(halfedges::FaceHandle(int(f)))) {
        const auto g = static_cast<uint32_t>(halfedges::face_across(links_, side).idx());
        if (g == f) patch.at_border = true;
        if (is_labelled(g)) patch.rim_direction += 0.5 * area_vector(mesh_, mesh_.faces[g]);
        if (is_labelled(g) && !was_seen(mesh_.provenance[g])) patch.rim_is_unseen = true;
        if (seen_[g] != 0 || is_labelled(g)) continue;
        seen_[g] = 1;
        patch.faces.push_back(g);
      }
    }
    return patch;
  }

  // Euler characteristic 1.
  bool is_disc(const Patch& patch) const {
    std::vector<int> vertices;
    std::vector<int> edges;
    for (const uint32_t f : patch.faces) {
      for (const auto side : links_.fh_range(halfedges::FaceHandle(int(f)))) {
        vertices.push_back(links_.to_vertex_handle(side).idx());
        edges.push_back(halfedges::first_edge(links_, links_.edge_handle(side)).idx());
      }
    }
    const auto distinct = [](auto& items) {
      std::sort(items.begin(), items.end());
      return std::unique(items.begin(), items.end()) - items.begin();
    };
    return distinct(vertices) - distinct(edges) + std::ptrdiff_t(patch.faces.size()) == 1;
  }

  TriangleMesh& mesh_;
  halfedges::HalfedgeMesh links_;
  std::vector<uint8_t> seen_;
  std::vector<uint32_t> interpolated_;
};

}  // namespace

VertexEvidence annotate_vertices(TriangleMesh& mesh, const Volume& volume) {
  const size_t n = mesh.vertices.size();
  mesh.support.assign(n, 0);
  mesh.sigma.assign(n, kNaN);
  mesh.colors.assign(n, Eigen::Vector3f::Zero());
  VertexEvidence out{std::vector<Evidence>(n, Evidence::None), std::vector<uint8_t>(n, 0)};
  tbb::parallel_for(tbb::blocked_range<size_t>(0, n, 1024), [&](const auto& range) {
    VolumeProbe probe(volume);  // Accessors keep a cache, so every task has its own.
    for (size_t v = range.begin(); v != range.end(); ++v) {
      const VolumeProbe::Found found = probe.annotate(mesh, v);
      out.of_vertex[v] = found.evidence;
      out.is_estimated[v] = found.is_estimated ? 1 : 0;
    }
  });
  spread_colors(mesh);
  return out;
}

void label_faces(TriangleMesh& mesh, const VertexEvidence& evidence, double gap) {
  mesh.provenance.assign(mesh.faces.size(), Provenance::Inferred);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    float support = std::numeric_limits<float>::max();
    bool seen = true;
    bool is_estimated = false;
    for (const uint32_t v : mesh.faces[f]) {
      seen = seen && evidence.of_vertex[v] != Evidence::None;
      is_estimated = is_estimated || evidence.is_estimated[v] != 0;
      support = std::min(support, mesh.support[v]);
    }
    if (!seen) continue;
    mesh.provenance[f] = is_estimated   ? Provenance::Estimated
                         : support >= 2 ? Provenance::Observed
                         : support >= 1 ? Provenance::SingleView
                                        : Provenance::Virtual;
  }
  PatchLabeller(mesh).label(gap);
}

}  // namespace cgs
