// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/files/mesh_files.h"
#include "convert/filter/chain.h"
#include "convert/measure/measured_file.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct FilterArgs {
  std::filesystem::path input;
  std::filesystem::path output;
  std::vector<std::string> operations;
  std::string assume_unit;
  std::vector<double> up;
  bool local_origin = false;
  CommonOptions common;
};

// Whether what is left can be written under that name.
void check_content(const std::filesystem::path& output, const FilterState& state) {
  if (!state.is_cloud() || lower_extension(output) == ".ply") return;
  throw InvalidInput("a point cloud can only be written as .ply, not as " + printable(output));
}

void run_filter_command(const FilterArgs& args) {
  limit_threads(args.common.threads);
  keep_apart(args.output, args.input);
  require(is_writable_mesh_name(args.output),
          "the output must end in .ply, .obj, .stl, .om, .3mf or .glb",
          printable(args.output.filename()));
  require(!args.local_origin || lower_extension(args.output) == ".glb",
          "--local-origin is for .glb; the output",
          printable(args.output.filename()));
  { const AtomicFile can_be_written(args.output); }  // before all the work
  Terminal terminal(args.common.quiet, args.common.strict);
  (void)prepare_filters(args.operations, Frame{.metres_per_unit = 1});  // before a long read
  MeasurableFile file = read_measured(args.input, args.assume_unit);
  terminal.warn(file.warnings);
  if (!args.up.empty()) {
    file.content.frame.up = up_direction(args.up);
    file.assumed_up.clear();
  }
  FilterState state{std::move(file.content.mesh), file.content.frame, file.content.file_origin};
  const std::vector<PreparedFilter> filters = prepare_filters(args.operations, state.frame);
  for (const PreparedFilter& filter : filters) {
    for (const auto& named : filter.files) keep_apart(args.output, named);
  }
  require_writable_as(args.output, state.frame);
  const nlohmann::ordered_json report = run_filters(state, filters, terminal);
  check_content(args.output, state);
  Frame written = state.frame;
  if (is_turned_upright(args.output)) {
    const std::string assumed = settle_up(written, {});
    if (!assumed.empty()) file.assumed_up = assumed;
  }
  for (const std::string& lost : {textures_text(file.has_textures),
                                  lost_in_file(args.output, state.mesh, state.frame),
                                  assumed_up_text(args.input, args.output, file.assumed_up)}) {
    if (!lost.empty()) terminal.say(lost);
  }
  // Nothing is rounded, so that what was certified stays that: cgs convert compresses.
  GlbOptions exact;
  exact.encoding = GlbEncoding::Plain;
  exact.local_origin = args.local_origin;
  (void)write_mesh_as(args.output, state.mesh, written, exact);
  const std::string moved =
      moved_origin_text(args.output, state.file_origin, state.frame.file_origin);
  if (!moved.empty()) terminal.warn(moved);
  const std::string place = glb_place_text(args.output, state.frame, args.local_origin);
  if (!place.empty()) terminal.say(place);
  if (args.common.json) print_report({{"operations", report}});
}

}  // namespace

void add_filter(CLI::App& app) {
  auto args = std::make_shared<FilterArgs>();
  auto* cmd = app.add_subcommand(
      "filter", "Clean, crop, smooth, simplify ... meshes and point clouds; labels and sigma stay");
  cmd->add_option("input",
                  args->input,
                  "Mesh or point cloud: .ply, .obj, .stl, .off, .om, .3mf, .glb, "
                  ".gltf")
      ->required();
  cmd->add_option("output", args->output, "File to write: .ply, .obj, .stl, .om, .3mf, .glb")
      ->required();
  cmd->add_option("--op", args->operations, "An operation, name=arguments; may be repeated")
      ->required()
      ->allow_extra_args(false);
  cmd->add_option(
      "--assume-unit", args->assume_unit, "What a unit of the file is, where it does not say");
  cmd->add_option("--up",
                  args->up,
                  "Direction that is up, for .stl, .3mf and .glb; default: as the file says, "
                  "else 0 0 1")
      ->expected(3);
  add_local_origin_option(*cmd, args->local_origin, "The .glb");
  add_output_options(*cmd, args->common);
  cmd->footer(filter_help() +
              "Coordinates are those of the file. Lengths and coordinates take a unit (2mm, -3cm) "
              "or are in units of the file.\n"
              "Example: cgs filter scan.ply clean.ply --op statistical-outliers=20,2 "
              "--op largest=1 --op taubin=10 --op simplify=2mm");
  cmd->callback([args] { run_filter_command(*args); });
}

}  // namespace cgs
