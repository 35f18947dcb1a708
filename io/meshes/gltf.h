// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/photo_texture.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How vertices and faces are stored in a binary glTF file.
enum class GlbEncoding {
  Plain,      ///< Floats; every reader takes them.
  Quantized,  ///< KHR_mesh_quantization: whole numbers of 16 bits, half the size; readers need no
              ///< decoder.
  Meshopt,    ///< EXT_meshopt_compression of Quantized: a fifth of the size, decoded fastest.
  Draco       ///< KHR_draco_mesh_compression: a tenth of the size.
};

/// Encodings by name, as users say them.
std::map<std::string, GlbEncoding> glb_encodings();

/// How a mesh becomes a binary glTF file.
struct GlbOptions {
  GlbEncoding encoding = GlbEncoding::Draco;  ///< Meshes smaller than 1e-6 [units of the file] are
                                              ///< stored plain where Draco is asked for, which
                                              ///< cannot hold them.
  double max_error = 0;  ///< Largest move of a vertex by Draco or Meshopt [world units]; 0 = extent
                         ///< / 2^14, else > extent / 2^21 (Draco) or extent / 2^16 (Meshopt).
                         ///< Quantized moves it by extent / 2^16 at most.
  int speed = 1;         ///< Of the encoder, 0 to 10 (fastest); files of 0 are no smaller.
  Eigen::Matrix3d y_up = Eigen::Matrix3d::Identity();  ///< World to glTF axes; y_up_from(up).
  std::optional<Eigen::Vector3d> center;  ///< What positions are stored relative to [internal
                                          ///< units]; default: the middle of the mesh.
  int jpeg_quality = 90;                  ///< Of textures, 1 to 100.
  std::string summary_json;               ///< JSON text for asset.extras.summary; may be empty.
  bool local_origin = false;              ///< As GlbPlace::has_local_origin.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// What was written, measured on the decoded content.
struct GlbReport {
  size_t bytes = 0;       ///< Of the file.
  size_t primitives = 0;  ///< One per provenance class and photograph that have faces.
  size_t vertices = 0;    ///< Of all primitives; borders between them count twice.
  size_t triangles = 0;
  size_t dropped_triangles = 0;    ///< Without area: two corners at one place.
  size_t collapsed_triangles = 0;  ///< Written, but without area once rounded: readers drop them.
  int position_bits = 0;           ///< Per coordinate; 0 = floats.
  double measured_max_error = 0;   ///< Largest distance of a decoded vertex [world units].
  size_t textured_triangles = 0;
  size_t texture_bytes = 0;           ///< Of all images.
  double measured_texture_error = 0;  ///< Largest move of a decoded texture coordinate [pixels].
};

/// Writes a mesh as .glb: +Y up, in metres where the scale is known, else in world units.
///
/// - One primitive and material per provenance class that is present ("observed", "single view",
///   "interpolated", "estimated", "inferred", or "surface" if the mesh has no labels), double-sided
///   and opaque; inferred surface is tinted magenta, interpolated surface orange, estimated surface
///   amber.
/// - POSITION is relative to options.center, and the translation of the node, in double, leads from
///   there to where GlbPlace has the mesh. asset.extras tells how the world follows from the
///   coordinates of the file: where their (0, 0, 0) lies (origin_in_world), the axes
///   (gltf_from_world, row by row), units ("m" or "unknown"), metres_per_unit, metres_sigma,
///   scale_source; also the area of each class, and the summary.
/// - NORMAL, which Draco and Meshopt leave out where the material is unlit: it follows from the
///   faces, and nothing asks for it there. COLOR_0 in linear light; _SUPPORT (number of views that
///   see the vertex); _SIGMA (standard deviation along the normal [units of the file]; negative =
///   no statement); _FEATURE_ID_0 (EXT_mesh_features: the number of the class, named in
///   asset.extras.provenance_names), which programs that pack files for the web keep.
/// - With Draco (edgebreaker) all primitives share one quantisation grid, so that borders between
///   them stay closed. The result is decoded again and compared with the input. Quantized and
///   with meshopt, the node's scale and translation lead from the shared grid to the same place.
///
/// \throws InvalidInput if options or mesh are not usable (an array does not fit, no face with an
///         area, coordinates beyond 1e18); NumericalError if the mesh as stored differs from the
///         input by more than max_error; LimitError above 4 GiB; IoError
/// Source: glTF 2.0 and KHR_draco_mesh_compression, Khronos Group.
GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const GlbOptions& options = {});

/// The same with photographs as texture.
///
/// - A primitive and material per provenance class and photograph, named "observed <photograph>",
///   with TEXCOORD_0 and a JPEG of the used part of the photograph; the classes' own primitives
///   hold the faces without photograph.
/// - Photographs hold the light of the scene already, so materials of surface that they vouch for
///   are KHR_materials_unlit; readers that do not know it find a rough non-metal.
/// - With Draco, texture coordinates move by at most 0.1 pixels, measured.
///
/// \throws Error as above; InvalidInput if the texture does not fit the mesh, see require_texture()
GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const PhotoTexture& texture,
                    const Frame& frame,
                    const GlbOptions& options = {});

/// A file that is on no disk yet.
struct GlbFile {
  std::string bytes;
  GlbReport report;
};

/// What write_glb() would write.
/// \throws Error as that, but for IoError
GlbFile make_glb(const TriangleMesh& mesh,
                 const PhotoTexture& texture,
                 const Frame& frame,
                 const GlbOptions& options = {});

}  // namespace cgs
