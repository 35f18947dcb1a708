// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/npy.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <half.h>

namespace cgs {

namespace {

struct Header {
  std::string descr;
  bool fortran_order = false;
  std::vector<size_t> shape;
};

// Reads the one dict literal NumPy writes: string keys; string, bool or tuple-of-int values.
class HeaderParser {
 public:
  HeaderParser(std::string_view text, const ByteReader& file) : text_(text), file_(file) {}

  Header parse() {
    Header header;
    bool has_descr = false;
    bool has_order = false;
    bool has_shape = false;
    expect('{');
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr" && !std::exchange(has_descr, true)) {
        header.descr = quoted();
      } else if (key == "fortran_order" && !std::exchange(has_order, true)) {
        header.fortran_order = boolean();
      } else if (key == "shape" && !std::exchange(has_shape, true)) {
        header.shape = tuple();
      } else {
        fail("unexpected key '" + key + "'");
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    skip_space();
    if (at_ != text_.size()) fail("something follows the header dictionary");
    if (!has_descr || !has_order || !has_shape) fail("descr, fortran_order or shape is missing");
    return header;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    file_.fail(Defect::Syntax, "npy header, character " + std::to_string(at_) + ": " + reason);
  }
  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
  }
  bool accept(char c) {
    skip_space();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!accept(c)) fail(std::string("expected '") + c + "'");
  }
  std::string quoted() {
    skip_space();
    if (at_ < text_.size() && text_[at_] == '[') {
      file_.fail(Defect::Unsupported, "structured element types are not read");
    }
    const char quote = at_ < text_.size() ? text_[at_] : '\0';
    if (quote != '\'' && quote != '"') fail("expected a quoted string");
    const size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos) fail("string never ends");
    std::string out(text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return out;
  }
  bool boolean() {
    skip_space();
    for (const std::string_view word : {"True", "False"}) {
      if (text_.substr(at_, word.size()) != word) continue;
      at_ += word.size();
      return word == "True";
    }
    fail("expected True or False");
  }
  std::vector<size_t> tuple() {
    constexpr size_t kMaxDimensions = 32;  // NumPy's own limit
    std::vector<size_t> out;
    expect('(');
    while (!accept(')')) {
      skip_space();
      const size_t end = std::min(text_.find_first_not_of("0123456789", at_), text_.size());
      uint64_t value = 0;
      if (!parse_number(text_.substr(at_, end - at_), value)) fail("expected a size");
      at_ = end;
      out.push_back(value);
      if (out.size() > kMaxDimensions) fail("more than 32 dimensions");
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return out;
  }

  std::string_view text_;
  const ByteReader& file_;
  size_t at_ = 0;
};

std::string_view header_text(ByteReader& file, const ReadLimits& limits) {
  if (file.remaining() < 6 || file.take(6, "magic") != std::string_view("\x93NUMPY", 6)) {
    throw BadInput(Defect::Magic, file.path(), "expected a .npy file");
  }
  const int major = file.get<uint8_t>("version");
  file.get<uint8_t>("version");
  if (major < 1 || major > 3) {
    throw BadInput(Defect::Magic,
                   file.path(),
                   "npy version " + std::to_string(major) + ", known are 1, 2 and 3");
  }
  const uint64_t length =
      major == 1 ? file.get<uint16_t>("header length") : file.get<uint32_t>("header length");
  if (length > limits.max_header_bytes) {
    file.fail(Defect::Count,
              "declares a header of " + std::to_string(length) + " bytes, allowed are " +
                  std::to_string(limits.max_header_bytes));
  }
  return file.take(length, "npy header");
}

size_t element_count(const std::vector<size_t>& shape, const ByteReader& file) {
  size_t count = 1;
  for (const size_t n : shape) {
    if (__builtin_mul_overflow(count, n, &count)) {
      file.fail(Defect::Count, "the product of the declared shape overflows");
    }
  }
  return count;
}

template <typename T>
double number(T value) {
  return static_cast<double>(value);
}
double number(Imath::half value) { return static_cast<double>(static_cast<float>(value)); }

template <typename T>
void convert(std::string_view bytes, bool swap, std::vector<double>& values) {
  for (size_t i = 0; i < values.size(); ++i) {
    std::array<char, sizeof(T)> element{};
    std::memcpy(element.data(), bytes.data() + i * sizeof(T), sizeof(T));
    if (swap) std::reverse(element.begin(), element.end());
    T value;
    std::memcpy(&value, element.data(), sizeof(T));
    values[i] = number(value);
  }
}

struct ElementType {
  std::string_view name;  ///< Of the type, without the byte order.
  size_t bytes = 0;
  int whole_bits = 0;
  void (*convert)(std::string_view bytes, bool swap, std::vector<double>& values) = nullptr;
};
constexpr std::array<ElementType, 5> kElementTypes = {{{"f2", 2, 0, convert<Imath::half>},
                                                       {"f4", 4, 0, convert<float>},
                                                       {"f8", 8, 0, convert<double>},
                                                       {"i2", 2, 16, convert<int16_t>},
                                                       {"u2", 2, 16, convert<uint16_t>}}};

// nullptr for others
const ElementType* element_type(std::string_view descr) {
  if (!descr.starts_with('<') && !descr.starts_with('>')) return nullptr;
  const auto* const found =
      std::find_if(kElementTypes.begin(), kElementTypes.end(), [&](const ElementType& type) {
        return type.name == descr.substr(1);
      });
  return found == kElementTypes.end() ? nullptr : found;
}

// Fortran order has the first index fastest: walk it with an odometer over C order.
std::vector<double> from_fortran_order(const NpyArray& array) {
  std::vector<double> out(array.values.size());
  std::vector<size_t> index(array.shape.size(), 0);
  for (double& value : out) {
    size_t offset = 0;
    for (size_t d = array.shape.size(); d-- > 0;) offset = offset * array.shape[d] + index[d];
    value = array.values[offset];
    for (size_t d = array.shape.size(); d-- > 0;) {
      if (++index[d] < array.shape[d]) break;
      index[d] = 0;
    }
  }
  return out;
}

// \throws BadInput Unsupported for elements of other types
Header known_header(ByteReader& file, const ReadLimits& limits) {
  const std::string_view text = header_text(file, limits);
  Header header = HeaderParser(text, file).parse();
  if (element_type(header.descr) == nullptr) {
    file.fail(Defect::Unsupported,
              "element type '" + header.descr + "', known are f2, f4, f8, i2 and u2 after < or >");
  }
  return header;
}

}  // namespace

NpyArray read_npy(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string bytes = read_file(path, limits);
  refuse_foreign_content(path, bytes, "npy");
  return parse_npy(bytes, path, limits);
}

std::optional<std::array<size_t, 2>> picture_sides(const std::vector<size_t>& shape) {
  std::vector<size_t> sides = shape;
  if (sides.size() > 2) std::erase(sides, size_t{1});
  if (sides.size() != 2 || sides[0] == 0 || sides[1] == 0) return std::nullopt;
  return std::array{sides[0], sides[1]};
}

std::optional<NpyArray> npy_outline(std::string_view start) {
  try {
    ByteReader file(start, "");
    const Header header = known_header(file, {});
    return NpyArray{header.shape, {}, element_type(header.descr)->whole_bits};
  } catch (const Error&) {
    return std::nullopt;
  }
}

NpyArray parse_npy(std::string_view bytes,
                   const std::filesystem::path& path,
                   const ReadLimits& limits) {
  ByteReader file(bytes, path);
  const Header header = known_header(file, limits);
  const ElementType& type = *element_type(header.descr);
  const size_t count = element_count(header.shape, file);
  size_t needed = 0;
  if (__builtin_mul_overflow(count, type.bytes, &needed) || needed > file.remaining()) {
    // A file that holds part of what it promises was cut; one that could never hold it lies.
    constexpr size_t kAbsurd = size_t{1} << 40;
    const bool is_absurd = count > kAbsurd;
    file.fail(is_absurd ? Defect::Count : Defect::Truncated,
              "the shape needs " + std::to_string(count) + " values of " +
                  std::to_string(type.bytes) + " bytes, " + std::to_string(file.remaining()) +
                  " bytes are left");
  }
  NpyArray array{header.shape, std::vector<double>(count), type.whole_bits};
  type.convert(file.take(needed, "npy values"), header.descr.starts_with('>'), array.values);
  if (header.fortran_order && array.shape.size() > 1) array.values = from_fortran_order(array);
  return array;
}

}  // namespace cgs
