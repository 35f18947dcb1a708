// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/threemf_reader.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "io/mesh_arrays.h"
#include "io/threemf_model.h"
#include "io/xml_events.h"
#include "io/zip.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostRelations = uint64_t{1} << 20;  // [bytes]
constexpr uint64_t kMostModel = uint64_t{2} << 30;      // [bytes]

// A name of a part as the archive has it: without the '/' of its root.
std::string part_name(std::string name, const fs::path& named_in) {
  if (name.starts_with('/')) name.erase(0, 1);
  const std::string between = "/" + name + "/";
  if (!name.empty() && between.find("/../") == std::string::npos) return name;
  throw BadInput(Defect::Path, named_in, "names the part '" + one_line(name.substr(0, 60)) + "'");
}

// The model that the relations of the whole file name.
std::string root_part(const ZipArchive& archive, const fs::path& path) {
  constexpr std::string_view kRelation =
      "http://schemas.openxmlformats.org/package/2006/relationships|Relationship";
  constexpr std::string_view kModel =
      "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
  const std::string relations = "_rels/.rels";
  const std::string xml = archive.read(relations, kMostRelations);
  const fs::path place = path / relations;
  std::string out;
  XmlHandlers handlers;
  handlers.start = [&](const XmlElement& element) {
    if (element.name() != kRelation || element.at("Type") != kModel) return;
    if (out.empty()) out = part_name(std::string(element.at("Target")), place);
  };
  read_xml(xml, place, handlers);
  if (out.empty()) throw BadInput(Defect::Schema, place, "names no 3D model");
  return out;
}

// \return the label of that name
std::optional<Provenance> provenance_named(std::string_view name) {
  for (const Provenance label : kProvenanceOrder) {
    if (provenance_name(label) == name) return label;
  }
  return std::nullopt;
}

/// Puts together what the build of a file places.
class Assembly {
 public:
  Assembly(const ZipArchive& archive, const fs::path& path) : archive_(archive), path_(path) {}

  ParsedMesh build() {
    const std::string root = root_part(archive_, path_);
    const ThreeMfModel& model = part(root);
    is_ours_ = model.application == "cgs";
    std::vector<ThreeMfPlacement> items;
    double cost = 0;
    for (const ThreeMfPlacement& item : model.build) {
      items.push_back(placed(item, root));
      cost += cost_of(items.back());
    }
    refuse_multiplication(cost);
    for (const ThreeMfPlacement& item : items) append(item, Eigen::Affine3d::Identity());
    if (out_.mesh.faces.empty()) throw BadInput(Defect::Empty, path_, "builds nothing");
    if (out_.mesh.provenance.size() != out_.mesh.faces.size()) out_.mesh.provenance.clear();
    out_.comments.push_back("metres_per_unit " + model.metres_per_unit);
    if (is_ours_) add_origin(model.description);
    return std::move(out_);
  }

 private:
  using Key = std::pair<std::string, uint64_t>;

  const ThreeMfModel& part(const std::string& name) {
    const auto known = parts_.find(name);
    if (known != parts_.end()) return known->second;
    const std::string xml = archive_.read(name, kMostModel);
    const auto added = parts_.emplace(name, parse_threemf_model(xml, path_ / name)).first;
    for (const auto& [id, object] : added->second.objects) stored_ += own_cost(object);
    return added->second;
  }

  const ThreeMfObject& object_at(const ThreeMfPlacement& at) {
    const auto& objects = part(at.part).objects;
    const auto found = objects.find(at.object);
    if (found != objects.end()) return found->second;
    throw BadInput(
        Defect::Ref, path_ / at.part, "object " + std::to_string(at.object) + " does not exist");
  }

  ThreeMfPlacement placed(const ThreeMfPlacement& component, const std::string& parent) const {
    ThreeMfPlacement out = component;
    out.part = component.part.empty() ? parent : part_name(component.part, path_ / parent);
    return out;
  }

  static double own_cost(const ThreeMfObject& object) {
    return 1 + static_cast<double>(std::max(object.vertices.size(), object.triangles.size()));
  }

  // Vertices or faces that an object becomes with all its components; each is looked at once.
  double cost_of(const ThreeMfPlacement& at) {
    const Key key(at.part, at.object);
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
    throw LimitError(printable(path_) + ": its components multiply to more than 33 million faces");
  }

  void append(const ThreeMfPlacement& at, const Eigen::Affine3d& world_from_parent) {
    const ThreeMfObject& object = object_at(at);
    const Eigen::Affine3d world = world_from_parent * at.transform;
    const auto first = static_cast<uint32_t>(out_.positions.size());
    if (out_.positions.size() + object.vertices.size() > std::numeric_limits<uint32_t>::max()) {
      throw LimitError(printable(path_) + ": more than 2^32 - 1 vertices");
    }
    for (const Eigen::Vector3d& vertex : object.vertices) {
      out_.positions.emplace_back(world * vertex);
      if (out_.positions.back().allFinite()) continue;
      throw BadInput(Defect::Value,
                     path_ / at.part,
                     "object " + std::to_string(at.object) + " is placed at infinity");
    }
    const bool is_mirrored = world.linear().determinant() < 0;  // outside stays outside
    for (std::array<uint32_t, 3> corners : object.triangles) {
      if (is_mirrored) std::swap(corners[1], corners[2]);
      out_.mesh.faces.push_back({first + corners[0], first + corners[1], first + corners[2]});
    }
    if (is_ours_) append_provenance(object, part(at.part));
    for (const ThreeMfPlacement& component : object.components) {
      append(placed(component, at.part), world);
    }
  }

  // Stops where a triangle has no label; then the mesh has none.
  void append_provenance(const ThreeMfObject& object, const ThreeMfModel& model) {
    for (const ThreeMfMaterial& material : object.materials) {
      const auto group = model.material_names.find(material.group);
      if (group == model.material_names.end() || material.index >= group->second.size()) return;
      const auto label = provenance_named(group->second[material.index]);
      if (!label) return;
      out_.mesh.provenance.push_back(*label);
    }
  }

  // As write_3mf() says what to add to the coordinates.
  void add_origin(const std::string& description) {
    constexpr std::string_view kAdd = "Coordinates of the scene: add ";
    const size_t at = description.find(kAdd);
    const size_t end = description.find(" mm.", at);
    if (at == std::string::npos || end == std::string::npos) return;
    const size_t begin = at + kAdd.size();
    out_.comments.push_back("file_origin " + description.substr(begin, end - begin));
  }

  const ZipArchive& archive_;
  const fs::path& path_;
  std::map<std::string, ThreeMfModel> parts_;
  std::map<Key, double> costs_;
  std::set<Key> open_;  // objects between the build and the one that is looked at
  double stored_ = 0;   // cost of all objects once
  bool is_ours_ = false;
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

}  // namespace cgs
