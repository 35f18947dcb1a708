// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

namespace cgs {

/// An object put somewhere, by a component of another or by the build.
struct ThreeMfPlacement {
  std::string part;  ///< File of the archive that holds the object; empty = this one.
  uint64_t object = 0;
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
};

/// The properties of a triangle's corners, in a group of base materials or colours; group 0 = none.
struct ThreeMfProperty {
  uint32_t group = 0;
  std::array<uint32_t, 3> index = {};  ///< All the same for base materials.
};

/// What an object is for; it says so of its own mesh, not of its components.
enum class ThreeMfType : uint8_t {
  Model,
  Surface,    ///< Part of the model, but encloses nothing.
  Accessory,  ///< "support", "solidsupport", "other": not part of the model.
};

/// A mesh, or what it is made of.
struct ThreeMfObject {
  ThreeMfType type = ThreeMfType::Model;
  std::vector<Eigen::Vector3d> vertices;  ///< In units of the model; finite.
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<ThreeMfProperty> properties;  ///< One per triangle.
  std::vector<ThreeMfPlacement> components;
};

/// One model file of a 3MF archive.
struct ThreeMfModel {
  std::string metres_per_unit = "0.001";  ///< As a decimal number.
  std::map<uint64_t, ThreeMfObject> objects;
  std::map<uint64_t, std::vector<std::string>> material_names;  ///< By group.
  /// Of base materials and colours by group, sRGB-coded in [0, 1]; NaN = not stated.
  std::map<uint64_t, std::vector<Eigen::Vector3f>> colors;
  bool has_textures = false;
  bool has_mixtures = false;  ///< Of materials, or several properties over each other.
  std::vector<ThreeMfPlacement> build;
  std::string application;  ///< Metadata of the model; empty = not stated.
  std::string description;
  size_t entries = 0;  ///< Objects, components, items, materials, groups of these and of colours.
};

/// Reads a model file: unit, meshes, components, base materials and build, of the core
/// specification and the production extension, and groups of colours of the materials extension.
/// \param path            for messages
/// \param entries_before  of other models of the archive; ThreeMfModel::entries goes on from there
/// \throws BadInput as read_xml(); Schema, Value, Ref (a corner that is not there), Unsupported (an
///         extension is required that changes the shape); LimitError (more than a million entries:
///         each takes ten times its text)
/// Source: 3MF Core Specification 1.3, Production Extension 1.1, and Materials and Properties
///         Extension 1.2, section 3, 3MF Consortium.
ThreeMfModel parse_threemf_model(std::string_view xml,
                                 const std::filesystem::path& path,
                                 size_t entries_before = 0);

}  // namespace cgs
