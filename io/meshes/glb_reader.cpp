// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_reader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "io/bytes/byte_reader.h"
#include "io/bytes/mesh_arrays.h"
#include "io/bytes/significance.h"
#include "io/glb/container.h"
#include "io/glb/extensions.h"
#include "io/glb/scene.h"
#include "io/meshes/glb_colors.h"
#include "io/meshes/glb_faces.h"
#include "io/meshes/material_labels.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

constexpr uint64_t kMostCorners = uint64_t{1} << 31;

/// Puts the primitives of all nodes together.
class SceneReader {
 public:
  SceneReader(GlbContainer& file, const GlbOrigin& origin)
      : file_(file), origin_(origin), colors_(file, origin.is_ours) {}

  GlbMesh read() {
    const GlbScene scene = glb_scene(file_);
    is_cloud_ = !shows_triangles(scene);
    refuse_multiplication(scene);
    for (const GlbInstance& instance : scene.instances) add_mesh(instance);
    TriangleMesh& mesh = out_.parsed.mesh;
    if (is_cloud_ ? out_.parsed.positions.empty() : mesh.faces.empty()) {
      throw BadInput(Defect::Empty,
                     file_.path(),
                     "holds no triangles" + (is_cloud_ ? std::string(" and no points") : "") +
                         (lines_ > 0 ? ", but " + std::to_string(lines_) + " lines" : ""));
    }
    if (!has_colors_) mesh.colors.clear();
    if (!all_have_support_) mesh.support.clear();
    if (!all_have_sigma_) mesh.sigma.clear();
    if (!all_have_normals_ || !is_cloud_) mesh.normals.clear();
    settle_labels();
    drop_unusable(out_.parsed, file_.path());
    const std::string odd = check_significance(file_.path(), stored_, kFloatDigits);
    if (!odd.empty()) warn(odd);
    for (const std::string& line : scene.warnings) warn(line);
    warn_of_what_is_left_out();
    return std::move(out_);
  }

 private:
  void warn(const std::string& line) { out_.parsed.warnings.push_back(line); }

  // A file of points and lines alone is a cloud.
  bool shows_triangles(const GlbScene& scene) const {
    std::set<std::string> seen;
    for (const GlbInstance& instance : scene.instances) {
      if (!seen.insert(instance.mesh.pointer()).second) continue;
      const JsonValue primitives = instance.mesh.at("primitives");
      for (size_t i = 0; i < primitives.size(); ++i) {
        if (glb_kind(primitives.at(i)) == GlbKind::Triangles) return true;
      }
    }
    return false;
  }

  // Nodes show meshes again and again, and meshes share arrays: the size of the file is no bound.
  void refuse_multiplication(const GlbScene& scene) const {
    constexpr double kMayMultiplyTo = 1 << 25;
    std::map<std::string, double> costs;             // of meshes
    std::set<std::pair<uint64_t, uint64_t>> arrays;  // of corners and positions
    double shown = 0;
    double stored = 0;
    for (const GlbInstance& instance : scene.instances) {
      const auto [known, is_new] = costs.try_emplace(instance.mesh.pointer(), 0.0);
      const JsonValue primitives = instance.mesh.at("primitives");
      for (size_t i = 0; is_new && i < primitives.size(); ++i) {
        const JsonValue primitive = primitives.at(i);
        known->second += 1;  // that of looking at it
        stored += 1;
        if (extension_of(primitive, kGaussianSplatting) || !is_read(glb_kind(primitive))) continue;
        const auto corners = primitive.find("indices");
        const JsonValue positions = primitive.at("attributes").at("POSITION");
        const uint64_t vertices = whole_number(file_.element("accessors", positions).at("count"));
        const auto cost = double(std::max(stated_elements(file_, primitive), vertices));
        known->second += cost;
        const bool is_first =
            arrays.emplace(whole_number(corners.value_or(positions)), whole_number(positions))
                .second;
        if (is_first) stored += cost;
      }
      shown += known->second;
    }
    if (shown <= std::max(kMayMultiplyTo, stored)) return;
    throw LimitError(printable(file_.path()) + ": nodes show meshes so often that there are more " +
                     "than 33 million triangles or vertices");
  }

  void warn_of_what_is_left_out() {
    const auto left_out = [&](uint64_t count, const char* what) {
      if (count > 0) warn("left out " + std::to_string(count) + " " + what);
    };
    if (has_splats_) warn("left out the splats that lie beside the triangles");
    left_out(points_, "points that lie beside the triangles");
    left_out(lines_, "line segments");
    for (const std::string& line : colors_.warnings()) warn(line);
    out_.parsed.has_textures = colors_.has_textures();
    left_out(collapsed_, "faces with two corners in one place");
    if (recolored_ > 0 && !origin_.is_ours) {  // ours are of photographs that differ a little
      warn("surfaces of different colours meet at " + std::to_string(recolored_) +
           " corners; vertices have one, that of the first");
    }
  }

  void settle_labels() {
    ParsedMesh& out = out_.parsed;
    const bool are_told = all_have_labels_ && (origin_.is_ours || materials_.are_told());
    if (!are_told) out.mesh.provenance.clear();
    const std::string of_names = materials_.warning(are_told);
    if (origin_.had_labels && !are_told) {
      out.warnings.emplace_back(kLostLabels);
    } else if (!origin_.is_ours && !of_names.empty()) {
      out.warnings.push_back(of_names);
    }
  }

  void add_mesh(const GlbInstance& instance) {
    const JsonValue primitives = instance.mesh.at("primitives");
    for (size_t i = 0; i < primitives.size(); ++i) {
      const JsonValue primitive = primitives.at(i);
      if (extension_of(primitive, kGaussianSplatting)) {
        has_splats_ = true;
      } else if (!is_read(glb_kind(primitive))) {
        const bool are_points = glb_kind(primitive) == GlbKind::Points;
        (are_points ? points_ : lines_) += stated_elements(file_, primitive);
      } else {
        add_primitive(primitive, instance);
      }
    }
  }

  bool is_read(GlbKind kind) const {
    return kind == (is_cloud_ ? GlbKind::Points : GlbKind::Triangles);
  }

  void add_primitive(const JsonValue& primitive, const GlbInstance& instance) {
    GlbFaces in =
        read_glb_primitive(file_, primitive, colors_.texcoord_set(primitive), instance.weights);
    if (in.faces.empty() && in.points.empty()) return;  // which lacks no colours either
    in.colors = colors_.of_vertices(primitive, in);
    if (is_cloud_) {
      add_points(in, instance.gltf_from_mesh);
    } else {
      add(in, instance.gltf_from_mesh, labels_of(primitive, in));
    }
    const size_t most = kMostCorners / 3;
    if (out_.parsed.mesh.faces.size() > most || out_.parsed.positions.size() > kMostCorners) {
      throw LimitError(printable(file_.path()) + ": more than " +
                       std::to_string(is_cloud_ ? kMostCorners : most) +
                       (is_cloud_ ? " points" : " triangles"));
    }
  }

  // Of faces; empty where nothing is said. Programs that pack files for the web join materials that
  // look alike under the name of one, but keep feature numbers: these come first. In files that do
  // not say that they are ours, numbers may be of anything; there they only weaken what names say.
  std::vector<Provenance> labels_of(const JsonValue& primitive, const GlbFaces& in) {
    const std::optional<Provenance> label = label_of(primitive);
    materials_.add(label);
    if (in.features.empty() || (!origin_.is_ours && !label)) {
      return label ? std::vector<Provenance>(in.faces.size(), *label) : std::vector<Provenance>();
    }
    std::vector<Provenance> out;
    for (const auto& face : in.faces) {
      Provenance weakest = origin_.is_ours ? Provenance::Observed : *label;
      for (const uint32_t corner : face) {
        const auto* const found = std::find_if(
            kProvenanceOrder.begin(), kProvenanceOrder.end(), [&](Provenance candidate) {
              return static_cast<float>(candidate) == in.features[corner];
            });
        const bool is_label = found != kProvenanceOrder.end();
        if (!is_label && origin_.is_ours) return {};
        if (!is_label) continue;
        weakest = weaker_evidence(weakest, *found);
      }
      out.push_back(weakest);
    }
    return out;
  }

  std::optional<Provenance> label_of(const JsonValue& primitive) const {
    const auto index = primitive.find("material");
    if (!index) return std::nullopt;
    const auto name = file_.element("materials", *index).find("name");
    return name ? provenance_of_material(name->text()) : std::nullopt;
  }

  void add(const GlbFaces& in,
           const Eigen::Affine3d& world,
           const std::vector<Provenance>& labels) {
    TriangleMesh& mesh = out_.parsed.mesh;
    const bool is_mirrored = world.linear().determinant() < 0;
    std::vector<uint32_t> numbers(in.positions.size() / 3);
    for (size_t v = 0; v < numbers.size(); ++v) {
      numbers[v] = number_of(place_of(in, world, v), in, v);
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
    note_attributes(in);
  }

  // Two points in one place stay two, unlike vertices of faces.
  void add_points(const GlbFaces& in, const Eigen::Affine3d& world) {
    const Eigen::Matrix3d turn = origin_.world_from_gltf * world.linear().inverse().transpose();
    for (const uint32_t v : in.points) {
      append_vertex(place_of(in, world, v), in, v);
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      if (!in.normals.empty()) normal = (turn * three(in.normals, v)).stableNormalized();
      if (!normal.allFinite()) normal.setZero();
      out_.parsed.mesh.normals.push_back(normal.cast<float>());
    }
    all_have_normals_ = all_have_normals_ && !in.normals.empty();
    note_attributes(in);
  }

  void note_attributes(const GlbFaces& in) {
    has_colors_ = has_colors_ || !in.colors.empty();
    all_have_support_ = all_have_support_ && !in.support.empty();
    all_have_sigma_ = all_have_sigma_ && !in.sigma.empty();
  }

  static Eigen::Vector3d three(const std::vector<float>& values, size_t v) {
    return {values[3 * v], values[3 * v + 1], values[3 * v + 2]};
  }

  Eigen::Vector3d place_of(const GlbFaces& in, const Eigen::Affine3d& world, size_t v) {
    const Eigen::Vector3d p = three(in.positions, v);
    if (p.allFinite()) stored_.extend(world.linear() * p);
    return origin_.world(world * p);
  }

  static Eigen::Vector3f color_of(const GlbFaces& in, size_t v) {
    Eigen::Vector3f color = Eigen::Vector3f::Ones();
    for (int c = 0; c < 3 && !in.colors.empty(); ++c) {
      const float linear = in.colors[3 * v + static_cast<size_t>(c)];
      color[c] = srgb_from_linear(std::isfinite(linear) ? std::clamp(linear, 0.0f, 1.0f) : 0.0f);
    }
    return color;
  }

  // The vertex at a place: a new one with what the primitive says of it, or the first there.
  uint32_t number_of(const Eigen::Vector3d& place, const GlbFaces& in, size_t v) {
    constexpr float kOtherColor = 0.1f;  // more than compression or shading makes of one
    ParsedMesh& out = out_.parsed;
    const uint32_t number = places_.number(place);
    if (number < out.positions.size()) {
      const Eigen::Vector3f color = color_of(in, v);
      const bool is_other = (out.mesh.colors[number] - color).cwiseAbs().maxCoeff() > kOtherColor;
      recolored_ += !in.colors.empty() && is_other ? 1 : 0;
      return number;
    }
    append_vertex(place, in, v);
    return number;
  }

  void append_vertex(const Eigen::Vector3d& place, const GlbFaces& in, size_t v) {
    ParsedMesh& out = out_.parsed;
    out.positions.push_back(place);
    out.mesh.colors.push_back(color_of(in, v));
    out.mesh.support.push_back(in.support.empty() ? 0.0f : in.support[v]);
    const float sigma = in.sigma.empty() ? -1.0f : in.sigma[v];
    out.mesh.sigma.push_back(static_cast<float>(double{sigma} * origin_.units_per_metre));
  }

  GlbContainer& file_;
  const GlbOrigin& origin_;
  GlbColors colors_;
  GlbMesh out_;
  PlaceNumbers places_;
  // Of the positions as they were rounded to float: nodes have scaled but not moved them yet.
  Eigen::AlignedBox3d stored_;
  size_t collapsed_ = 0;     // faces
  size_t recolored_ = 0;     // corners where surfaces of other colours meet
  bool has_colors_ = false;  // any of it; the rest is white
  bool all_have_labels_ = true;
  MaterialLabels materials_;
  bool all_have_support_ = true;
  bool all_have_sigma_ = true;
  bool all_have_normals_ = true;  // of a cloud
  bool has_splats_ = false;
  bool is_cloud_ = false;  // no triangles, so that points are read
  uint64_t points_ = 0;    // left out
  uint64_t lines_ = 0;     // segments
};

}  // namespace

GlbMesh read_glb(const std::filesystem::path& path) { return parse_glb(read_file(path), path); }

GlbMesh parse_glb(std::string content, const std::filesystem::path& path) {
  GlbContainer file(std::move(content), path);
  GlbOrigin origin = glb_origin(file);
  GlbMesh out = SceneReader(file, origin).read();
  out.parsed.comments = std::move(origin.comments);
  out.up = origin.world_from_gltf * Eigen::Vector3d::UnitY();
  return out;
}

}  // namespace cgs
