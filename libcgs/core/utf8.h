// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string_view>

namespace cgs {

/// Bytes of the UTF-8 sequence at the start of a text that can be shown: no control character; 0 if
/// there is none.
/// Source: RFC 3629 section 4.
size_t shown_sequence(std::string_view text);

}  // namespace cgs
