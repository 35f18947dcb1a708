// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace cgs {

/// A text in ASCII, for readers that take all else for damage: '%' and every byte beyond ASCII are
/// a '%' and two digits.
/// Source: RFC 3986, section 2.1.
std::string percent_encoded(std::string_view text);

/// The inverse. A '%' that no two digits follow stays: programs write names as they are.
std::string percent_decoded(std::string_view text);

}  // namespace cgs
