// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/model/model_fusion.h"

#include <cmath>
#include <limits>
#include <utility>

#include "libcgs/priors/estimated_depth.h"
#include "libcgs/render/picture.h"

namespace cgs {

namespace {

// Depth as fusion takes it: none where estimated surface is not wanted, infinite at sky and around
// an object that stands alone.
void settle_depth(const ViewPriors& priors, EstimatedSurface wanted, TsdfView& view) {
  const MaskMap framed =
      wanted == EstimatedSurface::FillOnly ? framed_estimates(priors) : MaskMap();
  for (size_t i = 0; i < view.depth.data.size(); ++i) {
    const DepthEvidence evidence = view.evidence.data[i];
    const bool is_wanted = wanted == EstimatedSurface::Keep ||
                           (wanted == EstimatedSurface::FillOnly && framed.data[i] != 0);
    const bool is_background = priors.origin.data[i] == DepthOrigin::Background;
    if (evidence == DepthEvidence::Sky || is_background) {
      view.depth.data[i] = std::numeric_limits<float>::infinity();
      view.sigma.data[i] = std::nanf("");
    } else if (evidence == DepthEvidence::Estimated && !is_wanted) {
      view.depth.data[i] = view.sigma.data[i] = std::nanf("");
    }
  }
}

}  // namespace

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
  options.voxel_size = request.voxel_size;
  options.coarsest_voxel = request.coarsest_voxel;
  options.max_voxels = request.max_voxels;
  options.memory_limit = request.memory_limit;
  return fuse(views, options, progress);
}

}  // namespace cgs
