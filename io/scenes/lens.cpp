// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/lens.h"

#include "io/scenes/orientation.h"
#include "io/scenes/resample.h"

namespace cgs {

namespace {

FisheyeMap fisheye_map(const View& view) {
  const ImageSize size = photograph_size(view);
  return FisheyeMap(*view.fisheye).resized(size.width, size.height);
}

}  // namespace

bool has_lens_distortion(const View& view) {
  return view.fisheye || view.distortion != std::array<double, 5>{};
}

Camera picture_camera(const View& view) {
  if (!view.fisheye) {
    const ImageSize size = photograph_size(view);
    return resized(view.camera, size.width, size.height);
  }
  Camera out = fisheye_map(view).picture();
  out.world_from_cam = view.camera.world_from_cam;
  return out;
}

LensMap::LensMap(const View& view, const Camera& camera)
    : camera_(camera), distortion_(view.distortion) {
  if (view.fisheye) fisheye_ = fisheye_map(view);
}

std::optional<PicturePoint> LensMap::operator()(const Eigen::Vector2d& in_photograph) const {
  if (fisheye_) return fisheye_->in_picture(in_photograph);
  const Eigen::Vector2d at = undistorted(in_photograph, camera_, distortion_);
  if (!is_undone(in_photograph, at, camera_, distortion_)) return std::nullopt;
  return PicturePoint{at};
}

std::optional<Eigen::Vector2d> LensMap::in_photograph(const Eigen::Vector2d& in_picture) const {
  const Eigen::Vector2d out =
      fisheye_ ? fisheye_->in_photograph(in_picture) : distorted(in_picture, camera_, distortion_);
  if (!out.allFinite()) return std::nullopt;
  return out;
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
