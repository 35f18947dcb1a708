// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/surface_measures.h"

#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "libcgs/core/disjoint_sets.h"
#include "meshing/mesh/places.h"

namespace cgs {

namespace {

struct Corners {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
  Eigen::Vector3d c;
  Eigen::Vector3d area_vector() const { return 0.5 * (b - a).cross(c - a); }
};

Corners corners(const MeasurableMesh& mesh, size_t face) {
  const auto& f = mesh.mesh.faces[face];
  return {mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]]};
}

void add_part(MeasuredValue& out, const MeasurableMesh& mesh, size_t face, double part) {
  out.value += part;
  if (mesh.states_provenance()) {
    out.by_provenance.at(static_cast<size_t>(mesh.mesh.provenance[face])) += part;
  }
}

// All three corners say how well they are known, and the face was not invented.
bool is_stated(const MeasurableMesh& mesh, size_t face) {
  if (mesh.mesh.sigma.empty()) return false;
  if (mesh.states_provenance() && !has_evidence(mesh.mesh.provenance[face])) return false;
  for (const uint32_t v : mesh.mesh.faces[face]) {
    if (!std::isfinite(mesh.mesh.sigma[v])) return false;
  }
  return true;
}

// Per vertex the sum of the area vectors of the faces that state a sigma, a third of each.
std::vector<Eigen::Vector3d> stated_area_vectors(const MeasurableMesh& mesh) {
  std::vector<Eigen::Vector3d> out(mesh.points.size(), Eigen::Vector3d::Zero());
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    if (!is_stated(mesh, f)) continue;
    const Eigen::Vector3d third = corners(mesh, f).area_vector() / 3;
    for (const uint32_t v : mesh.mesh.faces[f]) out[v] += third;
  }
  return out;
}

double stated_share(const MeasurableMesh& mesh) {
  double stated = 0;
  double all = 0;
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const double area = corners(mesh, f).area_vector().norm();
    all += area;
    if (is_stated(mesh, f)) stated += area;
  }
  return all > 0 ? stated / all : 0;
}

// Change of the area with every vertex: for a face, half its normal times the opposite edge.
std::vector<Eigen::Vector3d> area_gradients(const MeasurableMesh& mesh) {
  std::vector<Eigen::Vector3d> out(mesh.points.size(), Eigen::Vector3d::Zero());
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    if (!is_stated(mesh, f)) continue;
    const Corners t = corners(mesh, f);
    const Eigen::Vector3d half = 0.5 * t.area_vector().stableNormalized();
    out[mesh.mesh.faces[f][0]] += half.cross(t.c - t.b);
    out[mesh.mesh.faces[f][1]] += half.cross(t.a - t.c);
    out[mesh.mesh.faces[f][2]] += half.cross(t.b - t.a);
  }
  return out;
}

// A part of the surface that hangs together, as far as it states a sigma.
struct StatedPart {
  Eigen::AlignedBox3d box;
  double area = 0;
  double squares = 0;  // of sigma, by area

  // What the part's extent is off by, its area is twice.
  double sigma_of_area() const {
    if (!(area > 0)) return 0;
    const double end = kTangential * std::sqrt(squares / area);
    return 2 * area * std::sqrt(2.0) * end / box.diagonal().norm();
  }
};

// Of the area, from points that are off along the surface. That is most of the error of flat
// surface, whose area does not change along its normals. Parts apart know nothing of each other's
// extent; faces hang together where their corners are in the same places.
double sigma_from_extent(const MeasurableMesh& mesh) {
  const std::vector<uint32_t> first = first_at_place(mesh.points);
  DisjointSets sets(first.size());
  for (const auto& [a, b, c] : mesh.mesh.faces) {
    sets.join(first[a], first[b]);
    sets.join(first[b], first[c]);
  }
  std::map<uint32_t, StatedPart> parts;
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    if (!is_stated(mesh, f)) continue;
    const auto& face = mesh.mesh.faces[f];
    StatedPart& part = parts[sets.root(first[face[0]])];
    const double area = corners(mesh, f).area_vector().norm();
    part.area += area;
    for (const uint32_t v : face) {
      part.box.extend(mesh.points[v]);
      part.squares += area / 3 * std::pow(double(mesh.mesh.sigma[v]), 2);
    }
  }
  double sigma = 0;
  for (const auto& [root, part] : parts) sigma = std::hypot(sigma, part.sigma_of_area());
  return sigma;
}

}  // namespace

double SigmaSum::sigma() const { return std::sqrt(together_ * together_ + squares_); }

MeasuredValue surface_area(const MeasurableMesh& mesh) {
  MeasuredValue out;
  out.dimension = 2;
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    add_part(out, mesh, f, corners(mesh, f).area_vector().norm());
  }
  out.stated = stated_share(mesh);
  if (out.stated == 0) return out;
  const auto normals = stated_area_vectors(mesh);
  const auto gradients = area_gradients(mesh);
  SigmaSum sum;
  for (size_t v = 0; v < normals.size(); ++v) {
    if (normals[v].squaredNorm() == 0) continue;
    sum.add(double(mesh.mesh.sigma[v]) * gradients[v].dot(normals[v].stableNormalized()));
  }
  out.sigma = std::hypot(sum.sigma(), sigma_from_extent(mesh));
  return out;
}

MeasuredValue enclosed_volume(const MeasurableMesh& mesh) {
  MeasuredValue out;
  out.dimension = 3;
  Eigen::AlignedBox3d box;
  for (const auto& face : mesh.mesh.faces) {
    for (const uint32_t v : face) box.extend(mesh.points[v]);
  }
  if (box.isEmpty()) return out;
  const Eigen::Vector3d middle = box.center();
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const Corners t = corners(mesh, f);
    out.value += (t.a - middle).dot((t.b - middle).cross(t.c - middle)) / 6;
  }
  const auto areas = surface_area(mesh);
  out.stated = areas.stated;
  if (out.stated == 0) return out;
  // A vertex that moves by d sweeps d times its share of the area vectors around it.
  const auto normals = stated_area_vectors(mesh);
  SigmaSum sum;
  for (size_t v = 0; v < normals.size(); ++v) {
    if (normals[v].squaredNorm() > 0) sum.add(double(mesh.mesh.sigma[v]) * normals[v].norm());
  }
  out.sigma = sum.sigma();
  return out;
}

Eigen::Vector3d area_centroid(const MeasurableMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // from a point of the mesh, which may be far away
  double all = 0;
  const Eigen::Vector3d zero =
      mesh.mesh.faces.empty() ? Eigen::Vector3d::Zero().eval() : corners(mesh, 0).a;
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const Corners t = corners(mesh, f);
    const double area = t.area_vector().norm();
    sum += area * ((t.a - zero) + (t.b - zero) + (t.c - zero)) / 3;
    all += area;
  }
  return zero + sum / all;
}

Eigen::Vector3d volume_centroid(const MeasurableMesh& mesh) {
  const Eigen::Vector3d middle = area_centroid(mesh);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double all = 0;
  for (size_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    const Corners t = corners(mesh, f);
    const Eigen::Vector3d a = t.a - middle;
    const Eigen::Vector3d b = t.b - middle;
    const Eigen::Vector3d c = t.c - middle;
    const double volume = a.dot(b.cross(c)) / 6;
    sum += volume * (a + b + c) / 4;
    all += volume;
  }
  return middle + sum / all;
}

// Standard deviation of a point of the surface along a unit direction.
double sigma_along(const Eigen::Vector3d& direction, const SurfaceEvidence& at) {
  const double cosine = at.normal.dot(direction);
  return at.sigma * std::sqrt(std::lerp(kTangential * kTangential, 1.0, cosine * cosine));
}

MeasuredValue straight_distance(const MeasurableMesh& mesh,
                                const SurfacePoint& from,
                                const SurfacePoint& to) {
  MeasuredValue out;
  out.value = (to.position - from.position).norm();
  const SurfaceEvidence a = evidence_at(mesh, from);
  const SurfaceEvidence b = evidence_at(mesh, to);
  out.stated = (std::isfinite(a.sigma) ? 0.5 : 0) + (std::isfinite(b.sigma) ? 0.5 : 0);
  const Eigen::Vector3d along = (to.position - from.position).stableNormalized();
  out.sigma = std::hypot(sigma_along(along, a), sigma_along(along, b));  // NaN: no statement
  if (mesh.states_provenance()) {
    out.by_provenance.at(static_cast<size_t>(weaker_evidence(a.provenance, b.provenance))) =
        out.value;
  }
  return out;
}

}  // namespace cgs
