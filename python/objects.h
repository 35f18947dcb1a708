// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/measurable_mesh.h"
#include "libcgs/reconstruct/reconstruct.h"
#include "libcgs/render/render_buffers.h"
#include "meshing/mesh/certificate.h"
#include "meshing/volume/tsdf_report.h"
#include "meshing/volume/volume.h"

// What Python's objects hold.

namespace cgs {

/// A mesh, or points where it has no faces; its file_origin is zero, so that places that operations
/// are told are those of the world.
struct MeshObject {
  MeasurableMesh content;
  std::optional<Certificate> certificate;  ///< Where closing it gave one.
};

/// \param mesh  in `frame` [internal units]
MeshObject mesh_object(TriangleMesh mesh, const Frame& frame);

struct SplatsObject {
  Gaussians gaussians;
  Frame frame;
  std::string evidence;
};

struct VolumeObject {
  Volume volume;
  Frame frame;
};

struct ModelObject {
  Model model;
  std::vector<std::string> coverage;  ///< coverage_words(), where it was made here
};

/// What was rendered, and what is made of it when it is asked for.
struct PictureObject {
  RenderBuffers buffers;
  ColorImage color;
  DepthMap depth;  ///< As in files: of the surface, NaN in sky [world units].
  NormalMap normal;
  std::optional<ColorImage> filled;
};

/// \param camera      in `frame` [internal units]
/// \param background  of picture()
PictureObject picture_object(RenderBuffers buffers,
                             const Camera& camera,
                             const Frame& frame,
                             const Eigen::Vector3f& background = Eigen::Vector3f::Zero());

}  // namespace cgs
