// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/depth_fusion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>

#include "convert/length.h"
#include "convert/memory_plan.h"
#include "convert/model.h"
#include "convert/stated_frame.h"
#include "io/depth_file.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/given_depth.h"

namespace cgs {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

View& first_input(Scene& scene) { return scene.views[static_cast<size_t>(scene.input.front())]; }

// Leaves the views that have depth.
void keep_measured(Scene& scene) {
  std::erase_if(scene.input,
                [&](int i) { return scene.views[static_cast<size_t>(i)].depth_path.empty(); });
  if (!scene.input.empty()) return;
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

// Works at the size of the depth, since a larger picture has nothing to add but time.
void take_size_of_depth(Scene& scene) {
  const Raster<float> values = read_depth_file(first_input(scene).depth_path).values;
  const Camera& camera = first_input(scene).camera;
  const int factor = std::max(camera.width, camera.height) / std::max(values.width, values.height);
  if (factor < 2) return;
  for (View& view : scene.views) {
    view.camera = resized(view.camera, view.camera.width / factor, view.camera.height / factor);
  }
}

// Cameras with depth in metres are taken to be in metres unless something else is said.
void settle_scale(Scene& scene, const std::string& unit) {
  if (!unit.empty()) {
    const std::string refused = assume_unit(scene.frame, unit);
    if (!refused.empty()) scene.warnings.push_back(refused);
  }
  if (scene.frame.has_metric_scale()) return;
  scene.frame.metres_per_unit = 1;
  scene.frame.metres_sigma = kSensorSigma;
  scene.frame.scale_source = ScaleSource::DepthSensor;
}

// The frames of a scene in its canonical frame.
class Frames {
 public:
  explicit Frames(const Scene& scene) : scene_(scene) {}

  size_t size() const { return scene_.input.size(); }

  TsdfView operator()(size_t i, bool with_color) const {
    std::vector<std::string> warnings;
    View view = loaded_view(scene_, scene_.input[i], with_color, warnings);
    if (!warnings.empty()) {
      const std::lock_guard lock(mutex_);
      warnings_.insert(warnings.begin(), warnings.end());
    }
    if (!view.depth_states_metres && scene_.depth_kind != DepthKind::Metric) {
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
    const double internal_per_metre = 1 / (scene_.frame.metres_per_unit * scene_.frame.scale);
    for (int y = 0; y < out.depth.height; ++y) {
      for (int x = 0; x < out.depth.width; ++x) {
        const double z = double(view.given_depth(x, y)) * internal_per_metre;
        if (!(z > 0) || is_at_depth_edge(view.given_depth, x, y)) continue;
        out.depth(x, y) = static_cast<float>(z);
        out.sigma(x, y) = static_cast<float>(kSensorSigma * z);
      }
    }
    return out;
  }

  std::vector<std::string> warnings() const { return {warnings_.begin(), warnings_.end()}; }

 private:
  const Scene& scene_;
  mutable std::mutex mutex_;
  mutable std::set<std::string> warnings_;  // in an order that no thread decides
};

// The frame that shows much of what another does, from as far off as possible; itself if none does.
size_t partner_of(const Scene& scene, size_t i) {
  constexpr double kSameDirection = 0.5;  // cosine
  const auto camera = [&](size_t k) -> const Camera& {
    return scene.views[static_cast<size_t>(scene.input[k])].camera;
  };
  const Eigen::Vector3d axis = camera(i).world_from_cam.linear().col(2);
  size_t best = i;
  for (size_t k = 0; k < scene.input.size(); ++k) {
    if (axis.dot(camera(k).world_from_cam.linear().col(2)) < kSameDirection) continue;
    const auto off = [&](size_t j) { return (camera(j).center() - camera(i).center()).norm(); };
    if (off(k) > off(best)) best = k;
  }
  return best;
}

// How far the depth of some frames is from what others measured there; the median of some pixels.
double disagreement(const Scene& scene, const Frames& frames) {
  constexpr size_t kPairs = 8;
  constexpr int kStep = 7;
  std::vector<double> off;
  const size_t count = std::min(kPairs, frames.size());
  for (size_t n = 0; n < count; ++n) {
    const size_t i = n * frames.size() / count;
    const size_t k = partner_of(scene, i);
    if (k == i) continue;
    const TsdfView from = frames(i, false);
    const TsdfView to = frames(k, false);
    for (int y = 0; y < from.depth.height; y += kStep) {
      for (int x = 0; x < from.depth.width; x += kStep) {
        if (!(from.depth(x, y) > 0)) continue;
        const Eigen::Vector3d uvz =
            to.camera.project(from.camera.unproject(x + 0.5, y + 0.5, double(from.depth(x, y))));
        if (!to.camera.sees(uvz)) continue;
        const float measured = to.depth(int(uvz.x()), int(uvz.y()));
        if (measured > 0) off.push_back(std::abs(double(measured) / uvz.z() - 1));
      }
    }
  }
  if (off.empty()) return double(kNaN);
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return *middle;
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
  const Eigen::Vector3d up = request.up.empty() ? world_up(scene) : up_direction(request.up);
  to_canonical(scene);
  scene.frame.up = up;

  const Frames frames(scene);
  DepthFusion out;
  out.frames = frames.size();
  out.disagreement = disagreement(scene, frames);
  TsdfOptions fusing;
  if (!request.voxel_size.empty()) {
    fusing.voxel_size = parse_length(request.voxel_size, scene.frame);
  }
  fusing.memory_limit = memory_budget(request.memory_limit);
  const TsdfSource source = {frames.size(), std::cref(frames)};
  out.fused = fuse_streamed(source, fusing, progress);
  out.warnings = scene.warnings;
  const std::vector<std::string> odd = frames.warnings();
  out.warnings.insert(out.warnings.end(), odd.begin(), odd.end());
  constexpr double kAgrees = 0.05;
  if (out.disagreement > kAgrees) {
    // Nobody said that the cameras are in metres, and it does not look so.
    if (scene.frame.scale_source == ScaleSource::DepthSensor) scene.frame.metres_per_unit = 0;
    out.warnings.push_back(
        "frames disagree by " + std::to_string(std::lround(100 * out.disagreement)) +
        " % of the depth (median): are the cameras in metres (--assume-unit), the depth in "
        "millimetres (--depth-scale)?");
  }
  out.frame = scene.frame;
  return out;
}

}  // namespace cgs
