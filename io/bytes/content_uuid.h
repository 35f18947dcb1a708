// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace cgs {

/// A UUID made from content, for formats whose libraries would put a random one into the file and
/// so make equal content different: 8-4-4-4-12 hexadecimal digits, version 8 of RFC 9562.
/// Not a cryptographic digest.
/// \param purpose  gives one content several UUIDs
std::string content_uuid(std::string_view content, std::string_view purpose = {});

}  // namespace cgs
