// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "libcgs/coherence/conv_decoder.h"

namespace cgs::test {

/// ConvDecoder::evaluate() in double precision, written down loop by loop from its definition.
/// Reads nothing of the implementation but decoder options.
/// \return values per view, row-major
std::vector<std::vector<double>> reference_conv_decoder(
    const std::vector<Raster<uint8_t>>& layer_per_view,
    const ConvDecoderOptions& options,
    const std::vector<double>& parameters);

}  // namespace cgs::test
