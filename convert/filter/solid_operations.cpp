// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "convert/filter/evidence_remark.h"
#include "convert/filter/operations.h"
#include "convert/filter/second_mesh.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"
#include "meshing/edit/boolean.h"
#include "meshing/edit/flat_base.h"
#include "meshing/surface/closing.h"
#include "meshing/surface/wrapping.h"

namespace cgs {

namespace {

std::string cut_remark(size_t self_intersections) {
  if (self_intersections == 0) return {};
  return "; " + std::to_string(self_intersections) + " self-intersecting pairs of faces LEFT";
}

std::string volume_text(double volume, const Frame& frame) {
  const double unit = frame.scale * (frame.has_metric_scale() ? frame.metres_per_unit : 1);
  return number(volume * unit * unit * unit, "%.5g") +
         (frame.has_metric_scale() ? " m3" : " units3");
}

std::string wrap_remark(const WrappedMesh& wrap, const FilterState& state) {
  std::string out = "volume " + volume_text(wrap.volume, state.frame);
  if (!std::isnan(wrap.input_volume)) {
    out += " (the input with flat lids: " + volume_text(wrap.input_volume, state.frame) + ")";
  }
  out += "; " + bridge_remark(wrap.evidence, state.mesh) + "; " + percent(wrap.moved, 1) +
         " of the offset taken back" + cut_remark(wrap.self_intersections);
  if (!wrap.knows_sides) {
    out += "; without normals nobody knows whether it went inside: put --op normals before it";
  } else if (is_behind(wrap.evidence)) {
    out += "; " + percent(wrap.evidence.behind, wrap.evidence.area) +
           " of the area lies BEHIND the input: it is a sheet there, or holes wider than ALPHA let "
           "the wrap in; fill-holes before it, or a larger ALPHA, keeps it out";
  }
  return out;
}

FilterStep prepare_wrap(FilterArguments& arguments) {
  const double alpha = arguments.length();
  constexpr double kUsual = 30;  // as CGAL's default
  const double offset = arguments.more() ? arguments.length() : alpha / kUsual;
  if (offset > alpha) arguments.fail("OFFSET must not be larger than ALPHA");
  return [=](FilterState& state, const Progress& progress) {
    const double scale = state.frame.scale;
    WrappedMesh wrap =
        wrapped(state.mesh, {.alpha = alpha / scale, .offset = offset / scale}, progress);
    state.mesh = std::move(wrap.mesh);
    return wrap_remark(wrap, state);
  };
}

std::string attempt_text(const ClosingAttempt& attempt, const Frame& frame) {
  return attempt.way + (attempt.size > 0 ? " of " + format_length(attempt.size, frame) : "");
}

std::string closing_remark(const ClosedMesh& closed, const Frame& frame) {
  const ClosingAttempt& taken = closed.attempts[closed.taken];
  std::string out = "certified, by " + attempt_text(taken, frame);
  for (const ClosingAttempt& attempt : closed.attempts) {
    if (&attempt != &taken)
      out += "; not by " + attempt_text(attempt, frame) + ": " + attempt.reason;
  }
  out += "; volume " + volume_text(closed.certificate.volume, frame);
  const auto off = [&](const DistanceStatistics& d) {
    return format_length(d.rms, frame) + " rms, " + format_length(d.max, frame) + " at most";
  };
  out += "; off the input by " + off(closed.deviation.accuracy) + ", the input off it by " +
         off(closed.deviation.completeness);
  if (closed.inside > 0.01) {
    out += "; " + percent(closed.inside, 1) +
           " of the surface lies deep inside (overlaps, or cavities that were filled)";
  }
  if (!taken.reason.empty()) out += "; look at it: what was taken " + taken.reason;
  return out;
}

nlohmann::ordered_json closing_details(const ClosedMesh& closed, const Frame& frame) {
  nlohmann::ordered_json attempts = nlohmann::ordered_json::array();
  for (const ClosingAttempt& attempt : closed.attempts) {
    attempts.push_back(
        {{"way", attempt.way}, {"size", attempt.size * frame.scale}, {"reason", attempt.reason}});
  }
  nlohmann::ordered_json compared = nullptr;
  if (!std::isnan(closed.compared_volume)) {
    compared = closed.compared_volume * std::pow(frame.scale, 3);
  }
  const auto distances = [&](const DistanceStatistics& d) -> nlohmann::ordered_json {
    return {{"rms", d.rms * frame.scale}, {"max", d.max * frame.scale}};
  };
  return {{"way", closed.attempts[closed.taken].way},
          {"objection", closed.attempts[closed.taken].reason},
          {"attempts", attempts},
          {"compared_volume", compared},
          {"inside", closed.inside},
          {"deviation",
           {{"from_result", distances(closed.deviation.accuracy)},
            {"from_input", distances(closed.deviation.completeness)}}},
          {"certificate", certificate_to_json(closed.certificate, closed.mesh, frame)}};
}

FilterStep prepare_watertight(FilterArguments&) {
  return [](FilterState& state, const Progress& progress) {
    require_faces(state, "watertight");
    ClosedMesh closed = closed_mesh(state.mesh, progress);
    FilterRemark out(closing_remark(closed, state.frame), closing_details(closed, state.frame));
    state.mesh = std::move(closed.mesh);
    return out;
  };
}

void require_solid(const TriangleMesh& mesh, const std::string& name, const char* operation) {
  const std::string reason = why_no_solid(mesh);
  if (reason.empty()) return;
  throw InvalidInput(std::string("--op ") + operation + ": " + name + " " + reason +
                     ", so that it has no inside; repair, fill-holes or wrap may help");
}

FilterStep boolean_step(FilterArguments& arguments, const char* name, BooleanOperation operation) {
  return [=, path = arguments.file()](FilterState& state, const Progress& progress) {
    require_faces(state, name);
    require_solid(state.mesh, "the mesh", name);
    const SecondMesh second = read_second_mesh(state, path, name);
    require_solid(second.mesh, printable(path), name);
    report(progress, 0.3);
    BooleanResult result = boolean(state.mesh, second.mesh, operation);
    state.mesh = std::move(result.mesh);
    return "with " + second.remark + "; " + std::to_string(result.from_second) +
           " faces come from it" + cut_remark(result.self_intersections);
  };
}

FilterStep prepare_union(FilterArguments& arguments) {
  return boolean_step(arguments, "union", BooleanOperation::Union);
}

FilterStep prepare_intersect(FilterArguments& arguments) {
  return boolean_step(arguments, "intersect", BooleanOperation::Intersection);
}

FilterStep prepare_subtract(FilterArguments& arguments) {
  return boolean_step(arguments, "subtract", BooleanOperation::Difference);
}

FilterStep prepare_base(FilterArguments& arguments) {
  const double thickness = arguments.length();
  std::optional<Eigen::Vector3d> stated;
  if (arguments.more()) stated = arguments.direction();
  return [=](FilterState& state, const Progress& progress) {
    require_faces(state, "base");
    require_solid(state.mesh, "the mesh", "base");
    report(progress, 0.2);
    const Eigen::Vector3d front = stated.value_or(seen_side(state.mesh));
    if (front.isZero()) {
      throw InvalidInput(
          "--op base: the file does not say which side was seen; state the way that "
          "its front looks as X,Y,Z after the thickness");
    }
    FlatBase base = with_flat_base(state.mesh, front, thickness / state.frame.scale);
    constexpr double kNothing = 1e-9;  // of the volume
    if (base.cut_off < kNothing) {
      throw InvalidInput(
          "--op base: the mesh ends before THICKNESS behind what was seen, so that "
          "nothing can be cut flat; state less");
    }
    state.mesh = std::move(base.solid.mesh);
    const Eigen::Vector3d n = front.normalized();
    return percent(base.cut_off, 1) + " of the volume cut off behind; the front looks to " +
           number(n.x(), "%.2f") + "," + number(n.y(), "%.2f") + "," + number(n.z(), "%.2f") +
           cut_remark(base.solid.self_intersections);
  };
}

}  // namespace

std::vector<FilterOperation> solid_operations() {
  return {
      {"watertight",
       "",
       "Closed, oriented mesh that does not cut itself, certified, by the gentlest way that works",
       "watertight",
       prepare_watertight},
      {"wrap",
       "ALPHA[,OFFSET]",
       "Closed surface that a ball of radius ALPHA cannot get through",
       "wrap=2cm",
       prepare_wrap},
      {"base",
       "THICKNESS[,X,Y,Z]",
       "Closed mesh cut flat THICKNESS behind what was seen, which looks to X,Y,Z",
       "base=5mm",
       prepare_base},
      {"union", "FILE", "What is in this solid or a second one", "union=b.ply", prepare_union},
      {"intersect",
       "FILE",
       "What is in this solid and a second one",
       "intersect=b.ply",
       prepare_intersect},
      {"subtract",
       "FILE",
       "What is in this solid but not in a second one",
       "subtract=b.ply",
       prepare_subtract}};
}

}  // namespace cgs
