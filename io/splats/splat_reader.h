// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "io/splats/splat_doctor.h"

namespace cgs {

/// How much a file of splats holds, as it states it.
struct SplatCount {
  uint64_t splats = 0;
  uint64_t harmonics = 1;  ///< RGB coefficients of each.
  uint64_t file_bytes = 0;
};

/// Tells what a file holds by its header (a .glb or .sog is read for that), if it holds splats;
/// none for .ksplat. Nothing is promised: headers can lie.
/// \throws BadInput as parse_ply_header(), count_glb_splats() and stated_sog_splats(), or if the
///         file cannot be opened
std::optional<SplatCount> stated_splats(const std::filesystem::path& path);

/// Reads splats of any format we know, recognised by content: 3DGS and 2DGS PLY, packed PLY, SPZ 2
/// to 4, SOG 2 (also unpacked, by its meta.json), .ksplat 0.1, glTF, and .splat, which has no
/// header and must be plausible throughout.
///
/// \param frame  as for examine_splats()
/// \throws BadInput as the reader of the format; Magic for anything else; LimitError
GaussianFile read_splats(const std::filesystem::path& path, const std::optional<Frame>& frame = {});

}  // namespace cgs
