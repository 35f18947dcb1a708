// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_view.h"

#include <cmath>

#include "libcgs/core/photo_response.h"
#include "libcgs/train/training_inputs.h"

namespace cgs {

namespace {

template <typename T>
Raster<T> every_other(const Raster<T>& in) {
  if (in.empty()) return in;
  Raster<T> out(in.width / 2, in.height / 2, T{});
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = in(2 * x, 2 * y);
  }
  return out;
}

// Where all four pixels may be used, of which halved() takes the mean.
MaskMap all_usable(const MaskMap& in) {
  if (in.empty()) return in;
  MaskMap out(in.width / 2, in.height / 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const auto is_set = [&](int dx, int dy) { return in(2 * x + dx, 2 * y + dy) != 0; };
      out(x, y) = is_set(0, 0) && is_set(1, 0) && is_set(0, 1) && is_set(1, 1) ? 1 : 0;
    }
  }
  return out;
}

Camera halved(const Camera& camera) {
  Camera out = camera;
  out.width /= 2;
  out.height /= 2;
  out.fx /= 2;
  out.fy /= 2;
  out.cx /= 2;
  out.cy /= 2;
  return out;
}

}  // namespace

TrainingView training_view(const View& view, const ViewPriors& priors) {
  const DepthMap unknown(priors.depth.width, priors.depth.height, std::nanf(""));
  const bool is_grey = view.response.is_grey;
  TrainingView out{view.camera,
                   planes_of(is_grey ? in_grey(view.image) : view.image),
                   is_grey,
                   view.valid,
                   priors.layer,
                   unknown,
                   priors.sigma};
  for (size_t i = 0; i < priors.origin.data.size(); ++i) {
    if (priors.origin.data[i] != DepthOrigin::Measured) continue;
    out.measured.data[i] = priors.depth.data[i];
  }
  return out;
}

TrainingView halved(const TrainingView& view) {
  TrainingView out{halved(view.camera),
                   {},
                   view.is_grey,
                   all_usable(view.use),
                   every_other(view.layer),
                   every_other(view.measured),
                   every_other(view.sigma)};
  for (int c = 0; c < 3; ++c) out.photograph[c] = halved(view.photograph[c]);
  return out;
}

Raster<float> spread(const Raster<float>& gradient) {
  if (gradient.empty()) return {};
  Raster<float> out(gradient.width * 2, gradient.height * 2, 0);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) out(x, y) = 0.25f * gradient(x / 2, y / 2);
  }
  return out;
}

}  // namespace cgs
