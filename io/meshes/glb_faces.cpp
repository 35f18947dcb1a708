// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_faces.h"

#include <numeric>
#include <optional>
#include <string>

#include "io/meshes/draco_reader.h"

namespace cgs {

namespace {

constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

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

  GlbFaces read(const JsonValue& primitive) const {
    const auto extensions = primitive.find("extensions");
    const auto draco = extensions ? extensions->find(kDracoExtension) : std::nullopt;
    GlbFaces out = draco ? compressed(primitive, *draco) : plain(primitive);
    const size_t vertices = out.positions.size() / 3;
    const auto fits = [&](const std::vector<float>& values, size_t components) {
      return values.empty() || values.size() == components * vertices;
    };
    if (!fits(out.colors, 3) || !fits(out.support, 1) || !fits(out.sigma, 1) ||
        !fits(out.features, 1) || !fits(out.texcoords, 2)) {
      primitive.fail(Defect::Count, "has attributes of different length");
    }
    for (const auto& face : out.faces) {
      for (const uint32_t corner : face) {
        if (corner < vertices) continue;
        primitive.fail(
            Defect::Ref,
            "a face names vertex " + std::to_string(corner) + " of " + std::to_string(vertices));
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
    out.faces = triangles(primitive, corners);
    return out;
  }

  static std::vector<std::array<uint32_t, 3>> triangles(const JsonValue& primitive,
                                                        const std::vector<uint32_t>& corners) {
    constexpr int kTriangles = 4;
    constexpr int kStrip = 5;
    constexpr int kFan = 6;
    const auto mode = primitive.find("mode");
    const int kind = mode ? mode->count() : kTriangles;
    std::vector<std::array<uint32_t, 3>> out;
    if (kind == kTriangles) {
      for (size_t i = 0; i + 2 < corners.size(); i += 3) {
        out.push_back({corners[i], corners[i + 1], corners[i + 2]});
      }
    }
    for (size_t i = 2; i < corners.size() && kind == kStrip; ++i) {
      const size_t odd = i % 2;  // every other triangle of a strip is turned over
      out.push_back({corners[i - 2], corners[i - 1 + odd], corners[i - odd]});
    }
    for (size_t i = 2; i < corners.size() && kind == kFan; ++i) {
      out.push_back({corners[0], corners[i - 1], corners[i]});
    }
    return out;  // points and lines have no surface
  }

  GlbFaces compressed(const JsonValue& primitive, const JsonValue& draco) const {
    const DracoMesh mesh = read_draco(file_.view_bytes(draco.at("bufferView")), file_.path());
    const JsonValue ids = draco.at("attributes");
    const JsonValue attributes = primitive.at("attributes");
    const auto values = [&](const char* name, int least) -> std::vector<float> {
      const auto id = ids.find(name);
      if (!id) return {};
      const auto it = mesh.attributes.find(id->count());
      if (it == mesh.attributes.end() || it->second.components < least) {
        id->fail(Defect::Ref, "names no such attribute of the compressed mesh");
      }
      std::vector<float> out = it->second.values;
      if (std::string_view(name) == "COLOR_0" || name == texcoord_) {
        scale_whole_numbers(attributes.at(name), it->second, out);
      }
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
    constexpr int kByteType = 5121;
    constexpr int kShortType = 5123;
    const JsonValue accessor = file_.element("accessors", index);
    const int type = accessor.at("componentType").count();
    if (attribute.is_normalized || (type != kByteType && type != kShortType)) return;
    const float largest = type == kByteType ? 255.0f : 65535.0f;
    for (float& v : values) v /= largest;
  }

  const GlbContainer& file_;
  std::string texcoord_;  // name of an attribute; empty = none is read
};

}  // namespace

GlbFaces read_glb_primitive(const GlbContainer& file,
                            const JsonValue& primitive,
                            int texcoord_set) {
  return PrimitiveReader(file, texcoord_set).read(primitive);
}

}  // namespace cgs
