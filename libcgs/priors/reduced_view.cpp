// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/reduced_view.h"

#include <algorithm>

namespace cgs {

int reduction_to(int wanted, int longest) { return std::max(1, (longest + wanted / 2) / wanted); }

View reduced_view(const View& view, int factor) {
  View out = view;
  out.camera.width = view.camera.width / factor;
  out.camera.height = view.camera.height / factor;
  out.camera.fx /= factor;
  out.camera.fy /= factor;
  out.camera.cx /= factor;
  out.camera.cy /= factor;
  const float share = 1.0f / static_cast<float>(factor * factor);
  out.image = ColorImage(out.camera.width, out.camera.height, Eigen::Vector3f::Zero());
  if (!view.valid.empty()) out.valid = MaskMap(out.camera.width, out.camera.height, 1);
  for (int y = 0; y < out.camera.height * factor; ++y) {
    for (int x = 0; x < out.camera.width * factor; ++x) {
      out.image(x / factor, y / factor) += share * view.image(x, y);
      if (!view.valid.empty()) out.valid(x / factor, y / factor) &= view.valid(x, y);
    }
  }
  return out;
}

Scene reduced_inputs(const Scene& scene, int factor) {
  Scene out;
  out.folder = scene.folder;
  out.frame = scene.frame;
  out.points = scene.points;
  for (size_t k = 0; k < scene.input.size(); ++k) {
    out.views.push_back(reduced_view(scene.views[static_cast<size_t>(scene.input[k])], factor));
    out.input.push_back(static_cast<int>(k));
  }
  return out;
}

}  // namespace cgs
