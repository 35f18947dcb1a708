// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "libcgs/core/raster.h"
#include "libcgs/render/training_rasterizer.h"

namespace cgs {

/// The three channels of a photograph, as the losses take them.
ColorPlanes planes_of(const ColorImage& image);

/// A well-mixed number for a triple of counters: what a step does must not depend on what ran
/// before.
uint64_t mixed(uint64_t a, uint64_t b, uint64_t c);

/// What a step draws a view on: another colour in every step, so that no surface can hide in front
/// of it half transparent.
Eigen::Vector3f random_background(uint64_t step, size_t view);

}  // namespace cgs
