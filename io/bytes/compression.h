// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace cgs {

/// How a deflate stream is wrapped.
enum class DeflateWrapping { Gzip, Zlib, None };

/// The content of a deflate stream that must hold exactly `size` bytes.
/// \param what  names the content in the message
/// \throws BadInput Truncated (it is cut), Count (it holds less or more; where no stream of that
///         length can hold as much, this is told before memory is taken), Syntax (it is damaged, or
///         its checksum is wrong)
std::string inflate(std::string_view bytes,
                    DeflateWrapping wrapping,
                    size_t size,
                    const std::filesystem::path& path,
                    std::string_view what);

/// How many bytes something has.
struct SizeRange {
  size_t least = 0;
  size_t most = 0;
};

/// The same of content whose length is only known to lie in a range.
std::string inflate(std::string_view bytes,
                    DeflateWrapping wrapping,
                    const SizeRange& size,
                    const std::filesystem::path& path,
                    std::string_view what);

/// The first `size` bytes of the content; what follows them is not looked at.
/// \throws BadInput Truncated, Syntax, Count as above
std::string inflate_start(std::string_view bytes,
                          DeflateWrapping wrapping,
                          size_t size,
                          const std::filesystem::path& path,
                          std::string_view what);

/// Whether any deflate stream of so many bytes can hold `size`.
bool can_inflate_to(uint64_t packed, uint64_t size);

/// A gzip file of these bytes, without name and time: the same bytes give the same file.
std::string gzip(std::string_view bytes);

/// The content of a Zstandard frame that must hold exactly `size` bytes.
/// \throws BadInput Syntax, Mismatch (it holds more or less)
std::string zstd_decompress(std::string_view bytes,
                            size_t size,
                            const std::filesystem::path& path,
                            std::string_view what);

}  // namespace cgs
