// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "io/bytes/json_file.h"
#include "io/glb/primitive.h"

namespace cgs {

inline constexpr const char* kMeshopt = "EXT_meshopt_compression";

/// No stream holds more bytes for each of its own.
inline constexpr uint64_t kMostMeshoptRatio = 64;

/// The same primitive with faces and vertices in an order in which neighbours follow each other,
/// which compresses best and draws fast.
GlbPrimitive in_cache_order(GlbPrimitive primitive);

/// Compresses the vertices and faces of a binary glTF file of write_glb(), whose images stay.
///
/// Whole numbers and faces come back bit by bit, but for normals, which keep 8 bits per coordinate
/// of an octahedron; floats keep 9 bits (sigma), or are exact where these suffice. Readers that do
/// not know the extension cannot open the file.
/// \throws NumericalError if a stream does not decode to what went in; LimitError above 4 GiB
/// Source: glTF extension EXT_meshopt_compression, Khronos Group.
std::string meshopt_compressed(std::string_view glb);

/// The bytes of a compressed buffer view.
/// \param extension  its EXT_meshopt_compression
/// \param stream     the compressed bytes that this names
/// \throws BadInput Schema, Value or Count for parameters that fit no stream, Syntax for a stream
///         that does not decode; LimitError
std::string meshopt_decoded(const JsonValue& extension, std::string_view stream);

}  // namespace cgs
