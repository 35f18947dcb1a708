// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "io/splat_doctor.h"

namespace cgs {

/// Reads splats of any format we know, recognised by content: 3DGS and 2DGS PLY, packed PLY, SPZ 2
/// to 4, SOG 2, .ksplat 0.1, binary glTF, and .splat, which has no header and must be plausible
/// throughout.
///
/// \param frame  as for examine_splats()
/// \throws BadInput as the reader of the format; Unsupported for what is known but not read
///         (glTF as text); Magic for anything else; LimitError
GaussianFile read_splats(const std::filesystem::path& path, const std::optional<Frame>& frame = {});

}  // namespace cgs
