// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/text/figures.h"
#include "io/meshes/mesh_file.h"
#include "meshing/measure/section.h"
#include "meshing/mesh/certificate.h"

namespace cgs {

/// Reads a mesh to measure; where it does not state a unit, `assume_unit` (if any) is taken.
/// \throws BadInput; InvalidInput for splats, which are neither a mesh nor points on a surface, or
///         an unknown unit
MeasurableFile read_measured(const std::filesystem::path& path,
                             const std::string& assume_unit,
                             const std::optional<Frame>& frame = {});

/// {"file", "vertices", "faces", "unit", "scale": {"source", "metres_per_unit", "relative_sigma"},
/// "provenance": stated or not, "sigma": stated or not}
nlohmann::ordered_json measured_json(const std::filesystem::path& path,
                                     const MeasurableMesh& mesh,
                                     const FigureUnit& unit);
/// The same in one line.
std::string measured_line(const std::filesystem::path& path,
                          const MeasurableMesh& mesh,
                          const FigureUnit& unit);

/// "closed, manifold, oriented outward, no self-intersection, 1 component, genus 0"
std::string certificate_line(const Certificate& certificate);

/// Three numbers, "x,y,z".
/// \throws InvalidInput
Eigen::Vector3d parse_point(const std::string& text);

/// "x=…", "y=…", "z=…" or "px,py,pz/nx,ny,nz" in coordinates of the file.
/// \throws InvalidInput
CutPlane parse_plane(const std::string& text, const MeasurableMesh& mesh);

/// A section in its unit. Across an axis, numbers are coordinates of the file (times the unit).
Drawing section_drawing(const Section& section,
                        const CutPlane& plane,
                        const MeasurableMesh& mesh,
                        const FigureUnit& unit);

}  // namespace cgs
