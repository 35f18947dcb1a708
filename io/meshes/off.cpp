// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/off.h"

#include "io/bytes/byte_reader.h"

namespace cgs {

namespace {

std::vector<std::string_view> words_of(std::string_view line) {
  return tokens(line.substr(0, line.find('#')));
}

struct OffHeader {
  uint64_t vertices = 0;
  uint64_t faces = 0;
  size_t color = 0;  ///< Place of the red of a vertex among its numbers; 0 = it has none.
};

/// The numbers may follow the keyword on its line.
OffHeader read_header(TextLines& lines) {
  auto words = words_of(expect_line(lines, "the OFF keyword"));
  const std::string_view keyword = words.empty() ? std::string_view() : words[0];
  if (!keyword.ends_with("OFF")) lines.fail(Defect::Magic, "does not start with OFF");
  const std::string_view kind = keyword.substr(0, keyword.size() - 3);
  if (kind.find_first_of("4n") != std::string_view::npos) {
    lines.fail(Defect::Unsupported, "only three dimensions are supported");
  }
  const bool has_colors = kind.find('C') != std::string_view::npos;
  const bool has_normals = kind.find('N') != std::string_view::npos;
  words.erase(words.begin());
  if (!words.empty() && words[0] == "BINARY") {
    lines.fail(Defect::Unsupported, "binary OFF is not supported");
  }
  if (words.empty()) words = words_of(expect_line(lines, "the numbers of vertices and faces"));
  if (words.size() < 2) lines.fail(Defect::Syntax, "expected the numbers of vertices and faces");
  const size_t color = !has_colors ? 0 : has_normals ? 6 : 3;
  return {lines.count(words[0]), lines.count(words[1]), color};
}

struct Polygon {
  std::vector<uint32_t> corners;
  bool has_color = false;  ///< Numbers follow the corners.
};

Polygon read_polygon(TextLines& lines, uint64_t vertices) {
  const auto words = words_of(expect_line(lines, "a face"));
  const uint64_t count = words.empty() ? 0 : lines.count(words[0]);
  if (words.empty() || count > words.size() - 1) {
    lines.fail(Defect::Count, "a face has fewer corners than it says");
  }
  Polygon out{{}, words.size() > count + 1};
  for (uint64_t k = 1; k <= count; ++k) {
    const uint64_t corner = lines.count(words[k]);
    if (corner >= vertices) {
      lines.fail(
          Defect::Ref,
          "a face names vertex " + std::to_string(corner) + " of " + std::to_string(vertices));
    }
    out.corners.push_back(static_cast<uint32_t>(corner));
  }
  return out;
}

}  // namespace

ParsedMesh read_off(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OFF");
  TextLines lines(bytes, path);
  const auto [vertices, faces, color] = read_header(lines);
  ByteReader(bytes, path).expect_records(vertices, 6, "vertices");
  ByteReader(bytes, path).expect_records(faces, 2, "faces");
  if (vertices == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  ParsedMesh out;
  std::vector<size_t> colored;  // vertices that state a colour
  for (uint64_t i = 0; i < vertices; ++i) {
    const auto words = words_of(expect_line(lines, "a vertex"));
    if (words.size() < 3) lines.fail(Defect::Syntax, "a vertex needs three coordinates");
    out.positions.emplace_back(
        lines.number(words[0]), lines.number(words[1]), lines.number(words[2]));
    if (color == 0 || words.size() < color + 3) continue;
    colored.push_back(out.positions.size() - 1);
    Eigen::Vector3f& rgb = out.mesh.colors.emplace_back();
    for (size_t c = 0; c < 3; ++c) {
      rgb[static_cast<Eigen::Index>(c)] = static_cast<float>(lines.number(words[color + c]));
    }
  }
  settle_colors(out);
  fill_in_colors(out, colored);
  uint64_t dropped = 0;
  bool has_face_colors = false;
  for (uint64_t i = 0; i < faces; ++i) {
    const Polygon polygon = read_polygon(lines, vertices);
    if (polygon.corners.size() < 3) ++dropped;
    has_face_colors |= polygon.has_color;
    append_polygon(polygon.corners, out.positions, out.mesh.faces);
  }
  if (has_face_colors) out.warnings.emplace_back("colours of faces are not read");
  if (dropped > 0) {
    out.warnings.push_back("dropped " + std::to_string(dropped) + " faces of fewer than 3 corners");
  }
  return out;
}

}  // namespace cgs
