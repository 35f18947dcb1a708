// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/mesh/stated_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/mesh/corner_shares.h"
#include "meshing/mesh/measured_value.h"
#include "meshing/mesh/nearest_surface.h"
#include "meshing/mesh/point_normals.h"

namespace cgs {

namespace {

Provenance label_by_support(float support) {
  return support >= 2   ? Provenance::Observed
         : support >= 1 ? Provenance::SingleView
                        : Provenance::Inferred;
}

// Files state normals of any length, and zeros where they know none.
// \return none if all are zero
std::vector<Eigen::Vector3f> unit_normals(std::vector<Eigen::Vector3f> normals) {
  for (Eigen::Vector3f& n : normals) n.stableNormalize();
  if (std::none_of(normals.begin(), normals.end(), is_known_normal)) normals.clear();
  return normals;
}

}  // namespace

struct StatedSurface::Search {
  std::optional<NearestSurface> surface;
  std::optional<KdTree> points;
  std::vector<Eigen::Vector3f> normals;  // of the points
};

StatedSurface::StatedSurface(const TriangleMesh& mesh) : search_(std::make_unique<Search>()) {
  input_.mesh = mesh;
  input_.points.reserve(mesh.vertices.size());
  for (const auto& p : mesh.vertices) input_.points.push_back(p.cast<double>());
  if (!is_cloud()) {
    search_->surface.emplace(input_);
    return;
  }
  constexpr size_t kNeighbors = 12;
  require(!mesh.vertices.empty(),
          "the number of points of a surface must be > 0",
          mesh.vertices.size());
  search_->points.emplace(mesh.vertices);
  input_.mesh.normals = unit_normals(std::move(input_.mesh.normals));
  search_->normals = input_.mesh.normals.empty() ? estimated_normals(mesh.vertices, kNeighbors)
                                                 : input_.mesh.normals;
}

StatedSurface::~StatedSurface() = default;

bool StatedSurface::states_provenance() const {
  return is_cloud() ? !input_.mesh.support.empty() : input_.states_provenance();
}

StatedPlace StatedSurface::nearest(const Eigen::Vector3d& point) const {
  StatedPlace out;
  if (is_cloud()) {
    std::vector<Neighbor> found;
    search_->points->nearest(point.cast<float>(), 1, found);
    const uint32_t v = found.front().point;
    out.position = input_.points[v];
    out.normal = search_->normals[v].cast<double>();
    out.shares = {{{v, 1}, {v, 0}, {v, 0}}};
    if (states_provenance()) out.label = label_by_support(input_.mesh.support[v]);
    return out;
  }
  const SurfacePoint at = search_->surface->nearest(point);
  const SurfaceEvidence evidence = evidence_at(input_, at);
  out.position = at.position;
  out.normal = evidence.normal;
  out.label = evidence.provenance;
  out.shares = corner_shares(input_.mesh.faces[at.face], at.weights);
  return out;
}

double point_spacing(const std::vector<Eigen::Vector3f>& points) {
  constexpr size_t kNeighbors = 6;
  if (points.size() < 2) return 0;
  const KdTree tree(points);
  std::vector<float> mean(points.size());
  tbb::parallel_for(size_t(0), points.size(), [&](size_t i) {
    std::vector<Neighbor> found;
    tree.nearest(points[i], kNeighbors + 1, found);  // the point itself is among them
    double sum = 0;
    for (const Neighbor& n : found) sum += std::sqrt(double(n.squared_distance));
    mean[i] = static_cast<float>(sum / double(found.size() - 1));
  });
  return double{median(mean)};
}

namespace {

enum class Side : uint8_t { Front, Bridge, Back };

struct FaceFinding {
  Provenance label = Provenance::Inferred;  ///< Observed where a source without labels vouches.
  Side side = Side::Front;
  double area = 0;
};

FaceFinding examine(const std::array<Eigen::Vector3d, 3>& corners,
                    const StatedSurface& source,
                    double reach) {
  FaceFinding out;
  const Eigen::Vector3d area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const Eigen::Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
  out.area = area.norm();
  out.label = Provenance::Observed;
  int backs = 0;
  bool far = false;
  for (size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d at = k < 3 ? Eigen::Vector3d((middle + corners.at(k)) / 2) : middle;
    const StatedPlace place = source.nearest(at);
    if (source.states_provenance()) out.label = weaker_evidence(out.label, place.label);
    far = far || !((place.position - at).norm() <= reach);
    const bool knows_side = source.knows_sides() && !place.normal.isZero();
    if (knows_side && !(place.normal.dot(area) > 0)) ++backs;
  }
  constexpr int kMost = 3;  // of the four places
  if (far) {
    out.side = Side::Bridge;
  } else if (backs >= kMost) {
    out.side = Side::Back;
  }
  if (far || backs > 0) out.label = Provenance::Inferred;
  return out;
}

std::vector<FaceFinding> examine_faces(const TriangleMesh& surface,
                                       const StatedSurface& source,
                                       double reach) {
  std::vector<FaceFinding> out(surface.faces.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t f) {
    std::array<Eigen::Vector3d, 3> corners;
    for (size_t k = 0; k < 3; ++k) {
      corners.at(k) = surface.vertices[surface.faces[f].at(k)].cast<double>();
    }
    out[f] = examine(corners, source, reach);
  });
  return out;
}

// \return what they amount to
EvidenceTransfer write_labels(TriangleMesh& surface,
                              const StatedSurface& source,
                              const std::vector<FaceFinding>& findings) {
  EvidenceTransfer out;
  surface.provenance.clear();
  for (const FaceFinding& face : findings) {
    out.area += face.area;
    if (face.side == Side::Bridge) out.bridged += face.area;
    if (face.side == Side::Back) out.behind += face.area;
    if (source.states_provenance()) surface.provenance.push_back(face.label);
  }
  return out;
}

// Vertices of faces alone that nothing measured.
void drop_claims(TriangleMesh& surface, const std::vector<FaceFinding>& findings) {
  std::vector<uint8_t> vouched(surface.vertices.size(), 0);
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    if (!has_evidence(findings[f].label)) continue;
    for (const uint32_t v : surface.faces[f]) vouched[v] = 1;
  }
  for (size_t v = 0; v < vouched.size(); ++v) {
    if (vouched[v] != 0) continue;
    if (!surface.sigma.empty()) surface.sigma[v] = kNaN;
    if (!surface.support.empty()) surface.support[v] = 0;
  }
}

}  // namespace

std::vector<double> take_attributes(TriangleMesh& surface, const StatedSurface& source) {
  std::vector<StatedPlace> places(surface.vertices.size());
  tbb::parallel_for(size_t(0), places.size(), [&](size_t v) {
    places[v] = source.nearest(surface.vertices[v].cast<double>());
  });
  const std::vector<Eigen::Vector3f> vertices = std::move(surface.vertices);
  surface.vertices.clear();
  std::vector<double> distances;
  for (size_t v = 0; v < places.size(); ++v) {
    append_blend(surface, source.mesh(), places[v].shares);
    distances.push_back((vertices[v].cast<double>() - places[v].position).norm());
  }
  surface.vertices = vertices;
  return distances;
}

EvidenceTransfer take_labels(TriangleMesh& surface, const StatedSurface& source, double reach) {
  return write_labels(surface, source, examine_faces(surface, source, reach));
}

EvidenceTransfer take_evidence(TriangleMesh& surface, const StatedSurface& source, double reach) {
  const std::vector<FaceFinding> findings = examine_faces(surface, source, reach);
  const std::vector<double> distances = take_attributes(surface, source);
  for (size_t v = 0; v < surface.sigma.size(); ++v) {
    surface.sigma[v] = static_cast<float>(std::hypot(double{surface.sigma[v]}, distances[v]));
  }
  const EvidenceTransfer out = write_labels(surface, source, findings);
  drop_claims(surface, findings);
  if (!source.mesh().normals.empty()) surface.normals = vertex_normals(surface);
  return out;
}

}  // namespace cgs
