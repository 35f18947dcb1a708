// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/scene.h"

#include "io/bytes/byte_writer.h"
#include "io/glb/extensions.h"

namespace cgs {

namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr uint64_t kMostInstances = uint64_t{1} << 20;

void refuse_many_instances(const GlbContainer& file, uint64_t count) {
  if (count <= kMostInstances) return;
  throw LimitError(printable(file.path()) + ": nodes show meshes more than " +
                   std::to_string(kMostInstances) + " times");
}

/// The matrix of a node: given as such, or as translation, rotation and scale.
Eigen::Affine3d node_matrix(const JsonValue& node) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  if (node.find("matrix")) {
    const std::vector<double> m = numbers_or(node, "matrix", std::vector<double>(16));
    out.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
    return out;
  }
  const std::vector<double> t = numbers_or(node, "translation", {0, 0, 0});
  const std::vector<double> r = numbers_or(node, "rotation", {0, 0, 0, 1});
  const std::vector<double> s = numbers_or(node, "scale", {1, 1, 1});
  const Eigen::Quaterniond q(r[3], r[0], r[1], r[2]);
  if (!(q.norm() > 0)) node.at("rotation").fail(Defect::Value, "is not a rotation");
  out = Eigen::Translation3d(t[0], t[1], t[2]) * q.normalized() * Eigen::Scaling(s[0], s[1], s[2]);
  return out;
}

/// Where a node shows its mesh, seen from the node: once, or as EXT_mesh_gpu_instancing lists.
/// Source: EXT_mesh_gpu_instancing, Khronos Group.
std::vector<Eigen::Affine3d> places_of_mesh(const GlbContainer& file, const JsonValue& node) {
  const auto instancing = extension_of(node, kInstancing);
  if (!instancing) return {Eigen::Affine3d::Identity()};
  const JsonValue attributes = instancing->at("attributes");
  size_t count = 0;
  const auto values = [&](const char* name, size_t components) -> std::vector<float> {
    const auto index = attributes.find(name);
    if (!index) return {};
    const JsonValue accessor = file.element("accessors", *index);
    refuse_many_instances(file, whole_number(accessor.at("count")));
    auto out = file.floats(accessor, static_cast<int>(components));
    if (count != 0 && out.size() != components * count) {
      index->fail(Defect::Count, "differs in length from the other attributes");
    }
    count = out.size() / components;
    return out;
  };
  const std::vector<float> t = values("TRANSLATION", 3);
  const std::vector<float> r = values("ROTATION", 4);
  const std::vector<float> s = values("SCALE", 3);
  std::vector<Eigen::Affine3d> out(count, Eigen::Affine3d::Identity());
  for (size_t i = 0; i < count; ++i) {
    if (!t.empty()) out[i].translate(Eigen::Vector3d(t[3 * i], t[3 * i + 1], t[3 * i + 2]));
    if (!r.empty()) {
      const Eigen::Quaterniond q(r[4 * i + 3], r[4 * i], r[4 * i + 1], r[4 * i + 2]);
      if (!(q.norm() > 0)) attributes.at("ROTATION").fail(Defect::Value, "holds no rotation");
      out[i].rotate(q.normalized());
    }
    if (!s.empty()) out[i].scale(Eigen::Vector3d(s[3 * i], s[3 * i + 1], s[3 * i + 2]));
  }
  return out;
}

/// Follows the nodes of a file.
class NodeVisitor {
 public:
  explicit NodeVisitor(const GlbContainer& file) : file_(file) {}

  GlbScene visit() {
    const JsonValue root = file_.root();
    const auto nodes = root.find("nodes");
    visited_.assign(nodes ? nodes->size() : 0, false);
    visit_scene(root);
    if (hidden_ > 0) {
      out_.warnings.push_back("left out " + std::to_string(hidden_) +
                              " nodes that the file says are not visible, with what hangs on them");
    }
    return std::move(out_);
  }

 private:
  // The scene that is to be shown, else the first; a file without scenes is a library of nodes.
  void visit_scene(const JsonValue& root) {
    const auto scenes = root.find("scenes");
    const auto chosen = root.find("scene");
    if (!scenes && !chosen) return visit_roots(root);
    if (!chosen && scenes->size() == 0) return;
    const JsonValue scene = chosen ? file_.element("scenes", *chosen) : scenes->at(size_t{0});
    if (scenes->size() > 1) {
      out_.warnings.push_back("the file holds " + std::to_string(scenes->size()) +
                              " scenes; read is " + (chosen ? "the one it shows" : "the first"));
    }
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
    if (is_hidden(node)) {
      ++hidden_;
      return;
    }
    const Eigen::Affine3d world = parent * node_matrix(node);
    if (const auto skin = node.find("skin"); skin && node.find("mesh")) {
      skin->fail(Defect::Unsupported,
                 "joints of a skeleton place this mesh, which are not read: apply the armature "
                 "before exporting");
    }
    if (const auto index = node.find("mesh")) {
      const JsonValue mesh = file_.element("meshes", *index);
      const auto own_weights = node.find("weights");
      const auto weights = own_weights ? own_weights : mesh.find("weights");
      const std::vector<Eigen::Affine3d> places = places_of_mesh(file_, node);
      refuse_many_instances(file_, out_.instances.size() + places.size());
      for (const Eigen::Affine3d& place : places) {
        out_.instances.push_back({mesh, world * place, weights});
      }
    }
    if (const auto children = node.find("children")) visit_all(*children, world, depth + 1);
  }

  static bool is_hidden(const JsonValue& node) {
    const auto extension = extension_of(node, "KHR_node_visibility");
    const auto visible = extension ? extension->find("visible") : std::nullopt;
    return visible && !visible->boolean();
  }

  const GlbContainer& file_;
  GlbScene out_;
  std::vector<bool> visited_;
  size_t hidden_ = 0;
};

std::string number_line(const char* key, double value) {
  std::string out = std::string(key) + " ";
  append_number(out, value);
  return out;
}

}  // namespace

GlbScene glb_scene(const GlbContainer& file) {
  const JsonValue root = file.root();
  refuse_unknown_extensions(root);
  GlbScene out = NodeVisitor(file).visit();
  const auto add = [&](const std::string& line) { out.warnings.push_back(line); };
  for (const std::string& line : unread_extensions(root)) add(line);
  const auto animations = root.find("animations");
  if (animations && animations->is_array() && animations->size() > 0) {
    add(std::to_string(animations->size()) +
        " animations are left out; what is read is how the file looks before they begin");
  }
  return out;
}

GlbOrigin glb_origin(const GlbContainer& file) {
  GlbOrigin out;
  const auto extras = file.root().at("asset").find("extras");
  if (!extras || !extras->is_object() || !extras->find("gltf_from_world")) {
    out.comments = {"unit m", "metres_per_unit 1", "scale_source assumed"};
    return out;
  }
  out.is_ours = true;
  out.had_labels = extras->find("area").has_value();
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
  out.comments = {number_line("metres_per_unit", metres),
                  number_line("metres_sigma", extras->at("metres_sigma").number()),
                  "scale_source " + extras->at("scale_source").text()};
  return out;
}

}  // namespace cgs
