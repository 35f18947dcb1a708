// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include "convert/filter/operations.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/mesh/point_normals.h"
#include "meshing/mesh/vertex_attributes.h"
#include "meshing/points/down_sampling.h"
#include "meshing/points/hidden_points.h"
#include "meshing/points/outliers.h"
#include "meshing/points/point_smoothing.h"

namespace cgs {

namespace {

constexpr size_t kMostNeighbors = 10'000;

FilterStep prepare_statistical_outliers(FilterArguments& arguments) {
  const size_t neighbors = arguments.count(1, kMostNeighbors);
  const double deviations = arguments.number(0, 1e6);
  return [=](FilterState& state, const Progress&) {
    state.mesh = with_vertices(
        state.mesh, without_statistical_outliers(state.mesh.vertices, neighbors, deviations));
    return std::string();
  };
}

FilterStep prepare_radius_outliers(FilterArguments& arguments) {
  const size_t neighbors = arguments.count(1, 1'000'000);
  const double radius = arguments.length();
  return [=](FilterState& state, const Progress&) {
    state.mesh = with_vertices(
        state.mesh,
        without_lonely_points(state.mesh.vertices, neighbors, radius / state.frame.scale));
    return std::string();
  };
}

FilterStep prepare_voxel(FilterArguments& arguments) {
  const double side = arguments.length();
  return [side](FilterState& state, const Progress&) {
    require_cloud(state, "voxel");
    state.mesh = down_sampled(state.mesh, side / state.frame.scale);
    return std::string();
  };
}

FilterStep prepare_normals(FilterArguments& arguments) {
  const bool given = arguments.more();
  constexpr size_t kDefault = 30;
  const size_t neighbors = given ? arguments.count(3, kMostNeighbors) : kDefault;
  return [=](FilterState& state, const Progress&) -> std::string {
    TriangleMesh& mesh = state.mesh;
    if (!state.is_cloud()) {
      if (given)
        throw InvalidInput("--op normals: those of a mesh come from its faces; write normals");
      mesh.normals = vertex_normals(mesh);
      return "from the faces";
    }
    const std::vector<Eigen::Vector3f> before = std::move(mesh.normals);
    mesh.normals = estimated_normals(mesh.vertices, neighbors);
    const auto stated =
        static_cast<size_t>(std::count_if(before.begin(), before.end(), is_known_normal));
    if (stated > 0 && stated == before.size()) {
      turn_like(mesh.normals, before);
      return "on the side of those before";
    }
    constexpr size_t kJoined = 10;
    const std::vector<uint32_t> parts = turn_consistently(mesh.normals, mesh.vertices, kJoined);
    if (stated == 0) return "neighbours turned alike";
    turn_parts_like(mesh.normals, before, parts);
    turn_like(mesh.normals, before);
    return "on the side of those before, which " + std::to_string(before.size() - stated) +
           " points did not state: these like their neighbours";
  };
}

FilterStep prepare_normals_towards(FilterArguments& arguments) {
  const Eigen::Vector3d eye = arguments.point();
  return [eye](FilterState& state, const Progress&) {
    if (state.mesh.normals.empty()) {
      throw InvalidInput("--op normals-towards: there are no normals; put --op normals before it");
    }
    turn_towards(
        state.mesh.normals, state.mesh.vertices, state.internal_from_file(eye).cast<float>());
    return std::string();
  };
}

FilterStep prepare_mls(FilterArguments& arguments) {
  constexpr size_t kDefault = 24;
  const size_t neighbors = arguments.more() ? arguments.count(6, kMostNeighbors) : kDefault;
  return [neighbors](FilterState& state, const Progress&) {
    require_cloud(state, "mls");
    SmoothedPoints result = smoothed_points(state.mesh, neighbors);
    state.mesh = std::move(result.cloud);
    return "moved " + format_length(result.rms, state.frame) + " rms, " +
           format_length(result.most, state.frame) + " at most; " + std::to_string(result.held) +
           " points held";
  };
}

FilterStep prepare_hidden_points(FilterArguments& arguments) {
  const Eigen::Vector3d eye = arguments.point();
  return [eye](FilterState& state, const Progress&) {
    require_cloud(state, "hidden-points");
    state.mesh =
        with_vertices(state.mesh, seen_from(state.mesh.vertices, state.internal_from_file(eye)));
    return std::string();
  };
}

}  // namespace

std::vector<FilterOperation> point_operations() {
  return {
      {"statistical-outliers",
       "NEIGHBOURS,SIGMAS",
       "Drop points farther from their neighbours than usual",
       "statistical-outliers=20,2",
       prepare_statistical_outliers},
      {"radius-outliers",
       "NEIGHBOURS,RADIUS",
       "Drop points with fewer neighbours within the radius",
       "radius-outliers=16,5mm",
       prepare_radius_outliers},
      {"voxel", "SIDE", "One point per cube of a grid (point clouds)", "voxel=2mm", prepare_voxel},
      {"normals",
       "[=NEIGHBOURS]",
       "Normals of points from their neighbours (30), of a mesh from its faces",
       "normals=30",
       prepare_normals},
      {"normals-towards",
       "X,Y,Z",
       "Turn normals to where the scanner stood",
       "normals-towards=0,0,2m",
       prepare_normals_towards},
      {"mls",
       "[=NEIGHBOURS]",
       "Smooth points: each onto a curved surface through its nearest (24)",
       "mls=24",
       prepare_mls},
      {"hidden-points",
       "X,Y,Z",
       "Drop points that others hide from this place",
       "hidden-points=0,0,2m",
       prepare_hidden_points}};
}

}  // namespace cgs
