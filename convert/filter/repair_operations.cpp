// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>

#include "convert/files/mesh_files.h"
#include "convert/filter/operations.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/edit/hole_filling.h"
#include "meshing/edit/hull.h"
#include "meshing/edit/repair.h"

namespace cgs {

namespace {

std::string repair_remark(const RepairedMesh& result) {
  const std::pair<size_t, const char*> findings[] = {
      {result.merged_vertices, " vertices merged"},
      {result.other_colors, " of them of another colour, which is LOST"},
      {result.unused_vertices, " unused vertices dropped"},
      {result.flat_faces, " faces without area removed"},
      {result.flat_left, " faces without area LEFT"},
      {result.duplicate_faces, " duplicate faces removed"},
      {result.split_edges, " vertices on edges of other faces joined to these"},
      {result.turned_faces, " faces turned round"},
      {result.split_vertices, " vertices split off"},
      {result.self_intersections, " self-intersecting pairs of faces LEFT"}};
  std::string out;
  for (const auto& [count, what] : findings) {
    if (count > 0) out += (out.empty() ? "" : ", ") + std::to_string(count) + what;
  }
  return out.empty() ? "nothing to repair" : out;
}

FilterStep prepare_repair(FilterArguments&) {
  return [](FilterState& state, const Progress&) {
    require_faces(state, "repair");
    RepairedMesh result = repaired(state.mesh);
    state.mesh = std::move(result.mesh);
    return repair_remark(result);
  };
}

FilterStep prepare_cut_self_intersections(FilterArguments&) {
  return [](FilterState& state, const Progress&) {
    require_faces(state, "cut-self-intersections");
    const size_t before = state.mesh.faces.size();
    state.mesh = without_self_intersections(state.mesh);
    return std::to_string(before - state.mesh.faces.size()) + " faces removed";
  };
}

FilterStep prepare_fill_holes(FilterArguments& arguments) {
  const double widest = arguments.more() ? arguments.length() : std::numeric_limits<double>::max();
  return [widest](FilterState& state, const Progress& progress) {
    require_faces(state, "fill-holes");
    const std::string seams = seams_text(state.mesh);
    // Such a hole is the border of an open surface, and would take hours.
    constexpr size_t kLongestRim = 2000;
    FilledMesh result = holes_filled(state.mesh, widest / state.frame.scale, progress, kLongestRim);
    state.mesh = std::move(result.mesh);
    std::string remark = std::to_string(result.filled) + " holes filled, " +
                         std::to_string(result.left_open) + " left open";
    if (result.long_rims > 0) {
      remark += ", " + std::to_string(result.long_rims) + " of these with rims of more than " +
                std::to_string(kLongestRim) + " edges";
    }
    if (state.mesh.provenance.empty()) {
      remark += "; the file does not say what was observed, so what is filled is not marked";
    }
    return seams.empty() ? remark : remark + "; " + seams;
  };
}

FilterStep prepare_hull(FilterArguments&) {
  return [](FilterState& state, const Progress&) {
    state.mesh = convex_hull(state.mesh);
    return std::string();
  };
}

}  // namespace

std::vector<FilterOperation> repair_operations() {
  return {{"repair",
           "",
           "Merge equal vertices, drop flat and duplicate faces, make manifold and orient",
           "repair",
           prepare_repair},
          {"cut-self-intersections",
           "",
           "Drop faces that cut others (fill-holes closes the gaps)",
           "cut-self-intersections",
           prepare_cut_self_intersections},
          {"fill-holes",
           "[=WIDTH]",
           "Close holes up to this width, else all, by inferred faces",
           "fill-holes=5cm",
           prepare_fill_holes},
          {"hull", "", "The convex hull", "hull", prepare_hull}};
}

}  // namespace cgs
