// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/off.h"

#include "io/byte_reader.h"

namespace cgs {

namespace {

std::vector<std::string_view> words_of(std::string_view line) {
  return tokens(line.substr(0, line.find('#')));
}

/// Numbers of vertices and faces; they may follow the keyword on its line.
std::array<uint64_t, 2> read_counts(TextLines& lines) {
  auto words = words_of(expect_line(lines, "the OFF keyword"));
  const std::string_view keyword = words.empty() ? std::string_view() : words[0];
  if (!keyword.ends_with("OFF")) lines.fail(Defect::Magic, "does not start with OFF");
  const std::string_view kind = keyword.substr(0, keyword.size() - 3);
  if (kind.find_first_of("4n") != std::string_view::npos) {
    lines.fail(Defect::Unsupported, "only three dimensions are supported");
  }
  words.erase(words.begin());
  if (!words.empty() && words[0] == "BINARY") {
    lines.fail(Defect::Unsupported, "binary OFF is not supported");
  }
  if (words.empty()) words = words_of(expect_line(lines, "the numbers of vertices and faces"));
  if (words.size() < 2) lines.fail(Defect::Syntax, "expected the numbers of vertices and faces");
  return {lines.count(words[0]), lines.count(words[1])};
}

std::vector<uint32_t> read_polygon(TextLines& lines, uint64_t vertices) {
  const auto words = words_of(expect_line(lines, "a face"));
  const uint64_t count = words.empty() ? 0 : lines.count(words[0]);
  if (words.empty() || count > words.size() - 1) {
    lines.fail(Defect::Count, "a face has fewer corners than it says");
  }
  std::vector<uint32_t> corners;
  for (uint64_t k = 1; k <= count; ++k) {
    const uint64_t corner = lines.count(words[k]);
    if (corner >= vertices) {
      lines.fail(
          Defect::Ref,
          "a face names vertex " + std::to_string(corner) + " of " + std::to_string(vertices));
    }
    corners.push_back(static_cast<uint32_t>(corner));
  }
  return corners;
}

}  // namespace

ParsedMesh read_off(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OFF");
  TextLines lines(bytes, path);
  const auto [vertices, faces] = read_counts(lines);
  ByteReader(bytes, path).expect_records(vertices, 6, "vertices");
  ByteReader(bytes, path).expect_records(faces, 2, "faces");
  if (vertices == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  ParsedMesh out;
  for (uint64_t i = 0; i < vertices; ++i) {
    const auto words = words_of(expect_line(lines, "a vertex"));
    if (words.size() < 3) lines.fail(Defect::Syntax, "a vertex needs three coordinates");
    out.positions.emplace_back(
        lines.number(words[0]), lines.number(words[1]), lines.number(words[2]));
  }
  uint64_t dropped = 0;
  for (uint64_t i = 0; i < faces; ++i) {
    const auto corners = read_polygon(lines, vertices);
    if (corners.size() < 3) ++dropped;
    append_polygon(corners, out.positions, out.mesh.faces);
  }
  if (dropped > 0) {
    out.warnings.push_back("dropped " + std::to_string(dropped) + " faces of fewer than 3 corners");
  }
  return out;
}

}  // namespace cgs
