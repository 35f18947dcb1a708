// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "io/bytes/mesh_arrays.h"
#include "io/meshes/material_labels.h"
#include "io/meshes/obj_materials.h"

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

std::string_view rest_of_line(std::string_view line, std::string_view word) {
  line.remove_prefix(static_cast<size_t>(word.data() - line.data()) + word.size());
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  return line.substr(0, line.find_last_not_of(" \t\r") + 1);
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
    auto words = tokens(line);
    const auto begins_comment = [](std::string_view word) { return word.starts_with('#'); };
    words.erase(std::find_if(words.begin(), words.end(), begins_comment), words.end());
    if (words.empty()) return;
    const std::string_view rest = rest_of_line(line, words[0]);
    if (words[0] == "v") add_vertex(words);
    if (words[0] == "f") add_face(words);
    if (words[0] == "mtllib") paint_.add_library(rest);
    if (words[0] == "usemtl") set_material(rest);
    if (words[0] == "vt") add_texcoord(words);
    if (words[0] == "g") {
      group_ = words.size() == 2 ? provenance_of_group(words[1]) : std::nullopt;
    }
  }

  // Programs leave blanks in names as they are.
  void set_material(std::string_view name) {
    has_materials_ = true;
    material_ = provenance_of_material(name);
    paint_.use(name);
  }

  void add_texcoord(const std::vector<std::string_view>& words) {
    const auto part = [&](size_t at) {
      double value = 0;
      return at < words.size() && parse_measured(words[at], value) ? static_cast<float>(value)
                                                                   : 0.0f;
    };
    paint_.add_texcoord({part(1), part(2)});
  }

  double number(std::string_view word) const {
    double value = 0;
    if (!parse_measured(word, value)) {
      lines_.fail(Defect::Syntax,
                  "'" + printable(std::string(word.substr(0, 40))) + "' is not a number");
    }
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

  // Of a corner "v/vt/vn", counted from 0; -1 = none, or none that is there.
  int64_t texcoord(std::string_view word) const {
    const size_t slash = word.find('/');
    if (slash == std::string_view::npos) return -1;
    word.remove_prefix(slash + 1);
    int64_t index = 0;
    if (!parse_number(word.substr(0, word.find('/')), index)) return -1;
    return index < 0 ? static_cast<int64_t>(paint_.texcoords()) + index : index - 1;
  }

  void add_face(const std::vector<std::string_view>& words) {
    if (words.size() < 4) {
      ++small_faces_;
      return;
    }
    std::vector<uint32_t> corners;
    corners.reserve(words.size() - 1);
    for (size_t k = 1; k < words.size(); ++k) {
      corners.push_back(corner(words[k]));
      if (has_materials_) paint_.add_corner(corners.back(), texcoord(words[k]));
    }
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
    settle_paint();
    if (small_faces_ > 0) {
      out_.warnings.push_back("dropped " + std::to_string(small_faces_) +
                              " faces of fewer than 3 corners");
    }
    drop_unusable(out_, lines_.path());
  }

  // Colours of vertices come first, but for one that all of them have: that is a default, as some
  // programs write it beside textures.
  void settle_paint() {
    if (!paint_.is_used()) return;
    const std::vector<Eigen::Vector3f>& colors = out_.mesh.colors;
    const bool are_the_same = std::all_of(
        colors.begin(), colors.end(), [&](const auto& color) { return color == colors.front(); });
    if (colors.empty()) {
      paint_.paint(out_, lines_.path(), !out_.mesh.provenance.empty());
    } else if (are_the_same && paint_.texcoords() > 0) {
      const size_t warnings = out_.warnings.size();
      paint_.paint(out_, lines_.path(), true);
      if (!out_.has_textures) out_.warnings.resize(warnings);
    }
    if (!colors.empty() && !out_.has_textures && paint_.texcoords() > 0 && !colored_.empty()) {
      out_.warnings.emplace_back("textures are not read");
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
  ObjPaint paint_;
  uint64_t small_faces_ = 0;
};

}  // namespace

ParsedMesh read_obj(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OBJ");
  return ObjRows(bytes, path).read();
}

}  // namespace cgs
