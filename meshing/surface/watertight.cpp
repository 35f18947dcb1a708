// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/watertight.h"

#include <cmath>
#include <utility>
#include <vector>

#include <openvdb/tools/Morphology.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/provenance.h"
#include "meshing/surface/closed_isosurface.h"
#include "meshing/surface/solid.h"
#include "meshing/volume/volume.h"

namespace cgs {

namespace {

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

// Voxels that the surface was observed in, and a few around them. Only around the closed surface:
// what a file says of the rest may be of any size.
// \pre volume.surface is made
openvdb::BoolTree::Ptr observed_voxels(const Volume& volume) {
  constexpr int kAround = 3;
  auto out =
      std::make_shared<openvdb::BoolTree>(volume.surface->tree(), false, openvdb::TopologyCopy());
  out->topologyIntersection(volume.tsdf->tree());
  openvdb::tools::dilateActiveValues(*out, kAround);
  out->voxelizeActiveTiles();  // the mesher looks for blocks only
  return out;
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
    (void)remove_small_parts(matter, options.min_part);
    report(progress, 0.3);
    volume.surface = level_set(matter, volume);
  }
  report(progress, 0.5);
  ClosedIsosurface closed = closed_isosurface(*volume.surface, observed_voxels(volume));
  result.mesh = std::move(closed.mesh);
  result.certificate = closed.certificate;
  result.method = std::move(closed.method);
  result.voxels_smoothed = closed.voxels_smoothed;
  report(progress, 0.9);
  const VertexEvidence evidence = annotate_vertices(result.mesh, volume);
  label_faces(result.mesh, evidence, options.max_gap * double(volume.voxel_size));
  result.mesh.normals = vertex_normals(result.mesh);
  set_areas(result.certificate, result.mesh);
  report(progress, 1.0);
  return result;
}

}  // namespace cgs
