// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace cgs {

/// Text as it may stand in HTML, in and outside of attributes.
std::string escaped(std::string_view text);

/// A number by a printf format; "-" for what is none.
std::string number(const nlohmann::ordered_json& value, const char* format = "%.4g");

/// A share of one as "3.1 %"; "-" for what is no number.
std::string percent(const nlohmann::ordered_json& share);

/// Bytes as base64 with padding (RFC 4648, section 4).
std::string base64(std::string_view bytes);

/// A row of a table: a name, which is escaped, and a value, which is HTML.
std::string table_row(std::string_view name, std::string_view value);

/// `yes` in the colour of what is good or `no` in that of what is bad; both are HTML.
std::string verdict(bool good, const std::string& yes, const std::string& no);

}  // namespace cgs
