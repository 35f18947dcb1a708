// SPDX-License-Identifier: GPL-3.0-or-later
#include <iostream>
#include <memory>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/common_options.h"
#include "convert/run/verification.h"
#include "convert/text/report_json.h"
#include "convert/text/terminal.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct VerifyArgs {
  std::filesystem::path output;
  std::filesystem::path other;
  bool recompute = false;
  CommonOptions common;
};

Verification found_by(const VerifyArgs& args) {
  if (!args.other.empty()) return compare_runs(args.output, args.other);
  Terminal terminal(args.common.quiet || !args.recompute, args.common.strict);
  if (args.recompute) {
    return recompute_run(args.output, stated_memory_limit(args.common), terminal);
  }
  return verify_run(args.output, terminal);
}

void run_verify(const VerifyArgs& args) {
  limit_threads(args.common.threads);
  const Verification found = found_by(args);
  if (args.common.json) {
    print_report(
        {{"inputs", found.inputs}, {"outputs", found.outputs}, {"differing", found.differing}});
  } else {
    for (const std::string& line : found.differing) std::cout << one_line(line) << "\n";
    if (args.other.empty()) std::cout << found.inputs << " inputs and ";
    std::cout << found.outputs << " outputs checked, " << found.differing.size() << " differ\n";
    if (!found.recomputed.empty()) {
      std::cout << "what was computed now is in " << printable(found.recomputed) << "\n";
    }
  }
  if (found.differing.empty()) return;
  throw BadInput(
      Defect::Mismatch,
      args.output,
      std::to_string(found.differing.size()) + " differ, the first is " + found.differing.front());
}

}  // namespace

void add_verify(CLI::App& app) {
  auto args = std::make_shared<VerifyArgs>();
  auto* cmd = app.add_subcommand(
      "verify", "Inputs and outputs of a run against the hashes in its run.json; exit 3 = changed");
  cmd->add_option("output", args->output, "Folder that run wrote")->required();
  auto* other = cmd->add_option(
      "other", args->other, "Folder of another run that should have given the same files");
  cmd->add_flag("--recompute",
                args->recompute,
                "Do the whole run again from its inputs and compare the files; takes as long, and "
                "as much room beside it, as the run did")
      ->excludes(other);
  add_common_options(*cmd, args->common);
  cmd->footer("Example: cgs verify out/portal\n         cgs verify out/portal --recompute");
  cmd->callback([args] { run_verify(*args); });
}

}  // namespace cgs
