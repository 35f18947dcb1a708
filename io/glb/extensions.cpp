// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/extensions.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace cgs {

namespace {

/// Extensions that are read, and those that say nothing of shape and colour of what a file shows
/// when nobody touches it: how surface shines, lights, names, physics. docs/editing.md has reasons.
constexpr std::array kKnown = {"AGI_articulations",
                               "AGI_stk_metadata",
                               "CESIUM_primitive_outline",
                               "EXT_feature_metadata",
                               "EXT_instance_features",
                               "EXT_lights_ies",
                               "EXT_lights_image_based",
                               "EXT_mesh_features",
                               "EXT_mesh_gpu_instancing",
                               "EXT_mesh_manifold",
                               "EXT_mesh_primitive_edge_visibility",
                               "EXT_meshopt_compression",
                               "EXT_structural_metadata",
                               "FB_geometry_metadata",
                               "KHR_animation_pointer",
                               "KHR_draco_mesh_compression",
                               "KHR_gaussian_splatting",
                               "KHR_gaussian_splatting_compression_spz",
                               "KHR_gaussian_splatting_compression_spz_2",
                               "KHR_implicit_shapes",
                               "KHR_interactivity",
                               "KHR_lights_punctual",
                               "KHR_mesh_quantization",
                               "KHR_node_hoverability",
                               "KHR_node_selectability",
                               "KHR_node_visibility",
                               "KHR_physics_rigid_bodies",
                               "KHR_xmp",
                               "KHR_xmp_json_ld",
                               "MSFT_lod",
                               "MSFT_packing_normalRoughnessMetallic",
                               "MSFT_packing_occlusionRoughnessMetallic",
                               "MSFT_screencoverage",
                               "VRM",
                               "VRMC_springBone",
                               "VRMC_vrm"};
constexpr std::array kKnownFamilies = {"ADOBE_materials_",
                                       "EXT_materials_",
                                       "EXT_texture_",
                                       "KHR_materials_",
                                       "KHR_texture_",
                                       "MSFT_texture_",
                                       "OMI_",
                                       "VRMC_materials_"};

bool is_known(std::string_view name) {
  return std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end() ||
         std::any_of(kKnownFamilies.begin(), kKnownFamilies.end(), [&](std::string_view start) {
           return name.starts_with(start);
         });
}

}  // namespace

void refuse_unknown_extensions(const JsonValue& root) {
  const auto required = root.find("extensionsRequired");
  for (size_t i = 0; required && i < required->size(); ++i) {
    const std::string name = required->at(i).text();
    if (is_known(name)) continue;
    required->at(i).fail(Defect::Unsupported, printable(name) + " is required and not known");
  }
}

std::vector<std::string> unread_extensions(const JsonValue& root) {
  constexpr size_t kMost = 16;
  std::vector<std::string> out;
  const auto used = root.find("extensionsUsed");
  if (!used || !used->is_array()) return out;
  for (size_t i = 0; i < used->size() && out.size() < kMost; ++i) {
    if (!used->at(i).is_text()) continue;
    const std::string name = used->at(i).text();
    if (is_known(name)) continue;
    out.push_back("the extension " + printable(name) +
                  " is not known: what it says of shape or colour is not read");
  }
  return out;
}

std::optional<JsonValue> extension_of(const JsonValue& object, const char* name) {
  const auto extensions = object.find("extensions");
  return extensions ? extensions->find(name) : std::nullopt;
}

}  // namespace cgs
