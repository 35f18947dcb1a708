// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>

#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include "convert/terminal.h"
#include "io/atomic_file.h"
#include "io/cameras_json.h"
#include "io/checkpoint.h"
#include "io/content_hash.h"
#include "io/exr.h"
#include "io/gaussian_ply.h"
#include "io/masks.h"
#include "io/photographs.h"
#include "io/scene_path.h"
#include "io/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/depth_network.h"
#include "libcgs/priors/measured_range.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

template <typename T>
std::vector<float> as_floats(const Raster<T>& raster) {
  std::vector<float> out(raster.data.size());
  std::transform(raster.data.begin(), raster.data.end(), out.begin(), [](T value) {
    return static_cast<float>(value);
  });
  return out;
}

template <typename T>
Raster<T> as_raster(const ExrImage& image, const std::string& channel, const std::string& file) {
  for (const auto& [name, values] : image.channels) {
    if (name != channel) continue;
    Raster<T> raster(image.width, image.height, T{});
    std::transform(values.begin(), values.end(), raster.data.begin(), [](float value) {
      return static_cast<T>(value);
    });
    return raster;
  }
  throw BadInput(Defect::Schema, file, "has no channel '" + channel + "'");
}

constexpr const char* kCheckpointName = "training";

std::filesystem::path priors_path(const std::filesystem::path& folder, const View& view) {
  return folder / "priors" / (view.name + ".exr");
}

// Depths stay in internal units here: the file is for resuming, and restores the same bits.
void write_priors(const std::filesystem::path& path, const ViewPriors& priors) {
  ExrImage image;
  image.width = priors.depth.width;
  image.height = priors.depth.height;
  image.channels = {{"Z", priors.depth.data},
                    {"confidence.Y", priors.confidence.data},
                    {"layer.Y", as_floats(priors.layer)},
                    {"matched.Y", as_floats(priors.matched_views)},
                    {"origin.Y", as_floats(priors.origin)},
                    {"sigma.Y", priors.sigma.data}};
  image.text["cgs:units"] = "internal";
  write_exr(path, image);
}

ViewPriors read_priors(const std::filesystem::path& path, const Camera& camera) {
  const ExrImage image = read_exr(path);
  if (image.width != camera.width || image.height != camera.height) {
    throw BadInput(Defect::Mismatch,
                   path,
                   "is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                       ", its camera " + std::to_string(camera.width) + " x " +
                       std::to_string(camera.height));
  }
  const std::string file = path.string();
  ViewPriors priors;
  priors.depth = as_raster<float>(image, "Z", file);
  priors.sigma = as_raster<float>(image, "sigma.Y", file);
  priors.confidence = as_raster<float>(image, "confidence.Y", file);
  priors.layer = as_raster<uint8_t>(image, "layer.Y", file);
  priors.matched_views = as_raster<uint8_t>(image, "matched.Y", file);
  const Raster<uint8_t> origin = as_raster<uint8_t>(image, "origin.Y", file);
  priors.origin = Raster<DepthOrigin>(image.width, image.height, DepthOrigin::Unknown);
  std::transform(origin.data.begin(), origin.data.end(), priors.origin.data.begin(), [](uint8_t v) {
    return v > 3 ? DepthOrigin::Unknown : static_cast<DepthOrigin>(v);
  });
  return priors;
}

// Cameras in the coordinates of the splats' file go where the splats went.
void move_foreign_cameras(Scene& scene, const GaussianFile& splats) {
  scene.frame = splats.frame;
  for (View& view : scene.views) {
    Eigen::Isometry3d& pose = view.camera.world_from_cam;
    const Eigen::Vector3d from_origin = scene.frame.origin - splats.file_origin;
    pose.translation() = (pose.translation() - from_origin) / scene.frame.scale;
    view.near /= scene.frame.scale;
    view.far /= scene.frame.scale;
  }
}

// Everything the training depends on.
uint64_t training_key(const Model& model, const TrainingOptions& options) {
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

void optimise(TrainedModel& trained, const ModelRequest& request, const Progress& progress) {
  Model& model = trained.model;
  Trainer trainer(model.scene, model.priors, request.training);
  TrainingCheckpoint checkpoint(
      request.checkpoints, training_key(model, request.training), trained.hitches);
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
             ? "; all else is filled in from there: see that views overlap and show texture"
             : ", so it adds nothing: hardly a point of it is seen in another input view"));
  }
}

}  // namespace

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
  constexpr double kPriorsShare = 0.2;
  load_images(scene, scene.input, part_of(progress, 0, 0.01));
  if (!request.depth_network.empty()) guess_by_network(request.depth_network, scene);
  to_canonical(scene);
  narrow_depth_ranges(scene, request.priors.sweep);
  EstimatedPriors estimated =
      estimate_priors(scene, request.priors, part_of(progress, 0.01, kPriorsShare));
  const GivenDepthReport& given = estimated.report.given;
  scene.warnings.insert(scene.warnings.end(), given.remarks.begin(), given.remarks.end());
  take_sensor_scale(given, scene.frame);
  warn_of_coverage(estimated.report.coverage, scene);
  TrainedModel trained;
  trained.priors = estimated.report;
  trained.model.priors = std::move(estimated.views);
  trained.model.scene = std::move(scene);
  if (request.inspect) request.inspect(trained.model);
  optimise(trained, request, part_of(progress, kPriorsShare, 1));
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

// Of the pixels of every input view.
nlohmann::ordered_json coverage_to_json(const TrainedModel& trained) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  const Scene& scene = trained.model.scene;
  for (size_t i = 0; i < trained.priors.coverage.size(); ++i) {
    const PriorsCoverage& coverage = trained.priors.coverage[i];
    out.push_back({{"view", scene.views[static_cast<size_t>(scene.input[i])].name},
                   {"measured", coverage.measured},
                   {"guessed", coverage.guessed},
                   {"completed", coverage.completed}});
  }
  return out;
}

}  // namespace

nlohmann::ordered_json training_to_json(const TrainedModel& trained, const ModelRequest& request) {
  nlohmann::ordered_json loss = nlohmann::ordered_json::array();
  size_t skipped = 0;
  for (const StepReport& step : trained.steps) {
    loss.push_back(step.total());
    skipped += step.skipped;
  }
  const std::string start = "one Gaussian per pixel at the depth of a multi-view plane sweep; ";
  return {{"description",
           trained.steps.empty()
               ? "aligned initialisation: " + start + "not optimised against the photographs"
               : "coherent Gaussians: " + start +
                     "depth, opacity and shape optimised against the "
                     "photographs in " +
                     std::to_string(trained.steps.size()) + " steps"},
          {"gaussians", trained.model.gaussians.size()},
          {"settings", settings_to_json(request.training)},
          {"loss", loss},
          {"gradients_not_finite", skipped},
          {"alignment",
           {{"scale", trained.priors.alignment.scale},
            {"offset", trained.priors.alignment.offset},
            {"correspondences", trained.priors.alignment.correspondences}}},
          {"depth_of_views", coverage_to_json(trained)},
          {"given_depth", given_depth_to_json(trained.priors)}};
}

namespace {

// What the model that lies in a folder wrote per input view; nothing if there is none.
std::set<std::filesystem::path> priors_in(const std::filesystem::path& folder) {
  std::set<std::filesystem::path> out;
  if (!is_present(folder / "cameras.json")) return out;
  try {
    const Scene scene = read_cameras_json(folder / "cameras.json");
    for (const int i : scene.input) {
      out.insert(priors_path(folder, scene.views[static_cast<size_t>(i)]));
    }
  } catch (const Error&) {
    out.clear();  // damaged, or of another program: it wrote none
  }
  return out;
}

}  // namespace

void write_model(const std::filesystem::path& folder, const Model& model) {
  std::set<std::filesystem::path> earlier = priors_in(folder);
  make_output_folder(folder / "priors");
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
    write_priors(priors_path(folder, view), model.priors[k]);
    earlier.erase(priors_path(folder, view));
  }
  write_gaussian_ply(folder / "gaussians.ply", model.gaussians, model.scene.frame);
  write_cameras_json(folder / "cameras.json", model.scene);  // last: by it the scale is told
  for (const std::filesystem::path& file : earlier) std::filesystem::remove(file);
}

Model read_model(const std::filesystem::path& folder) {
  Model model = read_model_as_written(folder);
  use_metres_where_measured(model.scene);
  return model;
}

void use_metres_where_measured(Scene& scene) {
  const bool is_measured = scene.frame.scale_source == ScaleSource::KnownDistance ||
                           scene.frame.scale_source == ScaleSource::DepthSensor;
  if (scene.kind == "photographs" && is_measured) scene.frame = in_metres(scene.frame);
}

Model read_model_as_written(const std::filesystem::path& folder) {
  if (!is_folder(folder)) {
    throw BadInput(Defect::Open, folder, "no such folder; give the model folder of a run");
  }
  const bool is_of_run = !is_present(folder / "cameras.json") && is_present(folder / "run.json") &&
                         is_folder(folder / "model");
  if (is_of_run) return read_model_as_written(folder / "model");
  Model model;
  model.scene = read_cameras_json(folder / "cameras.json");
  const bool has_frame = model.scene.kind != kForeignCameras;
  const auto frame = has_frame ? std::optional(model.scene.frame) : std::nullopt;
  GaussianFile file = read_gaussian_ply(folder / "gaussians.ply", frame);
  if (!has_frame) move_foreign_cameras(model.scene, file);
  if (!model.scene.frame.knows_up()) model.scene.frame.up = world_up(model.scene);
  model.gaussians = std::move(file.gaussians);
  model.scene.warnings = std::move(file.warnings);
  for (const int i : model.scene.input) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    model.priors.push_back(read_priors(priors_path(folder, view), view.camera));
  }
  return model;
}

namespace {

// Photographs whose cameras were solved for have their file names as names of views: without what
// comes after the dot, but for the second of one stem.
void relink_photographs(Scene& scene, const std::vector<PhotoFile>& photographs) {
  for (View& view : scene.views) {
    const auto find = [&](const auto& name_of) {
      return std::find_if(photographs.begin(), photographs.end(), [&](const PhotoFile& photograph) {
        return name_of(photograph.path) == view.name;
      });
    };
    auto found = find([](const std::filesystem::path& path) { return path.filename(); });
    if (found == photographs.end()) {
      found = find([](const std::filesystem::path& path) { return path.stem(); });
    }
    if (found != photographs.end()) view.image_path = found->path;
  }
}

void relink_views(Scene& scene, const Scene& found) {
  for (View& view : scene.views) {
    const auto match = std::find_if(found.views.begin(), found.views.end(), [&](const View& other) {
      return other.name == view.name;
    });
    if (match == found.views.end()) continue;
    view.image_path = match->image_path;
    view.mask_path = match->mask_path;
  }
}

}  // namespace

void relink_images(Scene& scene, const std::filesystem::path& folder) {
  scene.folder = folder;
  for (View& view : scene.views) {
    view.image_path.clear();
    view.mask_path.clear();
  }
  if (is_photographs(folder)) {
    relink_photographs(scene, list_photographs({folder, false}));
    find_masks({folder, false}, scene);
  } else {
    relink_views(scene, read_scene(folder));
  }
  for (const View& view : scene.views) {
    if (view.image_path.empty()) {
      scene.warnings.push_back(printable(folder) + " has no photograph of view " +
                               printable(view.name));
    }
  }
}

MaskMap guessed_pixels(const ViewPriors& priors) {
  const auto is_guess = [](DepthOrigin origin) {
    return origin == DepthOrigin::Guessed || origin == DepthOrigin::Completed;
  };
  const std::vector<DepthOrigin>& origins = priors.origin.data;
  if (std::none_of(origins.begin(), origins.end(), is_guess)) return {};
  MaskMap out(priors.origin.width, priors.origin.height, 0);
  std::transform(origins.begin(), origins.end(), out.data.begin(), is_guess);
  return out;
}

std::vector<SupportView> support_views(const Model& model) {
  std::vector<SupportView> views;
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
    const ViewPriors& priors = model.priors[k];
    views.push_back({view.camera, priors.depth, priors.sigma, guessed_pixels(priors)});
  }
  return views;
}

RenderBuffers render_camera(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const Camera& camera) {
  RenderBuffers buffers = rasterize(model.gaussians, camera);
  annotate_support(buffers, camera, inputs);
  return buffers;
}

ColorImage picture(const RenderBuffers& buffers) {
  ColorImage out = buffers.color;
  constexpr float kMinAlpha = 0.5f;
  for (size_t i = 0; i < out.data.size(); ++i) {
    const float alpha = buffers.alpha.data[i];
    if (alpha >= kMinAlpha) out.data[i] /= alpha;
    out.data[i] = out.data[i].cwiseMax(0.0f).cwiseMin(1.0f);
  }
  return out;
}

Eigen::Vector3d world_up(const Scene& scene) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) {
    const Eigen::Matrix3d R = view.camera.world_from_cam.rotation();
    spread += R.col(0) * R.col(0).transpose();
    mean_up -= R.col(1);
  }
  if (!(mean_up.norm() > 1e-6)) return Eigen::Vector3d::UnitZ();
  mean_up.normalize();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  // The image x axes of level cameras lie in the horizontal plane and, once the cameras turn by
  // some degrees, span it; its normal is then free of the cameras' pitch.
  constexpr double kMinTurn = 0.004;  // second to first eigenvalue: about +-3.6 degrees
  constexpr double kLevel = 0.05;     // third to second: the axes do lie in a plane
  const Eigen::Vector3d& values = eigen.eigenvalues();
  if (values[1] < kMinTurn * values[2] || values[0] > kLevel * values[1]) return mean_up;
  const Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  return normal.dot(mean_up) < 0 ? Eigen::Vector3d(-normal) : normal;
}

}  // namespace cgs
