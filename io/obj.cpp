// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/obj.h"

#include <algorithm>
#include <array>
#include <string>

#include "io/atomic_file.h"
#include "io/byte_writer.h"
#include "io/mesh_arrays.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

/// Names in OBJ files end at a blank.
std::string group_name(Provenance provenance) {
  std::string name(provenance_name(provenance));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// Always all four, so that writing it again never changes what an older OBJ refers to.
std::string materials_text() {
  constexpr std::array<const char*, 4> kDiffuse = {
      "0.8 0.8 0.8", "0.8 0.74 0.56", "0.56 0.68 0.8", "0.8 0.28 0.68"};
  std::string out = "# cgs: materials tell where a surface comes from\n";
  for (size_t i = 0; i < kProvenanceOrder.size(); ++i) {
    out +=
        "newmtl " + group_name(kProvenanceOrder.at(i)) + "\nKd " + kDiffuse.at(i) + "\nillum 1\n";
  }
  return out;
}

template <typename Values>
void append_line(std::string& out, std::string_view keyword, const Values& values) {
  out += keyword;
  for (const auto value : values) {
    out += ' ';
    append_number(out, value);
  }
}

void write_vertices(AtomicFile& file, const TriangleMesh& mesh, const Frame& frame) {
  std::string line;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    line.clear();
    const Eigen::Vector3d p = frame.file_from_internal(mesh.vertices[i].cast<double>());
    append_line(line, "v", Eigen::Vector3f(p.cast<float>()));
    if (!mesh.colors.empty()) {
      for (const float c : mesh.colors[i]) {
        line += ' ';
        append_number(line, static_cast<float>(color_byte(c)) / 255.0f);
      }
    }
    file.write(line + "\n");
  }
  for (const Eigen::Vector3f& n : mesh.normals) {
    line.clear();
    append_line(line, "vn", n);
    file.write(line + "\n");
  }
}

void write_face(AtomicFile& file, const std::array<uint32_t, 3>& face, bool has_normals) {
  std::string line = "f";
  for (const uint32_t corner : face) {
    line += ' ';
    append_number(line, uint64_t{corner} + 1);
    if (!has_normals) continue;
    line += "//";
    append_number(line, uint64_t{corner} + 1);
  }
  file.write(line + "\n");
}

void write_faces(AtomicFile& file, const TriangleMesh& mesh) {
  const bool has_normals = !mesh.normals.empty();
  if (mesh.provenance.empty()) {
    for (const auto& face : mesh.faces) write_face(file, face, has_normals);
    return;
  }
  for (const Provenance group : kProvenanceOrder) {
    const std::string name = group_name(group);
    bool open = false;
    for (size_t i = 0; i < mesh.faces.size(); ++i) {
      if (mesh.provenance[i] != group) continue;
      if (!open) file.write(std::string("g ").append(name).append("\nusemtl ").append(name) + "\n");
      open = true;
      write_face(file, mesh.faces[i], has_normals);
    }
  }
}

}  // namespace

void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh, const Frame& frame) {
  require_writable(mesh, "write_obj");
  const std::filesystem::path materials = std::filesystem::path(path).replace_extension(".mtl");
  AtomicFile file(path);
  std::string header = "# cgs\n# unit " + frame.unit_name() + "\n";
  append_line(header, "# file_origin", frame.file_origin);
  file.write(header + "\nmtllib " + materials.filename().string() + "\n");
  write_vertices(file, mesh, frame);
  write_faces(file, mesh);
  const bool had_materials = std::filesystem::exists(materials);
  write_file(materials, materials_text());
  try {
    file.commit();
  } catch (...) {
    std::error_code ignored;
    if (!had_materials) std::filesystem::remove(materials, ignored);
    throw;
  }
}

}  // namespace cgs
