// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_faces.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>

#include "io/glb/extensions.h"
#include "io/meshes/draco_reader.h"

namespace cgs {

namespace {

constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

// mode of a primitive.
constexpr int kLineLoop = 2;
constexpr int kLineStrip = 3;
constexpr int kTriangleList = 4;
constexpr int kTriangleStrip = 5;
constexpr int kTriangleFan = 6;

int mode_of(const JsonValue& primitive) {
  const auto mode = primitive.find("mode");
  const int out = mode ? mode->count() : kTriangleList;
  if (out > kTriangleFan) mode->fail(Defect::Schema, "is none of 0 to 6");
  return out;
}

std::vector<float> without_alpha(const std::vector<float>& rgba) {
  std::vector<float> out;
  for (size_t i = 0; i + 3 < rgba.size(); i += 4) {
    out.insert(out.end(),
               rgba.begin() + static_cast<std::ptrdiff_t>(i),
               rgba.begin() + static_cast<std::ptrdiff_t>(i) + 3);
  }
  return out;
}

/// Reads what primitives hold.
class PrimitiveReader {
 public:
  PrimitiveReader(const GlbContainer& file, int texcoord_set)
      : file_(file),
        texcoord_(texcoord_set < 0 ? "" : "TEXCOORD_" + std::to_string(texcoord_set)) {}

  GlbFaces read(const JsonValue& primitive, const std::optional<JsonValue>& weights) const {
    const auto draco = extension_of(primitive, kDracoExtension);
    GlbFaces out = draco ? compressed(primitive, *draco) : plain(primitive);
    if (const auto targets = primitive.find("targets"); targets && weights) {
      morph(*targets, numbers_of(*weights), *weights, out);
    }
    const size_t vertices = out.positions.size() / 3;
    const auto fits = [&](const std::vector<float>& values, size_t components) {
      return values.empty() || values.size() == components * vertices;
    };
    if (!fits(out.colors, 3) || !fits(out.support, 1) || !fits(out.sigma, 1) ||
        !fits(out.features, 1) || !fits(out.texcoords, 2) || !fits(out.normals, 3)) {
      primitive.fail(Defect::Count, "has attributes of different length");
    }
    const auto refuse = [&](const char* what, uint32_t corner) {
      primitive.fail(Defect::Ref,
                     std::string(what) + " names vertex " + std::to_string(corner) + " of " +
                         std::to_string(vertices));
    };
    for (const uint32_t point : out.points) {
      if (point >= vertices) refuse("a point", point);
    }
    for (const auto& face : out.faces) {
      for (const uint32_t corner : face) {
        if (corner >= vertices) refuse("a face", corner);
      }
    }
    return out;
  }

 private:
  std::vector<float> attribute(const JsonValue& attributes,
                               const char* name,
                               int components) const {
    const auto index = attributes.find(name);
    if (!index) return {};
    return file_.floats(file_.element("accessors", *index), components);
  }

  std::vector<float> colors(const JsonValue& attributes) const {
    const auto index = attributes.find("COLOR_0");
    if (!index) return {};
    const JsonValue accessor = file_.element("accessors", *index);
    if (accessor.at("type").text() == "VEC3") return file_.floats(accessor, 3);
    return without_alpha(file_.floats(accessor, 4));
  }

  GlbFaces plain(const JsonValue& primitive) const {
    const JsonValue attributes = primitive.at("attributes");
    GlbFaces out;
    out.positions = file_.floats(file_.element("accessors", attributes.at("POSITION")), 3);
    out.colors = colors(attributes);
    out.support = attribute(attributes, "_SUPPORT", 1);
    out.sigma = attribute(attributes, "_SIGMA", 1);
    out.features = attribute(attributes, "_FEATURE_ID_0", 1);
    if (!texcoord_.empty()) out.texcoords = attribute(attributes, texcoord_.c_str(), 2);
    std::vector<uint32_t> corners;
    if (const auto index = primitive.find("indices")) {
      corners = file_.indices(file_.element("accessors", *index));
    } else {
      corners.resize(out.positions.size() / 3);
      std::iota(corners.begin(), corners.end(), 0u);
    }
    if (glb_kind(primitive) == GlbKind::Points) {
      out.normals = attribute(attributes, "NORMAL", 3);
      out.points = std::move(corners);
    } else {
      out.faces = triangles(mode_of(primitive), corners);
    }
    return out;
  }

  // Each value is the stored one plus, for every target, its weight times what it states.
  void morph(const JsonValue& targets,
             const std::vector<double>& weights,
             const JsonValue& stated,
             GlbFaces& out) const {
    if (weights.size() != targets.size()) {
      stated.fail(Defect::Count,
                  "has " + std::to_string(weights.size()) + " weights for " +
                      std::to_string(targets.size()) + " morph targets");
    }
    for (size_t i = 0; i < weights.size(); ++i) {
      if (weights[i] == 0) continue;
      const JsonValue target = targets.at(i);
      const auto add = [&](const std::vector<float>& change, std::vector<float>& values) {
        if (change.empty() || values.empty()) return;
        if (change.size() != values.size()) {
          target.fail(Defect::Count, "differs in length from what it changes");
        }
        for (size_t k = 0; k < change.size(); ++k) {
          values[k] = static_cast<float>(values[k] + weights[i] * double{change[k]});
        }
      };
      add(attribute(target, "POSITION", 3), out.positions);
      add(attribute(target, "NORMAL", 3), out.normals);
      add(colors(target), out.colors);
      if (!texcoord_.empty()) add(attribute(target, texcoord_.c_str(), 2), out.texcoords);
    }
  }

  static std::vector<std::array<uint32_t, 3>> triangles(int mode,
                                                        const std::vector<uint32_t>& corners) {
    std::vector<std::array<uint32_t, 3>> out;
    if (mode == kTriangleList) {
      for (size_t i = 0; i + 2 < corners.size(); i += 3) {
        out.push_back({corners[i], corners[i + 1], corners[i + 2]});
      }
    }
    for (size_t i = 2; i < corners.size() && mode == kTriangleStrip; ++i) {
      const size_t odd = i % 2;  // every other triangle of a strip is turned over
      const std::array<uint32_t, 3> face = {corners[i - 2], corners[i - 1 + odd], corners[i - odd]};
      // A corner named twice leads from one strip to the next.
      const bool is_seam = face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
      if (!is_seam) out.push_back(face);
    }
    for (size_t i = 2; i < corners.size() && mode == kTriangleFan; ++i) {
      out.push_back({corners[0], corners[i - 1], corners[i]});
    }
    return out;  // lines have no surface
  }

  // An attribute that the compressed mesh lacks lies in its accessor, as without compression; one
  // that holds no bytes stands for what was compressed.
  std::vector<float> beside(const JsonValue& attributes, const char* name, int components) const {
    const auto index = attributes.find(name);
    if (!index) return {};
    const JsonValue accessor = file_.element("accessors", *index);
    if (!accessor.find("bufferView") && !accessor.find("sparse")) return {};
    const bool is_color = std::string_view(name) == "COLOR_0";
    return is_color ? colors(attributes) : attribute(attributes, name, components);
  }

  // Source: KHR_draco_mesh_compression, Khronos Group, section Conformance.
  GlbFaces compressed(const JsonValue& primitive, const JsonValue& draco) const {
    const DracoMesh mesh = read_draco(file_.view_bytes(draco.at("bufferView")), file_.path());
    const JsonValue ids = draco.at("attributes");
    const JsonValue attributes = primitive.at("attributes");
    const auto values = [&](const char* name, int least) -> std::vector<float> {
      const auto id = ids.find(name);
      if (!id) return beside(attributes, name, least);
      const auto it = mesh.attributes.find(id->count());
      if (it == mesh.attributes.end() || it->second.components < least) {
        id->fail(Defect::Ref, "names no such attribute of the compressed mesh");
      }
      std::vector<float> out = it->second.values;
      scale_whole_numbers(attributes.at(name), it->second, out);
      return it->second.components == 4 ? without_alpha(out) : out;
    };
    GlbFaces out;
    out.positions = values("POSITION", 3);
    out.colors = values("COLOR_0", 3);
    out.support = values("_SUPPORT", 1);
    out.sigma = values("_SIGMA", 1);
    out.features = values("_FEATURE_ID_0", 1);
    if (!texcoord_.empty()) out.texcoords = values(texcoord_.c_str(), 2);
    out.faces = mesh.faces;
    if (out.positions.size() != 3 * mesh.vertices) {
      draco.fail(Defect::Schema, "has no positions");
    }
    return out;
  }

  // Whole numbers that the decoder left as they are, where the accessor says how to read them.
  void scale_whole_numbers(const JsonValue& index,
                           const DracoMesh::Attribute& attribute,
                           std::vector<float>& values) const {
    constexpr std::array<float, 4> kLargest = {127, 255, 32767, 65535};  // of types 5120 to 5123
    constexpr int kFirstType = 5120;
    const JsonValue accessor = file_.element("accessors", index);
    const int type = accessor.at("componentType").count() - kFirstType;
    const auto normalized = accessor.find("normalized");
    if (attribute.is_normalized || type < 0 || type >= int(kLargest.size())) return;
    const bool is_scaled = normalized && normalized->boolean();
    if (!is_scaled && !index.pointer().ends_with("/COLOR_0")) return;  // which always are
    for (float& v : values) v = std::max(-1.0f, v / kLargest.at(static_cast<size_t>(type)));
  }

  const GlbContainer& file_;
  std::string texcoord_;  // name of an attribute; empty = none is read
};

}  // namespace

GlbKind glb_kind(const JsonValue& primitive) {
  const int mode = mode_of(primitive);
  if (mode == 0) return GlbKind::Points;
  return mode < kTriangleList ? GlbKind::Lines : GlbKind::Triangles;
}

uint64_t stated_elements(const GlbContainer& file, const JsonValue& primitive) {
  const auto indices = primitive.find("indices");
  const JsonValue listed =
      file.element("accessors", indices ? *indices : primitive.at("attributes").at("POSITION"));
  const uint64_t count = whole_number(listed.at("count"));
  switch (mode_of(primitive)) {
    case 0:
      return count;
    case kLineLoop:
      return count > 1 ? count : 0;
    case kLineStrip:
      return count > 1 ? count - 1 : 0;
    case kTriangleList:
      return count / 3;
    case kTriangleStrip:
    case kTriangleFan:
      return count > 2 ? count - 2 : 0;
    default:
      return count / 2;
  }
}

GlbFaces read_glb_primitive(const GlbContainer& file,
                            const JsonValue& primitive,
                            int texcoord_set,
                            const std::optional<JsonValue>& weights) {
  return PrimitiveReader(file, texcoord_set).read(primitive, weights);
}

}  // namespace cgs
