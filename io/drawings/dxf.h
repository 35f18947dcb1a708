// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "libcgs/core/drawing.h"

namespace cgs {

/// Writes a drawing as DXF (release 12, ASCII), which every CAD program reads.
///
/// Lines become polylines on the layers OBSERVED, SINGLE_VIEW, INTERPOLATED (dotted), VIRTUAL,
/// ESTIMATED and INFERRED (dashed), or SECTION if nothing is stated, cut where the layer changes.
/// Where labels are stated, closed lines stand once more in one piece on the layer OUTLINE, below
/// the others: an open polyline bounds no hatch.
/// Coordinates are those of the drawing with all digits; $INSUNITS and comments name the unit.
/// \throws InvalidInput if there is no line; IoError
/// Source: Autodesk, "DXF Reference", release 12 group codes.
void write_dxf(const std::filesystem::path& path, const Drawing& drawing);

/// A piece of a line that has one label.
struct LabelledRun {
  std::vector<Eigen::Vector2d> points;
  int label = -1;  ///< Number of a Provenance; -1 = not stated.
  bool closed = false;
};

/// The line cut where its label changes; whole and closed if it has one label only.
std::vector<LabelledRun> labelled_runs(const DrawnLine& line);

}  // namespace cgs
