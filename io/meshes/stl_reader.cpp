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

 private:
  ParsedMesh& out_;
  PlaceNumbers places_;
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
      out.comments.push_back("file_origin " + std::string(rest.substr(kAdd.size())));
    }
  }
  Corners corners(out);
  out.mesh.faces.reserve(count);
  for (uint32_t f = 0; f < count; ++f) {
    (void)reader.take(12, "facet normal");
    std::array<uint32_t, 3> face{};
    for (uint32_t& corner : face) {
      const auto x = reader.get<float>("corner");
      const auto y = reader.get<float>("corner");
      const auto z = reader.get<float>("corner");
      const Eigen::Vector3d p(x, y, z);
      if (!p.allFinite()) {
        throw BadInput(
            Defect::Value, path, "facet " + std::to_string(f) + " has a corner that is not finite");
      }
      corner = corners.number(p);
    }
    (void)reader.take(2, "attribute");
    out.mesh.faces.push_back(face);
  }
  if (reader.remaining() > 0) {
    out.warnings.push_back("trailing " + std::to_string(reader.remaining()) + " bytes ignored");
  }
  return out;
}

// One facet after its "facet" line: "outer loop", three times "vertex x y z", "endloop",
// "endfacet".
std::array<uint32_t, 3> read_facet(TextLines& lines, Corners& corners) {
  const auto expect = [&](std::string_view word) {
    auto words = tokens(expect_line(lines, word));
    if (words.empty() || words[0] != word) {
      lines.fail(Defect::Syntax, std::string("expected ").append(word));
    }
    return words;
  };
  expect("outer");
  std::array<uint32_t, 3> face{};
  for (uint32_t& corner : face) {
    const auto words = expect("vertex");
    if (words.size() != 4) lines.fail(Defect::Syntax, "a vertex needs three coordinates");
    corner =
        corners.number({lines.number(words[1]), lines.number(words[2]), lines.number(words[3])});
  }
  expect("endloop");
  expect("endfacet");
  return face;
}

ParsedMesh read_text(const std::string& bytes, const std::filesystem::path& path) {
  TextLines lines(bytes, path);
  ParsedMesh out;
  Corners corners(out);
  bool inside = false;
  while (const auto line = lines.next_data()) {
    const auto words = tokens(*line);
    if (words[0] == "solid" && !inside) {
      inside = true;
    } else if (words[0] == "endsolid" && inside) {
      inside = false;
    } else if (words[0] == "facet" && inside) {
      out.mesh.faces.push_back(read_facet(lines, corners));
    } else {
      lines.fail(Defect::Syntax,
                 printable(std::string(words[0].substr(0, 40))) + " is not expected here");
    }
  }
  if (inside) lines.fail(Defect::Truncated, "the file ends before 'endsolid'");
  return out;
}

// In any case: some programs write SOLID.
bool starts_with_solid(std::string_view bytes) {
  constexpr std::string_view kSolid = "solid";
  return bytes.size() >= kSolid.size() &&
         std::equal(kSolid.begin(), kSolid.end(), bytes.begin(), [](char a, char b) {
           return a == std::tolower(static_cast<unsigned char>(b));
         });
}

bool is_binary(const std::string& bytes) {
  if (bytes.size() < kBytesBeforeFaces) return false;
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof(count));
  if (kBytesBeforeFaces + uint64_t{kFacetBytes} * count == bytes.size()) return true;
  return !starts_with_solid(bytes);
}

}  // namespace

ParsedMesh read_stl(const std::filesystem::path& path) {
  std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "STL");
  if (!is_binary(bytes) && !starts_with_solid(bytes)) {
    throw BadInput(Defect::Truncated,
                   path,
                   std::to_string(bytes.size()) + " bytes, a binary STL file has at least 84");
  }
  if (!is_binary(bytes) && !bytes.starts_with("solid")) {
    std::transform(bytes.begin(), bytes.end(), bytes.begin(), [](char c) {
      return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    });
  }
  ParsedMesh out = is_binary(bytes) ? read_binary(bytes, path) : read_text(bytes, path);
  if (out.mesh.faces.empty()) throw BadInput(Defect::Empty, path, "no facet");
  return out;
}

}  // namespace cgs
