// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/commands.h"

#include "convert/commands/usage.h"
#include "convert/text/terminal.h"

namespace cgs {

namespace {

constexpr const char* kDescription =
    "cgs - a few photographs to assets that say what was seen and what was invented";

constexpr const char* kFooter =
    "Example: cgs run photos/portal --views 1,10,19 -o out/portal\n"
    "         opens as out/portal/report.html\n"
    "Each command explains itself: cgs run --help";

}  // namespace

void add_commands(CLI::App& app) {
  add_run(app);
  add_batch(app);
  add_info(app);
  add_train(app);
  add_evaluate(app);
  add_render(app);
  add_fill(app);
  add_next(app);
  add_split(app);
  add_fuse(app);
  add_mesh(app);
  add_filter(app);
  add_measure(app);
  add_compare(app);
  add_monitor(app);
  add_convert(app);
  add_tradeoff(app);
  add_verify(app);
}

std::unique_ptr<CLI::App> command_line() {
  auto app = std::make_unique<CLI::App>(kDescription, "cgs");
  app->footer(kFooter);
  app->require_subcommand(1);
  app->failure_message(usage_message);
  app->set_version_flag("--version", program_version());
  add_commands(*app);
  return app;
}

}  // namespace cgs
