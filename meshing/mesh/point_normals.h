// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// Whether a normal is one: 0 0 0 stands for one that is not known, in files of other programs,
/// too.
inline bool is_known_normal(const Eigen::Vector3f& normal) { return !normal.isZero(0); }

/// Unit normals of a point cloud: per point the direction in which it and its nearest neighbours
/// spread least, with either sign. 0 where the neighbours are one point or on a line.
/// \param neighbors  the point included, >= 3
/// Source: Hoppe et al. 1992, "Surface reconstruction from unorganized points", section 3.2.
/// \throws InvalidInput for fewer neighbours
std::vector<Eigen::Vector3f> estimated_normals(const std::vector<Eigen::Vector3f>& points,
                                               size_t neighbors);

/// Turns each normal to the side of the hint for its point; where they are at right angles it
/// stays.
void turn_like(std::vector<Eigen::Vector3f>& normals, const std::vector<Eigen::Vector3f>& hints);

/// Turns the normals of each part together, to the side that most hints for its points say; parts
/// without any stay.
/// \param part_of  per point a number of its part, as from turn_consistently()
void turn_parts_like(std::vector<Eigen::Vector3f>& normals,
                     const std::vector<Eigen::Vector3f>& hints,
                     const std::vector<uint32_t>& part_of);

/// Turns each normal to the side on which `eye` lies.
void turn_towards(std::vector<Eigen::Vector3f>& normals,
                  const std::vector<Eigen::Vector3f>& points,
                  const Eigen::Vector3f& eye);

/// Turns normals so that neighbours agree: along the tree of neighbours whose normals differ least,
/// from the topmost (+z) point of every part, which looks up.
/// \param neighbors  of every point that may be joined to it, >= 1
/// \return per point the topmost of its part, on whose normal the side of all of them rests
/// Source: Hoppe et al. 1992, section 3.3.
std::vector<uint32_t> turn_consistently(std::vector<Eigen::Vector3f>& normals,
                                        const std::vector<Eigen::Vector3f>& points,
                                        size_t neighbors);

}  // namespace cgs
