// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads a file in OpenMesh's own format, versions 1.0 to 2.2, of ours or of others; polygons
/// become triangles, the properties that write_om() names are understood. What else is in it is
/// left out: what has a meaning or a name is said in a warning, faces that are marked as deleted
/// are counted. What is not finite is dropped, see drop_unusable().
///
/// OpenMesh's own reader takes the numbers of halfedges in a file for addresses in memory without
/// looking at them, so that a damaged file makes it write anywhere; hence one of our own.
/// \throws BadInput Magic, Unsupported (a later version, numbers of unknown size), Truncated, Count,
///         Schema (no coordinates, faces without corners), Ref (vertices, halfedges), Value (a
///         label; as drop_unusable()), Empty; LimitError
/// Source: as write_om().
ParsedMesh read_om(const std::filesystem::path& path);

}  // namespace cgs
