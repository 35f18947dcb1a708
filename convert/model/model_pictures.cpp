// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model_pictures.h"

#include <algorithm>
#include <string>
#include <vector>

#include "io/bytes/scene_path.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

// What input views leave out: what is masked, or, where the photograph is gone, all without depth.
double masked_share(const Model& model) {
  double masked = 0;
  double pixels = 0;
  const auto shows_nothing = [](DepthOrigin origin) {
    return origin == DepthOrigin::Unknown || origin == DepthOrigin::Background;
  };
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const int view = model.scene.input[k];
    const auto& origin = model.priors[k].origin.data;
    const bool is_there = is_present(model.scene.views[static_cast<size_t>(view)].image_path);
    const auto& valid = valid_pixels(model.scene, view).data;
    masked += double(is_there ? std::count(valid.begin(), valid.end(), uint8_t{0})
                              : std::count_if(origin.begin(), origin.end(), shows_nothing));
    pixels += double(origin.size());
  }
  return pixels > 0 ? masked / pixels : 1;
}

}  // namespace

const std::map<std::string, HoleFill>& hole_fills() {
  static const std::map<std::string, HoleFill> kNames = {{"around", HoleFill::Around},
                                                         {"none", HoleFill::None}};
  return kNames;
}

bool may_complete(const Model& model) {
  constexpr double kCutOut = 0.25;  // the rim that a wide lens leaves is half of that
  return masked_share(model) < kCutOut;
}

MaskMap valid_pixels(const Scene& scene, int view) {
  if (scene.views[static_cast<size_t>(view)].image_path.empty()) return {};
  std::vector<std::string> told_before;
  try {
    return loaded_view(scene, view, /*with_image=*/false, told_before).valid;
  } catch (const BadInput&) {
    return {};
  }
}

ModelPictures::ModelPictures(const Model& model, const PictureOptions& options)
    : model_(model),
      fill_(options.fill),
      is_completed_(options.fill == HoleFill::Around && may_complete(model)),
      water_(options.through_water ? model.scene.water : std::nullopt) {}

ColorImage ModelPictures::of(const RenderBuffers& buffers, const Camera& camera) const {
  ColorImage out = is_completed_ ? filled_picture(buffers) : picture(buffers);
  if (!water_) return out;
  // Open water was left as it is; without a surface nobody knows how much water there is.
  DepthMap depth = buffers.median_depth;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (buffers.hole.data[i] == Hole::Sky) depth.data[i] = 0;
  }
  return through_water(out, camera, depth, *water_);
}

PaintedPicture ModelPictures::painted(const RenderBuffers& buffers, const Camera& camera) const {
  if (fill_ == HoleFill::None || model_.fill.size() == 0) return {of(buffers, camera), {}};
  const RenderBuffers made_up = rasterize(model_.fill, camera);
  PaintedPicture out{of(with_fill(buffers, made_up), camera),
                     MaskMap(camera.width, camera.height, 0)};
  for (size_t i = 0; i < out.painted.data.size(); ++i) {
    out.painted.data[i] = shows_fill(buffers, made_up, i) ? 1 : 0;
  }
  return out;
}

}  // namespace cgs
