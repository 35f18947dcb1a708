// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/fusion.h"

#include <cmath>
#include <limits>
#include <utility>

#include "convert/model/memory_plan.h"
#include "convert/model/views.h"
#include "convert/text/length.h"
#include "libcgs/priors/estimated_depth.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Depth as fusion takes it: none where estimated surface is not wanted, infinite at sky.
void settle_depth(const ViewPriors& priors, EstimatedSurface wanted, TsdfView& view) {
  const MaskMap framed =
      wanted == EstimatedSurface::FillOnly ? framed_estimates(priors) : MaskMap();
  for (size_t i = 0; i < view.depth.data.size(); ++i) {
    const DepthEvidence evidence = view.evidence.data[i];
    const bool is_wanted = wanted == EstimatedSurface::Keep ||
                           (wanted == EstimatedSurface::FillOnly && framed.data[i] != 0);
    if (evidence == DepthEvidence::Sky) {
      view.depth.data[i] = std::numeric_limits<float>::infinity();
      view.sigma.data[i] = std::nanf("");
    } else if (evidence == DepthEvidence::Estimated && !is_wanted) {
      view.depth.data[i] = view.sigma.data[i] = std::nanf("");
    }
  }
}

}  // namespace

std::map<std::string, EstimatedSurface> estimated_surfaces() {
  return {{"keep", EstimatedSurface::Keep},
          {"fill-only", EstimatedSurface::FillOnly},
          {"drop", EstimatedSurface::Drop}};
}

FusedVolume fuse_model(const Model& model, const ModelFusion& request, const Progress& progress) {
  std::vector<TsdfView> views;
  const std::vector<SupportView> inputs = support_views(model);
  for (size_t k = 0; k < model.scene.input.size(); ++k) {
    const Camera& camera = model.scene.views[static_cast<size_t>(model.scene.input[k])].camera;
    const RenderBuffers buffers = render_camera(model, inputs, camera);
    TsdfView view;
    view.camera = camera;
    view.depth = model.priors[k].depth;
    view.sigma = model.priors[k].sigma;
    view.evidence = inputs[k].evidence;
    view.color = picture(buffers);
    settle_depth(model.priors[k], request.estimated, view);
    views.push_back(std::move(view));
  }
  TsdfOptions options;
  options.coarsest_voxel = request.coarsest_voxel;
  if (!request.voxel_size.empty()) {
    options.voxel_size = parse_length(request.voxel_size, model.scene.frame);
  }
  options.memory_limit = memory_budget(request.memory_limit);
  return fuse(views, options, progress);
}

Json fusion_to_json(const TsdfReport& report, const Frame& frame) {
  const auto corner = [&](const Eigen::Vector3d& p) -> Json {
    const Eigen::Vector3d q = frame.file_from_internal(p);
    return {q.x(), q.y(), q.z()};
  };
  return {{"voxel_size", report.voxel_size * frame.scale},
          {"units", frame.unit_name()},
          {"bounds", {corner(report.bounds.min()), corner(report.bounds.max())}},
          {"voxels",
           {{"free", report.free},
            {"occupied", report.occupied},
            {"estimated", report.estimated},
            {"never_seen_hidden", report.hidden},
            {"never_seen_outside", report.unseen},
            {"conflicts", report.conflicts},
            {"carved", report.carved}}},
          {"predicted_bytes", report.predicted_bytes},
          {"actual_bytes", report.actual_bytes}};
}

}  // namespace cgs
