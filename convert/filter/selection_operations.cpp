// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <numeric>

#include "convert/files/mesh_files.h"
#include "convert/filter/operations.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/edit/cropping.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/vertex_attributes.h"
#include "meshing/points/clusters.h"
#include "meshing/points/plane_search.h"

namespace cgs {

namespace {

FilterStep prepare_crop_box(FilterArguments& arguments) {
  const Eigen::Vector3d a = arguments.point();
  const Eigen::Vector3d b = arguments.point();
  if (!(a.array() < b.array()).all()) arguments.fail("the first corner must be the lower one");
  return [a, b](FilterState& state, const Progress&) {
    const Eigen::AlignedBox3d box(state.internal_from_file(a), state.internal_from_file(b));
    state.mesh = cropped_by_box(state.mesh, box);
    return std::string();
  };
}

FilterStep prepare_crop_ball(FilterArguments& arguments) {
  const Eigen::Vector3d center = arguments.point();
  const double radius = arguments.length();
  return [center, radius](FilterState& state, const Progress&) {
    state.mesh =
        cropped_by_ball(state.mesh, state.internal_from_file(center), radius / state.frame.scale);
    return std::string();
  };
}

FilterStep prepare_crop_plane(FilterArguments& arguments) {
  const Eigen::Vector3d point = arguments.point();
  const Eigen::Vector3d normal = arguments.direction();
  return [point, normal](FilterState& state, const Progress&) {
    state.mesh = cropped_by_plane(state.mesh, state.internal_from_file(point), normal);
    return std::string();
  };
}

// Keeps the parts for which the rule says so.
template <typename Rule>
std::string keep_parts(FilterState& state, const MeshComponents& parts, const Rule& rule) {
  const std::string seams = seams_text(state.mesh);
  std::vector<uint8_t> keep(state.mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) keep[f] = rule(parts.of_face[f]) ? 1 : 0;
  state.mesh = with_faces(state.mesh, keep);
  size_t kept = 0;
  for (uint32_t part = 0; part < parts.area.size(); ++part) kept += rule(part) ? 1 : 0;
  return std::to_string(parts.area.size()) + " -> " + std::to_string(kept) + " parts" +
         (seams.empty() ? "" : "; " + seams);
}

// Which ones are the `count` largest; of equal ones the first.
template <typename Size>
std::vector<uint8_t> largest_of(const std::vector<Size>& sizes, size_t count) {
  std::vector<uint32_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(
      order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return sizes[a] > sizes[b]; });
  std::vector<uint8_t> wanted(order.size(), 0);
  for (size_t i = 0; i < std::min(count, order.size()); ++i) wanted[order[i]] = 1;
  return wanted;
}

FilterStep prepare_largest(FilterArguments& arguments) {
  const size_t count = arguments.more() ? arguments.count(1, 1'000'000'000) : 1;
  return [count](FilterState& state, const Progress&) {
    require_faces(state, "largest");
    const MeshComponents parts = components(state.mesh);
    const std::vector<uint8_t> wanted = largest_of(parts.area, count);
    return keep_parts(state, parts, [&](uint32_t part) { return wanted[part] != 0; });
  };
}

FilterStep prepare_min_area(FilterArguments& arguments) {
  const double share = arguments.number(0, 1);
  return [share](FilterState& state, const Progress&) {
    require_faces(state, "min-area");
    const MeshComponents parts = components(state.mesh);
    const double least = share * *std::max_element(parts.area.begin(), parts.area.end());
    return keep_parts(state, parts, [&](uint32_t part) { return parts.area[part] >= least; });
  };
}

FilterStep prepare_min_faces(FilterArguments& arguments) {
  const size_t least = arguments.count(1, 1'000'000'000);
  return [least](FilterState& state, const Progress&) {
    require_faces(state, "min-faces");
    const MeshComponents parts = components(state.mesh);
    std::vector<size_t> faces(parts.area.size(), 0);
    for (const uint32_t part : parts.of_face) ++faces[part];
    return keep_parts(state, parts, [&](uint32_t part) { return faces[part] >= least; });
  };
}

FilterStep prepare_dbscan(FilterArguments& arguments) {
  const double radius = arguments.length();
  const size_t neighbors = arguments.count(1, 1'000'000);
  const size_t count = arguments.more() ? arguments.count(1, 1'000'000'000) : 1;
  return [=](FilterState& state, const Progress& progress) {
    const PointClusters clusters =
        dense_clusters(state.mesh.vertices, radius / state.frame.scale, neighbors, progress);
    const std::vector<uint8_t> wanted = largest_of(clusters.size, count);
    std::vector<uint8_t> keep(clusters.of_point.size(), 0);
    size_t noise = 0;
    for (size_t v = 0; v < keep.size(); ++v) {
      const uint32_t cluster = clusters.of_point[v];
      noise += cluster == PointClusters::kNoise ? 1 : 0;
      if (cluster != PointClusters::kNoise) keep[v] = wanted[cluster];
    }
    state.mesh = with_vertices(state.mesh, keep);
    return std::to_string(clusters.size.size()) + " clusters, " + std::to_string(noise) +
           " points of noise";
  };
}

// Keeps or drops the points on the plane that holds most of them.
FilterStep plane_step(double distance, bool keeps) {
  return [=](FilterState& state, const Progress&) {
    const FoundPlane found = largest_plane(state.mesh.vertices, distance / state.frame.scale);
    std::vector<uint8_t> keep = found.on_plane;
    for (uint8_t& k : keep) k = (k != 0) == keeps ? 1 : 0;
    state.mesh = with_vertices(state.mesh, keep);
    return std::to_string(found.count) + " points on the plane, " +
           format_length(found.rms, state.frame) + " rms";
  };
}

FilterStep prepare_keep_plane(FilterArguments& arguments) {
  return plane_step(arguments.length(), true);
}

FilterStep prepare_drop_plane(FilterArguments& arguments) {
  return plane_step(arguments.length(), false);
}

}  // namespace

std::vector<FilterOperation> selection_operations() {
  return {{"crop-box",
           "X0,Y0,Z0,X1,Y1,Z1",
           "Keep what lies in a box; faces are cut",
           "crop-box=0,0,0,1m,1m,50cm",
           prepare_crop_box},
          {"crop-ball",
           "X,Y,Z,RADIUS",
           "Keep vertices within a ball, and faces between them",
           "crop-ball=0,0,1.5,20cm",
           prepare_crop_ball},
          {"crop-plane",
           "X,Y,Z,NX,NY,NZ",
           "Keep what lies on the side of a plane that the normal points to; faces are cut",
           "crop-plane=0,0,3mm,0,0,1",
           prepare_crop_plane},
          {"largest",
           "[=N]",
           "Keep the N parts of largest area, else one",
           "largest=2",
           prepare_largest},
          {"min-area",
           "SHARE",
           "Drop parts below this share of the largest part's area",
           "min-area=0.01",
           prepare_min_area},
          {"min-faces", "N", "Drop parts of fewer faces", "min-faces=100", prepare_min_faces},
          {"dbscan",
           "RADIUS,NEIGHBOURS[,N]",
           "Keep the N largest clusters of points, else one",
           "dbscan=1cm,10",
           prepare_dbscan},
          {"keep-plane",
           "DISTANCE",
           "Keep points this near to the plane that holds most",
           "keep-plane=5mm",
           prepare_keep_plane},
          {"drop-plane",
           "DISTANCE",
           "Drop them, such as a floor or a table",
           "drop-plane=5mm",
           prepare_drop_plane}};
}

}  // namespace cgs
