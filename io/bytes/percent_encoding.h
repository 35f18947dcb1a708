// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace cgs {

/// What stays as it is when a text is encoded.
enum class PlainBytes : uint8_t {
  Ascii,    ///< All of ASCII but '%': for readers that take all else for damage.
  InPaths,  ///< Letters, digits and "-._~/" (RFC 3986, section 2.3): a path in an address.
};

/// A text in which every other byte is a '%' and two digits.
/// Source: RFC 3986, section 2.1.
std::string percent_encoded(std::string_view text, PlainBytes plain = PlainBytes::Ascii);

/// The inverse. A '%' that no two digits follow stays: programs write names as they are.
std::string percent_decoded(std::string_view text);

}  // namespace cgs
