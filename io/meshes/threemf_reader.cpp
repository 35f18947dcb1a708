// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf_reader.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/text_lines.h"
#include "io/bytes/xml_events.h"
#include "io/bytes/zip.h"
#include "io/meshes/material_labels.h"
#include "io/meshes/threemf_model.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOwnApplication = "cgs";     // of write_3mf()
constexpr uint64_t kMostRelations = uint64_t{1} << 20;  // [bytes]
constexpr uint64_t kMostModel = uint64_t{2} << 30;      // [bytes]

/// Names of parts, which programs write in one letter case and look for in another.
/// Source: ECMA-376 part 2 (Open Packaging Conventions): equal but for the case of ASCII letters.
class PartNames {
 public:
  explicit PartNames(const ZipArchive& archive) : archive_(archive) {
    for (const std::string& name : archive.names()) {
      const auto [known, is_new] = by_folded_.emplace(folded(name), name);
      if (!is_new) known->second.clear();  // of two none is meant
    }
  }

  /// As the archive has it, or the same name where it has none.
  std::string stored(const std::string& name) const {
    if (archive_.has(name)) return name;
    const auto found = by_folded_.find(folded(name));
    return found == by_folded_.end() || found->second.empty() ? name : found->second;
  }

 private:
  static std::string folded(std::string name) {
    for (char& c : name) {
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return name;
  }

  const ZipArchive& archive_;
  std::map<std::string, std::string> by_folded_;
};

// A name of a part without the '/' of its root.
std::string part_name(std::string name, const fs::path& named_in) {
  if (name.starts_with('/')) name.erase(0, 1);
  const std::string between = "/" + name + "/";
  if (!name.empty() && between.find("/../") == std::string::npos) return name;
  throw BadInput(Defect::Path, named_in, "names the part '" + one_line(name.substr(0, 60)) + "'");
}

// \pre the model states it
double metres_per_unit(const ThreeMfModel& model) {
  double out = 0;
  (void)parse_number(model.metres_per_unit, out);
  return out;
}

// The model that the relations of the whole file name.
std::string root_part(const ZipArchive& archive, const fs::path& path) {
  constexpr std::string_view kRelation =
      "http://schemas.openxmlformats.org/package/2006/relationships|Relationship";
  constexpr std::string_view kModel =
      "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
  const PartNames names(archive);
  const std::string relations = names.stored("_rels/.rels");
  const std::string xml = archive.read(relations, kMostRelations);
  const fs::path place = path / relations;
  std::string out;
  XmlHandlers handlers;
  handlers.start = [&](const XmlElement& element) {
    if (element.name() != kRelation || element.at("Type") != kModel) return;
    if (!out.empty()) return;
    out = names.stored(part_name(std::string(element.at("Target")), place));
  };
  read_xml(xml, place, handlers);
  if (out.empty()) throw BadInput(Defect::Schema, place, "names no 3D model");
  return out;
}

/// Puts together what the build of a file places.
class Assembly {
 public:
  Assembly(const ZipArchive& archive, const fs::path& path)
      : archive_(archive), names_(archive), path_(path) {}

  ParsedMesh build() {
    const std::string root = root_part(archive_, path_);
    const ThreeMfModel& model = part(root);
    is_ours_ = model.application == kOwnApplication;
    double cost = 0;
    for (const ThreeMfPlacement& item : model.build) cost += cost_of(placed(item, root));
    refuse_multiplication(cost);
    for (const ThreeMfPlacement& item : model.build) {
      append(placed(item, root), Eigen::Affine3d::Identity(), true);
    }
    if (out_.mesh.faces.empty()) {
      throw BadInput(Defect::Empty,
                     path_,
                     accessories_.empty() ? "builds nothing" : "builds nothing but supports");
    }
    settle_labels(model);
    settle_colors();
    drop_unusable(out_, path_);
    out_.comments.push_back("metres_per_unit " + model.metres_per_unit);
    if (is_ours_) {
      add_scale(model);
      add_origin(model);
    }
    warn_of_types();
    return std::move(out_);
  }

 private:
  using Key = std::pair<std::string, uint64_t>;

  ThreeMfModel& part(const std::string& name) {
    const auto known = parts_.find(name);
    if (known != parts_.end()) return known->second;
    const std::string xml = archive_.read(name, kMostModel);
    const auto added = parts_.emplace(name, parse_threemf_model(xml, path_ / name, entries_)).first;
    entries_ = added->second.entries;
    for (const auto& [id, object] : added->second.objects) stored_ += own_cost(object);
    return added->second;
  }

  ThreeMfObject& object_at(const ThreeMfPlacement& at) {
    auto& objects = part(at.part).objects;
    const auto found = objects.find(at.object);
    if (found != objects.end()) return found->second;
    throw BadInput(
        Defect::Ref, path_ / at.part, "object " + std::to_string(at.object) + " does not exist");
  }

  ThreeMfPlacement placed(const ThreeMfPlacement& component, const std::string& parent) const {
    ThreeMfPlacement out = component;
    out.part = parent;
    if (component.part.empty()) return out;
    out.part = names_.stored(part_name(component.part, path_ / parent));
    return out;
  }

  static double own_cost(const ThreeMfObject& object) {
    return 1 + static_cast<double>(std::max(object.vertices.size(), object.triangles.size()));
  }

  // Vertices or faces that an object becomes with all its components; each is looked at once, so
  // that every mention of an object, by an item or a component, counts once.
  double cost_of(const ThreeMfPlacement& at) {
    const Key key(at.part, at.object);
    ++mentions_[key];
    if (const auto known = costs_.find(key); known != costs_.end()) return known->second;
    constexpr size_t kDeepest = 64;
    if (!open_.insert(key).second) {
      throw BadInput(Defect::Ref,
                     path_ / at.part,
                     "object " + std::to_string(at.object) + " is a component of itself");
    }
    if (open_.size() > kDeepest) {
      throw LimitError(printable(path_) + ": components more than 64 deep");
    }
    const ThreeMfObject& object = object_at(at);
    double cost = own_cost(object);
    for (const ThreeMfPlacement& component : object.components) {
      cost += cost_of(placed(component, at.part));
    }
    open_.erase(key);
    return costs_[key] = cost;
  }

  void refuse_multiplication(double cost) const {
    constexpr double kMayMultiplyTo = 1 << 25;
    if (cost <= std::max(kMayMultiplyTo, stored_)) return;
    throw LimitError(printable(path_) + ": items and components place more than 33 million faces");
  }

  // \param is_last  what mentions the object is not placed again
  void append(const ThreeMfPlacement& at, const Eigen::Affine3d& world_from_parent, bool is_last) {
    const Key key(at.part, at.object);
    if (is_last) is_last = --mentions_[key] == 0;
    ThreeMfObject& object = object_at(at);
    const Eigen::Affine3d world = world_from_parent * at.transform;
    if (object.type == ThreeMfType::Accessory && !object.triangles.empty()) {
      accessories_.insert(key);
    } else {
      if (object.type == ThreeMfType::Surface && !object.triangles.empty()) surfaces_.insert(key);
      if (!is_last || at.transform.matrix() != Eigen::Matrix4d::Identity()) is_moved_ = true;
      append_mesh(object, at, world, is_last);
    }
    for (const ThreeMfPlacement& component : object.components) {
      append(placed(component, at.part), world, is_last);
    }
  }

  // \param is_last  what is read of the mesh is given back as soon as it is appended
  void append_mesh(ThreeMfObject& object,
                   const ThreeMfPlacement& at,
                   const Eigen::Affine3d& world,
                   bool is_last) {
    const auto first = static_cast<uint32_t>(out_.positions.size());
    if (out_.positions.size() + object.vertices.size() > std::numeric_limits<uint32_t>::max()) {
      throw LimitError(printable(path_) + ": more than 2^32 - 1 vertices");
    }
    for (const Eigen::Vector3d& vertex : object.vertices) {
      out_.positions.emplace_back(world * vertex);
      if (out_.positions.back().allFinite() || !vertex.allFinite()) continue;
      throw BadInput(Defect::Value,
                     path_ / at.part,
                     "object " + std::to_string(at.object) + " is placed at infinity");
    }
    if (is_last) give_back(object.vertices);
    const bool is_mirrored = world.linear().determinant() < 0;  // outside stays outside
    for (std::array<uint32_t, 3> corners : object.triangles) {
      if (is_mirrored) std::swap(corners[1], corners[2]);
      out_.mesh.faces.push_back({first + corners[0], first + corners[1], first + corners[2]});
    }
    if (!is_ours_) append_colors(object, first, part(at.part));
    if (is_last) give_back(object.triangles);
    append_provenance(object, part(at.part));
    if (is_last) give_back(object.properties);
  }

  template <typename T>
  static void give_back(std::vector<T>& values) {
    std::vector<T>().swap(values);
  }

  // Stops where a triangle has no label; then the mesh has none.
  void append_provenance(const ThreeMfObject& object, const ThreeMfModel& model) {
    for (const ThreeMfProperty& material : object.properties) {
      const auto group = model.material_names.find(material.group);
      std::optional<Provenance> label;
      if (group != model.material_names.end() && material.index[0] < group->second.size()) {
        label = provenance_of_material(group->second[material.index[0]]);
      }
      materials_.add(label);
      if (!label) return;
      out_.mesh.provenance.push_back(*label);
    }
  }

  // Of vertices the first triangle's that has one.
  void append_colors(const ThreeMfObject& object, uint32_t first, const ThreeMfModel& model) {
    constexpr float kOtherColor = 0.1f;
    has_textures_ = has_textures_ || model.has_textures;
    has_mixtures_ = has_mixtures_ || model.has_mixtures;
    if (model.colors.empty()) return;
    const Eigen::Vector3f none = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
    std::vector<Eigen::Vector3f> colors(out_.positions.size() - first, none);
    for (size_t f = 0; f < object.triangles.size(); ++f) {
      const auto group = model.colors.find(object.properties[f].group);
      if (group == model.colors.end()) continue;
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t index = object.properties[f].index.at(k);
        if (index >= group->second.size() || group->second[index].hasNaN()) continue;
        Eigen::Vector3f& color = colors[object.triangles[f].at(k)];
        if (color.hasNaN()) color = group->second[index];
        if ((color - group->second[index]).cwiseAbs().maxCoeff() > kOtherColor) ++recolored_;
      }
    }
    for (size_t v = 0; v < colors.size(); ++v) {
      if (colors[v].hasNaN()) continue;
      colored_.push_back(first + v);
      out_.mesh.colors.push_back(colors[v]);
    }
  }

  // Where materials tell labels, their colours tell these apart, and are not of the surface.
  void settle_colors() {
    if (has_textures_) out_.warnings.emplace_back("textures are not read");
    if (has_mixtures_) {
      out_.warnings.emplace_back(
          "mixed materials (multiproperties, compositematerials) are not read, nor their colours");
    }
    if (!out_.mesh.provenance.empty()) {
      out_.mesh.colors.clear();
      return;
    }
    fill_in_colors(out_, colored_);
    if (recolored_ == 0) return;
    out_.warnings.push_back("surfaces of different colours meet at " + std::to_string(recolored_) +
                            " corners; vertices have one, that of the first");
  }

  void settle_labels(const ThreeMfModel& model) {
    const bool are_told = out_.mesh.provenance.size() == out_.mesh.faces.size() &&
                          (is_ours_ || materials_.are_told());
    if (!are_told) out_.mesh.provenance.clear();
    const std::string of_names = materials_.warning(are_told);
    if (!are_told && model.description.starts_with("Surface by origin:")) {
      out_.warnings.emplace_back(kLostLabels);
    } else if (!is_ours_ && !of_names.empty()) {
      out_.warnings.push_back(of_names);
    }
  }

  // As write_3mf() says what to add to the coordinates: where the file was changed since, what it
  // says need not hold.
  // "Scale: known distance, relative sigma 0.01;"
  void add_scale(const ThreeMfModel& model) {
    constexpr std::string_view kScale = " Scale: ";
    constexpr std::string_view kSigma = ", relative sigma ";
    const size_t at = model.description.find(kScale);
    const size_t end = model.description.find(';', at);
    if (at == std::string::npos || end == std::string::npos) return;
    const size_t begin = at + kScale.size();
    const std::string text = model.description.substr(begin, end - begin);
    const size_t sigma_at = text.find(kSigma);
    out_.comments.push_back("scale_source " + text.substr(0, sigma_at));
    double relative = 0;
    if (sigma_at == std::string::npos ||
        !parse_number(text.substr(sigma_at + kSigma.size()), relative)) {
      return;
    }
    std::string comment = "metres_sigma ";
    append_number(comment, relative * metres_per_unit(model));
    out_.comments.push_back(comment);
  }

  void add_origin(const ThreeMfModel& model) {
    const std::string& description = model.description;
    constexpr std::string_view kAdd = "Coordinates of the scene: add ";
    const size_t at = description.find(kAdd);
    const size_t end = description.find(" mm.", at);
    if (at == std::string::npos || end == std::string::npos) return;
    if (is_moved_) {
      out_.warnings.emplace_back(
          "the origin in the description is left out: the file moves, turns or repeats objects");
      return;
    }
    const size_t begin = at + kAdd.size();
    const std::string numbers = description.substr(begin, end - begin);
    const double units_per_millimetre = 1e-3 / metres_per_unit(model);
    std::string comment = "file_origin";
    for (const std::string_view word : tokens(numbers)) {
      double millimetres = 0;
      if (!parse_number(word, millimetres)) break;
      comment += ' ';
      append_number(comment, units_per_millimetre * millimetres);
    }
    out_.comments.push_back(comment);
  }

  void warn_of_types() {
    if (!accessories_.empty()) {
      out_.warnings.push_back("left out " + std::to_string(accessories_.size()) +
                              " objects that are no part of the model (type support, "
                              "solidsupport or other)");
    }
    if (!surfaces_.empty()) {
      out_.warnings.push_back(std::to_string(surfaces_.size()) +
                              " objects are stated to be surfaces, which enclose nothing");
    }
  }

  const ZipArchive& archive_;
  const PartNames names_;
  const fs::path& path_;
  std::map<std::string, ThreeMfModel> parts_;
  size_t entries_ = 0;              // of all parts
  std::map<Key, size_t> mentions_;  // by items and components, that are still to be placed
  std::set<Key> accessories_;       // objects that were left out
  std::set<Key> surfaces_;
  std::map<Key, double> costs_;
  std::set<Key> open_;  // objects between the build and the one that is looked at
  double stored_ = 0;   // cost of all objects once
  bool is_ours_ = false;
  MaterialLabels materials_;
  std::vector<size_t> colored_;  // vertices that state a colour
  size_t recolored_ = 0;         // corners where surfaces of other colours meet
  bool has_textures_ = false;
  bool has_mixtures_ = false;
  bool is_moved_ = false;  // an object, or built more than once
  ParsedMesh out_;
};

}  // namespace

ParsedMesh read_3mf(const fs::path& path) {
  const std::string bytes = read_file(path);
  if (!bytes.starts_with("PK")) {
    refuse_foreign_content(path, bytes, "3MF");
    throw BadInput(Defect::Magic, path, "expected a 3MF file, a ZIP archive");
  }
  const ZipArchive archive(bytes, path);
  return Assembly(archive, path).build();
}

bool is_own_3mf(const fs::path& path) {
  try {
    const std::string bytes = read_file(path);
    const ZipArchive archive(bytes, path);
    const std::string root = root_part(archive, path);
    const std::string xml = archive.read(root, kMostModel);
    return parse_threemf_model(xml, path / root).application == kOwnApplication;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace cgs
