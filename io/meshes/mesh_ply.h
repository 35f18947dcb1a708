// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/meshes/parsed_mesh.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// Writes a mesh with its evidence as binary little-endian PLY, in file coordinates.
///
/// Vertices: x y z [world units, minus frame.file_origin], then, as far as the mesh has them,
/// nx ny nz, red green blue (uchar, sRGB), quality (number of views that see it) and
/// scalar_sigma ([world units]; -1 = no statement). Faces: vertex_indices and scalar_provenance
/// (uchar, the numbers of Provenance, which a comment names) with the same as `quality` (float).
/// MeshLab reads `quality`, CloudCompare what starts with `scalar_`. Comments carry unit, scale
/// source and origin.
///
/// \throws InvalidInput if an array does not fit, an index is out of range, or a vertex is not
///         finite; IoError
void write_mesh_ply(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame);

/// A number per vertex under a name of its own; CloudCompare shows names that start with "scalar_".
struct VertexScalar {
  std::string name;
  std::vector<float> values;  ///< As they are to stand in the file.
};

/// The same with further numbers per vertex behind the others.
/// \throws Error as above; InvalidInput if there are not as many numbers as vertices
void write_mesh_ply(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const std::vector<VertexScalar>& scalars);

/// A mesh from a file and the frame it was read into.
struct MeshFile {
  TriangleMesh mesh;
  Frame frame;
  std::vector<std::string> warnings;  ///< One line each: what is odd but usable.
};

/// Reads a PLY mesh or point cloud, ASCII or binary, written by us or by others.
///
/// Polygons become triangles, and so do triangle strips ("tristrips" of Stanford, where -1 ends a
/// strip). Colours are red green blue, diffuse_red … or r g b, whole numbers or floats up to 1 or
/// 255, of vertices, else of pictures in the folder of the file ("comment TextureFile"), else of
/// faces. What is not finite is dropped, see drop_unusable(). Our own
/// names are understood as written; a negative or non-finite scalar_sigma is NaN. Arrays the file
/// does not have stay empty; a warning says where another program left out, or may have, the labels
/// of a file of ours.
/// \param frame  read into exactly this frame; without it a canonical frame is made from the
///               vertices, with unit and origin from the comments
/// \throws BadInput as parse_ply_header() and read_ply_rows(); Schema (no vertices with x y z),
///         Empty (0 vertices), Value (as drop_unusable()), Ref (a face that names a vertex that is
///         not there); LimitError
MeshFile read_mesh_ply(const std::filesystem::path& path, const std::optional<Frame>& frame = {});

/// The content of the file as read_mesh_ply() reads it, in file coordinates and double.
/// \throws Error as read_mesh_ply()
ParsedMesh parse_mesh_ply(const std::filesystem::path& path);

}  // namespace cgs
