// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/mesh_arrays.h"
#include "io/bytes/scene_path.h"
#include "io/glb/texture_images.h"
#include "io/ply/frame.h"
#include "libcgs/core/error.h"
#include "libcgs/core/provenance.h"
#include "libcgs/core/texture_corners.h"

namespace cgs {

namespace {

/// Names in OBJ files end at a blank.
std::string group_name(Provenance provenance) {
  std::string name(provenance_name(provenance));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// What names of textured materials begin with: the class, as programs that leave groups out keep
/// names of materials.
std::string material_prefix(const TriangleMesh& mesh, Provenance label) {
  return (mesh.provenance.empty() ? "view" : group_name(label)) + "_";
}

/// Names of images that files and materials may have; but for the atlas, each once.
std::vector<std::string> safe_names(const PhotoTexture& texture) {
  std::vector<std::string> out;
  for (std::string name : texture_names(texture)) {
    for (char& c : name) {
      const bool plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
                         (c >= 'a' && c <= 'z') || c == '-' || c == '_' || c == '.';
      if (!plain) c = '_';
    }
    const bool is_shared = texture.atlas.has_value();
    while (!is_shared && std::find(out.begin(), out.end(), name) != out.end()) name += '_';
    out.push_back(std::move(name));
  }
  return out;
}

/// A texture with what belongs to it in files.
struct ObjTexture {
  const PhotoTexture& texture;
  std::vector<std::string> names;
  std::vector<TextureImage> images;

  int photograph(size_t face) const {
    return texture.empty() ? PhotoTexture::kNone : texture.of_face[face];
  }
  int image(size_t face) const {
    const int i = photograph(face);
    return i == PhotoTexture::kNone ? i : images[static_cast<size_t>(i)].image;
  }
  TextureCorners corners(const TriangleMesh& mesh) const {
    const std::span<const std::array<uint32_t, 3>> none;
    return {texture.empty() ? none : mesh.faces, texture.of_face, mesh.vertices.size()};
  }
};

/// What the files beside an OBJ begin with: its own name, in which many programs would take a blank
/// for the end and # for a comment.
std::string companion_stem(const std::filesystem::path& path) {
  std::string out = path.stem().string();
  std::replace_if(
      out.begin(),
      out.end(),
      [](char c) { return c == '#' || c == '\\' || (c >= '\0' && c <= ' '); },
      '_');
  return out;
}

std::string image_name(const std::filesystem::path& path, const std::string& name) {
  return companion_stem(path) + "." + name + ".jpg";
}

constexpr std::string_view kOurMaterials = "# cgs:";

/// Where the materials go. \throws InvalidInput if those of another program lie there
std::filesystem::path materials_path(const std::filesystem::path& path) {
  std::filesystem::path out = path.parent_path() / (companion_stem(path) + ".mtl");
  if (is_present(out) && read_file_start(out, kOurMaterials.size()) != kOurMaterials) {
    throw InvalidInput("the materials of " + printable(path) + " would replace " + printable(out) +
                       ", which another program wrote; choose another name");
  }
  return out;
}

std::string diffuse_text(Provenance label) {
  std::string out;
  for (const uint8_t value : traits(label).color) {
    if (!out.empty()) out += ' ';
    append_number(out, std::round(100 * value / 255.0) / 100);
  }
  return out;
}

/// Classes of the faces that show an image, one if the mesh has no labels.
std::array<bool, kProvenanceCount> classes_in(const TriangleMesh& mesh,
                                              const ObjTexture& texture,
                                              size_t image) {
  std::array<bool, kProvenanceCount> out = {};
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.image(f) != static_cast<int>(image)) continue;
    out.at(mesh.provenance.empty() ? 0 : static_cast<size_t>(mesh.provenance[f])) = true;
  }
  return out;
}

/// Always all classes, so that writing it again never changes what an older OBJ refers to.
std::string materials_text(const std::filesystem::path& path,
                           const TriangleMesh& mesh,
                           const ObjTexture& texture) {
  std::string out = std::string(kOurMaterials) + " materials tell where a surface comes from\n";
  for (const Provenance label : kProvenanceOrder) {
    out += "newmtl " + group_name(label) + "\nKd " + diffuse_text(label) + "\nillum 1\n";
  }
  for (size_t i = 0; i < texture.images.size(); ++i) {
    if (texture.images[i].jpeg.empty()) continue;
    const auto has_class = classes_in(mesh, texture, i);
    for (const Provenance label : kProvenanceOrder) {
      if (!has_class.at(static_cast<size_t>(label))) continue;
      out += "newmtl " + material_prefix(mesh, label) + texture.names[i] +
             "\nKd 1 1 1\nillum 1\nmap_Kd " + image_name(path, texture.names[i]) + "\n";
    }
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

/// Writes "vt" lines: one for every corner, in their order.
void write_texcoords(AtomicFile& file,
                     const TriangleMesh& mesh,
                     const ObjTexture& texture,
                     const TextureCorners& corners) {
  std::string line;
  for (size_t i = 0; i < corners.size(); ++i) {
    const auto photograph = static_cast<size_t>(corners.photograph(i));
    const Camera& camera = texture.texture.photographs[photograph].camera;
    const Eigen::Vector3d uvz = camera.project(mesh.vertices[corners.vertex(i)].cast<double>());
    Eigen::Vector2f t = texture.images[photograph].texcoord(uvz);
    t.y() = 1 - t.y();
    line.clear();
    append_line(line, "vt", t);
    file.write(line + "\n");
  }
}

/// Writes faces; normals have the numbers of the vertices.
struct FaceWriter {
  AtomicFile& file;
  const TextureCorners& corners;
  bool has_normals = false;

  /// \param photograph  that it shows, or kNone
  void write(const std::array<uint32_t, 3>& face, int photograph) const {
    const bool has_texcoords = photograph != PhotoTexture::kNone;
    std::string line = "f";
    for (const uint32_t corner : face) {
      line += ' ';
      append_number(line, uint64_t{corner} + 1);
      if (has_texcoords || has_normals) line += '/';
      if (has_texcoords) append_number(line, uint64_t{corners(corner, photograph)} + 1);
      if (!has_normals) continue;
      line += '/';
      append_number(line, uint64_t{corner} + 1);
    }
    file.write(line + "\n");
  }
};

/// Groups by provenance, materials within.
void write_faces(AtomicFile& file, const TriangleMesh& mesh, const ObjTexture& texture) {
  const TextureCorners corners = texture.corners(mesh);
  write_texcoords(file, mesh, texture, corners);
  const FaceWriter writer{file, corners, !mesh.normals.empty()};
  std::vector<std::vector<size_t>> faces(kProvenanceCount * (texture.images.size() + 1));
  const auto slot = [&](size_t group, int image) {
    return group * (texture.images.size() + 1) + static_cast<size_t>(image + 1);
  };
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto group = mesh.provenance.empty() ? 0 : static_cast<size_t>(mesh.provenance[f]);
    faces[slot(group, texture.image(f))].push_back(f);
  }
  const size_t groups = mesh.provenance.empty() ? 1 : kProvenanceOrder.size();
  for (size_t g = 0; g < groups; ++g) {
    const Provenance group = kProvenanceOrder.at(g);
    bool open = mesh.provenance.empty();
    for (int i = -1; i < static_cast<int>(texture.images.size()); ++i) {
      const std::vector<size_t>& part =
          faces[slot(mesh.provenance.empty() ? 0 : static_cast<size_t>(group), i)];
      if (part.empty()) continue;
      if (!open) file.write("g " + group_name(group) + "\n");
      open = true;
      if (i >= 0) {
        file.write("usemtl " + material_prefix(mesh, group) +
                   texture.names[static_cast<size_t>(i)] + "\n");
      } else if (!mesh.provenance.empty()) {
        file.write("usemtl " + group_name(group) + "\n");
      }
      for (const size_t f : part) writer.write(mesh.faces[f], texture.photograph(f));
    }
  }
}

/// Files beside the OBJ. All lie whole on the disk before the first takes its place; those that
/// were not there before go again unless kept.
class Companions {
 public:
  ~Companions() {
    std::error_code ignored;
    for (const auto& path : created_) std::filesystem::remove(path, ignored);
  }
  void write(const std::filesystem::path& path, std::string_view bytes) {
    files_.push_back({path, std::make_unique<AtomicFile>(path)});
    files_.back().second->write(bytes);
    files_.back().second->sync();
  }
  void commit() {
    for (const auto& [path, file] : files_) {
      const bool existed = std::filesystem::exists(path);
      file->commit();
      if (!existed) created_.push_back(path);
    }
  }
  void keep() { created_.clear(); }

 private:
  std::vector<std::pair<std::filesystem::path, std::unique_ptr<AtomicFile>>> files_;
  std::vector<std::filesystem::path> created_;
};

}  // namespace

void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh, const Frame& frame) {
  write_obj(path, mesh, PhotoTexture{}, frame);
}

void write_obj(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const PhotoTexture& texture,
               const Frame& frame) {
  require_writable(mesh, "write_obj");
  require_texture(mesh, texture, "write_obj");
  constexpr int kQuality = 90;
  ObjTexture used{texture, safe_names(texture), {}};
  if (!texture.empty()) used.images = texture_images(mesh, texture, kQuality);
  const std::filesystem::path materials = materials_path(path);
  AtomicFile file(path);
  file.write("# cgs\n" + frame_comments(frame, "# ") + "mtllib " + materials.filename().string() +
             "\n");
  write_vertices(file, mesh, frame);
  write_faces(file, mesh, used);
  Companions companions;
  for (size_t i = 0; i < used.images.size(); ++i) {
    if (used.images[i].jpeg.empty()) continue;
    companions.write(path.parent_path() / image_name(path, used.names[i]), used.images[i].jpeg);
  }
  companions.write(materials, materials_text(path, mesh, used));
  file.sync();
  companions.commit();
  file.commit();
  companions.keep();
}

}  // namespace cgs
