// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/second_mesh.h"

#include <algorithm>
#include <utility>

#include "convert/text/stated_frame.h"
#include "io/meshes/mesh_file.h"
#include "libcgs/core/error.h"
#include "meshing/edit/placement.h"

namespace cgs {

namespace {

// Without the unit of one of them, nobody knows how large it is beside the other.
void require_both_units(const std::filesystem::path& path,
                        const Frame& second,
                        const Frame& first,
                        const std::string& operation) {
  if (second.has_metric_scale() == first.has_metric_scale()) return;
  if (second.has_metric_scale()) {
    throw InvalidInput(operation + printable(path) +
                       " states its unit, the first file does not: say it by --assume-unit");
  }
  throw InvalidInput(operation + "the first file states its unit, " + printable(path) +
                     " does not: cgs filter with --assume-unit writes it with one");
}

void keep_larger_scale_sigma(Frame& frame, const Frame& second) {
  if (!second.has_metric_scale()) return;
  const double relative = second.metres_sigma / second.metres_per_unit;
  frame.metres_sigma = std::max(frame.metres_sigma, relative * frame.metres_per_unit);
}

}  // namespace

SecondMesh read_second_mesh(FilterState& state,
                            const std::filesystem::path& path,
                            const char* operation) {
  const std::string prefix = std::string("--op ") + operation + ": ";
  MeasurableFile second = read_mesh_file(path);
  TriangleMesh& mesh = second.content.mesh;
  if (mesh.faces.empty() != state.is_cloud()) {
    throw InvalidInput(prefix + printable(path) + " is a " +
                       (mesh.faces.empty() ? "point cloud" : "mesh") + ", the first file is not");
  }
  SecondMesh out;
  const bool is_assumed = state.frame.scale_source == ScaleSource::Assumed;
  if (is_assumed && !second.content.frame.has_metric_scale()) {
    second.content.frame.metres_per_unit = state.frame.metres_per_unit;
    second.content.frame.scale_source = ScaleSource::Assumed;
    out.remark = "its unit taken as " + state.frame.unit_name() + ", too; ";
  }
  require_both_units(path, second.content.frame, state.frame, prefix);
  out.remark += std::to_string(mesh.vertices.size()) + " vertices, " +
                std::to_string(mesh.faces.size()) + " faces";
  if (mesh.provenance.empty() != state.mesh.provenance.empty()) {
    out.remark += "; only one file says what was observed: all of the other counts as inferred";
  }
  for (const std::string& warning : second.warnings) out.remark += "; " + warning;
  const std::string turned = turned_text(state.frame, second.content.frame);
  if (!turned.empty()) out.remark += "; " + turned;
  move_to_frame(mesh, second.content.frame, state.frame);
  keep_larger_scale_sigma(state.frame, second.content.frame);
  out.mesh = std::move(mesh);
  return out;
}

}  // namespace cgs
