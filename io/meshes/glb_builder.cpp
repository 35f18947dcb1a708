// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_builder.h"

// The only file with the implementation; it may not touch files or pictures.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_FS
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>  // tinygltf forgets it
#include <limits>
#include <sstream>
#include <utility>

#include <tiny_gltf.h>

#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr const char* kQuantization = "KHR_mesh_quantization";
constexpr const char* kUnlit = "KHR_materials_unlit";
constexpr const char* kFeatures = "EXT_mesh_features";
constexpr const char* kFeatureLabel = "provenance";

tinygltf::Value value_of(const nlohmann::json& json) {
  if (json.is_object()) {
    tinygltf::Value::Object object;
    for (const auto& [key, entry] : json.items()) object[key] = value_of(entry);
    return tinygltf::Value(object);
  }
  if (json.is_array()) {
    tinygltf::Value::Array array;
    for (const auto& entry : json) array.push_back(value_of(entry));
    return tinygltf::Value(array);
  }
  if (json.is_boolean()) return tinygltf::Value(json.get<bool>());
  if (json.is_string()) return tinygltf::Value(json.get<std::string>());
  if (!json.is_number()) return tinygltf::Value();
  const double number = json.get<double>();
  constexpr double kLargestInt = std::numeric_limits<int>::max();
  if (json.is_number_integer() && std::abs(number) <= kLargestInt) {
    return tinygltf::Value(json.get<int>());
  }
  return tinygltf::Value(number);
}

Eigen::Vector3f extreme(const std::vector<Eigen::Vector3f>& points, bool low) {
  Eigen::Vector3f out = points.front();
  for (const Eigen::Vector3f& p : points) {
    out = low ? out.cwiseMin(p).eval() : out.cwiseMax(p).eval();
  }
  return out;
}

}  // namespace

GlbBuilder::GlbBuilder(const Eigen::Vector3d& place)
    : place_(place), model_(std::make_unique<tinygltf::Model>()) {
  model_->asset.version = "2.0";
  model_->asset.generator = "cgs";
  model_->buffers.resize(1);
  model_->meshes.resize(1);
  model_->meshes[0].name = "mesh";
  model_->nodes.resize(1);
  model_->nodes[0].mesh = 0;
  model_->nodes[0].name = "mesh";
  model_->nodes[0].translation = {place.x(), place.y(), place.z()};
  model_->scenes.resize(1);
  model_->scenes[0].nodes = {0};
  model_->defaultScene = 0;
}

GlbBuilder::~GlbBuilder() = default;

template <typename T>
int GlbBuilder::view(const std::vector<T>& values, int target) {
  return raw_view(values.data(), values.size() * sizeof(T), target);
}

template <typename T>
int GlbBuilder::view(const std::vector<T>& values) {
  return view(values, TINYGLTF_TARGET_ARRAY_BUFFER);
}

template <typename T>
int GlbBuilder::short_accessor(const std::vector<T>& values, int type, bool is_normalized) {
  const int out = accessor(values.size(), type, view(values));
  set_stored_type(out, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, is_normalized, sizeof(T));
  return out;
}

void GlbBuilder::add_photographs(const PhotoTexture& texture,
                                 const std::vector<TextureImage>& images) {
  if (texture.empty()) return;
  tinygltf::Sampler sampler;
  sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
  sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
  model_->samplers = {sampler};
  names_ = texture_names(texture);
  for (size_t i = 0; i < images.size(); ++i) {
    texture_of_.push_back(static_cast<int>(model_->textures.size()));
    if (images[i].jpeg.empty()) continue;
    tinygltf::Image image;
    image.name = names_[i];
    image.mimeType = "image/jpeg";
    image.bufferView = raw_view(images[i].jpeg.data(), images[i].jpeg.size(), 0);
    tinygltf::Texture out;
    out.sampler = 0;
    out.source = static_cast<int>(model_->images.size());
    model_->images.push_back(std::move(image));
    model_->textures.push_back(out);
  }
}

void GlbBuilder::set_extras(const nlohmann::json& extras) {
  model_->asset.extras = value_of(extras);
}

void GlbBuilder::add_plain(const GlbPrimitive& in) {
  tinygltf::Primitive out = empty_primitive(in);
  const auto [low, high] = std::pair(extreme(in.positions, true), extreme(in.positions, false));
  out.attributes["POSITION"] =
      accessor(in.positions.size(), TINYGLTF_TYPE_VEC3, view(in.positions));
  set_bounds(out.attributes["POSITION"], low, high);
  out.attributes["NORMAL"] = accessor(in.normals.size(), TINYGLTF_TYPE_VEC3, view(in.normals));
  if (!in.texcoords.empty()) {
    out.attributes["TEXCOORD_0"] =
        accessor(in.texcoords.size(), TINYGLTF_TYPE_VEC2, view(in.texcoords));
  }
  if (!in.colors.empty()) {
    out.attributes["COLOR_0"] = accessor(in.colors.size(), TINYGLTF_TYPE_VEC3, view(in.colors));
  }
  add_evidence_and_faces(in, std::move(out));
}

void GlbBuilder::add_quantized(const GlbPrimitive& in,
                               const QuantizedPrimitive& stored,
                               const QuantizedGrid& grid) {
  const Eigen::Vector3d origin = place_ + grid.origin;
  model_->nodes[0].translation = {origin.x(), origin.y(), origin.z()};
  model_->nodes[0].scale = {grid.step, grid.step, grid.step};
  use_extension(kQuantization);
  model_->extensionsRequired = {kQuantization};
  tinygltf::Primitive out = empty_primitive(in);
  out.attributes["POSITION"] = short_accessor(stored.positions, TINYGLTF_TYPE_VEC3, false);
  Eigen::Vector3f low = Eigen::Vector3f::Constant(65535);
  Eigen::Vector3f high = Eigen::Vector3f::Zero();
  for (const auto& p : stored.positions) {
    const Eigen::Vector3f whole(p[0], p[1], p[2]);
    low = low.cwiseMin(whole);
    high = high.cwiseMax(whole);
  }
  set_bounds(out.attributes["POSITION"], low, high);
  if (!in.normals.empty()) {
    const int normals = accessor(in.normals.size(), TINYGLTF_TYPE_VEC3, view(stored.normals));
    set_stored_type(normals, TINYGLTF_COMPONENT_TYPE_BYTE, true, sizeof(stored.normals[0]));
    out.attributes["NORMAL"] = normals;
  }
  if (!in.texcoords.empty()) {
    out.attributes["TEXCOORD_0"] = short_accessor(stored.texcoords, TINYGLTF_TYPE_VEC2, true);
  }
  if (!in.colors.empty()) {
    out.attributes["COLOR_0"] = short_accessor(stored.colors, TINYGLTF_TYPE_VEC4, true);
  }
  add_evidence_and_faces(in, std::move(out));
}

void GlbBuilder::add_compressed(const GlbPrimitive& in, const DracoPrimitive& draco) {
  tinygltf::Primitive out = empty_primitive(in);
  nlohmann::json extension = {{"bufferView", raw_view(draco.bytes.data(), draco.bytes.size(), 0)}};
  for (const auto& [name, id] : draco.attribute_ids) {
    const bool scalar = name.starts_with('_');  // all of ours
    const int type = scalar                 ? TINYGLTF_TYPE_SCALAR
                     : name == "TEXCOORD_0" ? TINYGLTF_TYPE_VEC2
                                            : TINYGLTF_TYPE_VEC3;
    out.attributes[name] = accessor(draco.vertices, type, -1);
    extension["attributes"][name] = id;
  }
  set_bounds(out.attributes["POSITION"], draco.min, draco.max);
  out.indices = accessor(draco.faces * 3, TINYGLTF_TYPE_SCALAR, -1);
  model_->accessors.back().componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  out.extensions[kDraco] = value_of(extension);
  use_extension(kDraco);
  model_->extensionsRequired = {kDraco};
  model_->meshes[0].primitives.push_back(std::move(out));
}

std::string GlbBuilder::bytes() {
  constexpr size_t kRoomForJson = size_t{1} << 20;
  if (model_->buffers[0].data.size() > std::numeric_limits<uint32_t>::max() - kRoomForJson) {
    throw LimitError("write_glb: glTF binary files end at 4 GiB");
  }
  std::ostringstream out(std::ios::binary);
  out.exceptions(std::ios::badbit | std::ios::failbit);
  tinygltf::TinyGLTF().WriteGltfSceneToStream(model_.get(), out, false, true);
  return std::move(out).str();
}

void GlbBuilder::add_evidence_and_faces(const GlbPrimitive& in, tinygltf::Primitive out) {
  if (!in.support.empty()) {
    out.attributes["_SUPPORT"] =
        accessor(in.support.size(), TINYGLTF_TYPE_SCALAR, view(in.support));
  }
  if (!in.sigma.empty()) {
    out.attributes["_SIGMA"] = accessor(in.sigma.size(), TINYGLTF_TYPE_SCALAR, view(in.sigma));
  }
  if (!in.features.empty()) {
    out.attributes["_FEATURE_ID_0"] =
        accessor(in.features.size(), TINYGLTF_TYPE_SCALAR, view(in.features));
  }
  out.indices = indices(in);
  model_->meshes[0].primitives.push_back(std::move(out));
}

// Of 16 bits where these suffice; their largest value restarts primitives and is no index.
int GlbBuilder::indices(const GlbPrimitive& in) {
  const bool is_short = in.positions.size() < 65535;
  std::vector<std::array<uint16_t, 3>> narrow;
  for (size_t f = 0; is_short && f < in.faces.size(); ++f) {
    const auto& face = in.faces[f];
    narrow.push_back({uint16_t(face[0]), uint16_t(face[1]), uint16_t(face[2])});
  }
  const int bytes = is_short ? view(narrow, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER)
                             : view(in.faces, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  const int out = accessor(in.faces.size() * 3, TINYGLTF_TYPE_SCALAR, bytes);
  model_->accessors.back().componentType =
      is_short ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  return out;
}

void GlbBuilder::set_stored_type(int number, int component, bool is_normalized, size_t stride) {
  tinygltf::Accessor& out = model_->accessors[static_cast<size_t>(number)];
  out.componentType = component;
  out.normalized = is_normalized;
  model_->bufferViews[static_cast<size_t>(out.bufferView)].byteStride = stride;
}

tinygltf::Primitive GlbBuilder::empty_primitive(const GlbPrimitive& in) {
  tinygltf::Primitive out;
  out.mode = TINYGLTF_MODE_TRIANGLES;
  out.material = static_cast<int>(model_->materials.size());
  model_->materials.push_back(material_for(in));
  if (!in.features.empty()) {
    const nlohmann::json id = {{"featureCount", 1}, {"attribute", 0}, {"label", kFeatureLabel}};
    out.extensions[kFeatures] = value_of({{"featureIds", nlohmann::json::array({id})}});
    use_extension(kFeatures);
  }
  return out;
}

tinygltf::Material GlbBuilder::material_for(const GlbPrimitive& in) {
  tinygltf::Material out;
  out.name = in.name;
  out.doubleSided = true;
  out.pbrMetallicRoughness.metallicFactor = 0;
  out.pbrMetallicRoughness.roughnessFactor = 1;
  if (in.name == provenance_name(Provenance::Inferred)) {
    out.pbrMetallicRoughness.baseColorFactor = {1.0, 0.25, 0.8, 1.0};
  } else if (in.name == provenance_name(Provenance::Interpolated)) {
    out.pbrMetallicRoughness.baseColorFactor = {1.0, 0.5, 0.2, 1.0};
  } else if (in.name == provenance_name(Provenance::Estimated)) {
    out.pbrMetallicRoughness.baseColorFactor = {1.0, 0.8, 0.15, 1.0};
  }
  if (in.is_unlit) {
    out.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object());
    use_extension(kUnlit);
  }
  if (in.image != PhotoTexture::kNone) {
    const auto i = static_cast<size_t>(in.image);
    out.name += " " + names_[i];
    out.pbrMetallicRoughness.baseColorTexture.index = texture_of_[i];
  }
  return out;
}

void GlbBuilder::use_extension(const char* name) {
  std::vector<std::string>& used = model_->extensionsUsed;
  if (std::find(used.begin(), used.end(), name) == used.end()) used.emplace_back(name);
}

int GlbBuilder::raw_view(const void* bytes, size_t size, int target) {
  std::vector<unsigned char>& data = model_->buffers[0].data;
  tinygltf::BufferView out;
  out.buffer = 0;
  out.byteOffset = data.size();
  out.byteLength = size;
  out.target = target;
  const auto* first = static_cast<const unsigned char*>(bytes);
  data.insert(data.end(), first, first + size);
  data.resize((data.size() + 3) / 4 * 4);  // accessors must begin at multiples of four
  model_->bufferViews.push_back(out);
  return static_cast<int>(model_->bufferViews.size()) - 1;
}

int GlbBuilder::accessor(size_t count, int type, int buffer_view) {
  tinygltf::Accessor out;
  out.bufferView = buffer_view;
  out.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
  out.count = count;
  out.type = type;
  model_->accessors.push_back(out);
  return static_cast<int>(model_->accessors.size()) - 1;
}

void GlbBuilder::set_bounds(int number, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  tinygltf::Accessor& out = model_->accessors[static_cast<size_t>(number)];
  out.minValues = {low.x(), low.y(), low.z()};
  out.maxValues = {high.x(), high.y(), high.z()};
}

}  // namespace cgs
