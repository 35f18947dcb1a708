// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads a binary or ASCII STL file; corners at the same coordinates become one vertex.
///
/// Whether it is binary is decided by its size, or where that does not fit by control characters,
/// as binary files may start with "solid", too. Text may break lines anywhere. Colours of facets
/// are those of VisCAM and SolidView, or of Materialise Magics. Facets with a corner that is not
/// finite are dropped, with a warning. The unit is known for files of write_stl() only.
/// \throws BadInput Count (more facets declared than the file has), Syntax (with the line number),
///         Value (more than half of the facets have a corner that is not finite), Empty (no
///         facet); LimitError
ParsedMesh read_stl(const std::filesystem::path& path);

}  // namespace cgs
