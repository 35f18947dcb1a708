// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_request.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "convert/model/model_training.h"
#include "convert/model/simplification.h"
#include "convert/run/run_record.h"
#include "convert/text/length.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/lens.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

Json names_of(const Scene& scene, const std::vector<int>& views) {
  Json out = Json::array();
  for (const int i : views) out.push_back(scene.views[static_cast<size_t>(i)].name);
  return out;
}

// Hashes of the photographs and masks of views.
Json photograph_hashes(const Scene& scene, const std::vector<int>& views) {
  Json out = Json::object();
  for (const int i : views) {
    const View& view = scene.views[static_cast<size_t>(i)];
    out[view.name] = file_hash(view.image_path);
    if (!view.mask_path.empty()) out[view.name + ", mask"] = file_hash(view.mask_path);
  }
  return out;
}

// Hashes of what the model is made of, by what it is.
Json input_hashes(const SceneRequest& request, const Scene& scene) {
  Json out = photograph_hashes(scene, scene.input);
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.depth_path.empty()) continue;
    out[view.name + ", depth"] = file_hash(view.depth_path);
    const std::filesystem::path confidence = confidence_file(scene, view, true);
    if (!confidence.empty()) out[view.name + ", confidence"] = file_hash(confidence);
  }
  const std::filesystem::path& network = request.options.depth.network;
  if (!network.empty()) out["depth network"] = file_hash(network);
  return out;
}

// Of the cameras, and of what came with them that says how far away to look.
uint64_t cameras_hash(const Scene& scene) {
  Json cameras = Json::array();
  for (const View& view : scene.views) {
    const Camera& c = view.camera;
    const Eigen::Matrix4d pose = c.world_from_cam.matrix();
    cameras.push_back({view.name,
                       {c.width, c.height, c.fx, c.fy, c.cx, c.cy},
                       std::vector<double>(pose.data(), pose.data() + pose.size()),
                       lens_numbers(view)});
    if (view.near > 0) cameras.push_back({view.near, view.far});
  }
  for (const SparsePoint& point : scene.points) {
    const Eigen::Vector3d& p = point.position;
    cameras.push_back({p.x(), p.y(), p.z(), point.views});
  }
  return content_hash(json_text(cameras, -1));
}

}  // namespace

PictureWork picture_work(const RunRequest& request) {
  return {.chooses_voxels = request.voxel_size.empty(),
          .measured = {.meshes = !request.max_error.empty(),
                       .asset = !request.max_error.empty() || request.max_size > 0},
          .coherence = request.training.coherence};
}

void check_lengths(const RunRequest& request, Frame frame) {
  if (request.scene.states_lengths()) frame.metres_per_unit = 1;
  if (!request.voxel_size.empty()) (void)parse_length(request.voxel_size, frame);
  for (const std::string& length : {request.max_error, request.compression_error}) {
    if (!length.empty()) (void)parse_length(length, frame);
  }
  (void)simplify_options(request.simplify, 1, frame);
}

void check_lengths(const RunRequest& request, const Scene& scene) {
  Frame frame = scene.frame;
  const DepthKind kind = request.scene.options.depth.kind;
  const bool may_tell_metres = (kind == DepthKind::Metric || kind == DepthKind::Unknown) &&
                               request.scene.options.depth.network.empty();
  if (has_given_depth(request.scene, scene) && may_tell_metres) frame.metres_per_unit = 1;
  check_lengths(request, frame);
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

Json request_json(const RunRequest& request, const Scene& scene) {
  Json out = {{"scene", std::filesystem::weakly_canonical(request.scene.path).string()},
              {"views", request.scene.options.views},
              {"downscale", request.scene.options.downscale.value_or(0)},
              {"assume_unit", request.scene.assume_unit},
              {"up", request.scene.up},
              {"known_distances", request.scene.known_distances},
              {"marker_size", request.scene.marker_size},
              {"training", settings_to_json(request.training)},
              {"voxel_size", request.voxel_size},
              {"max_error", request.max_error},
              {"simplify", request.simplify},
              {"compression_error", request.compression_error},
              {"max_size", request.max_size},
              {"input_images", input_hashes(request.scene, scene)},
              {"held_out", names_of(scene, scene.held_out)},
              {"held_out_images", photograph_hashes(scene, scene.held_out)},
              {"cameras", cameras_hash(scene)}};
  // The cameras have moved with it; what is left is the sigma of the scale.
  const ControlRequest& control = request.scene.control;
  if (!control.file.empty()) {
    out["control_points"] = {{"table", file_hash(control.file)}, {"unit", control.unit}};
  }
  // Only where they decide something: folders of runs without them go on as before.
  if (request.scene.refine_poses) out["refine_poses"] = true;
  if (request.lods > 0) out["lods"] = request.lods;
  for (const auto& [name, encoding] : glb_encodings()) {
    const bool is_default = encoding == GlbEncoding::Draco;
    if (encoding == request.glb_encoding && !is_default) out["glb_encoding"] = name;
  }
  for (const auto& [name, estimated] : estimated_surfaces()) {
    const bool is_default = estimated == EstimatedSurface::FillOnly;
    if (estimated == request.estimated && !is_default) out["estimated"] = name;
  }
  const Frame& frame = scene.frame;
  const bool is_stated = request.scene.assume_unit.empty() && control.file.empty();
  if (is_stated && frame.has_metric_scale()) {
    out["stated_scale"] = {
        frame.metres_per_unit, frame.metres_sigma, static_cast<int>(frame.scale_source)};
  }
  if (has_given_depth(request.scene, scene)) {
    out["depth"] = {static_cast<int>(scene.depth_kind), scene.depth_scale};
  }
  return out;
}

}  // namespace cgs
