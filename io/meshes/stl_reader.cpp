// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/stl_reader.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "io/bytes/byte_reader.h"

namespace cgs {

namespace {

constexpr size_t kBytesBeforeFaces = 84;
constexpr size_t kFacetBytes = 50;

/// Numbers corners by place, in the order they first appear.
class Corners {
 public:
  explicit Corners(ParsedMesh& out) : out_(out) {}
  uint32_t number(const Eigen::Vector3d& p) {
    const uint32_t out = places_.number(p);
    if (out == out_.positions.size()) out_.positions.push_back(p);
    return out;
  }
  std::array<uint32_t, 3> face(const std::array<Eigen::Vector3d, 3>& places) {
    return {number(places[0]), number(places[1]), number(places[2])};
  }

 private:
  ParsedMesh& out_;
  PlaceNumbers places_;
};

/// Colours in the two bytes behind a facet, five bits each. Source: VisCAM and SolidView, where the
/// highest bit says that there is one and blue comes lowest; Materialise Magics, whose header has
/// "COLOR=" and four bytes for the facets where the highest bit is set, and where red comes lowest.
class FacetColors {
 public:
  explicit FacetColors(std::string_view header) {
    constexpr std::string_view kMark = "COLOR=";
    const size_t at = header.find(kMark);
    if (at == std::string_view::npos || at + kMark.size() + 3 > header.size()) return;
    for (size_t k = 0; k < 3; ++k) {
      const auto byte = static_cast<uint8_t>(header[at + kMark.size() + k]);
      of_all_[static_cast<Eigen::Index>(k)] = static_cast<float>(byte) / 255;
    }
    is_by_magics_ = true;
  }

  void add(const std::array<uint32_t, 3>& face, uint16_t attribute) {
    const bool is_marked = (attribute & 0x8000) != 0;
    if (!is_by_magics_ && !is_marked) return;
    Eigen::Vector3f color(part(attribute, 10), part(attribute, 5), part(attribute, 0));
    if (is_by_magics_) std::swap(color.x(), color.z());
    if (is_by_magics_ && is_marked) color = of_all_;
    for (const uint32_t corner : face) colors_.add(corner, color);
  }

  void settle(ParsedMesh& out) {
    if (!colors_.empty()) colors_.settle(out);
  }

 private:
  static float part(uint16_t attribute, int shift) {
    return static_cast<float>((attribute >> shift) & 31) / 31;
  }

  bool is_by_magics_ = false;
  Eigen::Vector3f of_all_ = Eigen::Vector3f::Ones();
  CornerColors colors_;
};

/// Facets with a corner that is not finite; of these nothing can be kept.
class LostFacets {
 public:
  bool is_lost(const std::array<Eigen::Vector3d, 3>& corners) {
    ++all_;
    const bool out = std::any_of(
        corners.begin(), corners.end(), [](const auto& corner) { return !corner.allFinite(); });
    lost_ += out ? 1 : 0;
    return out;
  }

  /// \throws BadInput Value where more than half are lost
  void settle(ParsedMesh& out, const std::filesystem::path& path) const {
    if (lost_ == 0) return;
    const std::string found = counted(lost_, "facet") + " of " + std::to_string(all_) +
                              " with a corner that is not finite";
    if (2 * lost_ > all_) {
      throw BadInput(Defect::Value, path, found + ": that is more than half");
    }
    out.warnings.push_back("dropped " + found);
  }

 private:
  size_t all_ = 0;
  size_t lost_ = 0;
};

ParsedMesh read_binary(const std::string& bytes, const std::filesystem::path& path) {
  ByteReader reader(bytes, path);
  const std::string_view header = reader.take(80, "header");
  const auto count = reader.get<uint32_t>("number of facets");
  reader.expect_records(count, kFacetBytes, "facets");
  ParsedMesh out;
  out.digits = kFloatDigits;
  constexpr std::string_view kOurs = "cgs binary STL, unit mm";
  constexpr std::string_view kAdd = ", add ";
  if (header.starts_with(kOurs)) {
    out.comments.emplace_back("metres_per_unit 0.001");
    const std::string_view rest = header.substr(kOurs.size());
    if (rest.starts_with(kAdd)) {
      const std::string_view origin = rest.substr(kAdd.size());
      out.comments.push_back("file_origin " + std::string(origin.substr(0, origin.find(','))));
    }
  }
  Corners corners(out);
  FacetColors colors(header);
  LostFacets lost;
  out.mesh.faces.reserve(count);
  for (uint32_t f = 0; f < count; ++f) {
    (void)reader.take(12, "facet normal");
    std::array<Eigen::Vector3d, 3> places;
    for (Eigen::Vector3d& place : places) {
      for (double& c : place) c = double{reader.get<float>("corner")};
    }
    const auto attribute = reader.get<uint16_t>("attribute");
    if (lost.is_lost(places)) continue;
    out.mesh.faces.push_back(corners.face(places));
    colors.add(out.mesh.faces.back(), attribute);
  }
  lost.settle(out, path);
  colors.settle(out);
  if (reader.remaining() > 0) {
    out.warnings.push_back("trailing " + std::to_string(reader.remaining()) + " bytes ignored");
  }
  return out;
}

/// The words of a text file wherever its lines end, as programs break and indent them as they like.
class StlWords {
 public:
  StlWords(std::string_view text, const std::filesystem::path& path) : text_(text), path_(path) {}

  /// The next word; "" at the end.
  std::string_view next() {
    skip_blanks();
    const size_t end = std::min(text_.find_first_of(kBlanks, at_), text_.size());
    const std::string_view out = text_.substr(at_, end - at_);
    at_ = end;
    return out;
  }
  bool is_next(std::string_view word) { return is_same(StlWords(*this).next(), word); }
  size_t place() const { return at_; }
  void go_to(size_t place) { at_ = place; }
  void skip_line() { at_ = std::min(text_.find_first_of("\r\n", at_), text_.size()); }

  void expect(std::string_view word) {
    const std::string_view found = next();
    if (found.empty()) fail(Defect::Truncated, "the file ends before " + std::string(word));
    if (!is_same(found, word)) fail(Defect::Syntax, "expected " + std::string(word));
  }

  double number() {
    const std::string_view word = next();
    if (word.empty()) fail(Defect::Truncated, "the file ends within a vertex");
    double out = 0;
    if (!parse_measured(word, out)) {
      fail(Defect::Syntax, "'" + printable(std::string(word.substr(0, 40))) + "' is not a number");
    }
    return out;
  }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const {
    const auto lines = std::count(text_.begin(), text_.begin() + static_cast<ptrdiff_t>(at_), '\n');
    throw BadInput(defect, path_, "line " + std::to_string(lines + 1) + ": " + reason);
  }

  /// In any case: some programs write FACET.
  static bool is_same(std::string_view word, std::string_view lower) {
    return word.size() == lower.size() &&
           std::equal(word.begin(), word.end(), lower.begin(), [](char a, char b) {
             return std::tolower(static_cast<unsigned char>(a)) == b;
           });
  }

 private:
  static constexpr std::string_view kBlanks{" \t\r\n\v\f\0", 7};
  void skip_blanks() { at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size()); }

  std::string_view text_;
  const std::filesystem::path& path_;
  size_t at_ = 0;
};

/// "facet normal x y z outer loop", three times "vertex x y z", "endloop endfacet". The normal may
/// be anything: that of the corners counts.
std::array<Eigen::Vector3d, 3> read_facet(StlWords& words) {
  for (size_t k = 0; k < 4 && !words.is_next("outer"); ++k) (void)words.next();
  words.expect("outer");
  words.expect("loop");
  std::array<Eigen::Vector3d, 3> out;
  for (Eigen::Vector3d& place : out) {
    words.expect("vertex");
    for (double& c : place) c = words.number();
  }
  words.expect("endloop");
  words.expect("endfacet");
  return out;
}

// Its line, but for a facet that follows on it.
void skip_name(StlWords& words) {
  StlWords ahead = words;
  ahead.skip_line();
  const size_t end = ahead.place();
  while (words.place() < end) {
    const size_t before = words.place();
    const std::string_view word = words.next();
    const bool is_facet = StlWords::is_same(word, "facet") && words.is_next("normal");
    if (words.place() > end || word.empty() || is_facet) {
      words.go_to(before);
      return;
    }
  }
}

ParsedMesh read_text(std::string_view bytes, const std::filesystem::path& path) {
  StlWords words(bytes, path);
  ParsedMesh out;
  Corners corners(out);
  LostFacets lost;
  bool is_inside = false;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (StlWords::is_same(word, "solid") && !is_inside) {
      is_inside = true;
      skip_name(words);
    } else if (StlWords::is_same(word, "endsolid") && is_inside) {
      is_inside = false;
      words.skip_line();
    } else if (StlWords::is_same(word, "facet") && is_inside) {
      const auto places = read_facet(words);
      if (!lost.is_lost(places)) out.mesh.faces.push_back(corners.face(places));
    } else if (word.starts_with('#')) {
      words.skip_line();
    } else {
      words.fail(Defect::Syntax,
                 printable(std::string(word.substr(0, 40))) + " is not expected here");
    }
  }
  if (is_inside) words.fail(Defect::Truncated, "the file ends before 'endsolid'");
  lost.settle(out, path);
  return out;
}

// Without the mark that some editors put before text.
std::string_view without_mark(std::string_view bytes) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return bytes.starts_with(kMark) ? bytes.substr(kMark.size()) : bytes;
}

// In any case: some programs write SOLID. Blanks and a mark may go before.
bool starts_with_solid(std::string_view bytes) {
  constexpr std::string_view kSolid = "solid";
  std::string_view text = without_mark(bytes);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  return StlWords::is_same(text.substr(0, kSolid.size()), kSolid);
}

// Text holds no NUL and no control characters but blanks; where a header begins with "solid", what
// follows it tells.
bool looks_like_text(std::string_view bytes) {
  constexpr size_t kLooked = 1024;
  const std::string_view start = bytes.substr(kBytesBeforeFaces, kLooked);
  return std::none_of(start.begin(), start.end(), [](char c) {
    return c >= '\0' && c < ' ' &&
           std::string_view(" \t\r\n\v\f").find(c) == std::string_view::npos;
  });
}

bool is_binary(std::string_view bytes) {
  if (bytes.size() < kBytesBeforeFaces) return false;
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof(count));
  const uint64_t needed = kBytesBeforeFaces + uint64_t{kFacetBytes} * count;
  if (needed == bytes.size() || !starts_with_solid(bytes)) return true;
  return count > 0 && needed < bytes.size() && !looks_like_text(bytes);
}

}  // namespace

ParsedMesh read_stl(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "STL");
  const bool is_text = !is_binary(bytes);
  if (is_text && !starts_with_solid(bytes)) {
    throw BadInput(Defect::Truncated,
                   path,
                   std::to_string(bytes.size()) + " bytes, a binary STL file has at least 84");
  }
  ParsedMesh out = is_text ? read_text(without_mark(bytes), path) : read_binary(bytes, path);
  if (out.mesh.faces.empty()) throw BadInput(Defect::Empty, path, "no facet");
  return out;
}

}  // namespace cgs
