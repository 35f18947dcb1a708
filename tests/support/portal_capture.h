// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>

namespace cgs::test {

/// The capture of the portal as write_capture() writes it for capture_views(divisor). The build has
/// made it for the divisors that tests/CMakeLists.txt lists; not to be changed.
std::filesystem::path portal_capture(int divisor);

/// The same for the divisor 2, taken through PlantedWater(); truth/<view>_clear.png are its
/// pictures without the water.
std::filesystem::path underwater_capture();

/// Copies it.
///
/// \param views  so many of its views, the first; the truth of all is copied
void copy_portal_capture(const std::filesystem::path& folder,
                         int divisor,
                         size_t views = std::numeric_limits<size_t>::max());

}  // namespace cgs::test
