// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/rows.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cgs {

namespace {

constexpr std::array<size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};  // in the order of PlyType

size_t size_of(PlyType type) { return kSizes.at(static_cast<size_t>(type)); }

template <typename T>
double number_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

double native_number(const char* bytes, PlyType type) {
  switch (type) {
    case PlyType::Int8:
      return number_at<int8_t>(bytes);
    case PlyType::UInt8:
      return number_at<uint8_t>(bytes);
    case PlyType::Int16:
      return number_at<int16_t>(bytes);
    case PlyType::UInt16:
      return number_at<uint16_t>(bytes);
    case PlyType::Int32:
      return number_at<int32_t>(bytes);
    case PlyType::UInt32:
      return number_at<uint32_t>(bytes);
    case PlyType::Float32:
      return number_at<float>(bytes);
    case PlyType::Float64:
      return number_at<double>(bytes);
  }
  return 0;
}

/// Bytes of one record with every list empty: no record can be shorter.
uint64_t smallest_record(const PlyElement& element) {
  uint64_t bytes = 0;
  for (const PlyProperty& p : element.properties)
    bytes += size_of(p.is_list ? p.count_type : p.type);
  return bytes;
}

class BinaryRows {
 public:
  BinaryRows(std::string_view data, const std::filesystem::path& path, bool big_endian)
      : reader_(data, path), big_endian_(big_endian) {}

  /// More records than bytes is a wrong count; fewer bytes than the records need, a cut file.
  void expect(const PlyElement& element) const {
    if (element.properties.empty()) return;
    const uint64_t each = smallest_record(element);
    uint64_t bytes = 0;
    const bool overflow = __builtin_mul_overflow(element.count, each, &bytes);
    if (!overflow && bytes <= reader_.remaining()) return;
    if (overflow || element.count > reader_.remaining()) {
      reader_.expect_records(element.count, each, element.name + " records");
    }
    reader_.fail(Defect::Truncated,
                 std::to_string(element.count) + " " + element.name + " records need " +
                     std::to_string(bytes) + " bytes, " + std::to_string(reader_.remaining()) +
                     " are left");
  }

  void read(const PlyElement& element, PlyRow& row) {
    for (size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.is_list) {
        row.values[i] = number(property.type, property.name);
        continue;
      }
      const double count = number(property.count_type, property.name);
      if (count < 0)
        reader_.fail(Defect::Count, "list " + property.name + " has a negative length");
      const auto entries = static_cast<uint64_t>(count);
      if (entries > reader_.remaining()) {
        reader_.expect_records(entries, size_of(property.type), property.name + " entries");
      }
      row.values[i] = count;
      row.lists[i].resize(entries);
      for (double& entry : row.lists[i]) entry = number(property.type, property.name);
    }
  }

  uint64_t remaining() const { return reader_.remaining(); }

 private:
  double number(PlyType type, std::string_view what) {
    const size_t size = size_of(type);
    const std::string_view bytes = reader_.take(size, what);
    if (!big_endian_) return native_number(bytes.data(), type);
    std::array<char, 8> swapped{};
    for (size_t i = 0; i < size; ++i) swapped.at(i) = bytes[size - 1 - i];
    return native_number(swapped.data(), type);
  }

  ByteReader reader_;
  bool big_endian_;
};

// Digits of a number that no double holds; infinity itself is spelled out.
bool is_too_large(std::string_view token, double value) {
  return std::isinf(value) && token.find_first_of("iI#") == std::string_view::npos;
}

/// One record per line, as every writer does it.
class AsciiRows {
 public:
  AsciiRows(std::string_view data, const std::filesystem::path& path, const PlyHeader& header)
      : data_(data), path_(path), line_(header.line_count), line_end_(header.line_end) {}

  void expect(const PlyElement& element) const {
    if (element.properties.empty() || element.count <= data_.size()) return;
    ByteReader(data_, path_).expect_records(element.count, 1, element.name + " records");
  }

  void read(const PlyElement& element, PlyRow& row) {
    if (element.properties.empty()) return;
    next_line(element);
    for (size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.is_list) {
        row.values[i] = number(property.type, property.name);
        continue;
      }
      const double count = number(property.count_type, property.name);
      if (count < 0) fail(Defect::Count, "list " + property.name + " has a negative length");
      if (count > static_cast<double>(rest_.size())) {
        fail(Defect::Count, "list " + property.name + " is longer than its line");
      }
      row.values[i] = count;
      row.lists[i].resize(static_cast<size_t>(count));
      for (double& entry : row.lists[i]) entry = number(property.type, property.name);
    }
    if (!next_token().empty()) fail(Defect::Syntax, "more values than properties");
  }

  uint64_t remaining() const {
    const size_t text = data_.find_first_not_of(" \t\r\n");
    return text == std::string_view::npos ? 0 : data_.size() - text;
  }

 private:
  void next_line(const PlyElement& element) {
    do {
      ++line_;
      if (data_.empty()) fail(Defect::Truncated, "the file ends within element " + element.name);
      const size_t end = std::min(data_.find(line_end_), data_.size());
      rest_ = data_.substr(0, end);
      data_.remove_prefix(std::min(end + 1, data_.size()));
    } while (rest_.find_first_not_of(" \t\r") == std::string_view::npos);
  }

  std::string_view next_token() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r"), rest_.size()));
    const size_t end = std::min(rest_.find_first_of(" \t\r"), rest_.size());
    const std::string_view token = rest_.substr(0, end);
    rest_.remove_prefix(end);
    return token;
  }

  double number(PlyType type, const std::string& what) {
    const std::string_view token = next_token();
    if (token.empty()) fail(Defect::Syntax, "no value for property " + what);
    double value = 0;
    const bool is_float = type == PlyType::Float32 || type == PlyType::Float64;
    const bool is_number = is_float ? parse_measured(token, value) && !is_too_large(token, value)
                                    : parse_number(token, value) && value == std::floor(value);
    if (!is_number) {
      fail(Defect::Syntax,
           "property " + what + ": '" + printable(std::string(token.substr(0, 40))) +
               "' is not a number of its type");
    }
    return value;
  }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const {
    throw BadInput(defect, path_, "line " + std::to_string(line_) + ": " + reason);
  }

  std::string_view data_;
  const std::filesystem::path& path_;
  size_t line_;
  char line_end_;
  std::string_view rest_;
};

template <typename Rows>
uint64_t visit_all(Rows rows, const PlyHeader& header, const PlyRowVisitor& visit) {
  for (const PlyElement& element : header.elements) {
    rows.expect(element);
    PlyRow row{std::vector<double>(element.properties.size()),
               std::vector<std::vector<double>>(element.properties.size())};
    const uint64_t count = element.properties.empty() ? 0 : element.count;
    for (uint64_t i = 0; i < count; ++i) {
      rows.read(element, row);
      visit(element, i, row);
    }
  }
  return rows.remaining();
}

}  // namespace

uint64_t read_ply_rows(std::string_view bytes,
                       const std::filesystem::path& path,
                       const PlyHeader& header,
                       const PlyRowVisitor& visit) {
  const std::string_view data = bytes.substr(header.data_offset);
  if (header.format == PlyFormat::Ascii) {
    return visit_all(AsciiRows(data, path, header), header, visit);
  }
  const bool big_endian = header.format == PlyFormat::BinaryBigEndian;
  return visit_all(BinaryRows(data, path, big_endian), header, visit);
}

}  // namespace cgs
