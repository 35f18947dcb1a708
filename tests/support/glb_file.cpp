// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/glb_file.h"

#include <cmath>
#include <cstring>

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>

#include "io/images/image.h"
#include "libcgs/core/srgb.h"
#include "tests/support/temp_dir.h"

namespace cgs::test {

namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

uint32_t word(const std::string& bytes, size_t offset) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, 4);
  return value;
}

std::string view_bytes(const Glb& glb, size_t view) {
  const auto& v = glb.json["bufferViews"][view];
  return glb.binary.substr(v.value("byteOffset", size_t{0}), v["byteLength"]);
}

size_t components(const Glb& glb, size_t accessor) {
  const std::string type = glb.json["accessors"][accessor]["type"];
  return type == "VEC3" ? 3 : type == "VEC2" ? 2 : 1;
}

void read_plain(const Glb& glb, const nlohmann::json& primitive, GlbPart& part) {
  const auto raw = [&](size_t accessor) {
    return view_bytes(glb, glb.json["accessors"][accessor]["bufferView"]);
  };
  const std::string indices = raw(primitive["indices"]);
  const auto& listed = glb.json["accessors"][primitive["indices"].get<size_t>()];
  const size_t width = listed["componentType"] == 5123 ? 2 : 4;  // unsigned short, unsigned int
  EXPECT_TRUE(width == 2 || listed["componentType"] == 5125);
  EXPECT_EQ(listed["count"].get<size_t>() * width, indices.size());
  part.faces.resize(indices.size() / (3 * width));
  for (size_t i = 0; i < 3 * part.faces.size(); ++i) {
    std::memcpy(&part.faces[i / 3].at(i % 3), indices.data() + width * i, width);
  }
  for (const auto& [name, accessor] : primitive["attributes"].items()) {
    const size_t n = components(glb, accessor);
    const std::string bytes = raw(accessor);
    for (size_t at = 0; at < bytes.size(); at += n * 4) {
      std::vector<float> value(n);
      std::memcpy(value.data(), bytes.data() + at, n * 4);
      part.values[name].push_back(value);
    }
  }
}

void read_draco(const Glb& glb, const nlohmann::json& primitive, GlbPart& part) {
  const auto& extension = primitive["extensions"][kDraco];
  const std::string bytes = view_bytes(glb, extension["bufferView"]);
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  const auto mesh = draco::Decoder().DecodeMeshFromBuffer(&buffer).value();
  for (uint32_t i = 0; i < mesh->num_faces(); ++i) {
    const auto& f = mesh->face(draco::FaceIndex(i));
    part.faces.push_back({f[0].value(), f[1].value(), f[2].value()});
  }
  EXPECT_EQ(glb.json["accessors"][primitive["indices"].get<size_t>()]["count"],
            mesh->num_faces() * 3);
  for (const auto& [name, accessor] : primitive["attributes"].items()) {
    const auto* attribute = mesh->GetAttributeByUniqueId(extension["attributes"][name]);
    ASSERT_NE(attribute, nullptr) << name;
    const size_t n = components(glb, accessor);
    ASSERT_EQ(static_cast<size_t>(attribute->num_components()), n) << name;
    EXPECT_EQ(glb.json["accessors"][accessor.get<size_t>()]["count"], mesh->num_points());
    for (uint32_t i = 0; i < mesh->num_points(); ++i) {
      std::vector<float> value(n);
      attribute->GetMappedValue(draco::PointIndex(i), value.data());
      part.values[name].push_back(value);
    }
  }
}

ColorImage decoded_image(const Glb& glb, const nlohmann::json& image) {
  EXPECT_EQ(image["mimeType"], "image/jpeg");
  const TempDir dir;
  write_bytes(dir / "a.jpg", view_bytes(glb, image["bufferView"]));
  return read_image(dir / "a.jpg");
}

void read_material(const Glb& glb, const nlohmann::json& primitive, GlbPart& part) {
  part.material_json = glb.json["materials"][primitive["material"].get<size_t>()];
  part.material = part.material_json["name"];
  const auto& pbr = part.material_json["pbrMetallicRoughness"];
  if (!pbr.contains("baseColorTexture")) return;
  EXPECT_EQ(pbr["baseColorTexture"].value("texCoord", 0), 0);
  part.image = glb.json["textures"][pbr["baseColorTexture"]["index"].get<size_t>()]["source"];
}

/// Draws faces into a picture.
class Painter {
 public:
  Painter(const Glb& glb, const Camera& camera) : glb_(glb), camera_(camera) {
    out_.color = ColorImage(camera.width, camera.height, Eigen::Vector3f::Zero());
    out_.part = Raster<int>(camera.width, camera.height, -1);
    nearness_ = Raster<double>(camera.width, camera.height, 0);
  }

  GlbPicture paint() {
    const Eigen::Isometry3d cam_from_world = camera_.cam_from_world();
    for (size_t p = 0; p < glb_.parts.size(); ++p) {
      const GlbPart& part = glb_.parts[p];
      std::vector<Eigen::Vector3d> corners;
      for (const auto& position : part.values.at("POSITION")) {
        corners.push_back(camera_.project_in_cam(cam_from_world * in_world(glb_, position)));
      }
      for (const auto& face : part.faces) draw(p, face, corners);
    }
    return std::move(out_);
  }

 private:
  void draw(size_t p,
            const std::array<uint32_t, 3>& face,
            const std::vector<Eigen::Vector3d>& uvz) {
    const Eigen::Vector3d& a = uvz[face[0]];
    const Eigen::Vector3d& b = uvz[face[1]];
    const Eigen::Vector3d& c = uvz[face[2]];
    if (!(std::min({a.z(), b.z(), c.z()}) > 0)) return;
    const auto cross = [](const Eigen::Vector3d& s, const Eigen::Vector3d& t, double x, double y) {
      return (t.x() - s.x()) * (y - s.y()) - (t.y() - s.y()) * (x - s.x());
    };
    const double area = cross(a, b, c.x(), c.y());
    if (area == 0) return;
    const int x1 = std::min<int>(camera_.width - 1, int(std::max({a.x(), b.x(), c.x()})));
    const int y1 = std::min<int>(camera_.height - 1, int(std::max({a.y(), b.y(), c.y()})));
    for (int y = std::max(0, int(std::min({a.y(), b.y(), c.y()}) - 1)); y <= y1; ++y) {
      for (int x = std::max(0, int(std::min({a.x(), b.x(), c.x()}) - 1)); x <= x1; ++x) {
        const double u = x + 0.5;
        const double v = y + 0.5;
        Eigen::Vector3d w(cross(b, c, u, v), cross(c, a, u, v), cross(a, b, u, v));
        w /= area;
        if (w.minCoeff() < -1e-9) continue;
        w = w.cwiseQuotient(Eigen::Vector3d(a.z(), b.z(), c.z()));  // perspective
        if (w.sum() <= nearness_(x, y)) continue;
        nearness_(x, y) = w.sum();
        out_.part(x, y) = static_cast<int>(p);
        out_.color(x, y) = shade(glb_.parts[p], face, w / w.sum());
      }
    }
  }

  Eigen::Vector3f shade(const GlbPart& part,
                        const std::array<uint32_t, 3>& face,
                        const Eigen::Vector3d& weights) const {
    const auto mixed = [&](const char* name, int component) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) {
        const auto& value = part.values.at(name)[face.at(static_cast<size_t>(k))];
        sum += weights[k] * double{value[static_cast<size_t>(component)]};
      }
      return sum;
    };
    const auto factor = part.material_json["pbrMetallicRoughness"].value(
        "baseColorFactor", std::vector<float>{1, 1, 1, 1});
    Eigen::Vector3f linear(factor[0], factor[1], factor[2]);
    if (part.values.count("COLOR_0") != 0) {
      for (int c = 0; c < 3; ++c) linear[c] *= static_cast<float>(mixed("COLOR_0", c));
    }
    Eigen::Vector3f coded = linear.unaryExpr([](float c) { return srgb_from_linear(c); });
    if (part.image >= 0) {
      const ColorImage& image = glb_.images[static_cast<size_t>(part.image)];
      coded = coded.cwiseProduct(sample(image, mixed("TEXCOORD_0", 0), mixed("TEXCOORD_0", 1)));
    }
    return coded;
  }

  static Eigen::Vector3f sample(const ColorImage& image, double s, double t) {
    const double u = s * image.width - 0.5;
    const double v = t * image.height - 0.5;
    const int x = static_cast<int>(std::floor(u));
    const int y = static_cast<int>(std::floor(v));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int j = y; j <= y + 1; ++j) {
      for (int i = x; i <= x + 1; ++i) {
        const double weight = (1 - std::abs(u - i)) * (1 - std::abs(v - j));
        sum += weight * image(std::clamp(i, 0, image.width - 1), std::clamp(j, 0, image.height - 1))
                            .cast<double>();
      }
    }
    return sum.cast<float>();
  }

  const Glb& glb_;
  const Camera& camera_;
  GlbPicture out_;
  Raster<double> nearness_;
};

}  // namespace

Glb parse_glb(const std::string& bytes) {
  Glb glb;
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2u);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const size_t json_size = word(bytes, 12);
  EXPECT_EQ(word(bytes, 16), 0x4e4f534au);
  glb.json = nlohmann::json::parse(bytes.substr(20, json_size));
  EXPECT_EQ(json_size % 4, 0u);
  EXPECT_EQ(word(bytes, 24 + json_size), 0x004e4942u);
  glb.binary = bytes.substr(28 + json_size);
  EXPECT_EQ(glb.binary.size(), word(bytes, 20 + json_size));
  for (const auto& primitive : glb.json["meshes"][0]["primitives"]) {
    GlbPart part;
    read_material(glb, primitive, part);
    if (primitive.value("extensions", nlohmann::json()).contains(kDraco)) {
      read_draco(glb, primitive, part);
    } else {
      read_plain(glb, primitive, part);
    }
    const auto& bounds = glb.json["accessors"][primitive["attributes"]["POSITION"].get<size_t>()];
    for (const auto& p : part.values["POSITION"]) {
      for (size_t k = 0; k < 3; ++k) {
        EXPECT_GE(p[k], bounds["min"][k].get<float>());
        EXPECT_LE(p[k], bounds["max"][k].get<float>());
      }
    }
    glb.parts.push_back(part);
  }
  for (const auto& image : glb.json.value("images", nlohmann::json::array())) {
    glb.images.push_back(decoded_image(glb, image));
  }
  return glb;
}

Eigen::Vector3d placed(const Glb& glb, const std::vector<float>& position) {
  const auto& node = glb.json["nodes"][0];
  const auto shift = node.value("translation", std::vector<double>{0, 0, 0});
  const auto scale = node.value("scale", std::vector<double>{1, 1, 1});
  EXPECT_FALSE(node.contains("matrix") || node.contains("rotation"));
  Eigen::Vector3d out;
  for (size_t k = 0; k < 3; ++k) out[int(k)] = shift[k] + scale[k] * double{position[k]};
  return out;
}

Eigen::Vector3d in_world(const Glb& glb, const std::vector<float>& position) {
  const auto& extras = glb.json["asset"]["extras"];
  Eigen::Matrix3d R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = extras["gltf_from_world"][static_cast<size_t>(i)];
  Eigen::Vector3d origin;
  for (int k = 0; k < 3; ++k) origin[k] = extras["origin_in_world"][static_cast<size_t>(k)];
  const double unit = extras["units"] == "m" ? extras["metres_per_unit"].get<double>() : 1.0;
  return origin + R.transpose() * placed(glb, position) / unit;
}

GlbPicture render_glb(const Glb& glb, const Camera& camera) { return Painter(glb, camera).paint(); }

}  // namespace cgs::test
