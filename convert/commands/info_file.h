// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include <nlohmann/json.hpp>

namespace cgs {

/// Prints, as text or as JSON, what a file holds: a mesh with its certificate, splats, the grids of
/// a volume or the channels of an EXR; of a folder that run wrote, what was done; of a model, its
/// splats.
/// \return what was printed; nothing if the path is none of these, but perhaps a scene
/// \throws Error as the readers of the formats
std::optional<nlohmann::ordered_json> print_file_info(const std::filesystem::path& path,
                                                      bool as_json);

/// A line for each of "warnings".
void print_warnings(const nlohmann::ordered_json& info);

}  // namespace cgs
