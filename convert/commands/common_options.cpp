// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/common_options.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include <opencv2/core/utility.hpp>
#include <tbb/global_control.h>

#include "convert/model/model_training.h"
#include "convert/model/water_report.h"
#include "convert/text/length.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// What limit_threads() set; empty = nothing.
std::unique_ptr<tbb::global_control>& thread_control() {
  static std::unique_ptr<tbb::global_control> out;
  return out;
}

constexpr const char* kDepthHeading = "Depth";

}  // namespace

OptionGroup::OptionGroup(CLI::App& command, const std::string& heading)
    : command_(command), before_(command.option_defaults()->get_group()) {
  command.option_defaults()->group(heading);
}

// Copies a few letters; without memory for these, ending is right.
OptionGroup::~OptionGroup() {  // NOLINT(bugprone-exception-escape)
  command_.option_defaults()->group(before_);
}

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("--memory-limit",
                     options.memory_limit,
                     "Memory to stay below, e.g. 4G; default 80 % of what is free");
  add_output_options(command, options);
}

size_t stated_memory_limit(const CommonOptions& options) {
  return options.memory_limit.empty() ? 0 : parse_bytes(options.memory_limit, "--memory-limit");
}

void add_output_options(CLI::App& command, CommonOptions& options) {
  command.add_option("--threads", options.threads, "Threads to use; 0 = one per core")
      ->capture_default_str();
  command.add_flag("--json", options.json, "Print the report as JSON on standard output");
  command.add_flag("-q,--quiet", options.quiet, "No progress on standard error");
  command.add_flag("--strict", options.strict, "A warning ends the command with exit code 3");
}

void add_fill_option(CLI::App& command, HoleFill& fill, const char* shown) {
  command
      .add_option("--fill",
                  fill,
                  std::string(shown) + " (default; not around what masks cut out), or none: black")
      ->transform(CLI::CheckedTransformer(hole_fills()).description("around, none"));
}

void add_fill_option(CLI::App& command, HoleFill& fill) {
  add_fill_option(
      command, fill, "What pictures show where nothing was reconstructed: the colours around it");
}

void add_scene_options(CLI::App& command, SceneOptions& options) {
  {
    const OptionGroup group(command, "Photographs");
    command.add_option(
        "--views",
        options.views,
        "Input views: names, or indices in name order from 0, e.g. 1,10,19; the rest is "
        "held out. Default: all of up to four; of more those that show the most together, as many "
        "as take some five minutes on two cores (four of 1024 x 768 pixels, sixteen of 512 x 384); "
        "for up to twelve, they are made smaller");
    command
        .add_flag(
            "--use-all",
            options.all_views,
            "Every photograph is an input view, none is held out; time grows with their number")
        ->excludes("--views");
    command
        .add_option(
            "--downscale",
            options.downscale,
            "Divide the image size by this; default: the smallest that leaves no side above " +
                std::to_string(SceneOptions::kLongestSide) + " pixels")
        ->check(CLI::Range(1, 1 << 15).description("at least 1"));
  }
  add_depth_options(command, options);
  const OptionGroup group(command, kDepthHeading);
  command.add_option("--depth-model",
                     options.depth.network,
                     "Network (.onnx, in the form of MiDaS small) that guesses disparity where "
                     "photographs measure none; with --depth-kind depth one that guesses depth");
}

void add_depth_options(CLI::App& command, SceneOptions& options) {
  command.add_flag("--allow-external",
                   options.allow_external,
                   "Follow links and absolute paths that leave the scene folder");
  command.add_option("--chunk",
                     options.chunk,
                     "Of Metashape's cameras the chunk to read: its label, or its index from 0; "
                     "default: the first with aligned cameras");
  const OptionGroup group(command, kDepthHeading);
  command.add_option(
      "--depth",
      options.depth.folder,
      "Folder with a depth file per photograph, of the same stem: .exr .pfm .npy .npz "
      ".tif .png, or depth_maps of COLMAP's dense stereo; default: what the scene says, else a "
      "folder \"depth\" beside the photographs");
  command
      .add_option("--depth-kind",
                  options.depth.kind,
                  "metric (of a sensor), depth or disparity (up to scale and offset, of a "
                  "network); default auto: whichever fits what the photographs show")
      ->transform(
          CLI::CheckedTransformer(depth_kinds()).description("auto, metric, depth, disparity"));
  command
      .add_option("--depth-scale",
                  options.depth.scale,
                  "Values of metric depth files per metre; default: 1000 where they are whole "
                  "numbers (5000 in TUM data sets), else 1")
      ->check(CLI::NonNegativeNumber);
}

void add_scale_options(CLI::App& command, SceneRequest& request) {
  const OptionGroup group(command, "Scale and frame");
  command.add_option("--assume-unit",
                     request.assume_unit,
                     "What one scene unit is (m, cm, mm, in, ft), where the scene does not say; "
                     "STL and 3MF need it");
  command
      .add_option("--up",
                  request.up,
                  "World direction that is up, three numbers; default: judged by the cameras")
      ->expected(3);
  command
      .add_option("--known-distance",
                  request.known_distances,
                  "Two pixels of input photographs and how far apart these points really are: "
                  "VIEW:X,Y VIEW:X,Y 1.2m, or 1.2m+-3mm; gives the scene its scale; several are "
                  "weighed against each other")
      ->allow_extra_args(false);
  command.add_option("--marker-size",
                     request.marker_size,
                     "Side of the black square of printed markers (AprilTag 36h11; ArUco 4x4, 5x5, "
                     "6x6, original) that two photographs show, e.g. 80mm or 80mm+-0.2mm; gives "
                     "the scene its scale");
  command.add_option(
      "--control-points",
      request.control.file,
      "Table (CSV) of surveyed points and where photographs show them, columns name,x,y,z,view,"
      "px,py and, if wanted, sigma and role (control or check): results are then in the "
      "coordinates of the table, z up (files state a far origin apart, to be added); needs 3 "
      "points, each in 2 photographs, and tells scale, unit and up by itself");
  command.add_option("--control-unit",
                     request.control.unit,
                     "Unit of the coordinates in --control-points (m, cm, mm, in, ft); default m");
}

void add_glb_option(CLI::App& command, GlbEncoding& encoding) {
  command
      .add_option("--glb-encoding",
                  encoding,
                  "Of meshes in .glb: draco (smallest), meshopt (shown soonest; for browsers), "
                  "quantized (16 bits, for readers without a decoder such as Debian's Blender from "
                  "3.0 on), plain (floats, for all); default draco")
      ->transform(
          CLI::CheckedTransformer(glb_encodings()).description("draco, meshopt, quantized, plain"));
}

void add_local_origin_option(CLI::App& command, bool& local_origin, const std::string& files) {
  command.add_flag("--local-origin",
                   local_origin,
                   files +
                       " lies about an origin near by instead of where the input lies, for viewers "
                       "that compute in single precision, of surveys in national coordinates");
}

void add_estimated_option(CLI::App& command, std::optional<EstimatedSurface>& estimated) {
  command
      .add_option(
          "--estimated",
          estimated,
          "Surface that photographs show but nothing measured: keep, fill-only (where it is "
          "small and framed by what was measured, or ground or a wall that goes on), drop; "
          "default fill-only. It is never counted as evidence")
      ->transform(
          CLI::CheckedTransformer(estimated_surfaces()).description("keep, fill-only, drop"));
}

void add_camera_options(CLI::App& command, SceneRequest& request) {
  const OptionGroup group(command, "Photographs");
  command.add_option(
      "--focal",
      request.focal,
      "Focal length of photographs without cameras, in pixels of the files; default: "
      "what they say (Exif), else solved for");
  static const std::map<std::string, bool> kLenses = {{"shared", false}, {"each", true}};
  command
      .add_option("--lenses",
                  request.each_lens,
                  "Whether photographs without cameras share a focal length: shared (those of one "
                  "size and, by their Exif, one camera and lens; default), or each has its own, as "
                  "scans do")
      ->transform(CLI::CheckedTransformer(kLenses).description("shared, each"));
  command.add_flag(
      "--old-photographs",
      request.old_photographs,
      "Prints and films: even borders are left out, and gain, gamma, falling off of the light "
      "and mixing of colours of each are told, as far as others show the same places");
  command.add_flag(
      "--refine-poses",
      request.refine_poses,
      "Correct cameras that are slightly off (of phones, from elsewhere) by what the "
      "photographs show; focal lengths, the scale and the first input camera that shares "
      "enough with others stay");
}

void add_medium_option(CLI::App& command, Medium& medium) {
  const OptionGroup group(command, "Photographs");
  command
      .add_option("--medium",
                  medium,
                  "What the photographs were taken through: none (air), or water, which is "
                  "estimated from what they show of the same surface from nearer and from farther "
                  "away, and taken out of them; refused where ranges vary too little; default none")
      ->transform(CLI::CheckedTransformer(media()).description("none, water"));
}

void add_training_options(CLI::App& command, TrainingArguments& arguments) {
  const OptionGroup group(command, "Training");
  command
      .add_option("--preset",
                  arguments.preset,
                  "draft, standard, fine (a third, all, twice the training steps), "
                  "reference (the published CoherentGS schedule with convolutional decoders, hours "
                  "instead of a minute), or classical: 3D Gaussian Splatting without coherence, to "
                  "compare with")
      // Says what there is, to help and completion; training_preset() refuses others.
      ->check(CLI::Validator("{draft,standard,fine,reference,classical}"))
      ->capture_default_str();
  command
      .add_option("--set",
                  arguments.settings,
                  "One setting of the training, name=value; may be repeated. model/training.json "
                  "lists all")
      ->allow_extra_args(false);
}

TrainingOptions training_options(const TrainingArguments& arguments) {
  TrainingOptions options = training_preset(arguments.preset);
  for (const std::string& setting : arguments.settings) {
    const size_t equals = setting.find('=');
    require(equals != std::string::npos, "--set must be name=value", setting);
    set_training_field(options, setting.substr(0, equals), setting.substr(equals + 1));
  }
  options.validate();
  return options;
}

namespace {

// False where that cannot be told: reading or writing then tells what is wrong.
bool lies_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::error_code error;
  const auto outer = std::filesystem::weakly_canonical(folder, error);
  if (error) return false;
  const auto inner = std::filesystem::weakly_canonical(path, error);
  if (error) return false;
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

void keep_apart(const std::filesystem::path& output, const std::filesystem::path& input) {
  if (!lies_in(output, input)) return;
  throw InvalidInput("the output " + printable(output) + " lies in the input " + printable(input) +
                     "; choose another place");
}

void keep_scene_apart(const std::filesystem::path& output,
                      const std::filesystem::path& scene,
                      std::initializer_list<const char*> folders) {
  keep_apart(output, scene);
  for (const char* folder : folders) {
    if (!lies_in(scene, output / folder)) continue;
    throw InvalidInput("the scene " + printable(scene) + " lies in " + printable(output / folder) +
                       ", which results are written to; choose another output");
  }
}

void refuse_to_replace_model(const std::filesystem::path& output,
                             bool overwrite,
                             const std::string& how) {
  std::error_code error;
  const auto folder = std::filesystem::weakly_canonical(output, error);
  if (folder.filename() == "model" && is_present(folder.parent_path() / "run.json")) {
    throw InvalidInput(printable(output) +
                       " is the model of a run, which only cgs run may change; choose another "
                       "folder");
  }
  if (is_present(output / "run.json")) {
    throw InvalidInput(printable(output) +
                       " holds a run, which has a model of its own; choose another folder");
  }
  if (overwrite) return;
  const std::string remedy = "; choose another folder, or say " + how;
  if (is_present(output / "cameras.json")) {
    throw InvalidInput(printable(output) + " holds a finished model" + remedy);
  }
  if (is_present(output / "gaussians.ply") && !has_checkpoints(output)) {
    throw InvalidInput(printable(output) + " holds gaussians.ply, which no training here wrote" +
                       remedy);
  }
}

void require_ending(const std::filesystem::path& output, const char* ending, const char* option) {
  if (output.empty() || lower_extension(output) == ending) return;
  throw InvalidInput(std::string(option) + " " + printable(output) +
                     " is no name of such a file: write NAME" + ending);
}

void limit_threads(int threads) {
  constexpr int kMost = 1024;
  require(threads >= 0 && threads <= kMost, "--threads must be in 0 ... 1024", threads);
  const int count =
      threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  thread_control() = std::make_unique<tbb::global_control>(
      tbb::global_control::max_allowed_parallelism, static_cast<size_t>(count));
  cv::setNumThreads(count);
}

void release_threads() {
  thread_control().reset();
  cv::setNumThreads(-1);
}

}  // namespace cgs
