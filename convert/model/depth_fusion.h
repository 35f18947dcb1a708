// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/scenes/scene_reader.h"
#include "libcgs/core/progress.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

/// Depth frames to fuse as they were measured.
struct DepthFusionRequest {
  std::filesystem::path scene;
  SceneOptions options;     ///< Without a downscale the size of the depth files is worked on.
  std::string assume_unit;  ///< Of the cameras, where the scene does not say; empty = metres.
  std::vector<double> up;   ///< World direction that is up; empty = judged by the cameras.
  std::string voxel_size;   ///< As in RunRequest.
  size_t memory_limit = 0;  ///< [bytes]; 0 = 80 % of what is free.
};

struct DepthFusion {
  FusedVolume fused;
  Frame frame;
  size_t frames = 0;                  ///< Fused.
  double disagreement = 0;            ///< Median, relative, of depth between frames; NaN = unknown.
  std::vector<std::string> warnings;  ///< One line each.
  std::vector<std::string> notes;     ///< Scene::notes
};

/// Fuses the depth files of a scene, which measure metres, without any reconstruction.
///
/// A frame is decoded when it is needed and forgotten: memory follows the surface, not the number
/// of frames. Its depth counts as in training: as measured, with a standard deviation of
/// kSensorSigma of it; masked pixels and those at jumps of depth are left out. A frame counts as
/// one view: what two or more frames measured is observed, what one measured, single view.
/// \throws BadInput Missing (no depth files), Unsupported (their values are not metres);
///         InvalidInput; LimitError; and as read_scene(), load_images() and fuse()
DepthFusion fuse_depth(const DepthFusionRequest& request, const Progress& progress);

}  // namespace cgs
