// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
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

/// The base material of a triangle; group 0 = none.
struct ThreeMfMaterial {
  uint64_t group = 0;
  uint64_t index = 0;
};

/// A mesh, or what it is made of.
struct ThreeMfObject {
  std::vector<Eigen::Vector3d> vertices;  ///< In units of the model; finite.
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<ThreeMfMaterial> materials;  ///< One per triangle.
  std::vector<ThreeMfPlacement> components;
};

/// One model file of a 3MF archive.
struct ThreeMfModel {
  std::string metres_per_unit = "0.001";  ///< As a decimal number.
  std::map<uint64_t, ThreeMfObject> objects;
  std::map<uint64_t, std::vector<std::string>> material_names;  ///< By group.
  std::vector<ThreeMfPlacement> build;
  std::string application;  ///< Metadata; empty = not stated.
  std::string description;
};

/// Reads a model file: unit, meshes, components, base materials and build, of the core
/// specification and the production extension.
/// \param path  for messages
/// \throws BadInput as read_xml(); Schema, Value, Ref (a corner that is not there), Unsupported (an
///         extension is required that changes the shape)
/// Source: 3MF Core Specification 1.3 and Production Extension 1.1, 3MF Consortium.
ThreeMfModel parse_threemf_model(std::string_view xml, const std::filesystem::path& path);

}  // namespace cgs
