// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "convert/run/run_request.h"

namespace cgs {

/// The views that a run of a scene uses, as --views names them, so that runs of other sizes take
/// the same. Empty = as it chooses by itself, and where names cannot be listed.
std::string views_of_run(const RunRequest& request, const Scene& scene);

/// A whole run of the same photographs on smaller pictures, of which only times or a first look are
/// wanted, in a folder below that of the run, with a copy of the cameras there.
/// \param opened  the scene of the run
RunRequest small_run(const RunRequest& request,
                     const OpenedScene& opened,
                     const char* folder,
                     int downscale);

}  // namespace cgs
