// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj_materials.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

std::string_view trimmed_words(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

// The line behind its first word.
std::string_view rest_of(std::string_view line, std::string_view word) {
  return trimmed_words(line.substr(static_cast<size_t>(word.data() - line.data()) + word.size()));
}

// "r g b", or one number for all three.
std::optional<Eigen::Vector3f> color_in(const std::vector<std::string_view>& words) {
  Eigen::Vector3f out;
  for (size_t k = 0; k < 3; ++k) {
    const size_t at = words.size() < 4 ? 1 : k + 1;
    double value = 0;
    if (at >= words.size() || !parse_measured(words[at], value) || !std::isfinite(value)) {
      return std::nullopt;
    }
    out[static_cast<Eigen::Index>(k)] = static_cast<float>(std::clamp(value, 0.0, 1.0));
  }
  return out;
}

// Numbers that follow an option: up to three, of which two count.
std::string_view take_pair(std::string_view text, Eigen::Vector2d& out) {
  for (size_t k = 0; k < 3; ++k) {
    const std::string_view word = text.substr(0, text.find_first_of(" \t"));
    double value = 0;
    if (!parse_number(word, value) || !std::isfinite(value)) break;
    if (k < 2) out[static_cast<Eigen::Index>(k)] = value;
    text = trimmed_words(text.substr(word.size()));
  }
  return text;
}

std::string_view without_words(std::string_view text, size_t count) {
  for (size_t k = 0; k < count; ++k) {
    text = trimmed_words(text.substr(std::min(text.find_first_of(" \t"), text.size())));
  }
  return text;
}

// "-o 0.5 0 -s 2 2 wall of bricks.jpg": the name goes to the end of the line.
void read_picture(std::string_view text, ObjMaterial& material) {
  material.fit = {};
  while (text.starts_with('-')) {
    const std::string_view option = text.substr(0, text.find_first_of(" \t"));
    text = without_words(text, 1);
    Eigen::Vector2d unused;
    if (option == "-o") {
      text = take_pair(text, material.fit.offset);
    } else if (option == "-s") {
      text = take_pair(text, material.fit.scale);
    } else if (option == "-t") {
      text = take_pair(text, unused);
    } else if (option == "-clamp") {
      material.fit.is_clamped = text.starts_with("on");
      text = without_words(text, 1);
    } else {
      text = without_words(text, option == "-mm" ? 2 : 1);
    }
  }
  material.picture = text;
}

bool is_white(const Eigen::Vector3f& color) { return color == Eigen::Vector3f::Ones(); }

}  // namespace

std::map<std::string, ObjMaterial> read_mtl(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  TextLines lines(bytes, path);
  std::map<std::string, ObjMaterial> out;
  ObjMaterial* material = nullptr;
  while (const auto line = lines.next_data()) {
    constexpr size_t kLongest = size_t{4} << 20;
    if (line->size() > kLongest) {
      throw LimitError(printable(path) + ": a line is longer than 4 MiB");
    }
    const auto words = tokens(*line);
    const std::string_view rest = rest_of(*line, words[0]);
    if (words[0] == "newmtl") {
      material = &out[std::string(rest)];
      *material = {};
    } else if (material != nullptr && words[0] == "Kd") {
      material->color = color_in(words);
    } else if (material != nullptr && (words[0] == "map_Kd" || words[0] == "map_kd")) {
      read_picture(rest, *material);
    }
  }
  return out;
}

void ObjPaint::add_library(std::string_view names) {
  libraries_.emplace_back(trimmed_words(names));
}

void ObjPaint::use(std::string_view material) {
  const std::string_view name = trimmed_words(material);
  const auto known = number_of_.find(name);
  if (known != number_of_.end()) {
    current_ = known->second;
    return;
  }
  current_ = names_.size();
  number_of_.emplace(name, names_.size());
  names_.emplace_back(name);
}

void ObjPaint::add_corner(uint32_t vertex, int64_t texcoord) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  if (!current_) return;
  const bool is_there = texcoord >= 0 && texcoord < static_cast<int64_t>(texcoords_.size());
  corners_[*current_].push_back(
      {vertex,
       is_there ? texcoords_[static_cast<size_t>(texcoord)] : Eigen::Vector2f::Constant(kNone)});
}

std::map<std::string, ObjMaterial> ObjPaint::materials(const std::filesystem::path& path,
                                                       std::vector<std::string>& missing) const {
  std::map<std::string, ObjMaterial> out;
  const auto add = [&](const std::string& name) {
    const auto file = companion_of(path, name);
    if (!file) return false;
    try {
      for (auto& [key, material] : read_mtl(*file)) out[key] = std::move(material);
    } catch (const BadInput& error) {
      missing.emplace_back(error.what());
    }
    return true;
  };
  for (const std::string& names : libraries_) {
    if (add(names)) continue;
    for (const std::string_view name : tokens(names)) {
      if (!add(std::string(name))) {
        missing.push_back(one_line(name.substr(0, 100)) +
                          " does not lie in the folder of the file");
      }
    }
  }
  return out;
}

void ObjPaint::paint(ParsedMesh& out, const std::filesystem::path& path, bool has_tints) {
  std::vector<std::string> missing;
  const std::map<std::string, ObjMaterial> known = materials(path, missing);
  CornerColors colors;
  bool says_anything = false;  // any other colour than white
  size_t unknown = 0;
  for (const auto& [number, corners] : corners_) {
    const auto found = known.find(names_[number]);
    if (found == known.end()) {
      ++unknown;
      continue;
    }
    const ObjMaterial& material = found->second;
    if (!material.picture.empty() &&
        paint_corners(path, material.picture, material.fit, corners, colors, out.warnings)) {
      says_anything = out.has_textures = true;
    } else if (material.color && !has_tints) {
      for (const PaintedCorner& corner : corners) colors.add(corner.vertex, *material.color);
      says_anything = says_anything || !is_white(*material.color);
    }
  }
  if (says_anything && !colors.empty()) colors.settle(out);
  if (has_tints) return;
  if (known.empty()) {
    std::string why = missing.empty() ? "the file names none that lies beside it" : missing.front();
    out.warnings.push_back("materials and textures are not read: " + why);
  } else if (!missing.empty()) {
    out.warnings.push_back("materials are left out: " + missing.front());
  } else if (unknown > 0) {
    out.warnings.push_back(std::to_string(unknown) + " of " + counted(corners_.size(), "material") +
                           " without colour: in no library that was found");
  }
}

}  // namespace cgs
