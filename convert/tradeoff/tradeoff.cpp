// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <new>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/measure/comparison.h"
#include "convert/measure/measured_file.h"
#include "convert/model/memory_plan.h"
#include "convert/run/request_fields.h"
#include "convert/run/run_record.h"
#include "convert/run/run_stages.h"
#include "convert/text/advice.h"
#include "convert/tradeoff/tradeoff_stages.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/content_hash.h"
#include "io/scenes/lens.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

/// What all stages of one command share.
struct Bench {
  const TradeoffRequest& request;
  const Scene& scene;  // of the standard setting
  RunRequest standard;
  int downscale;
  Terminal& terminal;
  RunRecord record;
  Clock::time_point deadline;
  bool time_is_up = false;
  double voxel = 0;  // of the standard setting [scene units]; 0 = not known yet

  bool standard_is_done() const { return voxel > 0; }
  fs::path folder(const std::string& key) const { return request.output / "stages" / key; }
};

using Work = std::function<Json(const Progress&)>;

// Does a stage, or takes what it brought before. A failure is a result, too, unless it says that
// nothing can go on.
Json stage(Bench& bench, const std::string& key, const std::string& title, const Work& work) {
  if (bench.record.is_done(key, {})) return bench.record.result(key);
  const auto stop_in_time = [&] {
    if (Clock::now() < bench.deadline) return;
    bench.time_is_up = true;
    throw Cancelled();
  };
  stop_in_time();
  const Progress shown = bench.terminal.begin(title);
  const Progress progress = [&](double fraction) {
    shown(fraction);
    stop_in_time();
  };
  Json result;
  bool is_lasting = true;  // memory may be free another time
  try {
    result = work(progress);
  } catch (const Cancelled&) {
    throw;
  } catch (const IoError&) {
    throw;
  } catch (const LimitError& error) {
    if (!bench.standard_is_done()) throw;
    result = {{"failed", words_of(error)}};
    is_lasting = false;
  } catch (const Error& error) {
    if (!bench.standard_is_done()) throw;
    result = {{"failed", words_of(error)}};
  } catch (const std::bad_alloc&) {
    if (!bench.standard_is_done()) throw;
    result = {{"failed", "out of memory"}};
    is_lasting = false;
  }
  const double seconds = bench.terminal.end(result.contains("failed") ? "failed" : "");
  if (is_lasting) bench.record.finish(key, seconds, result);
  return result;
}

StageCost cost_of(const Json& result) {
  const Json& cost = result.at("cost");
  return {cost.at("cpu"), cost.at("wall"), cost.at("peak_memory")};
}

// What the stages of one setting brought; null = not reached as the one before failed.
constexpr size_t kModel = 0;
constexpr size_t kMesh = 1;
constexpr size_t kAssets = 2;
using StageResults = std::array<Json, 3>;

StageResults run_setting(Bench& bench, const Setting& setting) {
  StageResults out;
  const auto request = [&](const std::string& key) {
    RunRequest r = request_of(setting, bench.standard, bench.downscale, bench.voxel);
    r.output = bench.folder(key);
    return r;
  };
  const std::string name = label(setting);
  const fs::path model = bench.folder(model_key(setting));
  const fs::path mesh = bench.folder(mesh_key(setting));
  out[kModel] = stage(bench, model_key(setting), name + ": model", [&](const Progress& progress) {
    check_memory_plan(bench.scene,
                      {.chooses_voxels = setting.voxel == 1,
                       .coherence = bench.standard.training.coherence,
                       .method = bench.standard.training.method,
                       .match_lists = match_lists(bench.standard.training),
                       .downscale = setting.coarser},
                      memory_budget(bench.request.memory_limit));
    return make_model(request(model_key(setting)), bench.request.output, bench.scene, progress);
  });
  if (out[kModel].contains("failed")) return out;
  out[kMesh] = stage(bench, mesh_key(setting), name + ": meshes", [&](const Progress& progress) {
    return make_meshes(model, request(mesh_key(setting)), progress);
  });
  if (out[kMesh].contains("failed")) return out;
  out[kAssets] = stage(bench, asset_key(setting), name + ": assets", [&](const Progress& progress) {
    return make_assets(model,
                       mesh,
                       request(asset_key(setting)),
                       out[kModel].at("description"),
                       out[kMesh],
                       progress);
  });
  return out;
}

std::string failure(const StageResults& results) {
  for (const Json& result : results) {
    if (result.contains("failed")) return result.at("failed");
  }
  return "";
}

MeasuredSetting measured(const Bench& bench, const Setting& setting, const StageResults& results) {
  MeasuredSetting out;
  out.setting = setting;
  RunRequest request = request_of(setting, bench.standard, bench.downscale, bench.voxel);
  request.output = bench.request.output / ("run_" + asset_key(setting));
  out.command = command_line(request, bench.request.threads);
  out.failed = failure(results);
  if (!out.failed.empty()) return out;
  out.model = cost_of(results[kModel]);
  out.mesh = cost_of(results[kMesh]);
  out.assets = cost_of(results[kAssets]);
  const Json& e = results[kModel].at("evaluation");
  if (e.is_object()) {
    const auto figure = [&](const char* key) {
      return e.at(key).is_number() ? e.at(key).get<double>() : kNotMeasured;
    };
    out.pictures = {figure("psnr"), figure("ssim"), figure("psnr_seen"), figure("ssim_seen")};
  }
  out.voxel = results[kMesh].at("voxel");
  out.faces = results[kMesh].at("certificate").at("faces");
  out.asset_error = results[kAssets].at("error");
  out.model_bytes = results[kModel].at("bytes");
  out.mesh_bytes = results[kMesh].at("bytes");
  out.asset_bytes = results[kAssets].at("bytes");
  return out;
}

// Measures until all is done or time is up.
void measure_all(Bench& bench, const StageCost& opening, Tradeoff& out) {
  const std::vector<Setting> design = tradeoff_design();
  for (const Setting& setting : design) {
    try {
      const StageResults results = run_setting(bench, setting);
      if (!bench.standard_is_done()) bench.voxel = results[kMesh].at("voxel");
      out.settings.push_back(measured(bench, setting, results));
      out.settings.back().model.cpu += opening.cpu;
      out.settings.back().model.wall += opening.wall;
    } catch (const Cancelled&) {
      if (!bench.time_is_up) throw;
      out.left_out.push_back(label(setting));
    }
  }
}

// The cost of the standard setting becomes the mean of its repeats, which leave the table.
void fold_repeats(Tradeoff& out) {
  const auto is_repeat = [](const MeasuredSetting& m) {
    return m.failed.empty() && (m.setting.repeat != 0 || m.setting == Setting());
  };
  std::vector<MeasuredSetting> repeats;
  std::copy_if(out.settings.begin(), out.settings.end(), std::back_inserter(repeats), is_repeat);
  std::erase_if(out.settings,
                [](const MeasuredSetting& m) { return m.setting.repeat != 0 && m.failed.empty(); });
  out.repeats = static_cast<int>(repeats.size());
  const auto spread = [&](double (MeasuredSetting::*figure)() const) {
    double least = (repeats.front().*figure)();
    double most = least;
    for (const MeasuredSetting& m : repeats) {
      least = std::min(least, (m.*figure)());
      most = std::max(most, (m.*figure)());
    }
    return most / least - 1;
  };
  out.noise = {spread(&MeasuredSetting::cpu), spread(&MeasuredSetting::wall)};
  MeasuredSetting& standard = out.settings.front();
  for (StageCost MeasuredSetting::*part :
       {&MeasuredSetting::model, &MeasuredSetting::mesh, &MeasuredSetting::assets}) {
    StageCost mean;
    for (const MeasuredSetting& m : repeats) {
      mean.cpu += (m.*part).cpu / out.repeats;
      mean.wall += (m.*part).wall / out.repeats;
      mean.peak_memory = std::max(mean.peak_memory, (m.*part).peak_memory);
    }
    standard.*part = mean;
  }
}

using SurfaceOf = std::function<ShownSurface(const Model&, const std::vector<Camera>&)>;

/// What errors are measured from; read when the first of them is not known yet.
class Ruler {
 public:
  Ruler(std::string name, SurfaceOf read) : name_(std::move(name)), read_(std::move(read)) {}

  // Distances of a setting's surface, kept like a stage. A surface that cannot be compared fails
  // its setting; where that is the standard one, the reference is to blame.
  std::optional<SurfaceError> error_of(Bench& bench,
                                       MeasuredSetting& m,
                                       const Model& model,
                                       const std::vector<Camera>& inputs) {
    const std::string key = mesh_key(m.setting);
    const Json result =
        stage(bench, key + " from " + name_, label(m.setting) + ": error", [&](const Progress& p) {
          report(p, 0);
          if (!surface_) surface_ = read_(model, inputs);
          const Frame& frame = model.scene.frame;
          const SurfaceError e = surface_error(
              shown_surface(read_watertight(bench.folder(key), frame), inputs), *surface_);
          return Json{{"rms", e.rms * frame.scale},
                      {"p95", e.p95 * frame.scale},
                      {"max", e.max * frame.scale}};
        });
    if (!result.contains("failed")) {
      return SurfaceError{result.at("rms"), result.at("p95"), result.at("max")};
    }
    m.failed = result.at("failed").get<std::string>();
    if (m.setting == Setting()) throw InvalidInput(m.failed);
    return std::nullopt;
  }

 private:
  std::string name_;
  SurfaceOf read_;
  std::optional<ShownSurface> surface_;
};

Setting finest_of(const std::vector<MeasuredSetting>& settings) {
  const auto fineness = [](const MeasuredSetting& m) {
    constexpr double kUsual = 0.25;  // voxels that simplification is allowed by default
    return std::pair(m.setting.voxel * m.setting.coarser, m.setting.simplify.value_or(kUsual));
  };
  const MeasuredSetting* finest = &settings.front();
  for (const MeasuredSetting& m : settings) {
    if (m.failed.empty() && fineness(m) < fineness(*finest)) finest = &m;
  }
  return finest->setting;
}

void measure_errors(Bench& bench, Tradeoff& out) {
  bench.deadline = Clock::time_point::max();  // soon done, and without it nothing can be told
  const Setting finest = finest_of(out.settings);
  out.finest = label(finest);
  const Model model = read_model(bench.folder(model_key(Setting())));
  std::vector<Camera> inputs;
  for (const int i : model.scene.input) {
    inputs.push_back(model.scene.views[static_cast<size_t>(i)].camera);
  }
  Ruler from_finest(mesh_key(finest), [&](const Model& m, const auto& cameras) {
    return shown_surface(read_watertight(bench.folder(mesh_key(finest)), m.scene.frame), cameras);
  });
  const fs::path& path = bench.request.reference;
  Ruler from_truth(path.empty() ? "" : file_hash(path), [&](const Model& m, const auto& cameras) {
    const MeasurableFile file = read_measured(path, bench.request.scene.assume_unit);
    return shown_surface(in_frame_of(file.content, m.scene.frame).mesh, cameras);
  });
  for (MeasuredSetting& m : out.settings) {
    if (!m.failed.empty()) continue;
    const bool is_finest = mesh_key(m.setting) == mesh_key(finest);
    m.is_ruler = is_finest && path.empty();
    if (!is_finest) m.deviation = from_finest.error_of(bench, m, model, inputs);
    if (!path.empty()) m.truth = from_truth.error_of(bench, m, model, inputs);
  }
}

int downscale_of(const SceneRequest& request, const Scene& scene) {
  if (request.options.downscale) return *request.options.downscale;
  const View& view = scene.views[static_cast<size_t>(scene.input.front())];
  return std::max(1, picture_camera(view).width / view.camera.width);
}

RunRequest standard_request(const TradeoffRequest& request) {
  RunRequest out;
  out.scene = request.scene;
  out.output = request.output;
  out.memory_limit = request.memory_limit;
  return out;
}

}  // namespace

double MeasuredSetting::error() const {
  if (truth) return truth->p95;
  return deviation ? deviation->p95 : kNotMeasured;
}

namespace {

// What has to be the same for measurements to be of one kind. Named, as a folder holds either a run
// or measurements.
Json record_request(const TradeoffRequest& request, const Scene& scene) {
  Json out = request_json(standard_request(request), scene);
  out["command"] = "tradeoff";
  out["threads"] =
      request.threads > 0 ? request.threads : static_cast<int>(std::thread::hardware_concurrency());
  return out;
}

}  // namespace

Tradeoff measure_tradeoff(const TradeoffRequest& request,
                          const OpenedScene& opened,
                          const StageCost& opening,
                          Terminal& terminal) {
  make_output_folder(request.output);
  const FolderLock lock(request.output);
  const RunRequest standard = standard_request(request);
  const auto limit = std::chrono::duration<double>(60 * request.minutes - opening.wall);
  Bench bench{request,
              opened.scene,
              standard,
              downscale_of(request.scene, opened.scene),
              terminal,
              RunRecord(request.output, record_request(request, opened.scene), request.overwrite),
              Clock::now() + std::chrono::duration_cast<Clock::duration>(limit)};
  if ((opened.poses || opened.refined) && !bench.record.is_done("cameras", {})) {
    bench.record.finish("cameras", opening.wall, {{"cpu", opening.cpu}, {"wall", opening.wall}});
  }
  opened.keep(request.output);
  const Json cameras = bench.record.result("cameras");
  StageCost solving;
  if (cameras.is_object()) solving = {cameras.at("cpu"), cameras.at("wall"), 0};
  Tradeoff out;
  out.scene = opened.scene;
  try {
    measure_all(bench, solving, out);
    if (out.settings.empty()) {
      throw LimitError(
          "not even the standard setting was done in time; finished stages are kept, "
          "so start the same command again, with more --minutes");
    }
    fold_repeats(out);
    measure_errors(bench, out);
  } catch (const Json::exception&) {
    throw BadInput(Defect::Schema,
                   request.output / "run.json",
                   "does not hold what finished stages wrote; remove it to begin anew");
  }
  return out;
}

std::vector<TradeoffFigures> figures_of(const Tradeoff& tradeoff) {
  std::vector<TradeoffFigures> out;
  for (const MeasuredSetting& m : tradeoff.settings) {
    TradeoffFigures& f = out.emplace_back();
    if (!m.failed.empty()) continue;
    // What is promised holds for every file, the compressed one too.
    const double error = m.is_ruler ? m.asset_error : m.asset_and_surface_error();
    f = {m.cpu(), m.wall(), error, kNotMeasured, double(m.asset_bytes), m.is_ruler};
    if (m.pictures) f.psnr = m.pictures->psnr;
  }
  return out;
}

}  // namespace cgs
