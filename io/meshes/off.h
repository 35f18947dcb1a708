// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads an ASCII OFF file (OFF, COFF, NOFF, CNOFF, STOFF and their combinations); polygons become
/// fans of triangles, what follows the coordinates is ignored.
///
/// \throws BadInput Magic, Unsupported (binary, four dimensions), Syntax, Count, Truncated, Ref,
///         Value, Empty, with the line number; LimitError
/// Source: Geomview manual, "OFF: polyhedron".
ParsedMesh read_off(const std::filesystem::path& path);

}  // namespace cgs
