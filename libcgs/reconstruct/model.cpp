// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/model.h"

#include <algorithm>
#include <limits>
#include <span>

#include "libcgs/core/angle_between.h"
#include "libcgs/priors/sky.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

const Camera& input_camera(const Model& model, size_t input) {
  return model.scene.views[static_cast<size_t>(model.scene.input.at(input))].camera;
}

std::optional<Eigen::Vector3d> looked_at(const Model& model, size_t input) {
  const std::optional<float> depth = median_depth(std::span(&model.priors.at(input), 1));
  if (!depth) return std::nullopt;
  const Camera& camera = input_camera(model, input);
  return camera.unproject(0.5 * camera.width, 0.5 * camera.height, double{*depth});
}

Subjects subjects_of(const Model& model) {
  Subjects out;
  for (size_t k = 0; k < model.priors.size(); ++k) out.push_back(looked_at(model, k));
  return out;
}

std::optional<NearestInput> nearest_input(const Model& model,
                                          const Subjects& subjects,
                                          const Eigen::Vector3d& place) {
  std::optional<NearestInput> out;
  for (size_t k = 0; k < subjects.size(); ++k) {
    if (!subjects[k]) continue;
    const Eigen::Vector3d from = input_camera(model, k).center() - *subjects[k];
    const double angle = angle_between(from, place - *subjects[k]);
    if (angle < (out ? out->angle : std::numeric_limits<double>::infinity())) out = {k, angle};
  }
  return out;
}

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
    views.push_back({view.camera, priors.depth, priors.sigma, evidence_of(priors), {}});
    link_pixels(views.back());
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
