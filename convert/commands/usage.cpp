// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/usage.h"

#include <vector>

#include "convert/text/closest_name.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

std::string meant(const std::string& name) {
  return name.empty() ? "" : " (did you mean " + name + "?)";
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    out.push_back(command->get_name());
  }
  return out;
}

std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> out;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
  }
  return out;
}

}  // namespace

std::string usage_message(const CLI::App* app, const CLI::Error& error) {
  const std::vector<CLI::App*> chosen = app->get_subcommands();
  const std::vector<std::string> unknown = app->remaining(true);
  const std::string help =
      "; see cgs " + (chosen.empty() ? "" : chosen.front()->get_name() + " ") + "--help\n";
  if (unknown.empty()) return "cgs: " + one_line(error.what()) + help;
  const std::string& first = unknown.front();
  if (chosen.empty()) {
    return "cgs: there is no command " + printable(first) +
           meant(closest_name(first, commands_of(*app))) + help;
  }
  const std::string& command = chosen.front()->get_name();
  const std::string name = first.substr(0, first.find('='));
  return "cgs: " + command + " does not take " + printable(first) +
         meant(closest_name(name, options_of(*chosen.front()))) + help;
}

}  // namespace cgs
