// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/watertight.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "libcgs/core/error.h"
#include "meshing/components.h"
#include "meshing/isosurface.h"
#include "meshing/provenance.h"
#include "meshing/self_intersections.h"
#include "meshing/solid.h"

namespace cgs {

namespace {

using openvdb::Coord;

void check_memory(const Volume& volume, size_t limit) {
  const double voxels = (volume.bounds.sizes().array() / double(volume.voxel_size) + 5).prod();
  constexpr double kBytesPerVoxel = 6;  // inside, evidence, blurred, visited; part of the level set
  if (voxels * kBytesPerVoxel > static_cast<double>(limit)) {
    const auto mebibytes = [](double bytes) {
      return std::to_string(std::lround(bytes / (1 << 20))) + " MiB";
    };
    throw LimitError("closing a volume of " + std::to_string(std::llround(voxels)) +
                     " voxels may take " + mebibytes(voxels * kBytesPerVoxel) + ", allowed are " +
                     mebibytes(static_cast<double>(limit)) +
                     "; larger voxels need less, a larger memory limit allows it");
  }
}

// Voxels within two of the faces, each once.
std::vector<Coord> voxels_around(const TriangleMesh& mesh,
                                 const std::vector<std::pair<uint32_t, uint32_t>>& pairs,
                                 double voxel) {
  std::vector<Coord> voxels;
  const auto add = [&](uint32_t f) {
    for (const uint32_t v : mesh.faces[f]) {
      const Eigen::Vector3i at =
          (mesh.vertices[v].cast<double>() / voxel).array().floor().cast<int>();
      for (int k = 0; k < 64; ++k) {
        voxels.emplace_back(at.x() + k % 4 - 1, at.y() + k / 4 % 4 - 1, at.z() + k / 16 - 1);
      }
    }
  };
  for (const auto& [f, g] : pairs) {
    add(f);
    add(g);
  }
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  return voxels;
}

// Replaces the given voxels by the mean of their 3 x 3 x 3 neighbourhood.
void average(openvdb::FloatGrid& grid, const std::vector<Coord>& voxels) {
  std::vector<float> means;
  means.reserve(voxels.size());
  auto values = grid.getAccessor();
  for (const Coord& at : voxels) {
    float sum = 0;
    for (int k = 0; k < 27; ++k) {
      sum += values.getValue(at.offsetBy(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    }
    means.push_back(sum / 27);
  }
  for (size_t i = 0; i < voxels.size(); ++i) {
    if (values.isValueOn(voxels[i])) values.setValueOnly(voxels[i], means[i]);
  }
}

// Shells of closed surface that smoothing has cut off: fewer faces than around a few voxels.
TriangleMesh without_crumbs(const TriangleMesh& mesh, double voxel) {
  constexpr double kSide = 3;  // [voxels]
  const MeshComponents parts = components(mesh);
  const double smallest = 6 * std::pow(kSide * voxel, 2);
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = parts.area[parts.of_face[f]] >= smallest;
  return with_faces(mesh, keep);
}

TriangleMesh meshed(openvdb::FloatGrid& surface, WatertightResult& result) {
  const double voxel = surface.voxelSize()[0];
  result.method = "level set";
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    TriangleMesh mesh = without_crumbs(zero_surface(surface), voxel);
    result.certificate = certify(mesh);
    if (result.certificate.self_intersections == 0) {
      if (result.certificate.passed() || mesh.faces.empty()) return mesh;
      break;  // Smoothing helps against nothing else.
    }
    const auto voxels = voxels_around(mesh, self_intersections(mesh), voxel);
    average(surface, voxels);
    result.voxels_smoothed += voxels.size();
    result.method = "level set, locally smoothed";
  }
  result.method = "level set, marching tetrahedra";
  TriangleMesh mesh = without_crumbs(zero_surface_by_tetrahedra(surface), voxel);
  result.certificate = certify(mesh);
  return mesh;
}

}  // namespace

void WatertightOptions::validate() const {
  require(min_part >= 0 && min_part <= 1, "WatertightOptions.min_part must be in [0, 1]", min_part);
  require(max_gap >= 0, "WatertightOptions.max_gap must be >= 0", max_gap);
}

WatertightResult watertight_surface(Volume& volume,
                                    const WatertightOptions& options,
                                    const Progress& progress) {
  options.validate();
  check_memory(volume, options.memory_limit);
  WatertightResult result;
  {
    Solid matter = solid(volume);
    smooth(matter);
    report(progress, 0.2);
    const SolidParts removed = remove_small_parts(matter, options.min_part);
    result.floaters_removed = removed.floaters;
    result.cavities_filled = removed.cavities;
    report(progress, 0.3);
    volume.surface = level_set(matter, volume);
  }
  report(progress, 0.5);
  result.mesh = meshed(*volume.surface, result);
  report(progress, 0.9);
  const std::vector<Evidence> evidence = annotate_vertices(result.mesh, volume);
  label_faces(result.mesh, evidence, options.max_gap * double(volume.voxel_size));
  result.mesh.normals = vertex_normals(result.mesh);
  const auto areas = area_by_provenance(result.mesh);
  result.certificate.observed_area = areas[size_t(Provenance::Observed)];
  result.certificate.single_view_area = areas[size_t(Provenance::SingleView)];
  result.certificate.interpolated_area = areas[size_t(Provenance::Interpolated)];
  result.certificate.inferred_area = areas[size_t(Provenance::Inferred)];
  result.certificate.virtual_area = areas[size_t(Provenance::Virtual)];
  report(progress, 1.0);
  return result;
}

}  // namespace cgs
