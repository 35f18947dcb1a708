// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/commands/commands.h"
#include "convert/commands/run_options.h"
#include "convert/report/batch_page.h"
#include "convert/run/budget.h"
#include "convert/run/pipeline.h"
#include "convert/text/advice.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct BatchArgs {
  RunArguments run;
  std::vector<fs::path> scenes;
  fs::path output;
  bool retry = false;
};

// Before any of them is begun.
void keep_results_apart(const BatchArgs& args, const std::vector<std::string>& names) {
  for (size_t i = 0; i < names.size(); ++i) {
    keep_apart(args.output, args.scenes[i]);
    keep_run_apart(args.output / names[i], args.scenes[i]);
  }
}

// In the folder of a scene whose run failed, or that is at work: what ends the program is known of
// at the next start.
constexpr const char* kFailure = "failure.txt";

// "church" of photos/church, of photos/church/ and of photos/church/images. That of a link, as
// samples/workflow has it, not of what it leads to.
std::string name_of(const fs::path& scene) {
  fs::path folder = fs::absolute(scene).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  if (folder.filename() == "images" && folder.has_parent_path()) folder = folder.parent_path();
  if (folder.has_filename()) return folder.filename().string();
  throw InvalidInput("the scene " + printable(scene) +
                     " has no name that a folder of results could be called by");
}

std::vector<std::string> names_of(const std::vector<fs::path>& scenes) {
  std::vector<std::string> out;
  std::set<std::string> known;
  for (const fs::path& scene : scenes) {
    out.push_back(name_of(scene));
    if (known.insert(out.back()).second) continue;
    throw InvalidInput("two scenes are called " + one_line(out.back()) +
                       ", so that their results would lie in one folder; rename one");
  }
  return out;
}

std::string first_line(const fs::path& file) {
  const std::string text = read_file(file);
  return text.substr(0, text.find('\n'));
}

/// Runs scenes one after the other, each with all threads.
class Batch {
 public:
  Batch(const BatchArgs& args, Terminal& terminal) : args_(args), terminal_(terminal) {}

  BatchResult run(const fs::path& scene, const std::string& name) {
    BatchResult out;
    out.name = name;
    const fs::path folder = args_.output / name;
    const fs::path failure = folder / kFailure;
    if (is_present(failure) && !args_.retry) {
      out.failure = first_line(failure);
      terminal_.say(name + ": failed before, --retry tries again: " + out.failure);
      return out;
    }
    const bool is_run = is_present(folder / "run.json");
    make_output_folder(folder);
    write_file(failure, "the program ended in the middle of it\n");
    const auto start = std::chrono::steady_clock::now();
    try {
      out.report = pipeline(scene, folder, start).report;
      fs::remove(failure);
    } catch (const Cancelled&) {
      fs::remove(failure);
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      const auto* const own = dynamic_cast<const Error*>(&error);  // else that of a library
      out.failure = own != nullptr ? words_of(*own) : one_line(error.what());
      write_file(failure, out.failure + "\n");
      // Where a run is already, it is these options that do not suit it.
      if (is_run && dynamic_cast<const InvalidInput*>(&error) != nullptr) fs::remove(failure);
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    terminal_.say(name + ": " +
                  (out.failure.empty() ? "done in " + format_seconds(taken.count()) : out.failure));
    return out;
  }

 private:
  FinishedRun pipeline(const fs::path& scene,
                       const fs::path& folder,
                       std::chrono::steady_clock::time_point start) {
    RunArguments arguments = args_.run;
    arguments.request.scene.path = scene;
    arguments.request.output = folder;
    RunRequest request = run_request(arguments);
    // What many scenes say of themselves is in their reports.
    Terminal silent = Terminal::silent(arguments.common.strict);
    const double budget = stated_budget(arguments);
    if (budget > 0) request = within_budget(request, budget, start, silent);
    return run_pipeline(request, silent);
  }

  const BatchArgs& args_;
  Terminal& terminal_;
};

void print_rows(const Json& rows) {
  std::printf("%-24s %9s %9s %9s  %s\n", "scene", "measured", "observed", "invented", "");
  for (const Json& row : rows) {
    const std::string name = one_line(row["name"].get<std::string>());
    if (row["state"] == Json("failed")) {
      std::printf("%-24s failed: %s\n", name.c_str(), row["failure"].get<std::string>().c_str());
      continue;
    }
    std::printf("%-24s %9s %9s %9s  %s\n",
                name.c_str(),
                percent(row["measured"]).c_str(),
                percent(row["observed"]).c_str(),
                percent(row["invented"]).c_str(),
                row["certified"].get<bool>() ? "certified" : "NOT certified");
  }
}

// After all were tried, and told of.
void refuse_failures(const std::vector<BatchResult>& results, const fs::path& output) {
  const auto failed = std::count_if(
      results.begin(), results.end(), [](const BatchResult& r) { return !r.failure.empty(); });
  if (failed == 0) return;
  constexpr int kBadInput = 3;
  throw Error(kBadInput,
              "--strict: " + std::to_string(failed) + " of " + std::to_string(results.size()) +
                  " scenes failed; " + printable(output / "batch.json") + " says why");
}

void run_batch(const BatchArgs& args) {
  limit_threads(args.run.common.threads);
  const std::vector<std::string> names = names_of(args.scenes);
  keep_results_apart(args, names);
  Terminal terminal(args.run.common.quiet, args.run.common.strict);
  make_output_folder(args.output);
  Batch batch(args, terminal);
  std::vector<BatchResult> results;
  for (size_t i = 0; i < names.size(); ++i) {
    terminal.begin(names[i])(double(i) / double(names.size()));
    results.push_back(batch.run(args.scenes[i], names[i]));
    write_batch_page(args.output, results);  // whoever looks in between sees what is done
  }
  Json rows = Json::array();
  for (const BatchResult& result : results) rows.push_back(batch_row(result));
  write_file(args.output / "batch.json", json_text(rows) + "\n");
  if (args.run.common.json) {
    print_report(rows);
  } else {
    print_rows(rows);
  }
  terminal.say("open " + (args.output / "index.html").string());
  if (args.run.common.strict) refuse_failures(results, args.output);
}

}  // namespace

void add_batch(CLI::App& app) {
  auto args = std::make_shared<BatchArgs>();
  auto* cmd = app.add_subcommand("batch", "Many scenes to every asset, with one page over all");
  cmd->add_option("scenes", args->scenes, "Folders of scenes, as for run")->required();
  cmd->add_option("-o,--output", args->output, "Folder to write; each scene has one below it")
      ->required();
  cmd->add_flag("--retry", args->retry, "Also those that failed before");
  add_run_options(*cmd, args->run);
  add_overwrite_option(*cmd, args->run.request);
  cmd->footer(
      "Example: cgs batch objects/*/ --preset draft -o out/objects\n"
      "         opens as out/objects/index.html\n"
      "Run again, it does what is not done yet. One that fails does not stop the others, and\n"
      "the exit code is 0, with --strict 3: OUT/batch.json says which, OUT/NAME/failure.txt why.\n"
      "Each run takes all threads.");
  cmd->callback([args] { run_batch(*args); });
}

}  // namespace cgs
