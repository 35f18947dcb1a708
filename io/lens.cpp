// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/lens.h"

#include "io/orientation.h"
#include "io/resample.h"

namespace cgs {

Camera picture_camera(const View& view) {
  if (!view.fisheye) {
    const ImageSize size = photograph_size(view);
    return resized(view.camera, size.width, size.height);
  }
  Camera out = FisheyeMap(*view.fisheye).picture();
  out.world_from_cam = view.camera.world_from_cam;
  return out;
}

LensMap::LensMap(const View& view, const Camera& camera)
    : camera_(camera), distortion_(view.distortion) {
  if (view.fisheye) fisheye_.emplace(*view.fisheye);
}

std::optional<PicturePoint> LensMap::operator()(const Eigen::Vector2d& in_photograph) const {
  if (fisheye_) return fisheye_->in_picture(in_photograph);
  const Eigen::Vector2d at = undistorted(in_photograph, camera_, distortion_);
  if (!is_undone(in_photograph, at, camera_, distortion_)) return std::nullopt;
  return PicturePoint{at};
}

std::vector<double> lens_numbers(const View& view) {
  std::vector<double> out(view.distortion.begin(), view.distortion.end());
  if (!view.fisheye) return out;
  const Camera& c = view.fisheye->photograph;
  for (const double value : {double(c.width), double(c.height), c.fx, c.fy, c.cx, c.cy}) {
    out.push_back(value);
  }
  out.insert(out.end(), view.fisheye->k.begin(), view.fisheye->k.end());
  out.insert(out.end(), view.fisheye->p.begin(), view.fisheye->p.end());
  out.push_back(view.fisheye->radius);
  return out;
}

}  // namespace cgs
