// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// Checks everything in a .vdb file that OpenVDB would trust, so that the bytes can be decoded.
///
/// OpenVDB 10 writes past its buffers when the length of a compressed block lies, and keeps grids
/// whose node masks contradict each other. Here every length is held against the bytes that follow
/// it before the library sees one: names, metadata, transforms, the tree and each block of values,
/// at exactly the places the grid's own table states. What decoding needs in memory is then bounded
/// by the file: a node takes at most some 60 times its bytes.
///
/// Files of version 224 (OpenVDB 4 and later) are read, with 5-4-3 trees of numbers or 3-vectors,
/// uncompressed, zip or blosc-LZ4; other codecs of blosc are known to overrun.
/// \return where the type names of tables for delayed loading stand: the library would believe
///         their sizes, so the first letter of each must be overwritten to make it skip them
/// \throws BadInput Magic, Unsupported, Truncated, Count, Syntax, Value (transform), Empty (no
///         grid); LimitError
/// Source: openvdb/io/{Archive,GridDescriptor,Compression}.h, openvdb/tree/*.h; blosc 1 header.
std::vector<size_t> screen_vdb(std::string_view bytes,
                               const std::filesystem::path& path,
                               const ReadLimits& limits = {});

}  // namespace cgs
