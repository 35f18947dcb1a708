// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff_design.h"

#include <array>
#include <charconv>
#include <cstdio>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

std::string four_digits(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

// As many digits as read back to the same number.
std::string exact(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string optional_number(const std::optional<double>& value) {
  return value ? four_digits(*value) : "default";
}

// A word of a command line as a shell takes it.
std::string shell_word(const std::string& text) {
  static constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-=,:+%@";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// Of the presets, which differ in their steps; empty for standard and for other numbers.
std::string preset_of(int steps) {
  for (const char* name : {"draft", "fine"}) {
    if (steps == training_preset(name).steps) return name;
  }
  return "";
}

}  // namespace

std::string label(const Setting& setting) {
  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  if (setting.coarser != 1) add("1/" + std::to_string(setting.coarser) + " size");
  if (const std::string preset = preset_of(setting.steps); !preset.empty()) {
    add(preset);
  } else if (setting.steps != TrainingOptions().steps) {
    add(std::to_string(setting.steps) + " steps");
  }
  if (setting.voxel != 1) add("voxel x" + four_digits(setting.voxel));
  if (setting.simplify) {
    add(*setting.simplify == 0 ? "not simplified"
                               : "simplified " + four_digits(*setting.simplify) + " voxel");
  }
  if (setting.max_error) add("packed " + four_digits(*setting.max_error) + " voxel");
  if (setting.repeat != 0) add("repeat " + std::to_string(setting.repeat));
  return out.empty() ? "standard" : out;
}

std::string model_key(const Setting& setting) {
  return "d" + std::to_string(setting.coarser) + "_s" + std::to_string(setting.steps) +
         (setting.repeat != 0 ? "_r" + std::to_string(setting.repeat) : "");
}

std::string mesh_key(const Setting& setting) {
  return model_key(setting) + "_v" + four_digits(setting.voxel) + "_e" +
         optional_number(setting.simplify);
}

std::string asset_key(const Setting& setting) {
  return mesh_key(setting) + "_q" + optional_number(setting.max_error);
}

std::vector<Setting> tradeoff_design() {
  const int draft = training_preset("draft").steps;
  const int fine = training_preset("fine").steps;
  return {
      {},
      {.steps = draft},
      {.coarser = 2},
      {.voxel = 0.7, .simplify = 0},  // the finest surface: what the others are held against
      {.simplify = 0},
      {.voxel = 1.5},
      {.steps = 0},
      {.steps = 0, .simplify = 0},
      {.repeat = 1},
      {.max_error = 0.1},
      {.max_error = 0.4},
      {.voxel = 2},
      {.coarser = 2, .steps = draft},
      {.steps = fine},
      {.steps = 2 * fine},
      {.simplify = 1},
      {.voxel = 1.5, .simplify = 1, .max_error = 0.4},  // for the smallest file
      {.coarser = 2, .steps = 0, .simplify = 0},        // for the shortest time
      {.coarser = 2, .voxel = 0.5},
      {.coarser = 4},
      {.steps = draft, .voxel = 1.5},
      {.simplify = 0.5},
      {.repeat = 2},
      {.voxel = 0.7},
  };
}

RunRequest request_of(const Setting& setting,
                      const RunRequest& standard,
                      int downscale,
                      double standard_voxel) {
  RunRequest out = standard;
  out.scene.options.downscale = downscale * setting.coarser;
  out.training.steps = setting.steps;
  const auto length = [&](double voxels) {
    require(standard_voxel > 0, "the standard voxel must be known", standard_voxel);
    return four_digits(voxels * standard_voxel);
  };
  if (setting.voxel != 1) out.voxel_size = length(setting.voxel * setting.coarser);
  if (setting.simplify) out.simplify = *setting.simplify == 0 ? "0" : length(*setting.simplify);
  if (setting.max_error) out.compression_error = length(*setting.max_error);
  return out;
}

std::string command_line(const RunRequest& request, int threads) {
  const SceneRequest& scene = request.scene;
  std::string out = "cgs run " + shell_word(scene.path.string());
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) out += std::string(" ") + name + " " + shell_word(value);
  };
  add("--views", scene.options.views);
  if (scene.options.downscale) add("--downscale", std::to_string(*scene.options.downscale));
  const DepthOptions& depth = scene.options.depth;
  add("--depth", depth.folder.string());
  for (const auto& [name, kind] : depth_kinds()) {
    if (kind == depth.kind && kind != DepthKind::Unknown) add("--depth-kind", name);
  }
  if (depth.scale > 0) add("--depth-scale", exact(depth.scale));
  add("--depth-model", depth.network.string());
  add("--chunk", scene.options.chunk);
  if (scene.options.allow_external) out += " --allow-external";
  if (scene.focal > 0) add("--focal", exact(scene.focal));
  if (scene.each_lens) add("--lenses", "each");
  if (scene.old_photographs) out += " --old-photographs";
  if (scene.refine_poses) out += " --refine-poses";
  add("--assume-unit", scene.assume_unit);
  add("--marker-size", scene.marker_size);
  if (!scene.up.empty()) out += " --up";
  for (const double number : scene.up) out += " " + exact(number);
  if (const std::string preset = preset_of(request.training.steps); !preset.empty()) {
    add("--preset", preset);
  } else if (request.training.steps != TrainingOptions().steps) {
    add("--set", "steps=" + std::to_string(request.training.steps));
  }
  add("--voxel-size", request.voxel_size);
  add("--simplify", request.simplify);
  add("--compression-error", request.compression_error);
  if (request.memory_limit > 0) add("--memory-limit", std::to_string(request.memory_limit));
  if (threads > 0) add("--threads", std::to_string(threads));
  add("-o", request.output.string());
  return out;
}

}  // namespace cgs
