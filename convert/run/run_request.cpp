// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_request.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "convert/model/simplification.h"
#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/photographs.h"
#include "libcgs/core/error.h"

namespace cgs {

PictureWork picture_work(const RunRequest& request) {
  return {.chooses_voxels = request.voxel_size.empty(),
          .measured = {.meshes = !request.max_error.empty(),
                       .asset = !request.max_error.empty() || request.max_size > 0},
          .coherence = request.training.coherence,
          .method = request.training.method,
          .match_lists = match_lists(request.training)};
}

namespace {

// Lengths that will be refused, before minutes are spent on cameras.
void check_lengths_of_photographs(const RunRequest& request) {
  if (!is_photographs(request.scene.path)) return;
  Frame frame;
  const DepthOptions& depth = request.scene.options.depth;
  const bool has_depth = !depth.folder.empty() || is_folder(request.scene.path / "depth");
  const bool may_be_metric = depth.kind == DepthKind::Unknown || depth.kind == DepthKind::Metric;
  const bool may_tell_scale = has_depth && may_be_metric && depth.network.empty();
  const bool states_unit =
      !request.scene.assume_unit.empty() || !request.scene.control.file.empty();
  if (states_unit || may_tell_scale) frame.metres_per_unit = 1;
  check_lengths(request, frame);
}

}  // namespace

OpenedScene open_scene_of(const RunRequest& request, Terminal& terminal) {
  check_lengths_of_photographs(request);
  const std::filesystem::path model = request.output / "model";
  std::optional<NewFolder> folder;
  if (needs_cameras(request.scene)) folder.emplace(request.output);
  return open_scene(request.scene, model, terminal, [&](const OpenedScene& solved) {
    if (is_present(request.output / "run.json")) return;
    make_output_folder(model);
    const FolderLock lock(request.output);
    solved.keep(model);
  });
}

void check_lengths(const RunRequest& request, Frame frame) {
  if (request.scene.states_lengths()) frame.metres_per_unit = 1;
  (void)length_or_zero(request.voxel_size, frame, "--voxel-size");
  (void)length_or_zero(request.max_error, frame, "--max-error");
  (void)length_or_zero(request.compression_error, frame, "--compression-error");
  (void)simplify_options(request.simplify, 1, frame);
  (void)atlas_texel(request, frame);
}

void check_lengths(const RunRequest& request, const Scene& scene) {
  Frame frame = scene.frame;
  const DepthKind kind = request.scene.options.depth.kind;
  const bool may_tell_metres = (kind == DepthKind::Metric || kind == DepthKind::Unknown) &&
                               request.scene.options.depth.network.empty();
  if (has_given_depth(request.scene, scene) && may_tell_metres) frame.metres_per_unit = 1;
  check_lengths(request, frame);
}

std::optional<double> atlas_texel(const RunRequest& request, const Frame& frame) {
  constexpr std::string_view kSized = "atlas=";
  if (request.texture == "photographs") return {};
  if (request.texture == "atlas") return 0;
  if (!request.texture.starts_with(kSized)) {
    throw InvalidInput("--texture " + request.texture +
                       ": allowed are photographs, atlas, and atlas= with the size of a pixel");
  }
  return parse_length(request.texture.substr(kSized.size()), frame, "--texture");
}

void refuse_contradictions(const RunRequest& request) {
  // A promise is about all that is done to the fused surface; its parts are then no longer free.
  if (request.max_error.empty()) return;
  for (const auto& [option, value] :
       {std::pair("--simplify", request.simplify),
        std::pair("--compression-error", request.compression_error)}) {
    if (value.empty()) continue;
    throw InvalidInput(
        std::string("--max-error is the largest sum of all errors of the meshes and ") + option +
        " one of them; give one of the two");
  }
}

bool has_given_depth(const SceneRequest& request, const Scene& scene) {
  const bool has_files = std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
    return !scene.views[static_cast<size_t>(i)].depth_path.empty();
  });
  return has_files || !request.options.depth.network.empty();
}

}  // namespace cgs
