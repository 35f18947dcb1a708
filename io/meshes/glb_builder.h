// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "io/glb/primitive.h"
#include "io/glb/quantized.h"
#include "io/glb/texture_images.h"
#include "io/meshes/draco_codec.h"
#include "libcgs/core/photo_texture.h"

namespace tinygltf {
class Model;
struct Material;
struct Primitive;
}  // namespace tinygltf

namespace cgs {

/// Assembles a binary glTF 2.0 file of one mesh: primitives with their materials, the photographs
/// as textures, and what is known of vertices (_SUPPORT, _SIGMA, EXT_mesh_features).
/// Source: Khronos glTF 2.0; KHR_mesh_quantization, KHR_draco_mesh_compression,
/// KHR_materials_unlit, EXT_mesh_features.
class GlbBuilder {
 public:
  /// \param place  where the positions' (0, 0, 0) lies: the translation of the node
  explicit GlbBuilder(const Eigen::Vector3d& place);
  ~GlbBuilder();
  GlbBuilder(const GlbBuilder&) = delete;
  GlbBuilder& operator=(const GlbBuilder&) = delete;

  /// Adds the images that are used; call it before any primitive.
  void add_photographs(const PhotoTexture& texture, const std::vector<TextureImage>& images);

  /// What `asset.extras` holds.
  void set_extras(const nlohmann::json& extras);

  /// Each adds a primitive and its material. The first stores floats.
  void add_plain(const GlbPrimitive& in);

  /// \param stored  the vertices of `in` as whole numbers on `grid`, one for all primitives
  void add_quantized(const GlbPrimitive& in,
                     const QuantizedPrimitive& stored,
                     const QuantizedGrid& grid);

  /// \param draco  `in`, compressed
  void add_compressed(const GlbPrimitive& in, const DracoPrimitive& draco);

  /// The file.
  /// \throws LimitError if it would reach 4 GiB
  std::string bytes();

 private:
  void add_evidence_and_faces(const GlbPrimitive& in, tinygltf::Primitive out);

  tinygltf::Primitive empty_primitive(const GlbPrimitive& in);
  tinygltf::Material material_for(const GlbPrimitive& in);
  void use_extension(const char* name);

  // All of these return the number of what they add.
  int indices(const GlbPrimitive& in);
  int raw_view(const void* bytes, size_t size, int target);
  template <typename T>
  int view(const std::vector<T>& values, int target);
  template <typename T>
  int view(const std::vector<T>& values);
  int accessor(size_t count, int type, int buffer_view);
  template <typename T>
  int short_accessor(const std::vector<T>& values, int type, bool is_normalized);

  void set_stored_type(int number, int component, bool is_normalized, size_t stride);
  void set_bounds(int number, const Eigen::Vector3f& low, const Eigen::Vector3f& high);

  Eigen::Vector3d place_;
  std::unique_ptr<tinygltf::Model> model_;
  std::vector<std::string> names_;  // of photographs
  std::vector<int> texture_of_;     // per photograph
};

}  // namespace cgs
