// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

// Before its meshes, which else refuse to be written.
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

namespace cgs::test {

/// Meshes of OpenMesh that can hold all that its files can.
struct OpenMeshTraits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::Normal | OpenMesh::Attributes::Color |
                   OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
};
struct OpenMeshDoubleTraits : OpenMeshTraits {
  using Point = OpenMesh::Vec3d;
};
using OpenTriMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMeshTraits>;
using OpenPolyMesh = OpenMesh::PolyMesh_ArrayKernelT<OpenMeshTraits>;
using OpenDoubleMesh = OpenMesh::PolyMesh_ArrayKernelT<OpenMeshDoubleTraits>;

/// Normals and colours of vertices, and what is marked as deleted.
inline OpenMesh::IO::Options openmesh_options() {
  using OpenMesh::IO::Options;
  Options out;
  for (const auto flag : {Options::VertexNormal, Options::VertexColor, Options::Status}) {
    out += flag;
  }
  return out;
}

template <typename Mesh>
bool write_with_openmesh(const std::filesystem::path& path, const Mesh& mesh) {
  return OpenMesh::IO::write_mesh(mesh, path.string(), openmesh_options());
}

template <typename Mesh>
bool read_with_openmesh(const std::filesystem::path& path, Mesh& mesh) {
  OpenMesh::IO::Options options = openmesh_options();
  return OpenMesh::IO::read_mesh(mesh, path.string(), options);
}

}  // namespace cgs::test
