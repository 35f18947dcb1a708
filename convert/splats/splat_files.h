// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/text/terminal.h"
#include "io/splats/splat_doctor.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

/// True for a PLY file whose vertices have what makes a splat, or so much of it that a part is
/// missing, and for a .glb or .gltf file of splats. Opacity alone makes none: clouds have it, too.
/// \throws BadInput as read_ply_header() and is_splat_glb()
bool is_splat_file(const std::filesystem::path& path);

/// True for the endings of formats that hold splats and nothing of the scene that they are in:
/// .spz, .splat.
bool is_bare_splat_name(const std::filesystem::path& path);

/// True for SuperSplat's name for packed splats: .compressed.ply.
bool is_compressed_ply_name(const std::filesystem::path& path);

struct SplatFileOptions {
  int spz_version = 3;
  size_t memory_limit = 0;    ///< In bytes, for reading back; 0 = as memory_budget().
  std::string evidence = {};  ///< What the splats rest on, in words; empty = nobody says.
  bool local_origin = false;  ///< Of a .glb, as SplatGlbOptions.
};

/// Why other programs may refuse a file of that many splats; "" if none is known to.
std::string refused_by_others(const std::filesystem::path& path, size_t splats);

/// Writes splats in the format that the name of the file says, reads them back and says on the
/// terminal what they lost, and how many are estimated.
/// \param frame  whose `up` becomes +Y in GLB, and must be known for it
/// \return {"format", "splats", "provenance", "synthetic", "loss", …}; "provenance" and "synthetic"
///         of the file as splat_file_to_json() has them; "loss" is {"not_measured": why} where the
///         file could not be read back
/// \throws Error as the writers; Cancelled
nlohmann::ordered_json write_splat_file(const std::filesystem::path& path,
                                        const Gaussians& gaussians,
                                        const Frame& frame,
                                        const SplatFileOptions& options,
                                        Terminal& terminal);

/// What a file of splats holds and what is wrong with it: {"kind", "format", "counts", "bounds",
/// "units", "evidence": words or null, "provenance", "synthetic", "findings", "warnings"}.
/// "provenance" is null where it is not stated, else {"words": "estimated: 12 % of the splats",
/// "observed": splats, "single_view", …: one for each label}; "synthetic" is null where nothing is
/// made up, else {"words", "splats", "sources": [{"file", "sha256"}]}.
nlohmann::ordered_json splat_file_to_json(const GaussianFile& file);

}  // namespace cgs
