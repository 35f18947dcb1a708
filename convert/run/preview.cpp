// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/preview.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>

#include <nlohmann/json.hpp>

#include "convert/model/memory_plan.h"
#include "convert/model/model_training.h"
#include "convert/run/pipeline.h"
#include "convert/run/small_run.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr int64_t kPreviewVoxels = 1'000'000;  // where depth reaches far, more would take minutes

constexpr int kPreviewSide = 256;  // [pixels]

int longest_side(const Scene& scene) {
  int out = 0;
  for (const int i : scene.input) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    out = std::max({out, camera.width, camera.height});
  }
  return out;
}

int preview_reduction(const Scene& full) { return reduction_to(kPreviewSide, longest_side(full)); }

// Of the same views.
RunRequest preview_request(const RunRequest& request,
                           const OpenedScene& opened,
                           const Scene& full) {
  RunRequest out = small_run(request, opened, kPreviewFolder, preview_reduction(full));
  out.scene.options.views = views_of_run(request, opened.scene);
  out.max_voxels = kPreviewVoxels;
  out.training.steps = 0;
  out.lods = 0;
  out.fill = HoleFill::None;
  out.max_size = 0;
  out.max_error.clear();
  out.settings_reason = "a preview: small pictures, and Gaussians that were not trained";
  return out;
}

// The scene of a run with pictures as they are.
// \param model  where its cameras are stored
Scene full_scene(const RunRequest& request, const std::filesystem::path& model) {
  SceneRequest full = request.scene;
  full.options.downscale = 1;
  Terminal silent = Terminal::silent();
  return open_scene(full, model, silent).scene;
}

// Where the cameras of a preview are stored: for the run that follows, but a run that was made has
// its own.
std::filesystem::path model_of_preview(const RunRequest& request, const OpenedScene& opened) {
  const bool are_stored =
      (opened.poses && opened.poses->is_stored) || (opened.refined && opened.refined->is_stored);
  const bool is_run = is_present(request.output / "run.json");
  return request.output / (is_run && !are_stored ? kPreviewFolder : "") / "model";
}

// What most of the unmeasured is, with what helps.
std::string main_reason(const Json& depth_of_views) {
  struct Reason {
    const char* key;
    const char* words;
  };
  constexpr std::array<Reason, 5> kReasons = {
      {{"unseen", "it is in no other photograph: let them show more of the same"},
       {"hidden", "something hides it in the others: add photographs from a little aside"},
       {"even", "it shows no texture"},
       {"wide", "the others see it from too far aside: take steps of some 10 degrees"},
       {"unconfirmed",
        "what matches there is not confirmed: it repeats, shines or moves, or cameras are off"}}};
  double most = 0;
  std::string out;
  for (const Reason& reason : kReasons) {
    double sum = 0;
    for (const Json& view : depth_of_views) sum += view["unmeasured"][reason.key].get<double>();
    if (sum <= most) continue;
    most = sum;
    out = reason.words;
  }
  return out;
}

}  // namespace

Json write_preview(const RunRequest& request, Terminal& terminal) {
  const OpenedScene opened = open_scene_of(request, terminal);
  make_output_folder(request.output);
  const FolderLock lock(request.output);
  const std::filesystem::path model = model_of_preview(request, opened);
  make_output_folder(model);
  opened.keep(model);
  return run_pipeline(preview_request(request, opened, full_scene(request, model)), terminal)
      .report;
}

bool is_worth_a_preview(const Scene& scene, const Scene& full) {
  constexpr double kManyPixels = 8e5;  // of all input views: more than a minute
  return pixels_of(scene, scene.input) >= kManyPixels &&
         2 * longest_side(full) <= longest_side(scene) * preview_reduction(full);
}

void look_first(const RunRequest& request, const OpenedScene& opened, Terminal& terminal) {
  try {
    const Scene full = full_scene(request, request.output / "model");
    if (!is_worth_a_preview(opened.scene, full)) return;
    (void)terminal.begin("first look");
    Terminal silent = Terminal::silent();
    const Json report = run_pipeline(preview_request(request, opened, full), silent).report;
    (void)terminal.end("");
    terminal.say("first look: " + preview_words(report) + "; open " +
                 (request.output / kPreviewFolder / "report.html").string() +
                 " while the rest is made");
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;  // ends the program
  } catch (const std::exception& error) {
    terminal.say("first look failed: " + std::string(error.what()));
  }
}

std::string preview_words(const Json& report) {
  constexpr double kPoor = 0.25;
  constexpr double kGood = 0.6;
  const Json& depth = report["model"]["depth_of_views"];
  const double share = measured_share(depth);
  const std::string reason = main_reason(depth);
  std::string out = percent(share) + " of the surface in the photographs is measured";
  if (share < kGood && !reason.empty()) out += "; most of the rest is not, as " + reason;
  if (share < kPoor) out += ". These photographs are hardly worth going on with";
  return out;
}

}  // namespace cgs
