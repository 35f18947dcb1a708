// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace cgs {

/// SHA-256 of bytes as 64 hexadecimal digits, for what people compare with the figures of other
/// programs; content_hash.h is faster where only this program compares.
/// Source: FIPS 180-4, section 6.2.
std::string sha256(std::string_view bytes);

}  // namespace cgs
