// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/commands/compare_splats.h"
#include "convert/measure/comparison.h"
#include "convert/measure/m3c2_comparison.h"
#include "convert/measure/measured_file.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"
#include "meshing/measure/surface_measures.h"

namespace cgs {

namespace {

struct CompareArgs {
  std::filesystem::path a;
  std::filesystem::path b;
  size_t samples = 200'000;
  bool icp = false;
  bool scale = false;
  M3c2Request m3c2;
  std::string threshold;
  std::filesystem::path ply;
  std::filesystem::path svg;
  std::string unit;
  std::string assume_unit;
  SplatCompareArgs splats;
  CommonOptions common;
};

double share_within(const std::vector<Deviation>& deviations, double threshold) {
  const auto count = std::count_if(deviations.begin(), deviations.end(), [&](const Deviation& d) {
    return std::abs(d.distance) <= threshold;
  });
  return static_cast<double>(count) / static_cast<double>(std::max<size_t>(1, deviations.size()));
}

SurfaceAgreement agreement(const CompareArgs& args,
                           const MeasurableMesh& a,
                           const MeasurableMesh& b,
                           const std::vector<Deviation>& a_to_b) {
  SurfaceAgreement out;
  out.threshold = parse_length(args.threshold, a.frame, "--threshold");
  out.accuracy = share_within(a_to_b, out.threshold);
  if (a.mesh.faces.empty()) {
    throw InvalidInput("--threshold needs a surface on both sides, but " + printable(args.a) +
                       " is a point cloud");
  }
  out.completeness = share_within(deviations(points_by_area(b, args.samples), a, NearestSurface(a)),
                                  out.threshold);
  return out;
}

std::string title_of(const CompareArgs& args) {
  return printable(args.a.filename()) + " against " + printable(args.b.filename());
}

Registration lay_onto(MeasurableMesh& a,
                      const MeasurableMesh& b,
                      const NearestSurface& surface,
                      bool with_scale,
                      const Terminal& terminal) {
  Registration out = motion_onto(a, b, surface, with_scale);
  if (!out.converged) {
    terminal.warn({"--icp still moved A after " + std::to_string(out.iterations) +
                   " iterations: the surfaces hold each other badly"});
  }
  a = moved(a, out);
  return out;
}

// How wrong one scale may be against the other.
struct ScaleError {
  double relative = 0;                               // standard deviation
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // what it leaves in its place
};

// Faces say the sign of all distances, and a closed mesh says whether they lie.
void warn_of_inward(const std::filesystem::path& path,
                    const MeasurableMesh& mesh,
                    const Terminal& terminal) {
  constexpr double kFlat = 1e-9;  // what rounding makes of the volume of two sides of a sheet
  if (!(enclosed_volume(mesh).value < -kFlat * std::pow(box_of(mesh).diagonal().norm(), 3))) return;
  if (has_rim(mesh)) return;
  terminal.warn("the faces of " + printable(path) +
                " look inward, so that nearer and farther are exchanged; cgs filter --op repair "
                "turns them");
}

// What both files say, before A's frame is taken for both.
nlohmann::ordered_json files_json(const CompareArgs& args,
                                  const MeasurableMesh& a,
                                  const MeasurableMesh& b) {
  return {{"a", measured_json(args.a, a, figure_unit(a.frame, ""))},
          {"b", measured_json(args.b, b, figure_unit(b.frame, ""))}};
}

void print_json(const nlohmann::ordered_json& files,
                const FigureUnit& unit,
                const nlohmann::ordered_json& found) {
  nlohmann::ordered_json report = files;
  for (auto& file : report) file["unit"] = unit.name;  // of the figures
  report.update(found);
  print_report(report);
}

void print_text(const CompareArgs& args, const Comparison& comparison, const FigureUnit& unit) {
  std::printf("%s, %zu points\n%s",
              one_line(title_of(args)).c_str(),
              comparison.summary.count,
              comparison_text(comparison, unit).c_str());
}

// Where only one file says how long a unit is: A has grown into units of B, so that is known of
// these now.
void share_unit(Frame& a, const Frame& b, double growth) {
  if (a.has_metric_scale() == b.has_metric_scale()) return;
  a.has_metric_scale() ? take_scale(a, a, growth) : take_scale(a, b, 1);
}

// Cloud against cloud, along normals: what --m3c2 asks for.
void print_m3c2(const CompareArgs& args,
                const nlohmann::ordered_json& files,
                const MeasurableMesh& a,
                const M3c2Comparison& found,
                const FigureUnit& unit) {
  if (!args.ply.empty()) write_m3c2_ply(args.ply, a, found);
  if (!args.svg.empty()) write_histogram_svg(args.svg, found.comparison, unit, title_of(args));
  if (args.common.json) {
    print_json(files, unit, m3c2_json(found, a, unit));
  } else {
    print_text(args, found.comparison, unit);
    std::printf("%s", m3c2_text(found, unit).c_str());
  }
}

// The unit of one file is not that of the other. Only a registration finds it out, if it is near.
void check_units(const CompareArgs& args, const Frame& a, const Frame& b) {
  if (a.has_metric_scale() == b.has_metric_scale() || args.scale) return;
  const auto& [known, unknown] =
      a.has_metric_scale() ? std::pair(args.a, args.b) : std::pair(args.b, args.a);
  throw InvalidInput(printable(unknown) + " does not say how long a unit of it is, " +
                     printable(known) + " does; say it with --assume-unit");
}

void check_options(const CompareArgs& args) {
  for (const auto& output : {args.ply, args.svg}) {
    for (const auto& input : {args.a, args.b}) {
      if (!output.empty()) keep_apart(output, input);
    }
  }
  require_ending(args.ply, ".ply", "--ply");
  require_ending(args.svg, ".svg", "--svg");
  for (const auto& output : {args.ply, args.svg}) {
    if (!output.empty()) const AtomicFile can_be_written(output);  // before all the work
  }
  require(args.samples >= 100 && args.samples <= 100'000'000,
          "--samples must be in 100 ... 100000000",
          args.samples);
}

void check_clouds(const CompareArgs& args, const MeasurableMesh& b) {
  if (!b.mesh.faces.empty()) return;
  if (!args.m3c2.wanted) {
    throw InvalidInput(
        printable(args.b) +
        " is a point cloud; distances need a surface: name the cloud first, or say --m3c2");
  }
  if (args.icp) {
    throw InvalidInput("--icp needs a surface to lay A onto, but " + printable(args.b) +
                       " is a point cloud");
  }
}

// Both files hold splats, which have pictures, or neither does.
bool are_splats(const CompareArgs& args) {
  const bool a = holds_splats(args.a);
  const bool b = holds_splats(args.b);
  if (a != b) {
    throw InvalidInput(printable(a ? args.a : args.b) + " holds splats and " +
                       printable(a ? args.b : args.a) +
                       " does not: compare pictures of two files of splats, or make a mesh of them "
                       "with cgs convert");
  }
  const bool looks = !args.splats.scene.empty() || !args.splats.pictures.empty();
  if (looks && !a) throw InvalidInput("--scene and --pictures are for two files of splats");
  const bool measures = args.icp || args.m3c2.wanted || !args.threshold.empty() ||
                        !args.ply.empty() || !args.svg.empty() || !args.unit.empty() ||
                        !args.assume_unit.empty();
  if (measures && a) {
    throw InvalidInput(
        "two files of splats are compared by their pictures: distances, as --icp, --m3c2, "
        "--threshold, --ply, --svg, --unit and --assume-unit ask for, are those of meshes");
  }
  return a;
}

void run_compare(const CompareArgs& args) {
  limit_threads(args.common.threads);
  check_options(args);
  if (are_splats(args)) return run_splat_compare(args.a, args.b, args.splats, args.common);
  let_interrupts_end();
  Terminal terminal(args.common.quiet, args.common.strict);
  MeasurableFile first = read_measured(args.a, args.assume_unit);
  MeasurableFile second = read_measured(args.b, args.assume_unit);
  for (const MeasurableFile* file : {&first, &second}) terminal.warn(file->warnings);
  check_clouds(args, second.content);
  // With --scale it may be in a unit that is known afterwards alone.
  if (!args.threshold.empty() && !args.scale) {
    (void)parse_length(args.threshold, first.content.frame, "--threshold");
  }
  check_units(args, first.content.frame, second.content.frame);
  const std::string turned = turned_text(first.content.frame, second.content.frame);
  if (!turned.empty() && !args.icp) terminal.warn({turned});
  const nlohmann::ordered_json files = files_json(args, first.content, second.content);
  MeasurableMesh a = std::move(first.content);
  ScaleError of_scale{args.scale ? 0 : relative_scale_sigma(a.frame, second.content.frame)};
  MeasurableMesh b = in_frame_of(second.content, a.frame);
  warn_of_inward(args.m3c2.wanted ? args.a : args.b, args.m3c2.wanted ? a : b, terminal);
  if (!args.scale) (void)figure_unit(a.frame, args.unit);  // before all the work
  Comparison comparison;
  std::optional<NearestSurface> surface;
  if (args.icp || !args.m3c2.wanted) surface.emplace(b);
  if (args.icp) {
    comparison.registration = lay_onto(a, b, *surface, args.scale, terminal);
    share_unit(a.frame, second.content.frame, comparison.registration->scale);
    b.frame = a.frame;
  }
  of_scale.center = unmoved_by_scale(a, second.content.frame, args.icp);
  const FigureUnit unit = figure_unit(a.frame, args.unit);
  if (args.m3c2.wanted) {
    M3c2Request request = args.m3c2;
    request.scale_sigma = of_scale.relative;
    request.scale_center = of_scale.center;
    M3c2Comparison found = compare_m3c2(request, a, b);
    found.comparison.registration = comparison.registration;
    return print_m3c2(args, files, a, found, unit);
  }
  const auto compared = [&](ComparedPoints points) {
    add_scale_sigma(points, of_scale.relative, of_scale.center);
    return deviations(points, b, *surface);
  };
  comparison.by_area = compared(points_by_area(a, args.samples));
  comparison.summary = summarize(comparison.by_area);
  comparison.half_range = range_of(comparison.by_area);
  if (!args.threshold.empty()) {
    comparison.agreement = agreement(args, a, b, comparison.by_area);
  }
  if (!args.ply.empty()) {
    write_colored(args.ply, a, compared(points_by_vertex(a)), comparison.half_range);
  }
  if (!args.svg.empty()) write_histogram_svg(args.svg, comparison, unit, title_of(args));
  if (args.common.json) {
    print_json(files, unit, comparison_json(comparison, a, unit));
  } else {
    print_text(args, comparison, unit);
  }
}

void add_m3c2(CLI::App& cmd, M3c2Request& request) {
  auto* m3c2 = cmd.add_flag("--m3c2",
                            request.wanted,
                            "Points of A against points of B along local normals, with the level "
                            "of detection; either may be a point cloud");
  cmd.add_option("--normal-scale",
                 request.normal_scale,
                 "Diameter in which A gives the normal; default: twice the cylinder")
      ->needs(m3c2);
  cmd.add_option("--cylinder",
                 request.cylinder,
                 "Diameter in which points are averaged; default: about 30 points")
      ->needs(m3c2);
  cmd.add_option("--cylinder-depth",
                 request.depth,
                 "How far it reaches to either side; default: 10 diameters")
      ->needs(m3c2);
  cmd.add_option("--registration-error",
                 request.registration,
                 "Standard deviation of laying A onto B, e.g. 2mm; default 0")
      ->needs(m3c2);
}

}  // namespace

void add_compare(CLI::App& app) {
  auto args = std::make_shared<CompareArgs>();
  auto* cmd = app.add_subcommand("compare",
                                 "Signed distances of a mesh or point cloud to a mesh, and what "
                                 "really changed; or pictures of "
                                 "two files of splats");
  cmd->add_option(
         "a",
         args->a,
         "Mesh or point cloud: .ply, .obj, .stl, .off, .om, .3mf, .glb, .gltf; or splats: .ply, "
         ".splat, .spz, .sog or its meta.json, .ksplat, .glb, .gltf")
      ->required();
  cmd->add_option(
         "b",
         args->b,
         "Mesh to measure from (with --m3c2 also a cloud): reference, or the earlier date; or "
         "splats in the same coordinates")
      ->required();
  cmd->add_option("--samples", args->samples, "Points on A, evenly by area (of a cloud: all)")
      ->capture_default_str();
  auto* icp =
      cmd->add_flag("--icp",
                    args->icp,
                    "Move A onto B first (iterative closest point); A must lie near B already");
  cmd->add_flag("--scale", args->scale, "Let it grow or shrink, too")->needs(icp);
  add_m3c2(*cmd, args->m3c2);
  cmd->get_option("--samples")->excludes("--m3c2");
  cmd->add_option(
         "--threshold", args->threshold, "Accuracy, completeness and F-score within this length")
      ->excludes("--m3c2");
  cmd->add_option("--ply", args->ply, "Write A with the distance as colour and scalar");
  cmd->add_option("--svg", args->svg, "Draw the histogram");
  cmd->add_option("--unit", args->unit, "Unit of the figures; default m");
  cmd->add_option(
      "--assume-unit", args->assume_unit, "What a unit of a file is, where it does not say");
  add_splat_compare_options(*cmd, args->splats);
  add_output_options(*cmd, args->common);
  cmd->footer(
      "Positive distances lie on the side that B's faces look to; with --m3c2: that A's look to.\n"
      "Example: cgs compare 2026.ply 2024.ply --icp --unit mm --ply change.ply --threshold 5mm\n"
      "         cgs compare 2026.ply 2024.ply --m3c2 --cylinder 5cm --registration-error 2mm "
      "--ply change.ply\n"
      "         cgs compare splats.ply smaller.spz --scene photos/portal --pictures out/compared");
  cmd->callback([args] { run_compare(*args); });
}

}  // namespace cgs
