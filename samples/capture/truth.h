// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <vector>

#include "libcgs/core/camera.h"
#include "samples/capture/portal.h"

namespace cgs {

/// A camera of the capture.
struct CaptureView {
  std::string name;    ///< "view_01" …
  bool input = false;  ///< Else held out for evaluation.
  Camera camera;
  uint32_t seed = 0;  ///< Of the sensor noise of its picture.
};

/// A camera that stands at `eye` and looks at `target`, both in the world [m], without roll.
///
/// \param downscale  pictures are 504 / downscale pixels wide; a divisor of 126
/// \throws InvalidInput for another downscale
Camera capture_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int downscale);

/// The views of the capture in the order of their names: three inputs, then five held out (two
/// between the inputs, two beyond them, one nearer and higher).
///
/// \param downscale  pictures are 504 / downscale pixels wide; a divisor of 126
/// \throws InvalidInput for another downscale
std::vector<CaptureView> capture_views(int downscale = 1);

/// The cameras of the input views.
std::vector<Camera> input_cameras(const std::vector<CaptureView>& views);

/// What is known of a view, at the pixel centres, by casting rays against the mesh.
struct ViewTruth {
  DepthMap depth;        ///< z-depth [m].
  NormalMap normal;      ///< Of the face, in world axes, towards the camera.
  Raster<uint8_t> seen;  ///< Number of input views that see the surface point.
};
ViewTruth view_truth(const PortalScene& scene,
                     const Camera& camera,
                     std::span<const Camera> inputs);

/// z-depth at the pixel centres [m]; NaN where a ray leaves the scene.
DepthMap exact_depth(const PortalScene& scene, const Camera& camera);

/// 255 where a ray through the pixel centre meets that part of the scene first, else 0.
Raster<uint8_t> part_mask(const PortalScene& scene, const Camera& camera, size_t part);

/// Number of cameras that have a point of the surface in their picture with nothing before it.
/// A distance that differs by less than one part in ten million counts as the point itself.
int seen_by(const Bvh& bvh, const Eigen::Vector3d& point_in_world, std::span<const Camera> cameras);

}  // namespace cgs
