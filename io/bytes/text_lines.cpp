// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/text_lines.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cgs {

TextLines::TextLines(std::string_view text, std::filesystem::path path)
    : text_(text), path_(std::move(path)) {
  if (text_.starts_with("\xef\xbb\xbf")) at_ = 3;
}

std::optional<std::string_view> TextLines::next() {
  if (at_ >= text_.size()) return std::nullopt;
  const size_t end = std::min(text_.find('\n', at_), text_.size());
  line_ = text_.substr(at_, end - at_);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  at_ = end + 1;
  ++line_number_;
  return line_;
}

std::optional<std::string_view> TextLines::next_data() {
  while (const auto line = next()) {
    const size_t first = line->find_first_not_of(" \t\r");
    if (first != std::string_view::npos && (*line)[first] != '#') return line;
  }
  return std::nullopt;
}

void TextLines::fail(Defect defect, const std::string& reason) const {
  throw BadInput(defect, path_, "line " + std::to_string(line_number_) + ": " + reason);
}

void TextLines::fail_at(std::string_view token, const std::string& reason) const {
  const auto column = token.data() - line_.data() + 1;
  throw BadInput(Defect::Syntax,
                 path_,
                 std::to_string(line_number_) + ":" + std::to_string(column) + ": \"" +
                     printable(std::string(token.substr(0, 40))) + "\" " + reason);
}

double TextLines::number(std::string_view token) const {
  double value = 0;
  if (!parse_number(token, value)) fail_at(token, "is not a number");
  if (!std::isfinite(value)) fail(Defect::Value, "a number is not finite");
  return value;
}

double TextLines::measured(std::string_view token) const {
  double value = 0;
  if (!parse_measured(token, value)) fail_at(token, "is not a number");
  return value;
}

uint64_t TextLines::count(std::string_view token) const {
  uint64_t value = 0;
  if (!parse_number(token, value)) fail_at(token, "is not a whole number >= 0");
  return value;
}

std::vector<std::string_view> tokens(std::string_view line) {
  std::vector<std::string_view> out;
  size_t at = 0;
  while ((at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    out.push_back(line.substr(at, end - at));
    at = end;
  }
  return out;
}

std::vector<std::string_view> fields(std::string_view line, char separator) {
  std::vector<std::string_view> out;
  for (size_t at = 0; at <= line.size();) {
    const size_t end = std::min(line.find(separator, at), line.size());
    std::string_view field = line.substr(at, end - at);
    field.remove_prefix(std::min(field.find_first_not_of(" \t"), field.size()));
    field.remove_suffix(field.size() - (field.find_last_not_of(" \t") + 1));
    out.push_back(field);
    at = end + 1;
  }
  return out;
}

}  // namespace cgs
