// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "convert/run/run_request.h"

namespace cgs {

/// The record of a run that came to its end.
/// \throws BadInput Missing (no run.json), Schema (not of a finished run)
nlohmann::ordered_json finished_record(const std::filesystem::path& output);

/// What a finished run was asked for, so that it can be asked for again; the output is left empty.
/// \param path  of the record, for messages
/// \throws BadInput Schema where the record does not hold what run_pipeline() writes; InvalidInput
///         for settings that this version does not know
RunRequest recorded_request(const nlohmann::ordered_json& record,
                            const std::filesystem::path& path);

}  // namespace cgs
