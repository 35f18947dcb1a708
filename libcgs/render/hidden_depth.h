// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "libcgs/core/raster.h"
#include "libcgs/render/render_buffers.h"

namespace cgs {

/// A neighbour of a gap lies on its far side, and not on what stands before it, if its depth is at
/// least this part of what the gap hides there.
inline constexpr float kFarSide = 0.9f;

/// Depth of what may lie in gaps of a picture: what their far sides go on with. Inverse depth is a
/// membrane held by the far sides alone, so that a plane goes on as that plane, and what stands
/// before a gap does not pull it nearer. Sky holds it only where there is nothing else.
///
/// \param buffers  whose median depth counts outside of gaps, with holes
/// \param open     1 = in a gap
/// \return z-depth of the pixels of gaps [internal units]; NaN elsewhere, and everywhere where no
///         depth is known
/// Source: membrane and far side as in relax_membrane() and pulled_and_pushed().
DepthMap hidden_depth(const RenderBuffers& buffers, const MaskMap& open);

}  // namespace cgs
