// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "convert/files/mesh_files.h"
#include "convert/filter/operations.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/edit/loop_subdivision.h"
#include "meshing/edit/remeshing.h"
#include "meshing/edit/simplify.h"
#include "meshing/edit/smoothing.h"
#include "meshing/mesh/mesh_distance.h"

namespace cgs {

namespace {

FilterStep smoothing_step(const char* name, const SmoothingOptions& options) {
  return [=](FilterState& state, const Progress& progress) {
    require_faces(state, name);
    SmoothedMesh result = smoothed(state.mesh, options, progress);
    state.mesh = std::move(result.mesh);
    return "moved " + format_length(result.rms, state.frame) + " rms, " +
           format_length(result.most, state.frame) + " at most; " + std::to_string(result.locked) +
           " vertices held";
  };
}

constexpr size_t kMostIterations = 10'000;

FilterStep prepare_laplacian(FilterArguments& arguments) {
  return smoothing_step("laplacian", {.iterations = arguments.count(1, kMostIterations)});
}

FilterStep prepare_taubin(FilterArguments& arguments) {
  constexpr double kBack = 0.53;
  return smoothing_step("taubin",
                        {.iterations = arguments.count(1, kMostIterations), .outward = kBack});
}

std::string take_simplified(FilterState& state, SimplifyResult result) {
  state.mesh = std::move(result.mesh);
  if (result.faces_after == result.faces_before) {
    const std::string seams = seams_text(state.mesh);
    return "nothing left out, as the result would be too far off or cut itself; " +
           (seams.empty() ? "where the input cuts itself, cut-self-intersections goes before"
                          : seams);
  }
  return (result.joined_vertices == 0
              ? ""
              : std::to_string(result.joined_vertices) + " vertices joined along seams; ") +
         "largest error measured " +
         format_length(std::max(result.evidence.hausdorff(), result.inferred.hausdorff()),
                       state.frame);
}

FilterStep prepare_simplify(FilterArguments& arguments) {
  const double error = arguments.length();
  return [error](FilterState& state, const Progress& progress) {
    require_faces(state, "simplify");
    const SimplifyOptions options{.max_error = error / state.frame.scale};
    return take_simplified(state, simplify(state.mesh, options, progress));
  };
}

FilterStep prepare_simplify_to(FilterArguments& arguments) {
  const size_t faces = arguments.count(4, 1'000'000'000);
  return [faces](FilterState& state, const Progress& progress) {
    require_faces(state, "simplify-to");
    Eigen::AlignedBox3f box;
    for (const auto& p : state.mesh.vertices) box.extend(p);
    const SimplifyOptions options{.max_error = std::max(1e-30, 2 * double(box.diagonal().norm())),
                                  .max_color_error = 1,
                                  .max_area_change = 1,
                                  .target_faces = faces};
    if (state.mesh.faces.size() <= faces) return std::string("there are no more than that");
    std::string remark = take_simplified(state, simplify(state.mesh, options, progress));
    if (state.mesh.faces.size() <= faces) return remark;
    return "STOPPED at " + std::to_string(state.mesh.faces.size()) +
           " faces, as fewer would fold or be slivers; " + remark;
  };
}

FilterStep prepare_remesh(FilterArguments& arguments) {
  const double edge = arguments.length();
  return [edge](FilterState& state, const Progress&) {
    require_faces(state, "remesh");
    const TriangleMesh before = std::move(state.mesh);
    state.mesh = remeshed(before, edge / state.frame.scale);
    constexpr size_t kSamples = 100'000;
    const MeshDistance moved = mesh_distance(state.mesh, before, kSamples);
    widen_sigma(state.mesh, moved);
    return "largest error measured " + format_length(moved.hausdorff(), state.frame);
  };
}

FilterStep prepare_subdivide(FilterArguments& arguments) {
  const size_t times = arguments.count(1, 10);
  return [times](FilterState& state, const Progress&) {
    require_faces(state, "subdivide");
    state.mesh = subdivided(state.mesh, times);
    return std::string();
  };
}

FilterStep prepare_subdivide_loop(FilterArguments& arguments) {
  const size_t times = arguments.count(1, 10);
  return [times](FilterState& state, const Progress&) {
    require_faces(state, "subdivide-loop");
    state.mesh = loop_subdivided(state.mesh, times);
    return std::string();
  };
}

}  // namespace

std::vector<FilterOperation> surface_operations() {
  return {
      {"laplacian", "N", "Smooth N times; shrinks", "laplacian=3", prepare_laplacian},
      {"taubin", "N", "Smooth N times without shrinking", "taubin=10", prepare_taubin},
      {"simplify",
       "ERROR",
       "Fewer faces, nowhere farther off than this (measured)",
       "simplify=2mm",
       prepare_simplify},
      {"simplify-to",
       "FACES",
       "So many faces, whatever the error",
       "simplify-to=100000",
       prepare_simplify_to},
      {"remesh", "EDGE", "Triangles with sides of about this length", "remesh=5mm", prepare_remesh},
      {"subdivide", "N", "Split every face into four, N times", "subdivide=1", prepare_subdivide},
      {"subdivide-loop",
       "N",
       "Split every face into four and make the surface smooth, N times",
       "subdivide-loop=1",
       prepare_subdivide_loop}};
}

}  // namespace cgs
