// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/budget.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "convert/model/memory_plan.h"
#include "convert/model/model_training.h"
#include "convert/run/pipeline.h"
#include "convert/run/request_fields.h"
#include "convert/run/run_files.h"
#include "convert/run/small_run.h"
#include "convert/run/time_model.h"
#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

constexpr const char* kRecordFile = "budget.json";
constexpr const char* kTrialFolder = "budget_trial";
constexpr std::array kSizes = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32};
constexpr int kLeastSide = 64;          // [pixels]; below, windows of the sweep are most of a view
constexpr double kTrialPixels = 8'000;  // of a view, at least, in the first trials
constexpr double kTrialShare = 0.1;     // of the time left, that one more trial may take
constexpr double kEnoughPixels = 1.0 / 16;  // nearer to the goal another trial tells little
constexpr double kReserve = 1.1;            // what forecasts are off by

struct Candidate {
  int downscale = 1;
  std::string preset;
  double seconds = 0;
};

/// What was chosen; budget.json keeps it.
struct Choice {
  int downscale = 1;
  std::string preset;
  std::string words;  ///< For people.
};

struct Search {
  const RunRequest& request;
  const OpenedScene& opened;
  double pixels;           // of the input views, full size
  std::vector<int> sizes;  // downscales that may be used, ascending
  size_t larger_bytes;     // of memory, that the next larger size would need; 0 = there is none
  double deadline;         // seconds after start
  Clock::time_point start;
  Terminal& terminal;
  std::vector<TimedRun> runs = {};

  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start).count(); }
  double left() const { return deadline - elapsed(); }
  double pixels_at(int downscale) const { return pixels / (double(downscale) * downscale); }
};

std::string size_words(const Scene& scene, int downscale) {
  const Camera& camera = scene.views[static_cast<size_t>(scene.input.front())].camera;
  return std::to_string(camera.width / downscale) + " x " +
         std::to_string(camera.height / downscale) + " pixels";
}

// One whole run, of which only the times are kept.
TimedRun trial(const Search& search, int downscale, int steps) {
  RunRequest request = small_run(search.request, search.opened, kTrialFolder, downscale);
  request.training.steps = steps;
  (void)search.terminal.begin("trying " + size_words(search.opened.scene, downscale));
  Terminal silent = Terminal::silent();
  const auto start = Clock::now();
  TimedRun out;
  out.stages = run_pipeline(request, silent).seconds;
  out.pixels = search.pixels_at(downscale);
  out.steps = steps;
  out.opening = std::chrono::duration<double>(Clock::now() - start).count();
  for (const auto& [stage, seconds] : out.stages) out.opening -= seconds;
  out.opening = std::max(0.0, out.opening);
  (void)search.terminal.end(std::to_string(steps) + " steps");
  return out;
}

// The training alone: two of them tell what a step costs.
TimedRun training_trial(const Search& search, int downscale, int steps) {
  SceneRequest request = search.request.scene;
  request.options.downscale = downscale;
  (void)search.terminal.begin("trying " + size_words(search.opened.scene, downscale));
  Terminal silent = Terminal::silent();
  Scene scene = open_scene(request, search.request.output / "model", silent).scene;
  const auto start = Clock::now();
  ModelRequest training;
  training.training = search.request.training;
  training.training.steps = steps;
  training.depth_network = request.options.depth.network;
  (void)train_model(std::move(scene), training, silent.begin(""));
  TimedRun out;
  out.pixels = search.pixels_at(downscale);
  out.steps = steps;
  out.stages = {{kTrainedStage, std::chrono::duration<double>(Clock::now() - start).count()}};
  (void)search.terminal.end(std::to_string(steps) + " steps, training alone");
  return out;
}

// Best first.
std::vector<Candidate> candidates(const Search& search) {
  std::vector<Candidate> out;
  for (const int downscale : search.sizes) {
    for (const char* preset : {"standard", "draft"}) {
      const int steps = training_preset(preset).steps;
      out.push_back(
          {downscale, preset, foretold_seconds(search.runs, search.pixels_at(downscale), steps)});
    }
  }
  return out;
}

std::optional<Candidate> best_within(const Search& search, double seconds) {
  const std::vector<Candidate> all = candidates(search);
  const auto found = std::find_if(all.begin(), all.end(), [&](const Candidate& candidate) {
    return candidate.seconds * kReserve <= seconds;
  });
  return found == all.end() ? std::nullopt : std::optional(*found);
}

// The smallest pictures that something can be made of: what fails on a thumbnail, such as a known
// distance between two small things, is no reason to refuse the run.
int first_trial(Search& search, int steps) {
  const double views = static_cast<double>(search.opened.scene.input.size());
  auto size = std::find_if(search.sizes.rbegin(), search.sizes.rend(), [&](int downscale) {
    return search.pixels_at(downscale) >= kTrialPixels * views;
  });
  if (size == search.sizes.rend()) --size;
  while (true) {
    const double before = search.elapsed();
    const auto is_last = [&] {
      const auto next = std::next(size);
      if (next == search.sizes.rend()) return true;
      const double larger = search.pixels_at(*next) / search.pixels_at(*size);
      return larger * (search.elapsed() - before) > search.left();
    };
    try {
      search.runs.push_back(trial(search, *size, steps));
      return *size;
    } catch (const InvalidInput&) {
      if (is_last()) throw;
    } catch (const NumericalError&) {
      if (is_last()) throw;
    }
    ++size;
  }
}

// The smallest pictures, their training apart, then larger pictures while these cost little
// of the time left and tell more about the size in view.
void run_trials(Search& search) {
  const int draft = training_preset("draft").steps;
  const int smallest = first_trial(search, draft / 4);
  if (search.left() <= 0) return;  // no other setting takes less
  search.runs.insert(
      search.runs.begin(),
      {training_trial(search, smallest, draft / 4), training_trial(search, smallest, draft)});
  for (int size = smallest;;) {
    const std::optional<Candidate> aim = best_within(search, search.left());
    if (!aim) return;
    const bool has_two_sizes = search.runs.back().pixels != search.runs.front().pixels;
    const double nearness = search.runs.back().pixels / search.pixels_at(aim->downscale);
    if (has_two_sizes && nearness >= kEnoughPixels) return;
    const auto next = std::find_if(
        search.sizes.rbegin(), search.sizes.rend(), [&](int s) { return 2 * s <= size; });
    if (next == search.sizes.rend() || *next <= aim->downscale) return;
    size = *next;
    const double cost = foretold_seconds(search.runs, search.pixels_at(size), draft / 4);
    if (cost > kTrialShare * search.left()) return;
    search.runs.push_back(trial(search, size, draft / 4));
  }
}

/// Downscales, ascending, and the memory that the next larger pictures would need [bytes].
struct Sizes {
  std::vector<int> usable;
  size_t larger_bytes = 0;
};

// Sizes whose pictures hold something and whose run fits into memory.
Sizes usable_sizes(const RunRequest& request, const Scene& scene) {
  int side = std::numeric_limits<int>::max();
  for (const View& view : scene.views) {
    side = std::min({side, view.camera.width, view.camera.height});
  }
  PictureWork work = picture_work(request);
  const size_t budget = memory_budget(request.memory_limit);
  Sizes out;
  for (const int size : kSizes) {
    if (size > 1 && side / size < kLeastSide) break;
    work.downscale = size;
    size_t most = 0;
    for (const StageMemory& stage : memory_plan(scene, work)) {
      most = std::max(most, stage.bytes);
    }
    if (most <= budget) {
      out.usable.push_back(size);
    } else {
      out.larger_bytes = most;
    }
  }
  if (out.usable.empty()) {
    throw LimitError("the smallest pictures that tell something need about " +
                     mebibytes(out.larger_bytes) + " of memory and " + mebibytes(budget) +
                     " may be used; a larger --memory-limit allows it");
  }
  return out;
}

std::string words_of(const Search& search, const Candidate& chosen) {
  std::string out = "--budget " + format_seconds(search.deadline) + ": " +
                    size_words(search.opened.scene, chosen.downscale) + ", --preset " +
                    chosen.preset + ", about " + format_seconds(chosen.seconds) + " after " +
                    format_seconds(search.elapsed()) + " of trying";
  const std::vector<Candidate> all = candidates(search);
  const auto at = std::find_if(all.begin(), all.end(), [&](const Candidate& c) {
    return c.downscale == chosen.downscale && c.preset == chosen.preset;
  });
  if (at == all.begin() && search.larger_bytes > 0) {
    return out + "; larger pictures need about " + mebibytes(search.larger_bytes) +
           " of memory, which a larger --memory-limit allows";
  }
  if (at == all.begin()) return out + "; it is the best there is";
  const Candidate& better = *std::prev(at);
  return out + "; the next better, " + size_words(search.opened.scene, better.downscale) +
         ", --preset " + better.preset + ", would take about " +
         format_seconds(better.seconds * kReserve + search.elapsed());
}

// \param asked  for: the same takes what was chosen from the file
Choice choose(Search& search, const std::string& asked, const fs::path& file) {
  run_trials(search);
  const double left = search.left();
  const std::optional<Candidate> chosen = best_within(search, left);
  if (!chosen) {
    const Candidate quickest = candidates(search).back();
    throw LimitError("--budget " + format_seconds(search.deadline) +
                     " is too short; the quickest setting, " +
                     size_words(search.opened.scene, quickest.downscale) + ", needs about " +
                     format_seconds((search.elapsed() + quickest.seconds) * kReserve) +
                     (search.runs.size() == 1 ? " or more" : ""));
  }
  Json trials = Json::array();
  for (const TimedRun& run : search.runs) {
    Json stages = Json::object();
    for (const auto& [stage, seconds] : run.stages) stages[traits(stage).name] = seconds;
    trials.push_back({{"pixels", run.pixels},
                      {"steps", run.steps},
                      {"opening_seconds", run.opening},
                      {"stage_seconds", stages}});
  }
  const std::string words = words_of(search, *chosen);
  const Json record = {{"seconds", search.deadline},
                       {"downscale", chosen->downscale},
                       {"preset", chosen->preset},
                       {"foretold_seconds", chosen->seconds},
                       {"trying_seconds", search.elapsed()},
                       {"words", words},
                       {"trials", trials},
                       {"request", asked}};
  write_file(file, json_text(record) + "\n");
  return {chosen->downscale, chosen->preset, words};
}

// Holds the folder of the run, and takes away what trials wrote to it, those of a start that was
// killed, too, and its own folders that nothing came into.
class TrialFolder {
 public:
  explicit TrialFolder(const fs::path& output)
      : output_(output), folder_(output), model_(output / "model"), lock_(output) {
    remove_trials();
  }
  ~TrialFolder() { remove_trials(); }
  TrialFolder(const TrialFolder&) = delete;
  TrialFolder& operator=(const TrialFolder&) = delete;

 private:
  void remove_trials() const {
    std::error_code ignored;
    fs::remove_all(output_ / kTrialFolder, ignored);
  }

  fs::path output_;
  NewFolder folder_;
  NewFolder model_;
  FolderLock lock_;
};

// What an earlier start chose for the same.
std::optional<Choice> chosen_before(const fs::path& file,
                                    double seconds,
                                    const std::string& asked) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  const Json record = read_json(file);
  const bool is_same = record.is_object() && record.value("seconds", Json()) == Json(seconds) &&
                       record.value("request", Json()) == Json(asked) &&
                       record.value("downscale", Json()).is_number_integer() &&
                       record.value("preset", Json()).is_string() &&
                       record.value("words", Json()).is_string();
  if (!is_same) return std::nullopt;
  return Choice{record["downscale"].get<int>(),
                record["preset"].get<std::string>(),
                record["words"].get<std::string>()};
}

void refuse_other_run(const RunRequest& request) {
  if (request.overwrite || !is_present(request.output / "run.json")) return;
  throw InvalidInput(printable(request.output) +
                     " holds the results of another run; choose another folder, or say "
                     "--overwrite");
}

// The choice of an earlier start, so that its run can go on, or a new one.
// \param opened  the scene of the run as it would choose the size itself
// \param full  the run with its views, and pictures as they are
Choice choice(const RunRequest& full,
              const OpenedScene& opened,
              double seconds,
              Clock::time_point start,
              Terminal& terminal) {
  const fs::path file = full.output / kRecordFile;
  Json key = request_json(full, opened.scene);
  key["threads"] = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const std::string asked = std::to_string(content_hash(json_text(key, -1)));
  const std::optional<Choice> before = chosen_before(file, seconds, asked);
  if (!before) refuse_other_run(full);
  const TrialFolder trials(full.output);
  opened.keep(full.output / "model");
  const OpenedScene large = open_scene(full.scene, full.output / "model", terminal);
  const Sizes sizes = usable_sizes(full, large.scene);
  const bool still_fits =
      before &&
      std::find(sizes.usable.begin(), sizes.usable.end(), before->downscale) != sizes.usable.end();
  if (still_fits) return *before;
  refuse_other_run(full);
  Search search{full,
                large,
                pixels_of(large.scene, large.scene.input),
                sizes.usable,
                sizes.larger_bytes,
                seconds,
                start,
                terminal};
  return choose(search, asked, file);
}

}  // namespace

RunRequest within_budget(const RunRequest& request,
                         double seconds,
                         Clock::time_point start,
                         Terminal& terminal) {
  if (request.scene.options.downscale) {
    throw InvalidInput("--budget chooses the size of the pictures; give it or --downscale");
  }
  const auto refuse_foreign = [&](const Scene& scene) {
    if (!request.overwrite) refuse_foreign_files(request.output, stage_files(scene, request.lods));
  };
  refuse_foreign({});  // before minutes are spent on cameras
  const OpenedScene opened = open_scene_of(request, terminal);
  refuse_foreign(opened.scene);
  RunRequest full = request;
  full.scene.options.views = views_of_run(request, opened.scene);
  full.scene.options.downscale = 1;
  const Choice chosen = choice(full, opened, seconds, start, terminal);
  full.scene.options.downscale = chosen.downscale;
  full.training.steps = training_preset(chosen.preset).steps;
  full.settings_reason = chosen.words;
  terminal.say(full.settings_reason);
  return full;
}

}  // namespace cgs
