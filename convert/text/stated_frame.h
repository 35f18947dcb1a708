// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/frame.h"

namespace cgs {

/// Gives a frame the unit that the user assumes, unless its file or its cameras state one.
///
/// \param unit  as metres_in() takes it
/// \return why it was left out, for a warning; empty if it was not
/// \throws InvalidInput for an unknown unit
std::string assume_unit(Frame& frame, const std::string& unit);

/// Says that a measured scale contradicts the one that a frame has from elsewhere, for a warning.
///
/// \param by      what measured it, as in "the known distances"
/// \param metres  per unit of the frame, with its standard deviation
/// \return empty where the frame has no scale, or both agree within 3 sigma; where the frame does
///         not state its own, within 5 %
std::string scale_contradiction(const Frame& stated,
                                const std::string& by,
                                double metres,
                                double sigma);

/// Widens the sigma of a known scale by that of the focal length for which cameras were solved: a
/// wrong one stretches depth against width, so that a length along one tells the other no better.
/// \param focal_sigma  relative; 0 = the focal length was given
void widen_by_focal(Frame& frame, double focal_sigma);

/// Says that two files have other directions up, so that what they show together may be turned, for
/// a warning; empty if not, or if one does not say.
std::string turned_text(const Frame& a, const Frame& b);

/// Sets what is up: as given, else as the frame knows, else +z, or -y as splats of others mostly
/// lie.
/// \return what was assumed, for a note; empty where nothing was
/// \throws InvalidInput as up_direction()
std::string settle_up(Frame& frame, const std::vector<double>& given, bool is_of_splats = false);

/// The direction of --up, of unit length.
/// \throws InvalidInput unless it is three finite numbers, not all 0
Eigen::Vector3d up_direction(const std::vector<double>& numbers);

}  // namespace cgs
