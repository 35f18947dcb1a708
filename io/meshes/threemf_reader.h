// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "io/meshes/parsed_mesh.h"

namespace cgs {

/// Reads everything that a 3MF file builds as one mesh: objects, their components and where the
/// build puts them, in the unit the file states; +Z is up. Nothing is extracted to disk.
///
/// From files of ours, the label of each face is restored (a warning says where another program
/// left it out), and so is the origin they were moved from, unless the unit is no longer the
/// millimetre or an object is moved, turned or built twice. Objects of type support, solidsupport
/// and other are left out, surfaces are kept; warnings say how many. In other files labels are
/// those that MaterialLabels finds in names of materials. The type of an object speaks for its own
/// mesh, not for its components. Colours of faces and their corners become those of vertices, but
/// not where labels have them. Textures and mixtures, which warnings name, and what is not built
/// are not read.
///
/// Own code, because lib3mf, which writes, keeps coordinates as float.
/// \throws BadInput Magic (no ZIP archive), as ZipArchive and parse_threemf_model(); Missing (a
///         part that is named), Path (a part whose name would leave the archive), Ref (an object
///         that is not there, or is a component of itself), Empty (nothing is built); LimitError:
///         items and components place more than 33 million faces and more than there are
/// Source: 3MF Core Specification 1.3, Production Extension 1.1, and Materials and Properties
///         Extension 1.2, 3MF Consortium.
ParsedMesh read_3mf(const std::filesystem::path& path);

/// Whether a file says that write_3mf() made it; false if it cannot be read.
bool is_own_3mf(const std::filesystem::path& path);

}  // namespace cgs
