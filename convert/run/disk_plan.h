// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "libcgs/core/scene.h"

namespace cgs {

/// Predicts how large the files of a run will be, from the sizes of its pictures alone [bytes].
uint64_t disk_plan(const Scene& scene);

/// One line where the disk of a run's folder has less room than what the run still has to write;
/// empty where it has enough. No refusal: what is finished before the disk is full is kept.
/// \param available  bytes that may still be written beside the files in `folder`
std::string little_room_warning(const Scene& scene,
                                const std::filesystem::path& folder,
                                uint64_t available);

/// The same for the room that the disk of `folder` says it has; empty where it does not say.
std::string little_room_warning(const Scene& scene, const std::filesystem::path& folder);

}  // namespace cgs
