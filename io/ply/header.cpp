// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace cgs {

namespace {

constexpr size_t kMaxProperties = 4096;  // splats with features have hundreds
constexpr size_t kMaxElements = 64;

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> tokens;
  size_t at = 0;
  while ((at = line.find_first_not_of(" \t", at)) != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(" \t", at), line.size());
    tokens.push_back(line.substr(at, end - at));
    at = end;
  }
  return tokens;
}

std::optional<PlyType> type_of(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypes = {
      {{"char", PlyType::Int8},
       {"int8", PlyType::Int8},
       {"uchar", PlyType::UInt8},
       {"uint8", PlyType::UInt8},
       {"short", PlyType::Int16},
       {"int16", PlyType::Int16},
       {"ushort", PlyType::UInt16},
       {"uint16", PlyType::UInt16},
       {"int", PlyType::Int32},
       {"int32", PlyType::Int32},
       {"uint", PlyType::UInt32},
       {"uint32", PlyType::UInt32},
       {"float", PlyType::Float32},
       {"float32", PlyType::Float32},
       {"double", PlyType::Float64},
       {"float64", PlyType::Float64}}};
  for (const auto& [key, type] : kTypes) {
    if (key == name) return type;
  }
  return std::nullopt;
}

bool is_float(PlyType type) { return type == PlyType::Float32 || type == PlyType::Float64; }

/// A token of the file, short enough and clean enough for a message.
std::string in_quotes(std::string_view token) {
  std::string out = "'";
  out += printable(std::string(token.substr(0, 40)));
  return out += "'";
}

/// Reads the header line by line; one member function per keyword.
class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, const std::filesystem::path& path, const ReadLimits& limits)
      : bytes_(bytes), path_(path), limits_(limits) {}

  PlyHeader parse() {
    if (!bytes_.starts_with("ply\n") && !bytes_.starts_with("ply\r")) {
      refuse_foreign_content(path_, bytes_, "PLY");
      throw BadInput(Defect::Magic, path_, "expected PLY, the first line is not 'ply'");
    }
    // As plyfile has it: the first line says how all of them end.
    if (bytes_.starts_with("ply\r") && !bytes_.starts_with("ply\r\n")) header_.line_end = '\r';
    (void)next_line();
    bool has_format = false;
    for (;;) {
      const std::string_view line = next_line();
      const std::vector<std::string_view> tokens = split(line);
      if (tokens.empty()) continue;
      if (tokens[0] == "end_header") break;
      if (tokens[0] == "comment" || tokens[0] == "obj_info") {
        const size_t text = std::min(line.size(), tokens[0].size() + 1);
        header_.comments.emplace_back(line.substr(text));
      } else if (tokens[0] == "format") {
        if (has_format) fail(Defect::Syntax, "second format line");
        has_format = true;
        add_format(tokens);
      } else if (tokens[0] == "element") {
        add_element(tokens);
      } else if (tokens[0] == "property") {
        add_property(tokens);
      } else {
        fail(Defect::Syntax, "unknown keyword " + in_quotes(tokens[0]));
      }
    }
    if (!has_format) fail(Defect::Syntax, "no format line");
    header_.data_offset = offset_;
    header_.line_count = line_;
    return std::move(header_);
  }

 private:
  std::string_view next_line() {
    ++line_;
    const std::string_view rest = bytes_.substr(offset_);
    const size_t end = rest.find(header_.line_end);
    if (offset_ + std::min(end, rest.size()) > limits_.max_header_bytes) {
      throw LimitError(printable(path_) + ": header exceeds " +
                       std::to_string(limits_.max_header_bytes >> 10) + " KiB");
    }
    if (end == std::string_view::npos) {
      fail(Defect::Truncated, "the header ends without end_header");
    }
    offset_ += end + 1;
    std::string_view line = rest.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  void add_format(const std::vector<std::string_view>& tokens) {
    if (tokens.size() != 3) fail(Defect::Syntax, "a format line has a name and a version");
    if (tokens[1] == "ascii") {
      header_.format = PlyFormat::Ascii;
    } else if (tokens[1] == "binary_little_endian") {
      header_.format = PlyFormat::BinaryLittleEndian;
    } else if (tokens[1] == "binary_big_endian") {
      header_.format = PlyFormat::BinaryBigEndian;
    } else {
      fail(Defect::Unsupported, "format " + in_quotes(tokens[1]));
    }
    if (tokens[2] != "1.0") fail(Defect::Unsupported, "format version " + in_quotes(tokens[2]));
  }

  void add_element(const std::vector<std::string_view>& tokens) {
    PlyElement element;
    if (tokens.size() != 3 || !parse_number(tokens[2], element.count)) {
      fail(Defect::Syntax, "an element line has a name and a count >= 0");
    }
    element.name = tokens[1];
    if (header_.find(element.name) != nullptr) {
      fail(Defect::Syntax, "second element " + in_quotes(element.name));
    }
    if (header_.elements.size() == kMaxElements) {
      throw LimitError(printable(path_) + ": more than " + std::to_string(kMaxElements) +
                       " elements");
    }
    header_.elements.push_back(std::move(element));
  }

  void add_property(const std::vector<std::string_view>& tokens) {
    if (header_.elements.empty()) fail(Defect::Syntax, "property before any element");
    PlyElement& element = header_.elements.back();
    PlyProperty property;
    property.is_list = tokens.size() > 1 && tokens[1] == "list";
    if (tokens.size() != (property.is_list ? 5 : 3)) {
      fail(Defect::Syntax, "a property line has a type and a name");
    }
    property.name = tokens.back();
    property.type = checked_type(tokens[tokens.size() - 2]);
    if (property.is_list) {
      property.count_type = checked_type(tokens[2]);
      if (is_float(property.count_type)) {
        fail(Defect::Unsupported, "list " + in_quotes(property.name) + " has a float count");
      }
    }
    if (element.find(property.name) >= 0) {
      fail(Defect::Syntax, "second property " + in_quotes(property.name));
    }
    if (element.properties.size() == kMaxProperties) {
      throw LimitError(printable(path_) + ": an element has more than " +
                       std::to_string(kMaxProperties) + " properties");
    }
    element.properties.push_back(std::move(property));
  }

  PlyType checked_type(std::string_view name) const {
    const std::optional<PlyType> type = type_of(name);
    if (!type) fail(Defect::Unsupported, "scalar type " + in_quotes(name));
    return *type;
  }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const {
    throw BadInput(defect, path_, "line " + std::to_string(line_) + ": " + reason);
  }

  std::string_view bytes_;
  const std::filesystem::path& path_;
  const ReadLimits& limits_;
  PlyHeader header_;
  size_t offset_ = 0;
  size_t line_ = 0;
};

}  // namespace

int PlyElement::find(std::string_view property) const {
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property) return static_cast<int>(i);
  }
  return -1;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
  for (const PlyElement& candidate : elements) {
    if (candidate.name == element) return &candidate;
  }
  return nullptr;
}

PlyHeader parse_ply_header(std::string_view bytes,
                           const std::filesystem::path& path,
                           const ReadLimits& limits) {
  return HeaderParser(bytes, path, limits).parse();
}

std::optional<PlyHeader> read_ply_header(const std::filesystem::path& path) {
  const std::string start = read_file_start(path, ReadLimits().max_header_bytes);
  if (!start.starts_with("ply")) return std::nullopt;
  return parse_ply_header(start, path);
}

}  // namespace cgs
