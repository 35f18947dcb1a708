// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "io/bytes/mesh_arrays.h"
#include "io/meshes/material_labels.h"

namespace cgs {

namespace {

std::optional<Provenance> provenance_of_group(std::string_view name) {
  for (const Provenance known : kProvenanceOrder) {
    std::string group(provenance_name(known));
    std::replace(group.begin(), group.end(), ' ', '_');
    if (name == group) return known;
  }
  return std::nullopt;
}

// Comments and names of files may end like a line that goes on: "# from C:\models\".
bool may_go_on(std::string_view line) {
  const auto words = tokens(line);
  return !words.empty() && !words[0].starts_with('#') && words[0] != "mtllib";
}

class ObjRows {
 public:
  ObjRows(std::string_view bytes, const std::filesystem::path& path) : lines_(bytes, path) {}

  ParsedMesh read() {
    std::string joined;
    while (const auto line = lines_.next()) {
      if (line->starts_with("# ")) out_.comments.emplace_back(line->substr(2, 200));
      const bool goes_on = line->ends_with('\\') && (!joined.empty() || may_go_on(*line));
      joined.append(*line, 0, line->size() - (goes_on ? 1 : 0));
      constexpr size_t kLongest = size_t{4} << 20;
      if (joined.size() > kLongest) {
        throw LimitError(printable(lines_.path()) + ": a line is longer than 4 MiB");
      }
      if (goes_on) {
        joined += ' ';
        continue;
      }
      add(joined);
      joined.clear();
    }
    add(joined);
    finish();
    return std::move(out_);
  }

 private:
  void add(std::string_view line) {
    if (line.starts_with('#')) return;
    const auto words = tokens(line);
    if (words.empty()) return;
    if (words[0] == "v") add_vertex(words);
    if (words[0] == "f") add_face(words);
    if (words[0] == "usemtl") set_material(words);
    if (words[0] == "vt") has_texture_ = true;
    if (words[0] == "g") {
      group_ = words.size() == 2 ? provenance_of_group(words[1]) : std::nullopt;
    }
  }

  // Programs leave blanks in names as they are.
  void set_material(const std::vector<std::string_view>& words) {
    has_materials_ = true;
    const char* const end = words.back().data() + words.back().size();
    const char* const begin = words.size() > 1 ? words[1].data() : end;
    material_ = provenance_of_material({begin, static_cast<size_t>(end - begin)});
  }

  double number(std::string_view word) const {
    double value = 0;
    if (!parse_number(word, value)) {
      lines_.fail(Defect::Syntax,
                  "'" + printable(std::string(word.substr(0, 40))) + "' is not a number");
    }
    if (!std::isfinite(value)) lines_.fail(Defect::Value, "a number is not finite");
    return value;
  }

  void add_vertex(const std::vector<std::string_view>& words) {
    if (words.size() < 4) lines_.fail(Defect::Syntax, "a vertex needs three coordinates");
    out_.positions.emplace_back(number(words[1]), number(words[2]), number(words[3]));
    if (words.size() < 7) return;
    colored_.push_back(out_.positions.size() - 1);
    out_.mesh.colors.emplace_back(static_cast<float>(number(words[4])),
                                  static_cast<float>(number(words[5])),
                                  static_cast<float>(number(words[6])));
  }

  uint32_t corner(std::string_view word) const {
    const std::string_view digits = word.substr(0, word.find('/'));
    int64_t index = 0;
    if (!parse_number(digits, index)) {
      lines_.fail(Defect::Syntax,
                  "'" + printable(std::string(word.substr(0, 40))) + "' is not a corner of a face");
    }
    const auto count = static_cast<int64_t>(out_.positions.size());
    const int64_t at = index < 0 ? count + index : index - 1;
    if (at < 0 || at >= count) {
      lines_.fail(Defect::Ref,
                  "a face names vertex " + std::to_string(index) + " of " + std::to_string(count) +
                      " so far");
    }
    return static_cast<uint32_t>(at);
  }

  void add_face(const std::vector<std::string_view>& words) {
    if (words.size() < 4) {
      ++small_faces_;
      return;
    }
    std::vector<uint32_t> corners;
    corners.reserve(words.size() - 1);
    for (size_t k = 1; k < words.size(); ++k) corners.push_back(corner(words[k]));
    append_polygon(corners, out_.positions, out_.mesh.faces);
    all_grouped_ = all_grouped_ && group_.has_value();
    if (all_grouped_) out_.mesh.provenance.resize(out_.mesh.faces.size(), *group_);
    materials_.add(material_);
    by_material_.resize(out_.mesh.faces.size(), material_.value_or(Provenance::Inferred));
  }

  // Groups come first: materials of photographs have other names in files of earlier versions.
  void settle_labels() {
    if (all_grouped_) return;
    const bool are_told = materials_.are_told();
    out_.mesh.provenance = are_told ? std::move(by_material_) : std::vector<Provenance>();
    const std::string warning = materials_.warning(are_told);
    if (!warning.empty()) out_.warnings.push_back(warning);
  }

  void finish() {
    if (out_.positions.empty()) throw BadInput(Defect::Empty, lines_.path(), "no vertex");
    constexpr size_t kMost = 0xffffffff;
    if (out_.positions.size() > kMost) {
      throw LimitError(printable(lines_.path()) + ": more than 2^32 - 1 vertices");
    }
    settle_colors(out_);
    fill_in_colors(out_, colored_);
    settle_labels();
    if (has_materials_ && out_.mesh.colors.empty() && out_.mesh.provenance.empty()) {
      out_.warnings.emplace_back(
          "materials and textures are not read, only colours of vertices, which it has none of");
    } else if (has_materials_ && has_texture_) {
      out_.warnings.emplace_back("textures are not read");
    }
    if (small_faces_ > 0) {
      out_.warnings.push_back("dropped " + std::to_string(small_faces_) +
                              " faces of fewer than 3 corners");
    }
  }

  TextLines lines_;
  ParsedMesh out_;
  std::vector<size_t> colored_;  // vertices that state a colour
  std::optional<Provenance> group_;
  bool all_grouped_ = true;
  std::optional<Provenance> material_;
  MaterialLabels materials_;
  std::vector<Provenance> by_material_;  // of faces
  bool has_materials_ = false;
  bool has_texture_ = false;
  uint64_t small_faces_ = 0;
};

}  // namespace

ParsedMesh read_obj(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OBJ");
  return ObjRows(bytes, path).read();
}

}  // namespace cgs
