// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/written_surface.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "convert/files/volume_file.h"
#include "convert/model/memory_plan.h"
#include "io/bytes/scene_path.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/stl_reader.h"
#include "io/meshes/threemf_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/mesh/mesh_distance.h"
#include "meshing/mesh/provenance.h"
#include "meshing/surface/watertight.h"

namespace cgs {

namespace {

// Corners, each with the better label of its faces, then places by area.
struct Places {
  std::vector<Eigen::Vector3f> points;
  std::vector<uint8_t> inferred;
};

Places places_on(const TriangleMesh& mesh) {
  constexpr size_t kLeast = 100'000;
  const size_t n = mesh.vertices.size();
  enum class Label : uint8_t { Unused, Inferred, Evidence };
  std::vector<Label> label(n, Label::Unused);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const Label of_face = is_unmeasured(mesh, f) ? Label::Inferred : Label::Evidence;
    for (const uint32_t v : mesh.faces[f]) label[v] = std::max(label[v], of_face);
  }
  Places out;
  for (size_t v = 0; v < n; ++v) {
    if (label[v] == Label::Unused) continue;
    out.points.push_back(mesh.vertices[v]);
    out.inferred.push_back(label[v] == Label::Inferred ? 1 : 0);
  }
  const SurfaceSamples samples = sample_faces(mesh, std::max(kLeast, mesh.faces.size()));
  for (size_t i = 0; i < samples.points.size(); ++i) {
    out.points.push_back(samples.points[i]);
    out.inferred.push_back(is_unmeasured(mesh, samples.faces[i]) ? 1 : 0);
  }
  return out;
}

// One way.
void add_distances(const TriangleMesh& from, const TriangleMesh& to, SurfaceDeviation& out) {
  const Places places = places_on(from);
  const DistanceToMesh distance(to);
  const std::vector<float> distances = distance.of(places.points);
  float evidence = 0;
  float inferred = 0;
  for (size_t i = 0; i < distances.size(); ++i) {
    float& worst = places.inferred[i] != 0 ? inferred : evidence;
    worst = std::max(worst, distances[i]);
  }
  std::vector<float> known(from.faces.size());
  for (size_t f = 0; f < known.size(); ++f) known[f] = is_unmeasured(from, f) ? inferred : evidence;
  constexpr double kOfFarthest = 1.0 / 1024;
  constexpr double kOfSize = 1e-6;  // coordinates are not known better
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : from.vertices) box.extend(p);
  const std::vector<float> on_edges =
      distance.of_edges(from,
                        known,
                        std::max(kOfFarthest * double(std::max(evidence, inferred)),
                                 kOfSize * double(box.diagonal().norm())));
  for (size_t f = 0; f < on_edges.size(); ++f) {
    float& worst = is_unmeasured(from, f) ? inferred : evidence;
    worst = std::max(worst, on_edges[f]);
  }
  out.evidence = std::max(out.evidence, double(evidence));
  out.inferred = std::max(out.inferred, double(inferred));
  out.places += distances.size();
}

// The corners of an STL or 3MF file of ours, turned and scaled back.
TriangleMesh read_turned(const std::filesystem::path& file, const Frame& frame) {
  const ParsedMesh parsed = lower_extension(file) == ".stl" ? read_stl(file) : read_3mf(file);
  const Eigen::Matrix3d file_from_turned = z_up_from(frame.up).transpose();
  TriangleMesh out;
  out.faces = parsed.mesh.faces;
  for (const Eigen::Vector3d& p : parsed.positions) {
    const Eigen::Vector3d in_file = file_from_turned * p / (1e3 * frame.metres_per_unit);
    out.vertices.emplace_back(frame.internal_from_file(in_file).cast<float>());
  }
  return out;
}

}  // namespace

SurfaceDeviation surface_deviation(const TriangleMesh& written, const TriangleMesh& fused) {
  SurfaceDeviation out;
  add_distances(written, fused, out);
  add_distances(fused, written, out);
  return out;
}

TriangleMesh fused_surface(const std::filesystem::path& volume, size_t memory_limit) {
  VolumeFile file = read_volume(volume);
  WatertightOptions closing;
  closing.memory_limit = memory_budget(memory_limit);
  TriangleMesh mesh = watertight_surface(file.volume, closing).mesh;
  if (mesh.faces.empty()) throw BadInput(Defect::Empty, volume, "holds no surface");
  return mesh;
}

double vertex_moves(const std::filesystem::path& file,
                    const TriangleMesh& mesh,
                    const Frame& frame) {
  const bool by_corner = lower_extension(file) == ".stl" || lower_extension(file) == ".3mf";
  const TriangleMesh read =
      by_corner ? read_turned(file, frame) : read_mesh_file(file, frame).content.mesh;
  if (read.faces.size() != mesh.faces.size() ||
      (!by_corner && read.vertices.size() != mesh.vertices.size())) {
    throw BadInput(Defect::Count,
                   file,
                   "has " + std::to_string(read.faces.size()) + " faces and " +
                       std::to_string(read.vertices.size()) + " vertices, its mesh " +
                       std::to_string(mesh.faces.size()) + " and " +
                       std::to_string(mesh.vertices.size()));
  }
  double worst = 0;
  const auto compare = [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    worst = std::max(worst, double((a - b).norm()));
  };
  for (size_t v = 0; !by_corner && v < mesh.vertices.size(); ++v) {
    compare(read.vertices[v], mesh.vertices[v]);
  }
  for (size_t f = 0; by_corner && f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      compare(read.vertices[read.faces[f].at(k)], mesh.vertices[mesh.faces[f].at(k)]);
    }
  }
  return worst;
}

KnownArea known_within(const TriangleMesh& mesh, double length) {
  KnownArea out;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const bool seen = !mesh.provenance.empty() && was_seen(mesh.provenance[f]);
    if (!seen) continue;
    const auto& face = mesh.faces[f];
    const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const bool known =
        !mesh.sigma.empty() && std::all_of(face.begin(), face.end(), [&](uint32_t v) {
          return double(mesh.sigma[v]) <= length;  // NaN is not
        });
    out.seen += area;
    if (known) out.within += area;
  }
  return out;
}

}  // namespace cgs
