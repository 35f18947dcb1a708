// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "convert/run/run_request.h"

namespace cgs {

/// A whole run of the same photographs on smaller pictures, of which only times or a first look are
/// wanted, in a folder below that of the run, with the cameras that are stored there.
/// \param opened  the scene of the run; OpenedScene::keep() stored its cameras
RunRequest small_run(const RunRequest& request,
                     const OpenedScene& opened,
                     const char* folder,
                     int downscale);

}  // namespace cgs
