// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/commands.h"

namespace cgs {

void add_commands(CLI::App& app) {
  add_run(app);
  add_batch(app);
  add_info(app);
  add_train(app);
  add_evaluate(app);
  add_render(app);
  add_next(app);
  add_fuse(app);
  add_mesh(app);
  add_filter(app);
  add_measure(app);
  add_compare(app);
  add_convert(app);
  add_tradeoff(app);
  add_verify(app);
}

}  // namespace cgs
