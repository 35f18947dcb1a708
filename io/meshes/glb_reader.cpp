// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_reader.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "io/bytes/byte_reader.h"
#include "io/bytes/mesh_arrays.h"
#include "io/bytes/significance.h"
#include "io/glb/container.h"
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
  SceneReader(const GlbContainer& file, const GlbOrigin& origin)
      : file_(file), origin_(origin), colors_(file, origin.is_ours) {}

  GlbMesh read() {
    for (const GlbInstance& instance : glb_instances(file_)) {
      add_mesh(instance.mesh, instance.gltf_from_mesh);
    }
    TriangleMesh& mesh = out_.parsed.mesh;
    if (mesh.faces.empty()) {
      throw BadInput(Defect::Empty, file_.path(), "holds no triangles");
    }
    const std::string odd = check_significance(file_.path(), stored_, kFloatDigits);
    if (!odd.empty()) out_.parsed.warnings.push_back(odd);
    if (!has_colors_) mesh.colors.clear();
    if (!all_have_support_) mesh.support.clear();
    if (!all_have_sigma_) mesh.sigma.clear();
    settle_labels();
    if (has_splats_) {
      out_.parsed.warnings.emplace_back("left out the splats that lie beside the triangles");
    }
    out_.parsed.warnings.insert(
        out_.parsed.warnings.end(), colors_.warnings().begin(), colors_.warnings().end());
    out_.parsed.has_textures = colors_.has_textures();
    if (collapsed_ > 0) {
      out_.parsed.warnings.push_back("left out " + std::to_string(collapsed_) +
                                     " faces with two corners in one place");
    }
    if (recolored_ > 0 && !origin_.is_ours) {  // ours are of photographs that differ a little
      out_.parsed.warnings.push_back("surfaces of different colours meet at " +
                                     std::to_string(recolored_) +
                                     " corners; vertices have one, that of the first");
    }
    return std::move(out_);
  }

 private:
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

  void add_mesh(const JsonValue& mesh, const Eigen::Affine3d& world) {
    const JsonValue primitives = mesh.at("primitives");
    for (size_t i = 0; i < primitives.size(); ++i) {
      const JsonValue primitive = primitives.at(i);
      const auto extensions = primitive.find("extensions");
      has_splats_ = has_splats_ || (extensions && extensions->find(kGaussianSplatting));
      GlbFaces faces = read_glb_primitive(file_, primitive, colors_.texcoord_set(primitive));
      if (faces.faces.empty()) continue;  // points and lines neither add vertices nor lack colours
      faces.colors = colors_.of_vertices(primitive, faces);
      add(faces, world, labels_of(primitive, faces));
      if (out_.parsed.mesh.faces.size() > kMostCorners / 3) {
        throw LimitError(printable(file_.path()) + ": more than " +
                         std::to_string(kMostCorners / 3) + " triangles");
      }
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
    has_colors_ = has_colors_ || !in.colors.empty();
    all_have_support_ = all_have_support_ && !in.support.empty();
    all_have_sigma_ = all_have_sigma_ && !in.sigma.empty();
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
    const Eigen::Vector3f color = color_of(in, v);
    if (number < out.positions.size()) {
      const bool is_other = (out.mesh.colors[number] - color).cwiseAbs().maxCoeff() > kOtherColor;
      recolored_ += !in.colors.empty() && is_other ? 1 : 0;
      return number;
    }
    out.positions.push_back(place);
    out.mesh.colors.push_back(color);
    out.mesh.support.push_back(in.support.empty() ? 0.0f : in.support[v]);
    const float sigma = in.sigma.empty() ? -1.0f : in.sigma[v];
    out.mesh.sigma.push_back(static_cast<float>(double{sigma} * origin_.units_per_metre));
    return number;
  }

  const GlbContainer& file_;
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
  bool has_splats_ = false;
};

}  // namespace

GlbMesh read_glb(const std::filesystem::path& path) { return parse_glb(read_file(path), path); }

GlbMesh parse_glb(std::string content, const std::filesystem::path& path) {
  const GlbContainer file(std::move(content), path);
  GlbOrigin origin = glb_origin(file);
  GlbMesh out = SceneReader(file, origin).read();
  out.parsed.comments = std::move(origin.comments);
  out.up = origin.world_from_gltf * Eigen::Vector3d::UnitY();
  return out;
}

}  // namespace cgs
