// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/gltf.h"

// The only file with the implementation; it may not touch files or pictures.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_FS
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <algorithm>
#include <cmath>
#include <fstream>  // tinygltf forgets it
#include <limits>
#include <map>
#include <sstream>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include "io/atomic_file.h"
#include "io/draco_codec.h"
#include "io/glb_meshopt.h"
#include "io/glb_primitive.h"
#include "io/glb_quantized.h"
#include "io/mesh_arrays.h"
#include "io/texture_images.h"
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

nlohmann::json parsed_summary(const std::string& text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  require(!json.is_discarded(), "GlbOptions.summary_json must be JSON", text.substr(0, 40));
  return json;
}

/// Corners of the box around the vertices that faces use.
std::pair<Eigen::Vector3f, Eigen::Vector3f> bounds(const TriangleMesh& mesh) {
  Eigen::Vector3f low = mesh.vertices[mesh.faces.front()[0]];
  Eigen::Vector3f high = low;
  for (const auto& face : mesh.faces) {
    for (const uint32_t corner : face) {
      low = low.cwiseMin(mesh.vertices[corner]);
      high = high.cwiseMax(mesh.vertices[corner]);
    }
  }
  return {low, high};
}

/// Below it the encoder's quantisation of floats breaks down.
constexpr float kSmallestDracoExtent = 1e-6f;

Eigen::AlignedBox3f box_of(const std::vector<GlbPrimitive>& primitives) {
  Eigen::AlignedBox3f box;
  for (const GlbPrimitive& primitive : primitives) {
    for (const Eigen::Vector3f& p : primitive.positions) box.extend(p);
  }
  return box;
}

float extent_of(const std::vector<GlbPrimitive>& primitives) {
  return box_of(primitives).sizes().maxCoeff();
}

/// The nearest number at or below (above) that survives the encoder, which passes the grid on as
/// decimals of six places: on any other grid it would not round positions as we expect it to.
float decimal_below(float value) {
  constexpr float kPlace = 1e-6f;
  const auto stored = [](float v) { return std::stof(std::to_string(v)); };
  const float nearest = stored(value);
  return nearest <= value ? nearest : stored(nearest - kPlace);
}
float decimal_above(float value) { return -decimal_below(-value); }

double error_or_default(double max_error, double extent) {
  return max_error > 0 ? max_error : std::ldexp(extent, -14);
}

/// The cube that holds every position, and as few bits as keep the error.
DracoGrid grid_for(const std::vector<GlbPrimitive>& primitives, double max_error) {
  const Eigen::AlignedBox3f box = box_of(primitives);
  const Eigen::Vector3f origin = box.min().unaryExpr(&decimal_below);
  DracoGrid grid{origin, decimal_above((box.max() - origin).maxCoeff()), 1};
  const double half_diagonal = std::sqrt(3.0) / 2;  // of a cell: the farthest a vertex can move
  const double wanted = error_or_default(max_error, double{grid.range});
  while (grid.bits < kMaxDracoBits && grid.step() * half_diagonal > wanted) ++grid.bits;
  require(grid.step() * half_diagonal <= wanted,
          "GlbOptions.max_error must be above extent / 2^21",
          max_error);
  return grid;
}

/// Assembles the container.
class GlbBuilder {
 public:
  GlbBuilder() {
    model_.asset.version = "2.0";
    model_.asset.generator = "cgs";
    model_.buffers.resize(1);
    model_.meshes.resize(1);
    model_.meshes[0].name = "mesh";
    model_.nodes.resize(1);
    model_.nodes[0].mesh = 0;
    model_.nodes[0].name = "mesh";
    model_.scenes.resize(1);
    model_.scenes[0].nodes = {0};
    model_.defaultScene = 0;
  }

  /// Adds the images that are used; call it before any primitive.
  void add_photographs(const PhotoTexture& texture, const std::vector<TextureImage>& images) {
    if (texture.empty()) return;
    tinygltf::Sampler sampler;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    model_.samplers = {sampler};
    for (size_t i = 0; i < images.size(); ++i) {
      names_.push_back(texture.photographs[i].name);
      texture_of_.push_back(static_cast<int>(model_.textures.size()));
      if (images[i].jpeg.empty()) continue;
      tinygltf::Image image;
      image.name = names_.back();
      image.mimeType = "image/jpeg";
      image.bufferView = raw_view(images[i].jpeg.data(), images[i].jpeg.size(), 0);
      tinygltf::Texture out;
      out.sampler = 0;
      out.source = static_cast<int>(model_.images.size());
      model_.images.push_back(std::move(image));
      model_.textures.push_back(out);
    }
  }

  void set_extras(const nlohmann::json& extras) { model_.asset.extras = value_of(extras); }

  void add_plain(const GlbPrimitive& in) {
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

  void add_quantized(const GlbPrimitive& in,
                     const QuantizedPrimitive& stored,
                     const QuantizedGrid& grid) {
    model_.nodes[0].translation = {grid.origin.x(), grid.origin.y(), grid.origin.z()};
    model_.nodes[0].scale = {grid.step, grid.step, grid.step};
    use_extension(kQuantization);
    model_.extensionsRequired = {kQuantization};
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

  void add_compressed(const GlbPrimitive& in, const DracoPrimitive& draco) {
    tinygltf::Primitive out = empty_primitive(in);
    nlohmann::json extension = {
        {"bufferView", raw_view(draco.bytes.data(), draco.bytes.size(), 0)}};
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
    model_.accessors.back().componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    out.extensions[kDraco] = value_of(extension);
    use_extension(kDraco);
    model_.extensionsRequired = {kDraco};
    model_.meshes[0].primitives.push_back(std::move(out));
  }

  std::string bytes() {
    constexpr size_t kRoomForJson = size_t{1} << 20;
    if (model_.buffers[0].data.size() > std::numeric_limits<uint32_t>::max() - kRoomForJson) {
      throw LimitError("write_glb: glTF binary files end at 4 GiB");
    }
    std::ostringstream out(std::ios::binary);
    out.exceptions(std::ios::badbit | std::ios::failbit);
    tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, out, false, true);
    return std::move(out).str();
  }

 private:
  void add_evidence_and_faces(const GlbPrimitive& in, tinygltf::Primitive out) {
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
    model_.meshes[0].primitives.push_back(std::move(out));
  }

  // Of 16 bits where these suffice; their largest value restarts primitives and is no index.
  int indices(const GlbPrimitive& in) {
    const bool is_short = in.positions.size() < 65535;
    std::vector<std::array<uint16_t, 3>> narrow;
    for (size_t f = 0; is_short && f < in.faces.size(); ++f) {
      const auto& face = in.faces[f];
      narrow.push_back({uint16_t(face[0]), uint16_t(face[1]), uint16_t(face[2])});
    }
    const int bytes = is_short ? view(narrow, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER)
                               : view(in.faces, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    const int out = accessor(in.faces.size() * 3, TINYGLTF_TYPE_SCALAR, bytes);
    model_.accessors.back().componentType =
        is_short ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    return out;
  }

  template <typename T>
  int short_accessor(const std::vector<T>& values, int type, bool is_normalized) {
    const int out = accessor(values.size(), type, view(values));
    set_stored_type(out, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, is_normalized, sizeof(T));
    return out;
  }

  void set_stored_type(int number, int component, bool is_normalized, size_t stride) {
    tinygltf::Accessor& out = model_.accessors[static_cast<size_t>(number)];
    out.componentType = component;
    out.normalized = is_normalized;
    model_.bufferViews[static_cast<size_t>(out.bufferView)].byteStride = stride;
  }

  tinygltf::Primitive empty_primitive(const GlbPrimitive& in) {
    tinygltf::Primitive out;
    out.mode = TINYGLTF_MODE_TRIANGLES;
    out.material = static_cast<int>(model_.materials.size());
    model_.materials.push_back(material_for(in));
    if (!in.features.empty()) {
      const nlohmann::json id = {{"featureCount", 1}, {"attribute", 0}, {"label", kFeatureLabel}};
      out.extensions[kFeatures] = value_of({{"featureIds", nlohmann::json::array({id})}});
      use_extension(kFeatures);
    }
    return out;
  }

  tinygltf::Material material_for(const GlbPrimitive& in) {
    tinygltf::Material out;
    out.name = in.name;
    out.doubleSided = true;
    out.pbrMetallicRoughness.metallicFactor = 0;
    out.pbrMetallicRoughness.roughnessFactor = 1;
    if (in.name == provenance_name(Provenance::Inferred)) {
      out.pbrMetallicRoughness.baseColorFactor = {1.0, 0.25, 0.8, 1.0};
    } else if (in.name == provenance_name(Provenance::Interpolated)) {
      out.pbrMetallicRoughness.baseColorFactor = {0.55, 0.75, 1.0, 1.0};
    }
    if (in.is_unlit) {
      out.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object());
      use_extension(kUnlit);
    }
    if (in.photograph != PhotoTexture::kNone) {
      const auto i = static_cast<size_t>(in.photograph);
      out.name += " " + names_[i];
      out.pbrMetallicRoughness.baseColorTexture.index = texture_of_[i];
    }
    return out;
  }

  void use_extension(const char* name) {
    std::vector<std::string>& used = model_.extensionsUsed;
    if (std::find(used.begin(), used.end(), name) == used.end()) used.emplace_back(name);
  }

  template <typename T>
  int view(const std::vector<T>& values, int target = TINYGLTF_TARGET_ARRAY_BUFFER) {
    return raw_view(values.data(), values.size() * sizeof(T), target);
  }

  int raw_view(const void* bytes, size_t size, int target) {
    std::vector<unsigned char>& data = model_.buffers[0].data;
    tinygltf::BufferView out;
    out.buffer = 0;
    out.byteOffset = data.size();
    out.byteLength = size;
    out.target = target;
    const auto* first = static_cast<const unsigned char*>(bytes);
    data.insert(data.end(), first, first + size);
    data.resize((data.size() + 3) / 4 * 4);  // accessors must begin at multiples of four
    model_.bufferViews.push_back(out);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int accessor(size_t count, int type, int buffer_view) {
    tinygltf::Accessor out;
    out.bufferView = buffer_view;
    out.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    out.count = count;
    out.type = type;
    model_.accessors.push_back(out);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  void set_bounds(int number, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
    tinygltf::Accessor& out = model_.accessors[static_cast<size_t>(number)];
    out.minValues = {low.x(), low.y(), low.z()};
    out.maxValues = {high.x(), high.y(), high.z()};
  }

  static Eigen::Vector3f extreme(const std::vector<Eigen::Vector3f>& points, bool low) {
    Eigen::Vector3f out = points.front();
    for (const Eigen::Vector3f& p : points) {
      out = low ? out.cwiseMin(p).eval() : out.cwiseMax(p).eval();
    }
    return out;
  }

  tinygltf::Model model_;
  std::vector<std::string> names_;  // of photographs
  std::vector<int> texture_of_;     // per photograph
};

nlohmann::json extras_for(const TriangleMesh& mesh,
                          const Frame& frame,
                          const GlbPlacement& placement,
                          const GlbOptions& options) {
  const Eigen::Vector3d origin = frame.world_from_internal(placement.center);
  nlohmann::json rotation = nlohmann::json::array();
  for (int i = 0; i < 9; ++i) rotation.push_back(placement.rotation(i / 3, i % 3));
  nlohmann::json out = {{"units", frame.has_metric_scale() ? "m" : "unknown"},
                        {"metres_per_unit", frame.metres_per_unit},
                        {"metres_sigma", frame.metres_sigma},
                        {"scale_source", scale_source_name(frame.scale_source)},
                        {"origin_in_world", {origin.x(), origin.y(), origin.z()}},
                        {"gltf_from_world", rotation}};
  if (!mesh.provenance.empty()) {
    const auto area = area_by_provenance(mesh);
    for (const Provenance label : kProvenanceOrder) {
      out["area"][std::string(provenance_name(label))] =
          area.at(static_cast<size_t>(label)) * placement.scale * placement.scale;
    }
    for (size_t id = 0; id < kProvenanceCount; ++id) {
      out["provenance_names"].push_back(provenance_name(static_cast<Provenance>(id)));
    }
  }
  if (!options.summary_json.empty()) out["summary"] = parsed_summary(options.summary_json);
  return out;
}

GlbPlacement placement_for(const TriangleMesh& mesh,
                           const Frame& frame,
                           const GlbOptions& options) {
  const auto [low, high] = bounds(mesh);
  GlbPlacement out;
  out.rotation = options.y_up;
  out.scale = frame.scale * (frame.has_metric_scale() ? frame.metres_per_unit : 1.0);
  out.center = options.center.value_or(0.5 * (low.cast<double>() + high.cast<double>()));
  const double reach = out.scale * std::max((high.cast<double>() - out.center).norm(),
                                            (low.cast<double>() - out.center).norm());
  constexpr double kFarthest = 1e18;  // the encoder's float arithmetic overflows beyond
  require(reach > 1 / kFarthest && reach < kFarthest,
          "write_glb: the mesh must have an extent between 1e-18 and 1e18",
          reach);
  return out;
}

/// What Draco leaves out, too.
constexpr QuantizedRounding kPackedRounding = {kDracoColorBits, kDracoTextureError};

bool is_compressed(GlbEncoding encoding) {
  return encoding == GlbEncoding::Draco || encoding == GlbEncoding::Meshopt;
}

/// How the primitives of a file are stored, on which grid.
struct GlbStore {
  GlbEncoding encoding = GlbEncoding::Plain;
  DracoGrid draco;
  QuantizedGrid whole;
  int speed = 0;

  int position_bits() const {
    if (encoding == GlbEncoding::Plain) return 0;
    return encoding == GlbEncoding::Draco ? draco.bits : whole.bits;
  }
};

GlbStore store_for(const std::vector<GlbPrimitive>& primitives,
                   const GlbOptions& options,
                   double max_error) {
  GlbStore out;
  out.encoding = options.encoding;
  const bool is_too_small = extent_of(primitives) < kSmallestDracoExtent;
  if (out.encoding == GlbEncoding::Draco && is_too_small) out.encoding = GlbEncoding::Plain;
  if (out.encoding == GlbEncoding::Draco) out.draco = grid_for(primitives, max_error);
  const Eigen::AlignedBox3f box = box_of(primitives);
  out.whole = QuantizedGrid::around(box);
  if (out.encoding == GlbEncoding::Meshopt) {
    out.whole = QuantizedGrid::within(error_or_default(max_error, box.sizes().maxCoeff()), box);
  }
  out.speed = options.speed;
  return out;
}

/// \return the largest move of a vertex [units of the file]
double add_primitive(GlbBuilder& builder,
                     const GlbPrimitive& primitive,
                     const GlbStore& store,
                     GlbReport& report) {
  report.triangles += primitive.faces.size();
  if (!primitive.texcoords.empty()) report.textured_triangles += primitive.faces.size();
  double error = 0;
  double texture_error = 0;
  size_t vertices = primitive.positions.size();
  if (store.encoding == GlbEncoding::Draco) {
    const DracoPrimitive compressed = draco_compress(primitive, store.draco, store.speed);
    builder.add_compressed(primitive, compressed);
    vertices = compressed.vertices;
    error = compressed.max_error;
    texture_error = compressed.max_texture_error;
  } else if (store.encoding == GlbEncoding::Plain) {
    builder.add_plain(primitive);
  } else {
    const bool packed = store.encoding == GlbEncoding::Meshopt;
    const QuantizedPrimitive stored =
        quantized(primitive, store.whole, packed ? kPackedRounding : QuantizedRounding{});
    builder.add_quantized(primitive, stored, store.whole);
    error = stored.max_error;
    texture_error = stored.max_texture_error;
  }
  report.vertices += vertices;
  report.measured_texture_error = std::max(report.measured_texture_error, texture_error);
  return error;
}

}  // namespace

std::map<std::string, GlbEncoding> glb_encodings() {
  return {{"draco", GlbEncoding::Draco},
          {"meshopt", GlbEncoding::Meshopt},
          {"quantized", GlbEncoding::Quantized},
          {"plain", GlbEncoding::Plain}};
}

void GlbOptions::validate() const {
  require(
      max_error >= 0 && std::isfinite(max_error), "GlbOptions.max_error must be >= 0", max_error);
  require(speed >= 0 && speed <= 10, "GlbOptions.speed must be 0 to 10", speed);
  const double off = (y_up * y_up.transpose() - Eigen::Matrix3d::Identity()).norm();
  require(off < 1e-6 && y_up.determinant() > 0, "GlbOptions.y_up must be a rotation; error", off);
  require(jpeg_quality >= 1 && jpeg_quality <= 100,
          "GlbOptions.jpeg_quality must be 1 to 100",
          jpeg_quality);
  if (!summary_json.empty()) (void)parsed_summary(summary_json);
}

GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const GlbOptions& options) {
  return write_glb(path, mesh, PhotoTexture{}, frame, options);
}

GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const PhotoTexture& texture,
                    const Frame& frame,
                    const GlbOptions& options) {
  options.validate();
  require_writable(mesh, "write_glb");
  require_texture(mesh, texture, "write_glb");
  require(!mesh.faces.empty(), "write_glb: number of faces must be > 0", mesh.faces.size());
  const GlbPlacement placement = placement_for(mesh, frame, options);
  std::vector<TextureImage> images;
  if (!texture.empty()) images = texture_images(mesh, texture, options.jpeg_quality);
  std::vector<GlbPrimitive> primitives = glb_primitives(mesh, placement, texture, images);
  require(!primitives.empty(), "write_glb: faces with three different corners must be > 0", 0);
  const double world_scale = placement.scale / frame.scale;  // units of the file per world unit
  const double max_error = options.max_error * world_scale;
  GlbReport report;
  GlbBuilder builder;
  builder.set_extras(extras_for(mesh, frame, placement, options));
  builder.add_photographs(texture, images);
  for (const TextureImage& image : images) report.texture_bytes += image.jpeg.size();
  const GlbStore store = store_for(primitives, options, max_error);
  double worst = 0;
  for (GlbPrimitive& primitive : primitives) {
    if (is_compressed(store.encoding) && primitive.is_unlit) primitive.normals.clear();
    if (store.encoding == GlbEncoding::Meshopt) primitive = in_cache_order(std::move(primitive));
    worst = std::max(worst, add_primitive(builder, primitive, store, report));
  }
  // Half a rounding error of float coordinates is not the compression's.
  const double slack = 1e-6 * double{store.draco.range};
  if (max_error > 0 && worst > max_error + slack) {
    throw NumericalError("write_glb: compression moves a vertex by " +
                         std::to_string(worst / world_scale) + ", allowed are " +
                         std::to_string(options.max_error) +
                         "; another encoding or a larger error may do");
  }
  report.primitives = primitives.size();
  report.dropped_triangles = mesh.faces.size() - report.triangles;
  report.position_bits = store.position_bits();
  report.measured_max_error = worst / world_scale;
  std::string bytes = builder.bytes();
  if (store.encoding == GlbEncoding::Meshopt) bytes = meshopt_compressed(bytes);
  report.bytes = bytes.size();
  write_file(path, bytes);
  return report;
}

}  // namespace cgs
