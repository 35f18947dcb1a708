// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model_training.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/water_report.h"
#include "convert/text/terminal.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/checkpoint.h"
#include "io/bytes/content_hash.h"
#include "io/scenes/scene_reader.h"
#include "io/splats/splat_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/depth_network.h"
#include "libcgs/priors/pane.h"

namespace cgs {

namespace {

constexpr const char* kCheckpointName = "training";

// Everything the training depends on.
uint64_t training_key(const Model& model, const TrainingOptions& options, const Pane* pane) {
  uint64_t key = content_hash(program_version());
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
    if (view.response.is_grey) key = content_hash("grey", key);
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
  /// \param request  not owned; must outlive this
  explicit TrainingCheckpoint(const ModelRequest& request) : request_(request) {}

  /// \param key  of the training, for this and for what is saved from then on
  void restore(Trainer& trainer, uint64_t key) {
    key_ = key;
    if (request_.checkpoints.empty()) return;
    const SavedState saved = read_checkpoint(request_.checkpoints, kCheckpointName, key_);
    if (saved.is_of_other && request_.keeps_others) {
      throw BadInput(Defect::Mismatch,
                     request_.checkpoints,
                     "holds an unfinished training with other settings or inputs; choose another "
                     "folder, or say --overwrite");
    }
    if (saved.state) trainer.restore(*saved.state);
    if (!saved.warning.empty()) tell(saved.warning);
  }

  /// \throws IoError
  void save(const Trainer& trainer) {
    saved_ = std::chrono::steady_clock::now();
    if (request_.checkpoints.empty()) return;
    make_output_folder(request_.checkpoints);
    write_checkpoint(request_.checkpoints, kCheckpointName, key_, trainer.save());
  }

  /// What cannot be saved ends no work: the next state may be, and so may the result.
  void try_to_save(const Trainer& trainer) {
    try {
      save(trainer);
    } catch (const IoError& error) {
      if (!has_failed_) tell(std::string(error.what()) + "; going on without it");
      has_failed_ = true;
    }
  }

  void try_to_save_at_times(const Trainer& trainer) {
    constexpr auto kBetween = std::chrono::seconds(20);
    if (std::chrono::steady_clock::now() - saved_ >= kBetween) try_to_save(trainer);
  }

 private:
  void tell(const std::string& words) const {
    if (request_.warn) request_.warn(words);
  }

  const ModelRequest& request_;
  uint64_t key_ = 0;
  std::chrono::steady_clock::time_point saved_ = std::chrono::steady_clock::now();
  bool has_failed_ = false;
};

void guess_by_network(const std::filesystem::path& file, Scene& scene) {
  DepthNetwork network(read_file(file), file);
  for (const int i : scene.input) {
    View& view = scene.views[static_cast<size_t>(i)];
    view.given_depth = network(view);
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

nlohmann::ordered_json unmeasured_to_json(const UnmeasuredShares& why) {
  return {{"unseen", why.unseen},
          {"hidden", why.hidden},
          {"even", why.even},
          {"wide", why.wide},
          {"unconfirmed", why.unconfirmed}};
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
                   {"transient", coverage.transient},
                   {"background", coverage.background},
                   {"left_open", coverage.left_open},
                   {"estimated", coverage.estimated},
                   {"with_evidence", coverage.with_evidence()},
                   {"unmeasured", unmeasured_to_json(coverage.unmeasured)},
                   {"words", words[i]}});
  }
  return out;
}

}  // namespace

TrainedModel train_model(Scene scene, const ModelRequest& request, const Progress& progress) {
  TrainingCheckpoint checkpoint(request);
  ReconstructionHooks hooks;
  hooks.load_photographs = [&](Scene& of, const Progress& loading) {
    load_images(of, of.input, loading);
    if (!request.depth_network.empty()) guess_by_network(request.depth_network, of);
  };
  if (!request.start.empty()) {
    hooks.load_splats = [&](const Frame& frame) {
      return std::move(read_splats(request.start, frame).gaussians);
    };
  }
  hooks.inspect = request.inspect;
  hooks.begin_training = [&](const Model& model, const Pane* pane, Trainer& trainer) {
    checkpoint.restore(trainer, training_key(model, request.training, pane));
  };
  hooks.after_step = [&](const Trainer& trainer) { checkpoint.try_to_save_at_times(trainer); };
  hooks.after_training = [&](const Trainer& trainer) { checkpoint.try_to_save(trainer); };
  hooks.on_cancel = [&](const Trainer& trainer) { checkpoint.save(trainer); };
  return reconstruct(
      std::move(scene), {request.priors, request.training, hooks, request.medium}, progress);
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

nlohmann::ordered_json response_to_json(const View& view) {
  const PhotoResponse& response = view.response;
  const Eigen::Vector3f& gain = view.exposure;
  nlohmann::ordered_json matrix = nlohmann::ordered_json::array();
  for (int c = 0; c < 3; ++c) {
    const Eigen::RowVector3d row = response.matrix.row(c);
    matrix.push_back({row.x(), row.y(), row.z()});
  }
  return {{"view", view.name},
          {"grey", response.is_grey},
          {"gain", {gain.x(), gain.y(), gain.z()}},
          {"gamma", response.gamma},
          {"vignette", {response.vignette.x(), response.vignette.y()}},
          {"matrix", matrix}};
}

// Empty where nothing was done to the photographs that gains do not do.
std::string words_of(const TrainedModel& trained) {
  const PhotoResponses& responses = trained.responses;
  const Scene& scene = trained.model.scene;
  std::string used;
  for (const ResponseTerm& term : responses.terms) {
    if (term.is_used) used += (used.empty() ? "" : ", ") + term.name;
  }
  std::string out;
  if (responses.is_applied && !used.empty()) {
    out = "responses of the photographs were matched to that of view " +
          scene.views[static_cast<size_t>(scene.input[responses.reference])].name + ": " + used;
  }
  double mended = 0;
  for (const double share : trained.mended) mended += share / double(trained.mended.size());
  if (mended > 0) {
    std::array<char, 100> words{};
    std::snprintf(words.data(),
                  words.size(),
                  "%.1f %% of their pixels, which others contradict, were mended by these",
                  100 * mended);
    out += (out.empty() ? "" : "; ") + std::string(words.data());
  }
  return out;
}

// Words only where photographs were corrected.
nlohmann::ordered_json responses_to_json(const TrainedModel& trained) {
  const PhotoResponses& responses = trained.responses;
  const Scene& scene = trained.model.scene;
  nlohmann::ordered_json terms = nlohmann::ordered_json::array();
  for (const ResponseTerm& term : responses.terms) {
    terms.push_back({{"name", term.name},
                     {"parameters", term.parameters},
                     {"saved_bits", term.saved_bits},
                     {"residual", term.residual},
                     {"used", term.is_used}});
  }
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const int i : scene.input) {
    views.push_back(response_to_json(scene.views[static_cast<size_t>(i)]));
  }
  nlohmann::ordered_json out = {{"words", nullptr},
                                {"reference", views[responses.reference]["view"]},
                                {"places", responses.samples},
                                {"residual", responses.residual},
                                {"terms", terms},
                                {"views", views}};
  for (size_t k = 0; k < trained.mended.size(); ++k) out["views"][k]["mended"] = trained.mended[k];
  const std::string words = words_of(trained);
  if (!words.empty()) out["words"] = words;
  return out;
}

nlohmann::ordered_json grey_to_json(const TrainedModel& trained) {
  std::string words;
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const GreyReport& grey : trained.grey) {
    std::array<char, 100> share{};
    std::snprintf(share.data(),
                  share.size(),
                  " has no colours: of %.0f %% of what it shows they are unknown, and shown grey",
                  100 * grey.share_without_color);
    words += (words.empty() ? "view " : "; view ") + grey.view + share.data();
    views.push_back({{"view", grey.view}, {"share_without_color", grey.share_without_color}});
  }
  return {{"words", words}, {"views", views}};
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

double measured_share(const nlohmann::ordered_json& depth_of_views) {
  double sum = 0;
  for (const auto& view : depth_of_views) {
    double surface = 1;
    for (const char* other : {"sky", "transient", "background"}) {
      surface -= view.value(other, 0.0);  // models of earlier versions tell of no background
    }
    sum += surface > 0 ? view["with_evidence"].get<double>() / surface : 0;
  }
  return sum / static_cast<double>(depth_of_views.size());
}

std::vector<std::string> remarks_on_photographs(const nlohmann::ordered_json& training) {
  std::vector<std::string> out;
  for (const char* key : {"exposure", "responses", "grey", "view_dependence", "pane", "water"}) {
    const auto found = training.find(key);
    if (found == training.end() || !found->is_object()) continue;
    const auto words = found->find("words");
    if (words != found->end() && words->is_string()) out.push_back(words->get<std::string>());
  }
  return out;
}

namespace {

// Null for coherent Gaussians, of which there are as many as pixels.
nlohmann::ordered_json density_to_json(const TrainedModel& trained, const ModelRequest& request) {
  if (!trained.density) return nullptr;
  const DensityReport& density = *trained.density;
  nlohmann::ordered_json start;
  if (density.is_from_splats) start = request.start.filename().string();
  return {{"start", start},
          {"begun_with", density.begun_with},
          {"cloned", density.cloned},
          {"split", density.split},
          {"pruned", density.pruned}};
}

}  // namespace

nlohmann::ordered_json training_to_json(const TrainedModel& trained, const ModelRequest& request) {
  nlohmann::ordered_json loss = nlohmann::ordered_json::array();
  size_t skipped = 0;
  for (const StepReport& step : trained.steps) {
    loss.push_back(step.total());
    skipped += step.skipped;
  }
  nlohmann::ordered_json out = {
      {"description", description_of(trained, request.training)},
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
      {"density", density_to_json(trained, request)},
      {"given_depth", given_depth_to_json(trained.priors)}};
  // Left out of the many models that have none of it.
  if (trained.water) out["water"] = water_to_json(*trained.water, trained.model.scene.frame);
  if (!trained.responses.terms.empty()) out["responses"] = responses_to_json(trained);
  if (!trained.grey.empty()) out["grey"] = grey_to_json(trained);
  return out;
}

}  // namespace cgs
