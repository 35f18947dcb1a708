// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "convert/filter/evidence_remark.h"
#include "convert/filter/operations.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/mesh/point_normals.h"
#include "meshing/surface/advancing_front.h"
#include "meshing/surface/poisson_surface.h"

namespace cgs {

namespace {

// \return what is to be said of points that state none
std::string require_normals(const TriangleMesh& cloud) {
  const auto none = static_cast<size_t>(
      std::count_if(cloud.normals.begin(), cloud.normals.end(), std::not_fn(is_known_normal)));
  if (none == cloud.normals.size()) {
    throw InvalidInput("--op poisson: the points have no normals; put --op normals before it");
  }
  if (none == 0) return "";
  return "; " + std::to_string(none) + " of " + std::to_string(cloud.normals.size()) +
         " points have no normal and were LEFT OUT: --op normals gives them one";
}

std::string behind_remark(const EvidenceTransfer& evidence) {
  if (!is_behind(evidence)) return {};
  return "; " + percent(evidence.behind, evidence.area) +
         " of the area looks AGAINST the normals of its points: --op normals-towards turns them";
}

FilterStep prepare_poisson(FilterArguments& arguments) {
  const double spacing = arguments.more() ? arguments.length() : 0;
  return [spacing](FilterState& state, const Progress& progress) {
    require_cloud(state, "poisson");
    const std::string left_out = require_normals(state.mesh);
    PoissonSurface made =
        poisson_surface(state.mesh, {.spacing = spacing / state.frame.scale}, progress);
    state.mesh = std::move(made.mesh);
    return "triangles of " + format_length(made.spacing, state.frame) + "; " +
           bridge_remark(made.evidence, state.mesh) + behind_remark(made.evidence) + left_out;
  };
}

FilterStep prepare_advancing_front(FilterArguments& arguments) {
  const double most =
      arguments.more() ? arguments.length() : std::numeric_limits<double>::infinity();
  return [most](FilterState& state, const Progress&) {
    require_cloud(state, "advancing-front");
    InterpolatedSurface made = advancing_front(state.mesh, most / state.frame.scale);
    state.mesh = std::move(made.mesh);
    return std::to_string(made.unused) + " points left out; " +
           bridge_remark(made.evidence, state.mesh) + behind_remark(made.evidence);
  };
}

}  // namespace

std::vector<FilterOperation> reconstruction_operations() {
  return {{"poisson",
           "[=SPACING]",
           "Closed smooth surface of points with normals, triangles of about SPACING",
           "poisson=2mm",
           prepare_poisson},
          {"advancing-front",
           "[=MAX_EDGE]",
           "Surface through points as they are, open where there are none",
           "advancing-front=1cm",
           prepare_advancing_front}};
}

}  // namespace cgs
