// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/scene_request.h"

#include <cmath>
#include <utility>

#include "convert/model/model.h"
#include "convert/scene/baselines.h"
#include "convert/text/length.h"
#include "convert/text/stated_frame.h"
#include "io/scenes/control_points.h"
#include "io/scenes/photographs.h"
#include "io/scenes/view_names.h"
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

void refine(const std::filesystem::path& model, Terminal& terminal, OpenedScene& out) {
  out.refined = refined_poses(out.scene, model, terminal);
  move_cameras(*out.refined, out.scene);
  auto& warnings = out.scene.warnings;
  warnings.insert(warnings.end(), out.refined->warnings.begin(), out.refined->warnings.end());
}

void warn_of_turned(Scene& scene) {
  const size_t turned = turned_photographs(scene);
  if (turned == 0) return;
  scene.warnings.push_back(
      std::to_string(turned) +
      " photographs lie turned in their files (Exif); the cameras are for the files as they lie, "
      "so views are shown lying; up is as Exif says");
}

void expect_old_photographs(Scene& scene) {
  scene.has_old_photographs = true;
  for (View& view : scene.views) view.may_have_border = true;
}

// Which photographs there are is known before their cameras are, minutes earlier.
Scene named_photographs(const SceneRoot& root) {
  Scene named;
  for (const PhotoFile& photograph : list_photographs(root)) {
    View& view = named.views.emplace_back();
    view.name = photograph.path.filename().string();
    view.image_path = photograph.path;
  }
  name_views(named);
  return named;
}

// \return the names that a list stands for: indices are those of all photographs, also where some
//         cannot be placed
std::vector<std::string> names_of(const Scene& named, const std::string& views) {
  std::vector<std::string> out;
  if (views.empty()) return out;
  for (const int i : select_views(named, views)) {
    const std::string name = named.views[static_cast<size_t>(i)].image_path.filename().string();
    require_listable(name, "--views");
    out.push_back(name);
  }
  return out;
}

// What was typed and cannot be meant is refused before minutes are spent on cameras.
void check_words(const SceneRequest& request) {
  require(request.focal >= 0 && std::isfinite(request.focal),
          "--focal must be a number of pixels above 0",
          request.focal);
  if (!request.assume_unit.empty()) (void)metres_in(request.assume_unit, "--assume-unit");
  if (!request.up.empty()) (void)up_direction(request.up);
  if (!request.marker_size.empty())
    (void)parse_metres_with_sigma(request.marker_size, "--marker-size");
  if (request.control.file.empty()) return;
  if (!request.control.unit.empty()) (void)metres_in(request.control.unit, "--control-unit");
  (void)read_control_points(request.control.file);
}

// The same views among those that could be placed. \throws InvalidInput if one could not
std::string placed_views(const std::vector<std::string>& names, const ColmapModel& model) {
  for (const std::string& name : names) {
    const bool is_placed =
        std::any_of(model.images.begin(), model.images.end(), [&](const ColmapImage& image) {
          return image.name == name;
        });
    if (!is_placed) {
      throw InvalidInput("--views: photograph " + printable(name) +
                         " could not be placed: too little of what it shows is in the others");
    }
  }
  return view_list(names);
}

// A scene of photographs alone.
void solve(const SceneRequest& request,
           const std::filesystem::path& model,
           Terminal& terminal,
           const Solved& solved,
           OpenedScene& out) {
  if (request.refine_poses) {
    throw InvalidInput("--refine-poses is for cameras that a scene states; " +
                       printable(request.path) +
                       " holds photographs alone, which are solved for as well as they can be");
  }
  if (!request.options.chunk.empty()) {
    throw InvalidInput("--chunk is for cameras of Metashape; " + printable(request.path) +
                       " holds photographs alone");
  }
  request.options.validate();
  const SceneRoot root{request.path, request.options.allow_external};
  const Scene named = named_photographs(root);
  const std::vector<std::string> names = names_of(named, request.options.views);
  check_known_distances(request.known_distances, named);
  const std::filesystem::path stored = model.empty() ? model : model / kPosesFolder;
  const PhotoPoseOptions how{
      request.focal, request.each_lens, request.old_photographs, request.options.all_views};
  out.poses = photo_poses(root, names, how, stored, terminal);
  if (solved && !out.poses->is_stored) solved(out);
  SceneOptions options = request.options;
  options.views = placed_views(names, out.poses->model);
  out.scene = scene_of_photographs(request.path, out.poses->model, options);
  if (request.old_photographs) expect_old_photographs(out.scene);
  auto& warnings = out.scene.warnings;
  warnings.insert(warnings.end(), out.poses->warnings.begin(), out.poses->warnings.end());
  auto& notes = out.scene.notes;
  notes.insert(notes.end(), out.poses->notes.begin(), out.poses->notes.end());
}

// A scene with cameras.
void read_stated(const SceneRequest& request, OpenedScene& out) {
  out.scene = read_scene(request.path, request.options);
  if (request.focal > 0) {
    throw InvalidInput("--focal is for photographs without cameras; " + printable(request.path) +
                       " states them (" + scene_kind_name(out.scene.kind) + ")");
  }
  if (request.each_lens) {
    throw InvalidInput("--lenses each is for photographs without cameras; " +
                       printable(request.path) + " states them (" +
                       scene_kind_name(out.scene.kind) + ")");
  }
  check_known_distances(request.known_distances, out.scene);
  if (request.old_photographs) expect_old_photographs(out.scene);
  warn_of_turned(out.scene);
}

}  // namespace

bool SceneRequest::states_lengths() const {
  return !known_distances.empty() || !marker_size.empty();
}

bool needs_cameras(const SceneRequest& request) {
  return request.refine_poses || is_photographs(request.path);
}

OpenedScene open_scene(const SceneRequest& request,
                       const std::filesystem::path& model,
                       Terminal& terminal,
                       const Solved& solved) {
  refuse_two_scales(request);
  check_words(request);
  OpenedScene out;
  if (is_photographs(request.path)) {
    solve(request, model, terminal, solved, out);
  } else {
    read_stated(request, out);
    if (request.refine_poses) refine(model, terminal, out);
    if (request.refine_poses && solved && !out.refined->is_stored) solved(out);
  }
  for (std::string& warning : baseline_warnings(out.scene)) {
    out.scene.warnings.push_back(std::move(warning));
  }
  if (!request.control.file.empty()) {
    out.control = move_to_control_frame(request.control, out.scene);
    if (out.refined) state_in_units(out.scene.world_per_stated_unit, *out.refined);
    return out;
  }
  if (!request.assume_unit.empty()) {
    const std::string refused = assume_unit(out.scene.frame, request.assume_unit);
    if (!refused.empty()) out.scene.warnings.push_back(refused);
    if (out.poses && refused.empty()) {
      out.scene.warnings.emplace_back(
          "--assume-unit: the cameras were solved for, so that a unit is the way from the first to "
          "the farthest of them, however long it was; --known-distance and --marker-size tell the "
          "scale");
    }
  }
  out.scene.frame.up = up_of(out.scene, request.up);
  return out;
}

void OpenedScene::keep(const std::filesystem::path& model) const {
  if (poses && !poses->is_stored) write_photo_poses(model / kPosesFolder, *poses);
  if (!poses) forget_photo_poses(model / kPosesFolder);
  if (refined && !refined->is_stored) write_refined_poses(model, *refined);
  if (!refined) forget_refined_poses(model);
}

std::optional<CameraFit> check_stated_cameras(OpenedScene& opened, Terminal& terminal) {
  if (opened.poses || opened.refined) return std::nullopt;
  std::optional<CameraFit> fit = camera_fit(opened.scene, terminal.begin("checking cameras"));
  terminal.end("");
  const std::string warning = fit ? camera_fit_warning(*fit) : "";
  if (!warning.empty()) opened.scene.warnings.push_back(warning);
  return fit;
}

}  // namespace cgs
