// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "libcgs/core/drawing.h"

namespace cgs {

/// Writes a drawing as SVG with a scale bar and its notes.
///
/// A unit of the picture is a unit of the drawing, y is turned downwards, and the upper left corner
/// of the lines is moved to (0, 0), as programs show SVG in single precision; the notes say from
/// where. Observed pieces are drawn through, single-view ones thin, interpolated ones dotted,
/// estimated and inferred ones dashed.
/// \throws InvalidInput if there is no line; IoError
void write_svg(const std::filesystem::path& path, const Drawing& drawing);

/// Text fit for XML.
std::string xml_text(std::string_view text);

}  // namespace cgs
