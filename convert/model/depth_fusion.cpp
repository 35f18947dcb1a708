// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/depth_fusion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/text/advice.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "convert/text/stated_frame.h"
#include "io/scenes/colmap_depth.h"
#include "io/scenes/depth_file.h"
#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/progress.h"
#include "libcgs/priors/given_depth.h"
#include "meshing/volume/depth_agreement.h"

namespace cgs {

namespace {

// Scales nearer to each other than this are not told apart by frames.
constexpr double kFinestFactor = 0.0125;

View& first_input(Scene& scene) { return scene.views[static_cast<size_t>(scene.input.front())]; }

// Leaves the views that have depth.
void keep_measured(Scene& scene) {
  std::erase_if(scene.input,
                [&](int i) { return scene.views[static_cast<size_t>(i)].depth_path.empty(); });
  if (scene.input.size() > 1) return;
  if (!scene.input.empty()) {
    throw BadInput(Defect::Missing,
                   scene.folder,
                   "only view " + printable(first_input(scene).name) +
                       " of those chosen has depth; two or more are needed");
  }
  throw BadInput(Defect::Missing,
                 scene.folder,
                 "there is no depth to fuse: put a file per photograph, of the same stem, into a "
                 "folder \"depth\" beside them, or give --depth DIR; cgs run makes depth from "
                 "photographs");
}

void refuse_other_kinds(const Scene& scene) {
  if (scene.depth_kind == DepthKind::Metric || scene.depth_kind == DepthKind::Unknown) return;
  throw InvalidInput(
      "only metric depth can be fused as it is; cgs train fits depth and disparity of unknown "
      "scale to the photographs");
}

// How much larger a photograph is than its depth; nothing if that cannot be read, which is told
// when it is fused.
std::optional<int> times_larger(const View& view) {
  try {
    const Raster<float> values = read_depth_file(view.depth_path).values;
    return std::max(view.camera.width, view.camera.height) / std::max(values.width, values.height);
  } catch (const BadInput&) {
    return std::nullopt;
  }
}

// Works at the size of the depth, since a larger picture has nothing to add but time. One frame of
// each size tells it.
void take_size_of_depth(Scene& scene) {
  std::map<std::pair<int, int>, int> factors;
  for (const int i : scene.input) {
    View& view = scene.views[static_cast<size_t>(i)];
    const std::pair size(view.camera.width, view.camera.height);
    if (factors.contains(size)) continue;
    if (const auto factor = times_larger(view)) factors.emplace(size, *factor);
  }
  for (const int i : scene.input) {
    Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    const auto factor = factors.find({camera.width, camera.height});
    if (factor == factors.end() || factor->second < 2) continue;
    camera = resized(camera, camera.width / factor->second, camera.height / factor->second);
  }
}

// Depth maps of COLMAP are in units of the cameras and tell nothing of metres.
bool is_in_units_of_cameras(const View& view) { return is_colmap_depth_name(view.depth_path); }

bool tells_metres(const Scene& scene) {
  return std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
    return !is_in_units_of_cameras(scene.views[static_cast<size_t>(i)]);
  });
}

// Cameras with depth in metres are taken to be in metres unless something else is said.
void settle_scale(Scene& scene, const std::string& unit) {
  if (!unit.empty()) {
    const std::string refused = assume_unit(scene.frame, unit);
    if (!refused.empty()) scene.warnings.push_back(refused);
  }
  if (scene.frame.has_metric_scale() || !tells_metres(scene)) return;
  scene.frame.metres_per_unit = 1;
  scene.frame.scale_source = ScaleSource::DepthSensor;
}

// The frames of a scene in its canonical frame.
class Frames {
 public:
  explicit Frames(const Scene& scene) : scene_(scene) {}

  size_t size() const { return scene_.input.size(); }

  TsdfView operator()(size_t i, bool with_color) const {
    View view = loaded(i, with_color);
    const bool is_scaled = is_in_units_of_cameras(view);
    if (!is_scaled && !view.depth_states_metres && scene_.depth_kind != DepthKind::Metric) {
      throw BadInput(Defect::Unsupported,
                     view.depth_path,
                     "does not say that it measures metres; --depth-kind metric does, and cgs "
                     "train finds out what it is");
    }
    TsdfView out;
    out.camera = view.camera;
    out.color = std::move(view.image);
    out.usable = std::move(view.valid);
    out.depth = DepthMap(view.camera.width, view.camera.height, kNaN);
    out.sigma = out.depth;
    const double world_per_value =
        is_scaled ? scene_.world_per_stated_unit : 1 / scene_.frame.metres_per_unit;
    const double internal_per_value = world_per_value / scene_.frame.scale;
    for (int y = 0; y < out.depth.height; ++y) {
      for (int x = 0; x < out.depth.width; ++x) {
        const double z = double(view.given_depth(x, y)) * internal_per_value;
        if (!(z > 0) || is_at_depth_edge(view.given_depth, x, y)) continue;
        out.depth(x, y) = static_cast<float>(z);
        out.sigma(x, y) = static_cast<float>(relative_sigma_ * z);
      }
    }
    return out;
  }

  /// Of depth, where it is worse than that of a sensor. \param relative  may be NaN: nobody knows
  void expect(double relative) {
    if (relative > relative_sigma_) relative_sigma_ = relative;
  }

  size_t count_left_out() const { return left_out_.size(); }
  std::vector<std::string> warnings() const { return {warnings_.begin(), warnings_.end()}; }

 private:
  // One damaged file of many is no reason to lose the others.
  View loaded(size_t i, bool with_color) const {
    std::vector<std::string> warnings;
    View out;
    try {
      out = loaded_view(scene_, scene_.input[i], with_color, warnings);
    } catch (const BadInput& error) {
      count_damaged(i);
      // Its depth was taken before, where that is told without the photograph.
      if (with_color && is_whole(i, warnings, out)) {
        warnings.push_back("view " + printable(out.name) + " has no colours: " + words_of(error));
      } else {
        out = left_out(i);
        warnings.push_back("view " + printable(out.name) + " is left out: " + words_of(error));
      }
    }
    const std::lock_guard lock(mutex_);
    warnings_.insert(warnings.begin(), warnings.end());
    return out;
  }

  // \throws the error at hand if too many are
  void count_damaged(size_t i) const {
    constexpr size_t kOneIn = 10;
    const std::lock_guard lock(mutex_);
    damaged_.insert(i);
    if (damaged_.size() > size() / kOneIn) throw;
  }

  // Whether a frame has all but its colours.
  bool is_whole(size_t i, std::vector<std::string>& warnings, View& out) const {
    try {
      out = loaded_view(scene_, scene_.input[i], false, warnings);
      return true;
    } catch (const BadInput&) {
      return false;
    }
  }

  View left_out(size_t i) const {
    {
      const std::lock_guard lock(mutex_);
      left_out_.insert(i);
    }
    View out = scene_.views[static_cast<size_t>(scene_.input[i])];
    out.given_depth = DepthMap(out.camera.width, out.camera.height, kNaN);
    out.depth_states_metres = true;
    return out;
  }

  const Scene& scene_;
  double relative_sigma_ = kSensorSigma;
  mutable std::mutex mutex_;
  mutable std::set<std::string> warnings_;  // in an order that no thread decides
  mutable std::set<size_t> damaged_;
  mutable std::set<size_t> left_out_;  // of these; the others lack their colours
};

std::string percent(double part) { return std::to_string(std::lround(100 * part)) + " %"; }

// What to say where frames do not agree, or only as depth of another unit would.
std::string disagreement_words(const DepthAgreement& agreement, const Frame& frame) {
  std::string out = std::isnan(agreement.off)
                        ? "no two frames show the same, as they are placed"
                        : "frames disagree by " + percent(agreement.off) + " of the depth (median)";
  if (!std::isnan(agreement.best_factor) && agreement.best_factor != 1) {
    out += "; they agree better where a unit of the cameras is " +
           number(frame.metres_per_unit / agreement.best_factor, "%.3g") + " m";
  }
  return out +
         ": are the cameras in metres (--assume-unit), the depth in millimetres (--depth-scale)?";
}

// Depth in units of the cameras has no scale to find: it fits as it is, or is of other cameras.
void judge_fit(const DepthAgreement& agreement,
               const Scene& scene,
               std::vector<std::string>& warnings) {
  constexpr double kMost = 0.05;
  if (std::isnan(agreement.off)) {
    warnings.emplace_back("no two frames show the same, as they are placed");
    return;
  }
  if (agreement.off <= kMost) return;
  throw BadInput(Defect::Mismatch,
                 scene.folder,
                 "frames disagree by " + percent(agreement.off) +
                     " of the depth (median): were these depth maps made with these cameras?");
}

// A scale that only the depth tells has to be seen in it.
// \param is_said  somebody said that the values are metres
void judge_scale(const DepthAgreement& agreement,
                 const Scene& scene,
                 bool is_said,
                 Frame& frame,
                 std::vector<std::string>& warnings) {
  constexpr double kMost = 0.05;
  const bool is_assumed = frame.scale_source == ScaleSource::DepthSensor;
  const bool fits =
      agreement.off <= kMost && agreement.best_factor >= 0.9 && agreement.best_factor <= 1.1;
  const bool fits_other = !std::isnan(agreement.best_factor) && agreement.best_factor != 1;
  const bool is_refuted = !std::isnan(agreement.off) || fits_other;
  if (is_assumed && !is_said && !fits && is_refuted) {
    throw BadInput(Defect::Mismatch,
                   scene.folder,
                   disagreement_words(agreement, frame) + " --depth-kind metric takes it as it is");
  }
  if (!fits && (is_assumed || agreement.off > kMost)) {
    warnings.push_back(disagreement_words(agreement, frame));
  }
  if (fits && is_assumed && !agreement.shows_scale) {
    warnings.push_back(
        "frames agree with cameras of any unit, as these hardly move or see little but a plane; "
        "no scale is stated, but metres were taken: --assume-unit m states them");
  }
  if (!is_assumed) return;
  const bool is_known = fits && agreement.shows_scale;
  frame.metres_per_unit = is_known ? 1 : 0;
  frame.metres_sigma = is_known ? std::max(kFinestFactor, std::abs(agreement.best_factor - 1)) : 0;
  if (!is_known) frame.scale_source = ScaleSource::Unknown;
}

}  // namespace

DepthFusion fuse_depth(const DepthFusionRequest& request, const Progress& progress) {
  SceneOptions options = request.options;
  options.all_views = true;
  if (!options.downscale) options.downscale = 1;
  Scene scene = read_scene(request.scene, options);
  keep_measured(scene);
  refuse_other_kinds(scene);
  if (!request.options.downscale) take_size_of_depth(scene);
  settle_scale(scene, request.assume_unit);
  scene.frame.up = up_of(scene, request.up);
  to_canonical(scene);

  Frames frames(scene);
  std::vector<Camera> cameras;
  for (const int i : scene.input) cameras.push_back(scene.views[static_cast<size_t>(i)].camera);
  const DepthAgreement agreement =
      depth_agreement(cameras, [&](size_t i) { return frames(i, false); });
  DepthFusion out;
  out.frames = frames.size();
  out.disagreement = agreement.off;
  out.frame = scene.frame;
  out.warnings = scene.warnings;
  out.notes = scene.notes;
  const DepthOptions& depth = request.options.depth;
  const bool is_said = depth.kind == DepthKind::Metric || depth.scale != 0;
  if (tells_metres(scene)) {
    judge_scale(agreement, scene, is_said, out.frame, out.warnings);
  } else {
    judge_fit(agreement, scene, out.warnings);
    frames.expect(agreement.off);  // no sensor measured it
  }
  TsdfOptions fusing;
  if (!request.voxel_size.empty()) {
    fusing.voxel_size = parse_length(request.voxel_size, scene.frame, "--voxel-size");
  }
  fusing.memory_limit = memory_budget(request.memory_limit);
  fusing.common_sigma = kCommonSensorSigma;
  const TsdfSource source = {frames.size(), std::cref(frames)};
  out.fused = fuse_streamed(source, fusing, progress);
  out.frames -= frames.count_left_out();
  const std::vector<std::string> odd = frames.warnings();
  out.warnings.insert(out.warnings.end(), odd.begin(), odd.end());
  return out;
}

}  // namespace cgs
