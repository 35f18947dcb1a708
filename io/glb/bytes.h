// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace cgs {

/// A binary glTF file of a JSON text and a binary chunk, left out if it is empty.
/// \throws LimitError above 4 GiB
/// Source: glTF 2.0, section 4.4 (GLB file format), Khronos Group.
std::string glb_bytes(std::string json, std::string binary);

}  // namespace cgs
