// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "io/splat_doctor.h"

namespace cgs {

/// Reads splats of any format we know, recognised by content: 3DGS and 2DGS PLY, packed PLY, SPZ 2
/// to 4, SOG 2, and .splat, which has no header and must be plausible throughout.
///
/// \param frame  as for examine_splats()
/// \throws BadInput as the reader of the format; Unsupported with a way out for formats that are
///         known but not read (.ksplat, glTF); Magic for anything else; LimitError
GaussianFile read_splats(const std::filesystem::path& path, const std::optional<Frame>& frame = {});

}  // namespace cgs
