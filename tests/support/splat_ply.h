// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace cgs::test {

/// The header of a PLY of splats without harmonics as other programs write it, all float.
/// \param format  "ascii" or "binary_little_endian"
inline std::string splat_ply_header(const std::string& format, size_t count) {
  std::string out =
      "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(count) + "\n";
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"}) {
    out += std::string("property float ") + name + "\n";
  }
  for (const char* name : {"scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    out += std::string("property float ") + name + "\n";
  }
  return out + "end_header\n";
}

}  // namespace cgs::test
