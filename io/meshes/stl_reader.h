// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads a binary or ASCII STL file; corners at the same coordinates become one vertex.
///
/// Whether it is binary is decided by its size, as binary files may start with "solid", too. The
/// unit is known for files of write_stl() only.
/// \throws BadInput Count (more facets declared than the file has), Syntax (with the line number),
///         Value (a corner that is not finite), Empty (no facet); LimitError
ParsedMesh read_stl(const std::filesystem::path& path);

}  // namespace cgs
