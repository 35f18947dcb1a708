// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

namespace cgs {

struct Volume;

/// Distance from each point to the observed surface of a fused volume [internal units]: |d| / |g|
/// of the trilinear signed distance d with gradient g, which is exact for a plane and first order
/// for others. NaN where one of the eight voxels around the point was not observed, or where the
/// field is so flat that it has no surface near by.
/// Source: Taubin 1994, "Distance approximations for rasterizing implicit curves".
std::vector<float> distances_to_observed(const Volume& volume,
                                         const std::vector<Eigen::Vector3f>& points);

}  // namespace cgs
