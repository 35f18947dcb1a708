// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model_training.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/checkpoint.h"
#include "io/bytes/content_hash.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/depth_network.h"
#include "libcgs/priors/exposure.h"
#include "libcgs/priors/measured_range.h"
#include "libcgs/priors/pane.h"

namespace cgs {

namespace {

constexpr const char* kCheckpointName = "training";

// Everything the training depends on.
uint64_t training_key(const Model& model, const TrainingOptions& options, const Pane* pane) {
  uint64_t key = content_hash(kProgramVersion);
  for (const auto& [name, value] : training_fields(options)) {
    key = content_hash(value, content_hash(name, key));
  }
  const auto add = [&](const void* data, size_t bytes) {
    key = content_hash({static_cast<const char*>(data), bytes}, key);
  };
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
    const ViewPriors& priors = model.priors[k];
    add(view.image.data.data(), view.image.data.size() * sizeof(Eigen::Vector3f));
    add(priors.depth.data.data(), priors.depth.data.size() * sizeof(float));
    add(priors.sigma.data.data(), priors.sigma.data.size() * sizeof(float));
    add(priors.origin.data.data(), priors.origin.data.size());
    add(priors.layer.data.data(), priors.layer.data.size());
    add(view.valid.data.data(), view.valid.data.size());
    const Camera& camera = view.camera;
    const std::array<double, 4> intrinsics = {camera.fx, camera.fy, camera.cx, camera.cy};
    add(intrinsics.data(), sizeof intrinsics);
    add(camera.world_from_cam.data(), 16 * sizeof(double));
  }
  if (pane != nullptr) {
    add(pane->depth.data.data(), pane->depth.data.size() * sizeof(float));
    add(pane->color.data.data(), pane->color.data.size() * sizeof(Eigen::Vector3f));
    add(&pane->opacity, sizeof(float));
  }
  return key;
}

/// The state of a training on the disk; without a folder there is none.
class TrainingCheckpoint {
 public:
  TrainingCheckpoint(std::filesystem::path folder, uint64_t key, std::vector<std::string>& hitches)
      : folder_(std::move(folder)), key_(key), hitches_(hitches) {}

  void restore(Trainer& trainer, bool keeps_others) {
    if (folder_.empty()) return;
    const SavedState saved = read_checkpoint(folder_, kCheckpointName, key_);
    if (saved.is_of_other && keeps_others) {
      throw BadInput(Defect::Mismatch,
                     folder_,
                     "holds an unfinished training with other settings or inputs; choose another "
                     "folder, or say --overwrite");
    }
    if (saved.state) trainer.restore(*saved.state);
    if (!saved.warning.empty()) hitches_.push_back(saved.warning);
  }

  /// \throws IoError
  void save(const Trainer& trainer) {
    saved_ = std::chrono::steady_clock::now();
    if (folder_.empty()) return;
    make_output_folder(folder_);
    write_checkpoint(folder_, kCheckpointName, key_, trainer.save());
  }

  /// What cannot be saved ends no work: the next state may be, and so may the result.
  void try_to_save(const Trainer& trainer) {
    try {
      save(trainer);
    } catch (const IoError& error) {
      if (!has_failed_) hitches_.push_back(std::string(error.what()) + "; going on without it");
      has_failed_ = true;
    }
  }

  void try_to_save_at_times(const Trainer& trainer) {
    constexpr auto kBetween = std::chrono::seconds(20);
    if (std::chrono::steady_clock::now() - saved_ >= kBetween) try_to_save(trainer);
  }

 private:
  std::filesystem::path folder_;
  uint64_t key_;
  std::vector<std::string>& hitches_;
  std::chrono::steady_clock::time_point saved_ = std::chrono::steady_clock::now();
  bool has_failed_ = false;
};

// Splats keep the colours of the photographs they stem from: where exposures differ, the same
// surface would come in two colours, and every step of the training would fight over them.
// Returns ExposureGains::difference().
float match_exposures(Scene& scene, const std::vector<ViewPriors>& priors) {
  const ExposureGains exposure = exposure_gains(scene, priors);
  for (size_t k = 0; k < scene.input.size(); ++k) {
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    view.exposure = exposure.gain[k];
    apply_exposure(view);
  }
  return exposure.difference();
}

void optimise(TrainedModel& trained,
              const Pane* pane,
              const ModelRequest& request,
              const Progress& progress) {
  Model& model = trained.model;
  Trainer trainer(model.scene, model.priors, request.training, pane);
  TrainingCheckpoint checkpoint(
      request.checkpoints, training_key(model, request.training, pane), trained.hitches);
  checkpoint.restore(trainer, request.keeps_others);
  while (!trainer.done()) {
    trainer.step();
    try {
      report(progress, double(trainer.steps_done()) / request.training.steps);
    } catch (const Cancelled&) {
      checkpoint.save(trainer);
      throw;
    }
    checkpoint.try_to_save_at_times(trainer);
  }
  checkpoint.try_to_save(trainer);
  model.gaussians = trainer.model().gaussians();
  trained.view_dependence = trainer.model().view_dependence();
  // The depth of the priors stays that of the sweep: meshes and support rest on what was measured,
  // pictures on what was optimised to look right.
  trained.steps = trainer.history();
}

void guess_by_network(const std::filesystem::path& file, Scene& scene) {
  DepthNetwork network(read_file(file), file);
  for (const int i : scene.input) {
    View& view = scene.views[static_cast<size_t>(i)];
    view.given_depth = network(view);
  }
}

PaneReport report_of(const Pane& pane, const Scene& scene) {
  const auto pixels = static_cast<double>(pane.depth.data.size());
  const auto covered = std::count_if(pane.depth.data.begin(), pane.depth.data.end(), has_gaussian);
  return {scene.views[static_cast<size_t>(scene.input[pane.drawn_from])].name,
          static_cast<double>(covered) / pixels,
          double{pane.opacity},
          pane.gain};
}

// A pane in the photographs, and then the priors of what lies behind it: what it shows disturbs
// their matching, and the better they are, the better the two are told apart.
std::optional<Pane> look_behind_pane(const Scene& scene,
                                     const PriorsOptions& options,
                                     EstimatedPriors& priors,
                                     const Progress& progress) {
  std::optional<Pane> pane = find_pane(scene, priors.views, part_of(progress, 0, 0.1));
  if (!pane) return pane;
  priors = estimate_priors(behind_pane(scene, *pane), options, part_of(progress, 0.1, 0.9));
  std::optional<Pane> better = find_pane(scene, priors.views, part_of(progress, 0.9, 1));
  return better ? better : pane;
}

// Views whose depth rests on little.
void warn_of_coverage(const std::vector<PriorsCoverage>& coverage, Scene& scene) {
  constexpr double kLittle = 0.1;
  for (size_t i = 0; i < coverage.size(); ++i) {
    const View& view = scene.views[static_cast<size_t>(scene.input[i])];
    const double share = coverage[i].measured + coverage[i].guessed;
    if (share >= kLittle) continue;
    std::array<char, 120> text{};
    std::snprintf(text.data(), text.size(), "depth was found for %.1f %% of view ", 100 * share);
    scene.warnings.push_back(
        text.data() + view.name +
        (is_measured(coverage[i])
             ? "; what is filled in from there is an estimate: see that views overlap and show "
               "texture"
             : ", so it adds nothing: hardly a point of it is seen in another input view"));
  }
}

// Null where there was none; scale null where it tells none.
nlohmann::ordered_json given_depth_to_json(const PriorsReport& priors) {
  const GivenDepthReport& given = priors.given;
  if (given.kind == DepthKind::Unknown) return nullptr;
  const char* kind = given.kind == DepthKind::Relative ? "depth" : "disparity";
  if (given.kind == DepthKind::Metric) {
    kind = given.metres_per_unit > 0 ? "metric" : "in units of the scene";
  }
  nlohmann::ordered_json out = {{"kind", kind}, {"words", given.found}};
  if (given.metres_per_unit > 0) {
    out["metres_per_unit"] = given.metres_per_unit;
    out["metres_sigma"] = given.metres_sigma;
  }
  return out;
}

// "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& words) {
  std::string out;
  for (size_t i = 0; i < words.size(); ++i) {
    if (i > 0) out += i + 1 < words.size() ? ", " : " and ";
    out += words[i];
  }
  return out;
}

// Where the depth of the input views is from: what most rests on first.
std::string depth_words(const PriorsReport& priors) {
  PriorsCoverage sum;
  for (const PriorsCoverage& view : priors.coverage) {
    if (!is_measured(view)) continue;  // its depth stays unknown
    sum.measured += view.measured;
    sum.guessed += view.guessed;
    sum.completed += view.completed;
  }
  const bool has_sensor = priors.given.kind == DepthKind::Metric;
  std::vector<std::pair<double, std::string>> sources = {
      {sum.measured,
       has_sensor ? "measured by a multi-view plane sweep and a depth sensor"
                  : "measured by a multi-view plane sweep"},
      {sum.guessed, "guessed from one photograph and fitted to what is measured"},
      {sum.completed, "filled in from neighbours"}};
  std::stable_sort(sources.begin(), sources.end(), [](const auto& a, const auto& b) {
    return a.first > b.first;
  });
  const double all = sum.measured + sum.guessed + sum.completed;
  std::vector<std::string> words;
  for (const auto& [share, text] : sources) {
    if (!(share > 0)) continue;
    std::array<char, 32> percent{};
    std::snprintf(percent.data(), percent.size(), "%.0f %% ", 100 * share / all);
    words.push_back(share < all ? percent.data() + text : text);
  }
  return words.empty() ? "unknown" : listed(words);
}

// What a training of so many steps may have changed.
std::vector<std::string> optimised(const TrainingOptions& options, size_t steps) {
  const bool has_networks = options.coherence.decoder == ResidualDecoder::Conv;
  // Shapes are free from the first step on that begins at or after this part of the schedule.
  const bool frees_shapes = options.free_from * options.steps <= double(steps) - 1;
  std::vector<std::string> out;
  if ((has_networks ? options.conv_depth_rate : options.depth_rate) > 0) out.emplace_back("depth");
  if ((has_networks ? options.conv_opacity_rate : options.opacity_rate) > 0) {
    out.emplace_back("opacity");
  }
  if (options.shape_rate > 0 && frees_shapes) out.emplace_back("shape");
  if (options.color_rate > 0) out.emplace_back("colour");
  return out;
}

std::string description_of(const TrainedModel& trained, const TrainingOptions& options) {
  const std::string start =
      "one Gaussian per pixel at a depth that is " + depth_words(trained.priors) + "; ";
  const std::string pane = trained.pane.view.empty() ? "" : "before them a pane; ";
  const std::vector<std::string> changed = optimised(options, trained.steps.size());
  if (trained.steps.empty() || changed.empty()) {
    return "aligned initialisation: " + start + pane + "not optimised against the photographs";
  }
  return "coherent Gaussians: " + start + pane + listed(changed) +
         " optimised against the photographs in " + std::to_string(trained.steps.size()) + " steps";
}

// Of the pixels of every input view.
nlohmann::ordered_json coverage_to_json(const TrainedModel& trained) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  const Scene& scene = trained.model.scene;
  const std::vector<std::string> words = coverage_words(trained.priors, scene);
  for (size_t i = 0; i < trained.priors.coverage.size(); ++i) {
    const PriorsCoverage& coverage = trained.priors.coverage[i];
    out.push_back({{"view", scene.views[static_cast<size_t>(scene.input[i])].name},
                   {"measured", coverage.measured},
                   {"guessed", coverage.guessed},
                   {"completed", coverage.completed},
                   {"sky", coverage.sky},
                   {"left_open", coverage.left_open},
                   {"estimated", coverage.estimated},
                   {"words", words[i]}});
  }
  return out;
}

// "43 % "; tenths where it is little.
std::string percent_text(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), share < 0.095 ? "%.1f %% " : "%.0f %% ", 100 * share);
  return text.data();
}

std::string words_on(const PriorsCoverage& share) {
  constexpr double kMentioned = 0.0005;
  const std::array<std::pair<double, const char*>, 3> parts = {
      {{share.sky, "is sky"},
       {share.estimated,
        "shows surface that nothing measured and is estimated from its surroundings"},
       {share.left_open, "shows surface of which nothing is known and stays open"}}};
  std::vector<std::string> words = {
      percent_text(1 - share.sky - share.estimated - share.left_open) + "is measured"};
  for (const auto& [part, text] : parts) {
    if (part >= kMentioned) words.push_back(percent_text(part) + text);
  }
  return listed(words);
}

}  // namespace

std::vector<std::string> coverage_words(const PriorsReport& priors, const Scene& scene) {
  std::vector<std::string> out;
  for (size_t i = 0; i < priors.coverage.size(); ++i) {
    const std::string& name = scene.views[static_cast<size_t>(scene.input[i])].name;
    out.push_back("of photograph " + name + ", " + words_on(priors.coverage[i]));
  }
  return out;
}

void take_sensor_scale(const GivenDepthReport& given, Frame& frame) {
  if (frame.has_metric_scale() || !(given.metres_per_unit > 0)) return;
  frame.metres_per_unit = given.metres_per_unit;
  frame.metres_sigma = given.metres_sigma;
  frame.scale_source = ScaleSource::DepthSensor;
}

TrainedModel train_model(Scene scene, const ModelRequest& request, const Progress& progress) {
  request.priors.validate();
  request.training.validate();
  require_decodable(scene, request.training.coherence);
  constexpr double kPriorsShare = 0.18;
  constexpr double kPaneShare = 0.2;  // without a pane, and there hardly ever is one
  load_images(scene, scene.input, part_of(progress, 0, 0.01));
  if (!request.depth_network.empty()) guess_by_network(request.depth_network, scene);
  to_canonical(scene);
  narrow_depth_ranges(scene, request.priors.sweep, part_of(progress, 0.01, 0.02));
  EstimatedPriors estimated =
      estimate_priors(scene, request.priors, part_of(progress, 0.02, kPriorsShare));
  TrainedModel trained;
  trained.exposure_difference = match_exposures(scene, estimated.views);
  std::optional<Pane> pane;
  if (request.training.coherence.layers_per_ray > 1) {
    const Progress looking = part_of(progress, kPriorsShare, kPaneShare);
    pane = look_behind_pane(scene, request.priors, estimated, looking);
  }
  if (pane) trained.pane = report_of(*pane, scene);
  const GivenDepthReport& given = estimated.report.given;
  scene.warnings.insert(scene.warnings.end(), given.remarks.begin(), given.remarks.end());
  take_sensor_scale(given, scene.frame);
  warn_of_coverage(estimated.report.coverage, scene);
  trained.priors = estimated.report;
  trained.model.priors = std::move(estimated.views);
  trained.model.scene = std::move(scene);
  if (request.inspect) request.inspect(trained.model, trained.priors);
  optimise(trained, pane ? &*pane : nullptr, request, part_of(progress, kPaneShare, 1));
  trained.model.evidence = description_of(trained, request.training);
  report(progress, 1);
  return trained;
}

bool has_checkpoints(const std::filesystem::path& folder) {
  return has_checkpoint(folder, kCheckpointName);
}

void forget_checkpoints(const std::filesystem::path& folder) {
  remove_checkpoint(folder, kCheckpointName);
}

nlohmann::ordered_json settings_to_json(const TrainingOptions& options) {
  nlohmann::ordered_json settings = nlohmann::ordered_json::object();
  for (const auto& [name, value] : training_fields(options)) settings[name] = value;
  return settings;
}

namespace {

// Null where the photographs were exposed alike.
nlohmann::ordered_json exposure_to_json(const TrainedModel& trained) {
  if (trained.exposure_difference == 0) return nullptr;
  const Scene& scene = trained.model.scene;
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    const Eigen::Vector3f& gain = view.exposure;
    views.push_back({{"view", view.name}, {"gain", {gain.x(), gain.y(), gain.z()}}});
  }
  std::array<char, 100> words{};
  std::snprintf(words.data(),
                words.size(),
                "exposures of the photographs differ by up to %.0f %% and were matched",
                100 * double{trained.exposure_difference});
  return {{"words", words.data()}, {"views", views}};
}

// Null where there is none.
nlohmann::ordered_json pane_to_json(const PaneReport& pane) {
  if (pane.view.empty()) return nullptr;
  std::array<char, 100> words{};
  std::snprintf(words.data(),
                words.size(),
                "a pane that hides %.0f %% of what lies behind is before %.0f %% of view ",
                100 * pane.opacity,
                100 * pane.share);
  return {{"words", words.data() + pane.view + "; it is in no mesh"},
          {"view", pane.view},
          {"share", pane.share},
          {"opacity", pane.opacity},
          {"gain_db", pane.gain}};
}

// Words only where colours depend on the direction.
nlohmann::ordered_json view_dependence_to_json(const ViewDependence& found) {
  nlohmann::ordered_json out = {{"words", nullptr},
                                {"difference", found.difference},
                                {"explained", found.explained},
                                {"share", found.share}};
  if (!(found.share > 0)) return out;
  std::array<char, 100> words{};
  std::snprintf(words.data(),
                words.size(),
                "colours of %.0f %% of the Gaussians change with the direction of view",
                100 * found.share);
  out["words"] = words.data();
  return out;
}

}  // namespace

GivenDepthReport recorded_sensor_scale(const nlohmann::ordered_json& training) {
  GivenDepthReport out;
  const nlohmann::ordered_json given = training.value("given_depth", nlohmann::ordered_json());
  if (!given.is_object() || !given.contains("metres_per_unit")) return out;
  out.metres_per_unit = given["metres_per_unit"].get<double>();
  out.metres_sigma = given["metres_sigma"].get<double>();
  return out;
}

std::vector<std::string> remarks_on_photographs(const nlohmann::ordered_json& training) {
  std::vector<std::string> out;
  for (const char* key : {"exposure", "view_dependence", "pane"}) {
    const auto found = training.find(key);
    if (found == training.end() || !found->is_object()) continue;
    const auto words = found->find("words");
    if (words != found->end() && words->is_string()) out.push_back(words->get<std::string>());
  }
  return out;
}

nlohmann::ordered_json training_to_json(const TrainedModel& trained, const ModelRequest& request) {
  nlohmann::ordered_json loss = nlohmann::ordered_json::array();
  size_t skipped = 0;
  for (const StepReport& step : trained.steps) {
    loss.push_back(step.total());
    skipped += step.skipped;
  }
  return {{"description", description_of(trained, request.training)},
          {"gaussians", trained.model.gaussians.size()},
          {"settings", settings_to_json(request.training)},
          {"loss", loss},
          {"gradients_not_finite", skipped},
          {"alignment",
           {{"scale", trained.priors.alignment.scale},
            {"offset", trained.priors.alignment.offset},
            {"correspondences", trained.priors.alignment.correspondences}}},
          {"depth_of_views", coverage_to_json(trained)},
          {"exposure", exposure_to_json(trained)},
          {"view_dependence", view_dependence_to_json(trained.view_dependence)},
          {"pane", pane_to_json(trained.pane)},
          {"given_depth", given_depth_to_json(trained.priors)}};
}

}  // namespace cgs
