// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libcgs/core/error.h"

namespace cgs {

/// The start of an element, valid while its handler runs.
class XmlElement {
 public:
  XmlElement(const char* name,
             const char** attributes,
             uint64_t line,
             const std::filesystem::path& path)
      : name_(name), attributes_(attributes), line_(line), path_(path) {}

  /// With its namespace: "http://…/core/2015/02|vertex".
  std::string_view name() const { return name_; }
  /// Attributes without a prefix are called by their bare name, others as elements are.
  std::optional<std::string_view> find(std::string_view attribute) const;
  /// \throws BadInput Schema if it is not there
  std::string_view at(std::string_view attribute) const;
  /// Also with a leading '+'.
  /// \throws BadInput Schema, Syntax (no number), Value (not finite)
  double number(std::string_view attribute) const;
  /// A number that may be not finite, see parse_measured().
  /// \throws BadInput Schema, Syntax
  double measured(std::string_view attribute) const;
  /// As number(), of all that blanks separate.
  std::vector<double> numbers(std::string_view attribute) const;
  /// A whole number.
  /// \throws BadInput Schema, Syntax
  uint64_t count(std::string_view attribute) const;
  /// \throws BadInput that names the line
  [[noreturn]] void fail(Defect defect, const std::string& reason) const;

 private:
  double parse(std::string_view attribute, std::string_view word) const;

  std::string_view name_;
  const char** attributes_;
  uint64_t line_;
  const std::filesystem::path& path_;
};

/// What to call while an XML file is read; each may be empty, and may throw.
struct XmlHandlers {
  std::function<void(const XmlElement&)> start;
  std::function<void(std::string_view name)> end;
  std::function<void(std::string_view text)> text;  ///< In pieces.
  std::function<void(std::string_view prefix, std::string_view uri)> prefix;
};

/// Reads XML from start to end, keeping nothing of it.
/// \param path  for messages
/// \throws BadInput Syntax naming line and column, Truncated (it ends too early), Unsupported (a
///         document type declaration: entities are not expanded); LimitError (elements more than 64
///         deep; a tag or comment of more than 4 MiB: before version 2.6, expat starts over with
///         these at each piece, CVE-2023-52425); whatever a handler throws
/// Source: XML 1.0 and Namespaces in XML 1.0, W3C.
void read_xml(std::string_view bytes,
              const std::filesystem::path& path,
              const XmlHandlers& handlers);

}  // namespace cgs
