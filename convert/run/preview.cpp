// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/preview.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "convert/model/model_training.h"
#include "convert/run/pipeline.h"
#include "convert/run/small_run.h"
#include "convert/text/html.h"
#include "io/bytes/scene_path.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr int64_t kPreviewVoxels = 1'000'000;  // where depth reaches far, more would take minutes

int preview_reduction(const Scene& scene) {
  constexpr int kSide = 256;  // [pixels]
  int side = 0;
  for (const int i : scene.input) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    side = std::max({side, camera.width, camera.height});
  }
  return std::max(1, (side + kSide / 2) / kSide);
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
  RunRequest full = request;
  full.scene.options.downscale = 1;
  const OpenedScene opened = open_scene(full.scene, request.output / "model", terminal);
  make_output_folder(request.output / "model");
  opened.keep(request.output / "model");
  const int reduction = preview_reduction(opened.scene);
  RunRequest small = small_run(request, opened, kPreviewFolder, reduction);
  small.max_voxels = kPreviewVoxels;
  small.training.steps = 0;
  small.lods = 0;
  small.max_size = 0;
  small.max_error.clear();
  small.settings_reason = "a preview: small pictures, and Gaussians that were not trained";
  return run_pipeline(small, terminal).report;
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
