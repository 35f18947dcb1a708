// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/initialisation.h"

#include "libcgs/core/error.h"

namespace cgs {

namespace {

float starting_opacity(size_t views, const InitialisationOptions& options) {
  if (options.opacity > 0) return options.opacity;
  if (views <= 2) return 0.6f;
  return views == 3 ? 0.5f : 0.35f;
}

void require_same_sizes(const View& view, const ViewPriors& priors) {
  const Camera& c = view.camera;
  const auto fits = [&](const auto& raster) {
    return raster.width == c.width && raster.height == c.height;
  };
  require(fits(priors.depth) && fits(view.image),
          "image and depth of an input view must be of its camera's size",
          view.name);
}

// \pre the pixel has a depth
Provenance label_of(const ViewPriors& priors, size_t pixel) {
  const DepthEvidence evidence = depth_evidence(priors.origin.data[pixel]);
  if (evidence == DepthEvidence::Adjoining) return Provenance::SingleView;
  if (evidence != DepthEvidence::Measured) return Provenance::Estimated;
  const bool is_matched = priors.matched_views.data[pixel] > 0;
  return is_matched ? Provenance::Observed : Provenance::SingleView;
}

// In the order of the Gaussians; empty where the priors of a view do not say how they know.
std::vector<Provenance> labels_of(const std::vector<ViewPriors>& priors) {
  std::vector<Provenance> out;
  for (const ViewPriors& p : priors) {
    const std::vector<float>& depth = p.depth.data;
    if (p.origin.data.size() != depth.size() || p.matched_views.data.size() != depth.size()) {
      return {};
    }
    for (size_t i = 0; i < depth.size(); ++i) {
      if (draws(p, i)) out.push_back(label_of(p, i));
    }
  }
  return out;
}

}  // namespace

void InitialisationOptions::validate() const {
  require(radius_factor > 0, "InitialisationOptions.radius_factor must be > 0", radius_factor);
  require(opacity >= 0 && opacity < 1, "InitialisationOptions.opacity must be in [0, 1)", opacity);
}

Gaussians initial_gaussians(const Scene& scene,
                            const std::vector<ViewPriors>& priors,
                            const InitialisationOptions& options) {
  options.validate();
  require(
      priors.size() == scene.input.size(), "there must be priors per input view", priors.size());
  Gaussians out;
  const float opacity = starting_opacity(priors.size(), options);
  for (size_t n = 0; n < priors.size(); ++n) {
    const View& view = scene.views[static_cast<size_t>(scene.input[n])];
    require_same_sizes(view, priors[n]);
    const DepthMap& depth = priors[n].depth;
    const double pixel = view.camera.pixel_size(1);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        const auto z = static_cast<double>(depth(x, y));
        if (!draws(priors[n], depth.index(x, y))) continue;
        const auto radius = static_cast<float>(double(options.radius_factor) * z * pixel);
        out.position.push_back(view.camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
        out.scale.push_back(Eigen::Vector3f::Constant(radius));
        out.rotation.emplace_back(1.0f, 0.0f, 0.0f, 0.0f);
        out.opacity.push_back(opacity);
        out.sh.push_back((view.image(x, y) - Eigen::Vector3f::Constant(0.5f)) / kShC0);
      }
    }
  }
  out.provenance = labels_of(priors);
  return out;
}

}  // namespace cgs
