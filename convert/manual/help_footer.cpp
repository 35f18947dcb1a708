// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/help_footer.h"

#include <algorithm>
#include <sstream>
#include <string_view>

namespace cgs {

namespace {

using Kind = FooterPart::Kind;

constexpr std::string_view kExample = "Example: ";

bool begins_with(const std::string& line, std::string_view start) {
  return line.compare(0, start.size(), start) == 0;
}

bool is_indented(const std::string& line, size_t width) {
  return line.size() > width && line.find_first_not_of(' ') >= width;
}

bool is_part_of_table(const std::string& line) {
  return is_indented(line, 2) || line.find("   ") != std::string::npos;
}

// "  name   what it means"
std::pair<std::string, std::string> term_of(const std::string& line) {
  const size_t start = line.find_first_not_of(' ');
  const size_t end = std::min(line.find("  ", start), line.size());
  const size_t meaning = std::min(line.find_first_not_of(' ', end), line.size());
  return {line.substr(start, end - start), line.substr(meaning)};
}

// Adds the line to the last part where it goes on with it.
bool goes_on(FooterPart& part, const std::string& line) {
  switch (part.kind) {
    case Kind::Example:
      if (!is_indented(line, kExample.size())) return false;
      part.lines.push_back(line.substr(kExample.size()));
      return true;
    case Kind::Table:
      if (!is_part_of_table(line) && line.back() != ',') return false;
      part.lines.push_back(line);
      return true;
    case Kind::Terms:
      if (!is_indented(line, 2)) return false;
      part.terms.push_back(term_of(line));
      return true;
    case Kind::Text:
      if (begins_with(line, kExample) || line.empty()) return false;
      if (is_indented(line, 2) && part.text.back() == ':') {
        part.kind = Kind::Terms;
        return goes_on(part, line);
      }
      if (is_part_of_table(line)) return false;
      part.text += " " + line;
      return true;
  }
  return false;
}

FooterPart begun(const std::string& line) {
  FooterPart out;
  if (begins_with(line, kExample)) {
    out.kind = Kind::Example;
    out.lines.push_back(line.substr(kExample.size()));
  } else if (is_part_of_table(line)) {
    out.kind = Kind::Table;
    out.lines.push_back(line);
  } else {
    out.text = line;
  }
  return out;
}

}  // namespace

std::vector<FooterPart> footer_parts(const std::string& footer) {
  std::vector<FooterPart> out;
  std::istringstream lines(footer);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    if (out.empty() || !goes_on(out.back(), line)) out.push_back(begun(line));
  }
  return out;
}

}  // namespace cgs
