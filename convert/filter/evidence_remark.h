// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "libcgs/core/triangle_mesh.h"
#include "meshing/mesh/stated_surface.h"

namespace cgs {

/// "9.3 %"
std::string percent(double part, double whole);

/// "9.3 % of the area bridges gaps", and whether that is marked.
std::string bridge_remark(const EvidenceTransfer& evidence, const TriangleMesh& mesh);

/// Whether so much of the surface is the back of its source that it must be said.
bool is_behind(const EvidenceTransfer& evidence);

}  // namespace cgs
