// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/model.h"

#include <algorithm>

#include "libcgs/render/rasterizer.h"

namespace cgs {

EvidenceMap evidence_of(const ViewPriors& priors) {
  EvidenceMap out(priors.origin.width, priors.origin.height, DepthEvidence::Measured);
  std::transform(
      priors.origin.data.begin(), priors.origin.data.end(), out.data.begin(), depth_evidence);
  return out;
}

std::vector<SupportView> support_views(const Model& model) {
  std::vector<SupportView> views;
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
    const ViewPriors& priors = model.priors[k];
    views.push_back({view.camera, priors.depth, priors.sigma, evidence_of(priors)});
  }
  return views;
}

RenderBuffers render_camera(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const Camera& camera) {
  RenderBuffers buffers = rasterize(model.gaussians, camera);
  annotate_support(buffers, camera, inputs);
  return buffers;
}

}  // namespace cgs
