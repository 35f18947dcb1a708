// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "io/byte_writer.h"
#include "io/glb_container.h"
#include "io/glb_faces.h"
#include "io/glb_meshopt.h"
#include "io/mesh_arrays.h"
#include "io/significance.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

constexpr uint64_t kMostCorners = uint64_t{1} << 31;

/// Scale and place of a file in the world; that of others is the identity.
struct Origin {
  bool is_ours = false;
  Eigen::Matrix3d world_from_gltf = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double units_per_metre = 1;  ///< World units per unit of the file.

  Eigen::Vector3d world(const Eigen::Vector3d& p) const {
    return origin + units_per_metre * (world_from_gltf * p);
  }
};

/// The matrix of a node: given as such, or as translation, rotation and scale.
Eigen::Affine3d node_matrix(const JsonValue& node) {
  const auto numbers = [&](const char* key, std::vector<double> values) {
    const auto list = node.find(key);
    if (!list) return values;
    if (list->size() != values.size()) list->fail(Defect::Count, "has the wrong length");
    for (size_t i = 0; i < values.size(); ++i) values[i] = list->at(i).number();
    return values;
  };
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  if (node.find("matrix")) {
    const std::vector<double> m = numbers("matrix", std::vector<double>(16));
    out.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
    return out;
  }
  const std::vector<double> t = numbers("translation", {0, 0, 0});
  const std::vector<double> r = numbers("rotation", {0, 0, 0, 1});
  const std::vector<double> s = numbers("scale", {1, 1, 1});
  const Eigen::Quaterniond q(r[3], r[0], r[1], r[2]);
  if (!(q.norm() > 0)) node.at("rotation").fail(Defect::Value, "is not a rotation");
  out = Eigen::Translation3d(t[0], t[1], t[2]) * q.normalized() * Eigen::Scaling(s[0], s[1], s[2]);
  return out;
}

/// Puts the primitives of all nodes together.
class SceneReader {
 public:
  SceneReader(const GlbContainer& file, const Origin& origin) : file_(file), origin_(origin) {}

  GlbMesh read() {
    const JsonValue root = file_.root();
    refuse_unknown_extensions(root);
    const auto nodes = root.find("nodes");
    visited_.assign(nodes ? nodes->size() : 0, false);
    visit_scene(root);
    TriangleMesh& mesh = out_.parsed.mesh;
    if (mesh.faces.empty()) {
      throw BadInput(
          Defect::Empty, file_.path(), "holds no triangles (splats in glTF are not read)");
    }
    const std::string odd = check_significance(file_.path(), stored_, kFloatDigits);
    if (!odd.empty()) out_.parsed.warnings.push_back(odd);
    if (!all_have_colors_) mesh.colors.clear();
    if (!all_have_support_) mesh.support.clear();
    if (!all_have_sigma_) mesh.sigma.clear();
    if (!origin_.is_ours || !all_have_labels_) mesh.provenance.clear();
    if (has_textures_) {
      out_.parsed.warnings.emplace_back("textures are not read; a mesh keeps colours of vertices");
    }
    if (collapsed_ > 0) {
      out_.parsed.warnings.push_back("left out " + std::to_string(collapsed_) +
                                     " faces with two corners in one place");
    }
    return std::move(out_);
  }

 private:
  static void refuse_unknown_extensions(const JsonValue& root) {
    const auto required = root.find("extensionsRequired");
    for (size_t i = 0; required && i < required->size(); ++i) {
      const std::string name = required->at(i).text();
      const bool known = name == "KHR_draco_mesh_compression" || name == "KHR_mesh_quantization" ||
                         name == kMeshopt || name == "EXT_mesh_features" ||
                         name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_") ||
                         name.starts_with("EXT_texture_") || name == "KHR_lights_punctual";
      if (!known) required->at(i).fail(Defect::Unsupported, name + " is required and not known");
    }
  }

  // The scene that is to be shown, else the first; a file without scenes is a library of nodes.
  void visit_scene(const JsonValue& root) {
    const auto scenes = root.find("scenes");
    const auto chosen = root.find("scene");
    if (!scenes && !chosen) return visit_roots(root);
    if (!chosen && scenes->size() == 0) return;
    const JsonValue scene = chosen ? file_.element("scenes", *chosen) : scenes->at(size_t{0});
    if (const auto nodes = scene.find("nodes")) visit_all(*nodes, Eigen::Affine3d::Identity(), 0);
  }

  void visit_roots(const JsonValue& root) {
    std::vector<bool> is_child(visited_.size(), false);
    for (size_t i = 0; i < visited_.size(); ++i) {
      const auto children = root.at("nodes").at(i).find("children");
      for (size_t k = 0; children && k < children->size(); ++k) {
        const uint64_t child = whole_number(children->at(k));
        if (child < is_child.size()) is_child[child] = true;  // others are refused on the way
      }
    }
    for (size_t i = 0; i < visited_.size(); ++i) {
      if (!is_child[i]) visit_node(root.at("nodes").at(i), i, Eigen::Affine3d::Identity(), 0);
    }
  }

  void visit_all(const JsonValue& indices, const Eigen::Affine3d& parent, int depth) {
    for (size_t i = 0; i < indices.size(); ++i) visit(indices.at(i), parent, depth);
  }

  void visit(const JsonValue& index, const Eigen::Affine3d& parent, int depth) {
    const JsonValue node = file_.element("nodes", index);
    const auto number = static_cast<size_t>(whole_number(index));
    if (visited_[number]) index.fail(Defect::Ref, "names a node that has a parent already");
    visit_node(node, number, parent, depth);
  }

  void visit_node(const JsonValue& node, size_t number, const Eigen::Affine3d& parent, int depth) {
    constexpr int kDeepest = 256;
    visited_[number] = true;
    if (depth > kDeepest) throw LimitError(printable(file_.path()) + ": nodes nest too deeply");
    const Eigen::Affine3d world = parent * node_matrix(node);
    if (const auto mesh = node.find("mesh")) add_mesh(file_.element("meshes", *mesh), world);
    if (const auto children = node.find("children")) visit_all(*children, world, depth + 1);
  }

  void add_mesh(const JsonValue& mesh, const Eigen::Affine3d& world) {
    const JsonValue primitives = mesh.at("primitives");
    for (size_t i = 0; i < primitives.size(); ++i) {
      const JsonValue primitive = primitives.at(i);
      const GlbFaces faces = read_glb_primitive(file_, primitive);
      add(faces, world, labels_of(primitive, faces));
      if (out_.parsed.mesh.faces.size() > kMostCorners / 3) {
        throw LimitError(printable(file_.path()) + ": more than " +
                         std::to_string(kMostCorners / 3) + " triangles");
      }
    }
  }

  // Of faces; empty where nothing is said. Programs that pack files for the web join materials and
  // forget their names, but keep feature numbers.
  std::vector<Provenance> labels_of(const JsonValue& primitive, const GlbFaces& in) {
    const std::optional<Provenance> label = label_of(primitive);
    if (label) return std::vector<Provenance>(in.faces.size(), *label);
    std::vector<Provenance> out;
    if (in.features.empty()) return out;
    for (const auto& face : in.faces) {
      const float feature = in.features[face[0]];
      if (!(feature >= 0 && feature < float{kProvenanceCount})) return {};
      out.push_back(static_cast<Provenance>(feature));
    }
    return out;
  }

  // Materials of ours are named "<class>" or "<class> <photograph>"; of a mesh that does not say
  // what was observed, otherwise.
  std::optional<Provenance> label_of(const JsonValue& primitive) {
    const auto index = primitive.find("material");
    if (!index) return std::nullopt;
    const JsonValue material = file_.element("materials", *index);
    if (const auto pbr = material.find("pbrMetallicRoughness")) {
      has_textures_ = has_textures_ || pbr->find("baseColorTexture").has_value();
    }
    const auto name = material.find("name");
    for (const Provenance label : kProvenanceOrder) {
      if (name && (name->text() + " ").starts_with(std::string(provenance_name(label)) + " ")) {
        return label;
      }
    }
    return std::nullopt;
  }

  void add(const GlbFaces& in,
           const Eigen::Affine3d& world,
           const std::vector<Provenance>& labels) {
    if (in.faces.empty()) return;  // points and lines neither add vertices nor lack colours
    TriangleMesh& mesh = out_.parsed.mesh;
    const bool is_mirrored = world.linear().determinant() < 0;
    std::vector<uint32_t> numbers(in.positions.size() / 3);
    for (size_t v = 0; v < numbers.size(); ++v) {
      const Eigen::Vector3f p(
          in.positions[3 * v], in.positions[3 * v + 1], in.positions[3 * v + 2]);
      const Eigen::Vector3d place = origin_.world(world * p.cast<double>());
      stored_.extend(world.linear() * p.cast<double>());
      if (!place.allFinite()) {
        throw BadInput(Defect::Value, file_.path(), "a vertex is not finite");
      }
      numbers[v] = number_of(place, in, v);
    }
    for (size_t f = 0; f < in.faces.size(); ++f) {
      const auto& face = in.faces[f];
      std::array<uint32_t, 3> corners = {numbers[face[0]], numbers[face[1]], numbers[face[2]]};
      if (is_mirrored) std::swap(corners[1], corners[2]);
      // Rounding by compression lets short edges vanish, and with them their faces.
      if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
        ++collapsed_;
        continue;
      }
      mesh.faces.push_back(corners);
      mesh.provenance.push_back(labels.empty() ? Provenance::Inferred : labels[f]);
    }
    all_have_labels_ = all_have_labels_ && !labels.empty();
    all_have_colors_ = all_have_colors_ && !in.colors.empty();
    all_have_support_ = all_have_support_ && !in.support.empty();
    all_have_sigma_ = all_have_sigma_ && !in.sigma.empty();
  }

  // The vertex at a place: a new one with what the primitive says of it, or the first there.
  uint32_t number_of(const Eigen::Vector3d& place, const GlbFaces& in, size_t v) {
    ParsedMesh& out = out_.parsed;
    const uint32_t number = places_.number(place);
    if (number < out.positions.size()) return number;
    out.positions.push_back(place);
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    for (int c = 0; c < 3 && !in.colors.empty(); ++c) {
      const float linear = in.colors[3 * v + static_cast<size_t>(c)];
      color[c] = srgb_from_linear(std::isfinite(linear) ? std::clamp(linear, 0.0f, 1.0f) : 0.0f);
    }
    out.mesh.colors.push_back(color);
    out.mesh.support.push_back(in.support.empty() ? 0.0f : in.support[v]);
    const float sigma = in.sigma.empty() ? -1.0f : in.sigma[v];
    out.mesh.sigma.push_back(static_cast<float>(double{sigma} * origin_.units_per_metre));
    return number;
  }

  const GlbContainer& file_;
  const Origin& origin_;
  GlbMesh out_;
  PlaceNumbers places_;
  // Of the positions as they were rounded to float: nodes have scaled but not moved them yet.
  Eigen::AlignedBox3d stored_;
  std::vector<bool> visited_;
  size_t collapsed_ = 0;  // faces
  bool all_have_colors_ = true;
  bool all_have_labels_ = true;
  bool all_have_support_ = true;
  bool all_have_sigma_ = true;
  bool has_textures_ = false;
};

std::string number_line(const char* key, double value) {
  std::string out = std::string(key) + " ";
  append_number(out, value);
  return out;
}

/// What asset.extras of write_glb() say; without them, the words for metres.
Origin origin_of(const GlbContainer& file, std::vector<std::string>& comments) {
  Origin out;
  const auto extras = file.root().at("asset").find("extras");
  if (!extras || !extras->is_object() || !extras->find("gltf_from_world")) {
    comments = {"unit m", "metres_per_unit 1", "scale_source assumed"};
    return out;
  }
  out.is_ours = true;
  const JsonValue rotation = extras->at("gltf_from_world");
  const JsonValue origin = extras->at("origin_in_world");
  if (rotation.size() != 9) rotation.fail(Defect::Count, "needs 9 numbers");
  if (origin.size() != 3) origin.fail(Defect::Count, "needs 3 numbers");
  for (int i = 0; i < 9; ++i) {
    out.world_from_gltf(i % 3, i / 3) = rotation.at(static_cast<size_t>(i)).number();
  }
  const Eigen::Matrix3d off =
      out.world_from_gltf * out.world_from_gltf.transpose() - Eigen::Matrix3d::Identity();
  if (!(off.norm() < 1e-6)) rotation.fail(Defect::Value, "is not a rotation");
  for (int i = 0; i < 3; ++i) out.origin[i] = origin.at(static_cast<size_t>(i)).number();
  const double metres = extras->at("metres_per_unit").number();
  if (extras->at("units").text() != "m") return out;
  if (!(metres > 0)) extras->at("metres_per_unit").fail(Defect::Value, "must be > 0");
  out.units_per_metre = 1 / metres;
  comments = {number_line("metres_per_unit", metres),
              number_line("metres_sigma", extras->at("metres_sigma").number()),
              "scale_source " + extras->at("scale_source").text()};
  return out;
}

}  // namespace

GlbMesh read_glb(const std::filesystem::path& path) {
  const GlbContainer file(path);
  std::vector<std::string> comments;
  const Origin origin = origin_of(file, comments);
  GlbMesh out = SceneReader(file, origin).read();
  out.parsed.comments = std::move(comments);
  out.up = origin.world_from_gltf * Eigen::Vector3d::UnitY();
  return out;
}

}  // namespace cgs
