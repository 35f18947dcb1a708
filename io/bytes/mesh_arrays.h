// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "libcgs/core/frame.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// What every mesh writer demands before it writes a byte: optional arrays are empty or as long as
/// vertices (faces), indices are in range, vertices are finite.
/// \throws InvalidInput that starts with `writer`
void require_writable(const TriangleMesh& mesh, std::string_view writer);

/// What a file for printing or machining demands on top: a known scale, at least one face, and at
/// most 2^32 - 1 of them.
/// \throws InvalidInput that starts with `writer`
void require_printable_solid(const TriangleMesh& mesh, const Frame& frame, std::string_view writer);

/// Three numbers to add to the coordinates that millimetres() makes, for scenes so far from their
/// origin that files leave it out: "448000500.000 5411000250.000 120000.000"; else empty.
/// \pre frame.has_metric_scale()
std::string origin_in_millimetres(const Frame& frame, const Eigen::Matrix3d& up_rotation);

/// A point in file coordinates, in millimetres along target axes.
/// \pre frame.has_metric_scale()
Eigen::Vector3d millimetres(const Eigen::Vector3f& point,
                            const Frame& frame,
                            const Eigen::Matrix3d& up_rotation);

/// sRGB-coded value in [0, 1] as a byte; NaN becomes 0.
uint8_t color_byte(float value);

}  // namespace cgs
