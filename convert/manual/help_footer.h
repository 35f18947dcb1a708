// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace cgs {

/// A part of what stands below the options in the help of a command.
struct FooterPart {
  enum class Kind {
    Text,     ///< sentences: text
    Terms,    ///< text introduces terms
    Table,    ///< columns that must stay where they are: lines
    Example,  ///< commands to type: lines
  };
  Kind kind = Kind::Text;
  std::string text;
  std::vector<std::string> lines;
  std::vector<std::pair<std::string, std::string>> terms;  ///< each with what it means
};

/// The parts of a footer. Examples begin with "Example: " and go on in lines indented as far; terms
/// are indented by two, below a line that ends with a colon; lines that hold three spaces in a row
/// are a table, with those between that end with a comma; all others are sentences.
std::vector<FooterPart> footer_parts(const std::string& footer);

}  // namespace cgs
