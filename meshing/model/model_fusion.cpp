// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/model/model_fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "libcgs/core/error.h"
#include "libcgs/priors/estimated_depth.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

// 1 where estimated surface is wanted.
MaskMap wanted_estimates(const ViewPriors& priors, EstimatedSurface wanted) {
  const auto& origin = priors.origin;
  const bool is_kept = wanted == EstimatedSurface::Keep;
  if (wanted != EstimatedSurface::FillOnly) return MaskMap(origin.width, origin.height, is_kept);
  MaskMap out = framed_estimates(priors);
  for (size_t i = 0; i < out.data.size(); ++i) {
    if (origin.data[i] == DepthOrigin::Continued) out.data[i] = 1;
  }
  return out;
}

// Depth as fusion takes it: none where estimated surface is not wanted, infinite at sky and around
// an object that stands alone.
void settle_depth(const ViewPriors& priors, EstimatedSurface wanted, TsdfView& view) {
  const MaskMap is_wanted = wanted_estimates(priors, wanted);
  for (size_t i = 0; i < view.depth.data.size(); ++i) {
    const DepthEvidence evidence = view.evidence.data[i];
    const bool is_background = priors.origin.data[i] == DepthOrigin::Background;
    if (evidence == DepthEvidence::Sky || is_background) {
      view.depth.data[i] = std::numeric_limits<float>::infinity();
      view.sigma.data[i] = std::nanf("");
    } else if (evidence == DepthEvidence::Estimated && is_wanted.data[i] == 0) {
      view.depth.data[i] = view.sigma.data[i] = std::nanf("");
    }
  }
}

// What an input view of a model sees.
TsdfView seen_by_input(const Model& model, size_t k, EstimatedSurface estimated, bool with_color) {
  TsdfView view;
  view.camera = input_camera(model, k);
  view.depth = model.priors[k].depth;
  view.sigma = model.priors[k].sigma;
  view.evidence = evidence_of(model.priors[k]);
  if (with_color) view.color = picture(rasterize(model.gaussians, view.camera));
  settle_depth(model.priors[k], estimated, view);
  return view;
}

TsdfOptions tsdf_options(const ModelFusion& request) {
  TsdfOptions options;
  options.voxel_size = request.voxel_size;
  options.coarsest_voxel = request.coarsest_voxel;
  options.max_voxels = request.max_voxels;
  options.memory_limit = request.memory_limit;
  return options;
}

// An input view of one of several models.
struct Witness {
  size_t model = 0;
  size_t input = 0;  // position in its scene.input
  std::string name;
  Eigen::Isometry3d world_from_cam;
  size_t measured = 0;  // pixels
  bool is_in_several = false;
};

size_t measured_pixels(const ViewPriors& priors) {
  const EvidenceMap evidence = evidence_of(priors);
  size_t out = 0;
  for (size_t i = 0; i < evidence.data.size(); ++i) {
    out += evidence.data[i] == DepthEvidence::Measured && std::isfinite(priors.depth.data[i]);
  }
  return out;
}

// Cameras of one photograph may have been refined apart.
bool is_same_photograph(const Witness& a, const Witness& b, double extent) {
  constexpr double kNear = 1e-2;
  if (a.name != b.name) return false;
  const double apart = (a.world_from_cam.translation() - b.world_from_cam.translation()).norm();
  const double turned =
      (a.world_from_cam.rotation() - b.world_from_cam.rotation()).norm() / std::sqrt(2.0);
  return apart < kNear * extent && turned < kNear;
}

// Keeps the one of each photograph that measured the most; the first of equals.
// \param extent  of what one model shows [world]
void keep_best_witnesses(std::vector<Witness>& witnesses, double extent) {
  std::vector<Witness> kept;
  for (Witness& witness : witnesses) {
    const auto same = std::find_if(kept.begin(), kept.end(), [&](const Witness& other) {
      return other.model != witness.model && is_same_photograph(other, witness, extent);
    });
    if (same == kept.end()) {
      kept.push_back(std::move(witness));
      continue;
    }
    if (witness.measured > same->measured) *same = std::move(witness);
    same->is_in_several = true;
  }
  std::stable_sort(kept.begin(), kept.end(), [](const Witness& a, const Witness& b) {
    return std::pair(a.model, a.input) < std::pair(b.model, b.input);
  });
  witnesses = std::move(kept);
}

void check_units(const Frame& first, const Frame& other, size_t model) {
  constexpr double kSame = 1e-6;
  const double allowed = kSame * first.metres_per_unit;
  if (std::abs(other.metres_per_unit - first.metres_per_unit) <= allowed) return;
  throw InvalidInput(
      "models that are fused together must be of one world: a unit of the first is " +
      first.unit_name() + ", of model " + std::to_string(model + 1) + " " + other.unit_name());
}

// Moves a view from the frame of its model into another. Scales are powers of two: depth keeps its
// bits.
void move_to_frame(const Frame& own, const Frame& wanted, TsdfView& view) {
  view.camera.world_from_cam =
      internal_from_world(wanted, world_from_internal(own, view.camera.world_from_cam));
  const auto factor = static_cast<float>(own.scale / wanted.scale);
  for (float& depth : view.depth.data) depth *= factor;
  for (float& sigma : view.sigma.data) sigma *= factor;
}

// Holds the models that were asked for last.
class ModelShelf {
 public:
  // \param source  not owned; must outlive this
  explicit ModelShelf(const ModelSource& source) : source_(source) {}

  struct Entry {
    size_t index = 0;
    std::shared_ptr<const Model> model;
  };

  std::shared_ptr<const Entry> operator()(size_t i) {
    const std::lock_guard lock(mutex_);
    for (const auto& held : held_) {
      if (held && held->index == i) return held;
    }
    std::swap(held_[0], held_[1]);
    held_[0].reset();  // before another is read
    auto entry = std::make_shared<Entry>();
    entry->index = i;
    entry->model = source_.model(i);
    held_[0] = std::move(entry);
    return held_[0];
  }

 private:
  const ModelSource& source_;
  std::mutex mutex_;
  std::array<std::shared_ptr<const Entry>, 2> held_;
};

}  // namespace

FusedVolume fuse_model(const Model& model, const ModelFusion& request, const Progress& progress) {
  size_t pixels = 0;
  for (const ViewPriors& priors : model.priors) pixels += priors.depth.data.size();
  check_view_memory(pixels, request.memory_limit);
  std::vector<TsdfView> views;
  for (size_t k = 0; k < model.scene.input.size(); ++k) {
    views.push_back(seen_by_input(model, k, request.estimated, true));
  }
  return fuse(views, tsdf_options(request), progress);
}

JoinedVolume fuse_models(const ModelSource& source,
                         const ModelFusion& request,
                         const Progress& progress) {
  require(source.count > 0, "fuse needs at least one model, their number", source.count);
  JoinedVolume out;
  ModelShelf shelf(source);
  std::vector<Witness> witnesses;
  for (size_t i = 0; i < source.count; ++i) {
    const auto held = shelf(i);
    const Model& model = *held->model;
    const Frame& frame = model.scene.frame;
    if (i == 0) out.frame = frame;
    check_units(out.frame, frame, i);
    for (size_t k = 0; k < model.scene.input.size(); ++k) {
      const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
      witnesses.push_back({i,
                           k,
                           view.name,
                           world_from_internal(frame, view.camera.world_from_cam),
                           measured_pixels(model.priors[k])});
    }
    report(progress, 0.1 * static_cast<double>(i + 1) / static_cast<double>(source.count));
  }
  keep_best_witnesses(witnesses, out.frame.scale);
  out.photographs = witnesses.size();
  out.in_several = static_cast<size_t>(std::count_if(
      witnesses.begin(), witnesses.end(), [](const Witness& w) { return w.is_in_several; }));
  const TsdfSource views = {witnesses.size(), [&](size_t i, bool with_color) {
                              const Witness& witness = witnesses[i];
                              const auto held = shelf(witness.model);
                              TsdfView view = seen_by_input(
                                  *held->model, witness.input, request.estimated, with_color);
                              move_to_frame(held->model->scene.frame, out.frame, view);
                              return view;
                            }};
  out.fused = fuse_streamed(views, tsdf_options(request), part_of(progress, 0.1, 1));
  return out;
}

}  // namespace cgs
