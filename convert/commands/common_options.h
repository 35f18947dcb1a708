// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "convert/model/fusion.h"
#include "convert/model/views.h"
#include "convert/scene/scene_request.h"
#include "io/meshes/gltf.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/train/training_options.h"

namespace cgs {

/// Puts the options that are added during its life under a heading of their own in --help.
class OptionGroup {
 public:
  OptionGroup(CLI::App& command, const std::string& heading);
  ~OptionGroup();  // NOLINT(bugprone-exception-escape)
  OptionGroup(const OptionGroup&) = delete;
  OptionGroup& operator=(const OptionGroup&) = delete;

 private:
  CLI::App& command_;
  std::string before_;
};

/// Flags that every long command has.
struct CommonOptions {
  int threads = 0;           ///< 0 = one per core.
  std::string memory_limit;  ///< "4G"; empty = 80 % of what is free.
  bool json = false;         ///< Report on standard output, as JSON.
  bool quiet = false;        ///< No progress on standard error.
  bool strict = false;       ///< Warnings end the command.
};

/// Adds them to a command; limit_threads() must be called when the command runs.
void add_common_options(CLI::App& command, CommonOptions& options);

/// What --memory-limit says [bytes]; 0 where it is not given.
/// \throws InvalidInput as parse_bytes()
size_t stated_memory_limit(const CommonOptions& options);

/// The same options without --memory-limit, for commands that plan no memory.
void add_output_options(CLI::App& command, CommonOptions& options);

/// --fill.
/// \param shown  what is shown by default where nothing was reconstructed, and in what
void add_fill_option(CLI::App& command, HoleFill& fill, const char* shown);

/// --fill of commands that show a model in pictures.
void add_fill_option(CLI::App& command, HoleFill& fill);

/// --assume-unit, --up, --known-distance, --marker-size, --control-points and --control-unit.
void add_scale_options(CLI::App& command, SceneRequest& request);

/// --views, --downscale, --depth, --depth-kind, --depth-model, --depth-scale
/// and --allow-external.
void add_scene_options(CLI::App& command, SceneOptions& options);

/// Of these --depth, --depth-kind, --depth-scale and --allow-external.
void add_depth_options(CLI::App& command, SceneOptions& options);

/// --glb-encoding.
void add_glb_option(CLI::App& command, GlbEncoding& encoding);

/// --local-origin.
/// \param files  what it is of, the first words of its help
void add_local_origin_option(CLI::App& command, bool& local_origin, const std::string& files);

/// --estimated.
void add_estimated_option(CLI::App& command, std::optional<EstimatedSurface>& estimated);

/// --focal, --lenses, --old-photographs and --refine-poses.
void add_camera_options(CLI::App& command, SceneRequest& request);

/// --medium.
void add_medium_option(CLI::App& command, Medium& medium);

/// How to train, as typed.
struct TrainingArguments {
  std::string preset = "standard";
  std::vector<std::string> settings;  ///< "name=value"
};

/// --preset and --set.
void add_training_options(CLI::App& command, TrainingArguments& arguments);

/// The preset with the settings applied.
/// \throws InvalidInput
TrainingOptions training_options(const TrainingArguments& arguments);

/// \throws InvalidInput if `output`, unless it is empty, has another ending (".svg") in its name
void require_ending(const std::filesystem::path& output, const char* ending, const char* option);

/// Refuses outputs that would overwrite the input.
/// \throws InvalidInput if `output` is `input` or lies in that folder.
void keep_apart(const std::filesystem::path& output, const std::filesystem::path& input);

/// The same for a scene and the folders below `output` that are written to.
void keep_scene_apart(const std::filesystem::path& output,
                      const std::filesystem::path& scene,
                      std::initializer_list<const char*> folders);

/// Refuses a model folder that holds something: a model may have taken hours, and a run vouches for
/// the one it made.
/// \param overwrite  a finished model may go, but not that of a run
/// \param how        what the caller is to say for that, for messages
/// \throws InvalidInput
void refuse_to_replace_model(const std::filesystem::path& output,
                             bool overwrite,
                             const std::string& how = "--overwrite");

/// Keeps every library within the number of threads for the rest of the program.
/// \throws InvalidInput if it is negative or above 1024.
void limit_threads(int threads);
/// Lets them take as many as they like again.
void release_threads();

}  // namespace cgs
