// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "io/bytes/scene_path.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// True if the folder holds a .csv file with cameras of RealityCapture.
bool is_realitycapture(const std::filesystem::path& folder);

/// Reads the registration that RealityCapture (RealityScan) exports as CSV "Internal/External
/// camera parameters": a line that starts with `#name` and says which column is which, then one
/// line per photograph. Photographs lie in images/ or beside the file, or in folders below.
///
/// f is that of 35 mm film (36 mm along the longer side); px and py count from the middle of the
/// picture in units of its longer side. heading, pitch and roll, in degrees, turn a camera that
/// looks straight down with its top to +y (north): about its viewing axis, x and y axes as
/// Rz(-heading) Rx(pitch) Ry(roll). World axes are x, y and alt (up), in units of the project. The
/// lens is Brown's: t1 shifts x by t1 (r^2 + 2 x^2) and y by 2 t1 x y, and t2 the other way round.
/// \throws BadInput Schema (a column or field is missing, or twice there), Syntax, Value,
///         Unsupported (k4), Empty
/// Source: RealityCapture help, "Export of registration"; nerfstudio documentation,
///         "RealityCapture".
Scene read_realitycapture(const SceneRoot& root);

}  // namespace cgs
