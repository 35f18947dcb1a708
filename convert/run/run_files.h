// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/stage.h"
#include "convert/run/run_record.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Files that a run wrote, by their paths below its folder, in order.
///
/// \param names  paths of what a run writes; "*" in one stands for one character or more. Other
///               files are the user's, who may change them.
std::vector<std::string> named_outputs(const std::filesystem::path& output,
                                       const std::set<std::string>& names);

/// Hashes of named_outputs().
/// \throws IoError
nlohmann::ordered_json output_hashes(const std::filesystem::path& output,
                                     const std::set<std::string>& names);

/// What a stage of a run writes, as paths below the folder of the run.
struct StageFiles {
  Stage stage = Stage::Model;
  std::vector<std::string> files;         ///< One of them absent means that the stage must run.
  std::vector<std::string> further = {};  ///< What it may write besides, as for named_outputs().

  std::set<std::string> all() const;
};

/// The stages of a run in their order.
/// \param lods  levels of detail of the asset
std::vector<StageFiles> stage_files(const Scene& scene, size_t lods);

/// What OpenedScene::keep() writes, before the first stage.
std::set<std::string> camera_files();

/// A folder without the record of a run may hold work of somebody else under the names that a run
/// writes to.
/// \throws InvalidInput if it does
void refuse_foreign_files(const std::filesystem::path& output,
                          const std::vector<StageFiles>& stages);

/// Hashes of what stages before `stage` wrote and it may write anew.
/// \throws IoError
nlohmann::ordered_json earlier_outputs(const StageFiles& stage,
                                       const std::vector<StageFiles>& stages,
                                       const RunRecord& record,
                                       const std::filesystem::path& output);

/// Removes what stages after `stage` wrote: made of other settings, it must not stand beside what
/// comes now, as if it belonged to it, should this run end before them. Files of like names that no
/// stage is known to have written are the user's.
void remove_outputs_after(Stage stage,
                          const std::vector<StageFiles>& stages,
                          const RunRecord& record,
                          const std::filesystem::path& output);

}  // namespace cgs
