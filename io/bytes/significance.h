// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Geometry>

namespace cgs {

constexpr int kDoubleDigits = 53;  ///< Binary digits of a coordinate stored as double, or as text.
constexpr int kFloatDigits = 24;   ///< … as float.

/// Refuses content that lies so far from the origin that its coordinates hold too little of it:
/// below 20 binary digits for double, below 10 for float. Nobody can bring back what was rounded
/// away when the file was written.
///
/// \param box     of the content, in the coordinates of the file
/// \param digits  kDoubleDigits or kFloatDigits
/// \return what to warn of (float below 14 digits, fewer than our own files have); empty = nothing.
/// A box without extent passes.
/// \throws BadInput Value, "input has only N significant bits: …"
std::string check_significance(const std::filesystem::path& path,
                               const Eigen::AlignedBox3d& box,
                               int digits);

}  // namespace cgs
