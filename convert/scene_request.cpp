// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene_request.h"

#include <cmath>
#include <utility>

#include "convert/camera_fit.h"
#include "convert/stated_frame.h"
#include "io/photographs.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

void refuse_two_scales(const SceneRequest& request) {
  const ControlRequest& control = request.control;
  if (control.file.empty() && !control.unit.empty()) {
    throw InvalidInput("--control-unit is the unit of --control-points, which is not given");
  }
  for (const auto& [option, is_given] :
       {std::pair("--known-distance", !request.known_distances.empty()),
        std::pair("--marker-size", !request.marker_size.empty()),
        std::pair("--assume-unit", !request.assume_unit.empty()),
        std::pair("--up", !request.up.empty())}) {
    if (control.file.empty() || !is_given) continue;
    throw InvalidInput(std::string("--control-points tells scale, unit and up of the scene, and ") +
                       option + " would tell it once more; leave that out");
  }
  if (!request.assume_unit.empty() && request.states_lengths()) {
    throw InvalidInput(
        "--assume-unit states the scale that --known-distance or --marker-size measures; give one");
  }
}

void refine(const SceneRequest& request,
            const std::filesystem::path& model,
            Terminal& terminal,
            OpenedScene& out) {
  const SceneRoot root{request.path, request.options.allow_external};
  out.refined = refined_poses(out.scene, root, model, terminal);
  move_cameras(*out.refined, out.scene);
  auto& warnings = out.scene.warnings;
  warnings.insert(warnings.end(), out.refined->warnings.begin(), out.refined->warnings.end());
}

// Which photographs there are is known before their cameras are, minutes earlier.
void check_names(const SceneRoot& root, const std::string& views) {
  if (views.empty()) return;
  Scene named;
  for (const PhotoFile& photograph : list_photographs(root)) {
    View& view = named.views.emplace_back();
    view.name = photograph.path.stem().string();
    view.image_path = photograph.path;
  }
  (void)select_views(named, views);
}

}  // namespace

bool SceneRequest::states_lengths() const {
  return !known_distances.empty() || !marker_size.empty();
}

OpenedScene open_scene(const SceneRequest& request,
                       const std::filesystem::path& model,
                       Terminal& terminal) {
  refuse_two_scales(request);
  require(request.focal >= 0 && std::isfinite(request.focal),
          "--focal must be a number of pixels above 0",
          request.focal);
  OpenedScene out;
  if (is_photographs(request.path)) {
    if (request.refine_poses) {
      throw InvalidInput("--refine-poses is for cameras that a scene states; " +
                         printable(request.path) +
                         " holds photographs alone, which are solved for as well as they can be");
    }
    request.options.validate();
    const SceneRoot root{request.path, request.options.allow_external};
    check_names(root, request.options.views);
    const std::filesystem::path stored = model.empty() ? model : model / kPosesFolder;
    out.poses = photo_poses(root, request.focal, stored, terminal);
    out.scene = scene_of_photographs(request.path, out.poses->model, request.options);
    auto& warnings = out.scene.warnings;
    warnings.insert(warnings.end(), out.poses->warnings.begin(), out.poses->warnings.end());
  } else {
    out.scene = read_scene(request.path, request.options);
    if (request.focal > 0) {
      throw InvalidInput("--focal is for photographs without cameras; " + printable(request.path) +
                         " states them (" + out.scene.kind + ")");
    }
    if (request.refine_poses) refine(request, model, terminal, out);
  }
  if (!request.control.file.empty()) {
    out.control = move_to_control_frame(request.control, out.scene);
    return out;
  }
  if (!request.assume_unit.empty()) {
    const std::string refused = assume_unit(out.scene.frame, request.assume_unit);
    if (!refused.empty()) out.scene.warnings.push_back(refused);
  }
  out.scene.frame.up = request.up.empty() ? world_up(out.scene) : up_direction(request.up);
  return out;
}

void OpenedScene::keep(const std::filesystem::path& model) const {
  if (poses && !poses->is_stored) write_photo_poses(model / kPosesFolder, *poses);
  if (refined && !refined->is_stored) write_refined_poses(model, *refined);
  if (!refined) forget_refined_poses(model);
}

nlohmann::ordered_json check_stated_cameras(const SceneRequest& request,
                                            OpenedScene& opened,
                                            Terminal& terminal) {
  if (opened.poses || opened.refined) return nullptr;
  const SceneRoot root{request.path, request.options.allow_external};
  nlohmann::ordered_json fit = camera_fit(opened.scene, root, terminal.begin("checking cameras"));
  terminal.end("");
  const std::string warning = camera_fit_warning(fit);
  if (!warning.empty()) opened.scene.warnings.push_back(warning);
  return fit;
}

}  // namespace cgs
