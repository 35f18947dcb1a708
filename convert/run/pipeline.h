// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/stage.h"
#include "convert/run/run_request.h"
#include "convert/text/terminal.h"

namespace cgs {

/// What a run that came to its end tells.
struct FinishedRun {
  nlohmann::ordered_json report;                  ///< The content of OUT/report.json.
  std::vector<std::pair<Stage, double>> seconds;  ///< That stages took, whichever run did them.
};

/// What a run keeps photographs in at most, beside its stages, where there is room [bytes].
inline constexpr size_t kKeptPhotographs = size_t{256} << 20;

/// What to do with the scene of a run before its first stage.
using FirstLook = std::function<void(const OpenedScene&)>;

/// Photographs to every asset, in stages that are skipped when their output is there already.
/// \param first_look  called once the cameras are stored, where no stage was done before; may be
///                    empty
FinishedRun run_pipeline(const RunRequest& request,
                         Terminal& terminal,
                         const FirstLook& first_look = {});

}  // namespace cgs
