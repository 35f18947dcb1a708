// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/commands.h"

#include <iostream>
#include <mutex>
#include <sstream>

#include "python/module.h"
#include "python/work.h"
#include <nlohmann/json.hpp>

#include "convert/commands/common_options.h"
#include "convert/commands/usage.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace py = pybind11;

bool is_row(const py::handle& value) {
  return py::isinstance<py::tuple>(value) || py::isinstance<py::list>(value);
}

// A value as it would be typed: "0.5", "1,10,19".
std::string typed(const py::handle& value) {
  if (!is_row(value)) return py::str(value).cast<std::string>();
  std::string out;
  for (const auto& part : py::reinterpret_borrow<py::sequence>(value)) {
    out += (out.empty() ? "" : ",") + typed(part);
  }
  return out;
}

// As `if value:` has it: 0 and numpy.False_ are not the object False.
bool is_true(const py::handle& value) {
  const int answer = PyObject_IsTrue(value.ptr());
  if (answer < 0) throw py::error_already_set();
  return answer == 1;
}

// voxel_size=0.5 as --voxel-size 0.5; a list for an option that takes one word as 1,10,19, for one
// that takes several as so many words, and else as an option for each.
void add_option(const CLI::App& command,
                const std::string& name,
                const py::handle& value,
                std::vector<std::string>& out) {
  std::string flag = "--" + name;
  std::replace(flag.begin(), flag.end(), '_', '-');
  const CLI::Option* option = command.get_option_no_throw(flag);
  if (option == nullptr) {
    throw InvalidInput(command.get_name() + " takes no " + name + "; help(cgs.program." +
                       command.get_name() + ") lists what it takes");
  }
  if (value.is_none() || value.ptr() == Py_False) return;
  const bool is_flag = option->get_expected_max() == 0;
  if (is_flag && !is_true(value)) return;
  if (is_flag || value.ptr() == Py_True) {
    out.push_back(flag);
    return;
  }
  const bool is_one_word = option->get_expected_max() == 1;
  if (!is_row(value) || is_one_word) {
    out.insert(out.end(), {flag, typed(value)});
    return;
  }
  const auto parts = py::reinterpret_borrow<py::sequence>(value);
  const auto count = static_cast<int>(parts.size());
  constexpr int kAnyNumber = 1 << 16;  // CLI11 has a larger one for options that may be repeated
  const bool takes_all = option->get_expected_max() < kAnyNumber &&
                         count >= option->get_expected_min() && count <= option->get_expected_max();
  if (takes_all) out.push_back(flag);
  for (const auto& part : parts) {
    if (!takes_all) out.push_back(flag);
    out.push_back(typed(part));
  }
}

struct Outcome {
  std::string printed;
  std::string misuse;
};

// Commands print on the standard output of C++, which all threads share.
std::mutex one_command;

Outcome outcome_of(CLI::App& app, std::vector<std::string> words) {
  const std::lock_guard lock(one_command);
  std::ostringstream printed;
  struct Redirected {
    std::streambuf* before;
    ~Redirected() { std::cout.rdbuf(before); }
  } const redirected{std::cout.rdbuf(printed.rdbuf())};
  struct ThreadsFreed {
    ~ThreadsFreed() { release_threads(); }
  } const threads_freed;
  std::reverse(words.begin(), words.end());  // the order CLI11 takes a vector in
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    std::string misuse = usage_message(&app, error);
    while (!misuse.empty() && misuse.back() == '\n') misuse.pop_back();
    return {{}, misuse};
  }
  return {printed.str(), {}};
}

py::object run(const std::string& name,
               const py::args& args,
               const py::object& progress,
               const py::kwargs& options) {
  CLI::App app("", "cgs");
  app.require_subcommand(1);
  add_commands(app);
  const CLI::App& command = *app.get_subcommand(name);
  std::vector<std::string> words = {name};
  for (const auto& arg : args) words.push_back(typed(arg));
  for (const auto& [key, value] : options) {
    add_option(command, key.cast<std::string>(), value, words);
  }
  if (command.get_option_no_throw("--json") != nullptr) words.emplace_back("--json");
  const Outcome outcome = result_of(progress, [&](Terminal&) { return outcome_of(app, words); });
  if (!outcome.misuse.empty()) throw InvalidInput(outcome.misuse);
  if (outcome.printed.empty()) return py::none();
  return py::module_::import("json").attr("loads")(outcome.printed);
}

}  // namespace

void add_program(py::module_& module) {
  py::module_ program = module.def_submodule(
      "program",
      R"(The commands of the program, on files: cgs.program.run("photos/portal", output="out").

Options are those of the command line with _ for -, a flag is True or False, a list stands for
several values. Each returns what the command prints with --json, as dict or list, and raises
cgs.Error where the program would end with an error.)");
  CLI::App app("", "cgs");
  add_commands(app);
  for (const CLI::App* command : app.get_subcommands({})) {
    const std::string name = command->get_name();
    program.def(
        name.c_str(),
        [name](const py::args& args, const py::object& progress, const py::kwargs& options) {
          return run(name, args, progress, options);
        },
        py::arg("progress") = py::none(),
        command->help().c_str());
  }
}

}  // namespace cgs
