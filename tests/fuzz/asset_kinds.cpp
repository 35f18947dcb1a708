// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "io/meshes/obj.h"
#include "io/meshes/om.h"
#include "io/meshes/stl.h"
#include "io/meshes/threemf.h"
#include "io/meshes/threemf_model.h"
#include "io/splats/compressed_ply.h"
#include "io/splats/dot_splat.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_reader.h"
#include "io/splats/spz.h"
#include "tests/fuzz/file_kinds.h"
#include "tests/support/ksplat_file.h"
#include "tests/support/openmesh_file.h"
#include "tests/support/packed_ply.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"
#include "tests/support/sog_file.h"
#include "tests/support/splat_ply.h"
#include "tests/support/temp_dir.h"
#include "tests/support/threemf_file.h"
#include "tests/support/triangle_glb.h"

namespace cgs::test {

namespace {

namespace fs = std::filesystem;
using Kinds = std::vector<FileKind>;
using Folder = const fs::path&;

// --- splats ---------------------------------------------------------------------------------

std::string ascii_splats() {
  return splat_ply_header("ascii", 2) +
         "0 1 2 .1 .2 .3 0 -4 -4 -5 1 0 0 0\n"
         "1 1e0 -2 .1 .2 .3 0.5 -4 -4 -5 1 0 0 0\n";
}

using WriteSplats =
    std::function<void(const fs::path& file, const Gaussians& splats, const Frame& frame)>;

void write_splat_ply(const fs::path& file, const Gaussians& splats, const Frame& frame) {
  write_gaussian_ply(file, splats, frame);
}

// What was read is written, and comes back.
void expect_splats_back(const GaussianFile& first,
                        const fs::path& again,
                        const WriteSplats& write) {
  write(again, first.gaussians, first.frame);
  const GaussianFile second = read_back([&] { return read_splats(again, first.frame); });
  require(second.gaussians.size() == first.gaussians.size(), "splats were lost");
}

FileKind of_splats(const std::string& name,
                   const std::string& file,
                   const std::function<void(const fs::path& file)>& write) {
  return {name,
          file,
          [=](Folder folder) { write(folder / file); },
          [=](Folder folder) {
            expect_splats_back(read_splats(folder / file), folder / "again.ply", write_splat_ply);
          }};
}

// Of a format that we write, too.
FileKind of_own_splats(const std::string& name, const std::string& file, const WriteSplats& write) {
  return {name,
          file,
          [=](Folder folder) { write(folder / file, varied_splats(3, 1), centimetre_frame()); },
          [=](Folder folder) {
            expect_splats_back(read_splats(folder / file), folder / ("again_" + file), write);
          }};
}

/// Splats in glTF as SPZ packs them.
std::string spz_glb() {
  const TempDir dir;
  write_spz(dir / "a.spz", varied_splats(3, 1), Frame{}, {});
  std::string blob = read_bytes(dir / "a.spz");
  const std::string json = R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"mode": 0, "attributes": {},
  "extensions": {"KHR_gaussian_splatting": {"extensions":
   {"KHR_gaussian_splatting_compression_spz_2": {"bufferView": 0}}}}}]}],
 "bufferViews": [{"buffer": 0, "byteLength": )" +
                           std::to_string(blob.size()) +
                           "}], \"buffers\": [{\"byteLength\": " + std::to_string(blob.size()) +
                           "}]}";
  blob.resize((blob.size() + 3) / 4 * 4);
  return glb(json, blob);
}

void add_splats(Kinds& kinds) {
  kinds.push_back(of_own_splats("splat-ply", "a.ply", write_splat_ply));
  kinds.push_back(of_splats(
      "splat-ply-ascii", "a.ply", [](const fs::path& file) { write_bytes(file, ascii_splats()); }));
  kinds.push_back(of_splats("packed-ply", "a.ply", [](const fs::path& file) {
    write_bytes(file, PackedFile{.splats = {{1, 2, 3, 4}, {}}, .coefficients = 9}.bytes());
  }));
  for (const int version : {2, 3}) {
    kinds.push_back(of_own_splats("spz-" + std::to_string(version),
                                  "a.spz",
                                  [=](const fs::path& file, const Gaussians& g, const Frame& f) {
                                    write_spz(file, g, f, {.version = version});
                                  }));
  }
  kinds.push_back(of_splats("sog", "a.sog", [](const fs::path& file) {
    SogFile sog;
    sog.add_harmonics();
    write_bytes(file, sog.bytes());
  }));
  kinds.push_back(of_splats("sog-unpacked", "meta.json", [](const fs::path& file) {
    SogFile sog;
    sog.add_harmonics();
    sog.unpack(file.parent_path());
  }));
  kinds.push_back(of_own_splats("packed-ply-of-ours",
                                "a.compressed.ply",
                                [](const fs::path& file, const Gaussians& g, const Frame& f) {
                                  write_compressed_ply(file, g, f);
                                }));
  kinds.push_back(of_own_splats(
      "splat-glb", "a.glb", [](const fs::path& file, const Gaussians& g, const Frame& f) {
        write_splat_glb(file, g, f);
      }));
  kinds.push_back(of_splats(
      "splat-glb-spz", "a.glb", [](const fs::path& file) { write_bytes(file, spz_glb()); }));
  for (const uint16_t level : {0, 1, 2}) {
    const std::string name = "ksplat-" + std::to_string(level);
    kinds.push_back(of_splats(name, "a.ksplat", [=](const fs::path& file) {
      write_bytes(file, KSplatFile{.level = level, .degree = 1, .splats = {{}, {}, {}}}.bytes());
    }));
  }
  kinds.push_back(of_own_splats(
      "dot-splat", "a.splat", [](const fs::path& file, const Gaussians& g, const Frame& f) {
        write_dot_splat(file, g, f);
      }));
}

// --- meshes ---------------------------------------------------------------------------------

/// \return the most triangles that the file may hold
using WriteMesh =
    std::function<size_t(const fs::path& file, const TriangleMesh& mesh, const Frame& frame)>;

// What was read is written as PLY, and comes back.
void expect_mesh_back(const MeasurableFile& first, const fs::path& again) {
  write_mesh_ply(again, first.content.mesh, first.content.frame);
  const MeasurableFile second =
      read_back([&] { return read_mesh_file(again, first.content.frame); });
  require(second.content.mesh.vertices.size() == first.content.mesh.vertices.size(),
          "vertices were lost");
  require(second.content.mesh.faces == first.content.mesh.faces, "faces were changed");
}

FileKind of_mesh(const std::string& name,
                 const std::string& file,
                 const std::function<void(const fs::path& file)>& write) {
  return {name,
          file,
          [=](Folder folder) { write(folder / file); },
          [=](Folder folder) {
            expect_mesh_back(read_mesh_file(folder / file), folder / "again.ply");
          }};
}

// Of a format that we write, too. \param is_exact  else coordinates are rounded, and triangles, or
// all of them, may have no area left
FileKind of_own_mesh(const std::string& name,
                     const std::string& file,
                     const WriteMesh& write,
                     bool is_exact = true) {
  return {name,
          file,
          [=](Folder folder) { write(folder / file, labelled_sphere(4, 4), centimetre_frame()); },
          [=](Folder folder) {
            const MeasurableFile first = read_mesh_file(folder / file);
            expect_mesh_back(first, folder / "again.ply");
            const fs::path again = folder / ("again_" + file);
            const size_t triangles = write(again, first.content.mesh, first.content.frame);
            const size_t back = read_back([&]() -> size_t {
              try {
                return read_mesh_file(again, first.content.frame).content.mesh.faces.size();
              } catch (const BadInput& error) {
                if (is_exact || error.defect() != Defect::Empty) throw;
                return 0;
              }
            });
            require(is_exact ? back == triangles : back <= triangles, "triangles were lost");
          }};
}

void add_own_meshes(Kinds& kinds) {
  kinds.push_back(of_own_mesh(
      "obj", "a.obj", [](const fs::path& file, const TriangleMesh& mesh, const Frame& frame) {
        write_obj(file, mesh, frame);
        return mesh.faces.size();
      }));
  kinds.push_back(of_own_mesh(
      "om", "a.om", [](const fs::path& file, const TriangleMesh& mesh, const Frame& frame) {
        write_om(file, mesh, frame);
        return mesh.faces.size();
      }));
  kinds.push_back(of_own_mesh(
      "stl", "a.stl", [](const fs::path& file, const TriangleMesh& mesh, const Frame& frame) {
        write_stl(file, mesh, frame, Eigen::Matrix3d::Identity());
        return mesh.faces.size();
      }));
  kinds.push_back(
      of_own_mesh("3mf-of-ours",
                  "a.3mf",
                  [](const fs::path& file, const TriangleMesh& mesh, const Frame& frame) {
                    write_3mf(file, mesh, frame, Eigen::Matrix3d::Identity());
                    return static_cast<size_t>(
                        std::count_if(mesh.faces.begin(), mesh.faces.end(), [](const auto& face) {
                          return face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
                        }));
                  }));
  const std::initializer_list<std::pair<const char*, GlbEncoding>> encodings = {
      {"glb", GlbEncoding::Plain},
      {"glb-quantized", GlbEncoding::Quantized},
      {"glb-meshopt", GlbEncoding::Meshopt},
      {"glb-draco", GlbEncoding::Draco}};
  for (const auto& [name, encoding] : encodings) {
    kinds.push_back(of_own_mesh(
        name,
        "a.glb",
        [encoding = encoding](const fs::path& file, const TriangleMesh& mesh, const Frame& frame) {
          return write_glb(file, mesh, frame, {.encoding = encoding}).triangles;
        },
        encoding == GlbEncoding::Plain));
    kinds.back().is_isolated = encoding == GlbEncoding::Draco;
  }
}

/// A triangle in glTF as text whose last corner a sparse morph target lifts; points beside it.
std::string morphed_gltf() {
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0, "translation": [1, 2, 3], "weights": [0.5]}],
 "meshes": [{"weights": [0], "primitives": [
  {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]},
  {"attributes": {"POSITION": 0}, "mode": 0, "targets": [{}]}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
  {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1,
   "indices": {"bufferView": 1, "componentType": 5125}, "values": {"bufferView": 2}}}],
 "bufferViews": [{"buffer": 0, "byteLength": 36},
  {"buffer": 0, "byteOffset": 36, "byteLength": 4},
  {"buffer": 0, "byteOffset": 40, "byteLength": 12}],
 "buffers": [{"byteLength": 52, "uri": "data:application/octet-stream;base64,)"
         "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAAAgAAAAAAAAAAAAAAAACAPw=="
         R"("}]})";
}

void add_meshes(Kinds& kinds) {
  kinds.push_back(
      of_mesh("gltf", "a.gltf", [](const fs::path& file) { write_bytes(file, morphed_gltf()); }));
  kinds.push_back(of_mesh("mesh-ply", "a.ply", [](const fs::path& file) {
    write_mesh_ply(file, labelled_sphere(4, 4), centimetre_frame());
  }));
  kinds.push_back(of_mesh("stl-ascii", "a.stl", [](const fs::path& file) {
    write_bytes(file,
                "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                "vertex 0 1e0 0\nendloop\nendfacet\nendsolid a\n");
  }));
  kinds.push_back(of_mesh("off", "a.off", [](const fs::path& file) {
    write_bytes(file, "OFF\n# a\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2 255 0 0\n4 0 1 3 2\n");
  }));
  kinds.push_back(of_mesh("om-of-openmesh", "a.om", [](const fs::path& file) {
    OpenTriMesh mesh;
    std::vector<OpenMesh::VertexHandle> v;
    for (const auto& p : {OpenMesh::Vec3f(0, 0, 0), {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      v.push_back(mesh.add_vertex(p));
      mesh.set_color(v.back(), {255, 0, 7});
    }
    for (size_t k = 0; k < 3; ++k) mesh.add_face(v[0], v[1 + (k + 1) % 3], v[1 + k]);
    require(write_with_openmesh(file, mesh), "OpenMesh did not write");
  }));
  kinds.push_back(of_mesh("ply-strips", "a.ply", [](const fs::path& file) {
    write_bytes(file,
                "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 5\n"
                "property float x\nproperty float y\nproperty float z\nproperty float s\n"
                "property float t\nelement tristrips 1\nproperty list int int vertex_indices\n"
                "element face 1\nproperty list uchar uint vertex_index\nproperty uchar red\n"
                "property uchar green\nproperty uchar blue\nend_header\n0 0 0 0 0\n1 0 0 1 0\n"
                "0 1 0 0 1\n1 1 0 1 1\nnan 0 1 0 0\n8 0 1 2 3 -1 0 2 1\n4 0 2 3 1 9 8 7\n");
  }));
  kinds.push_back(of_mesh("stl-colors", "a.stl", [](const fs::path& file) {
    std::string bytes = "COLOR=abcd";
    bytes.resize(80, ' ');
    bytes += std::string("\2\0\0\0", 4);
    for (const char attribute : {'\0', '\x80'}) {
      bytes += std::string(12, '\0');
      for (const float c : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) {
        bytes.append(reinterpret_cast<const char*>(&c), sizeof c);
      }
      bytes += std::string("\x1f") + attribute;
    }
    write_bytes(file, bytes);
  }));
  kinds.push_back({"mtl",
                   "a.mtl",
                   [](Folder folder) {
                     write_bytes(folder / "a.mtl",
                                 "newmtl a b\nKd 1 .5 0\nmap_Kd -o 1 2 -s 2 2 -clamp on a.png\n"
                                 "newmtl c\nKd 0.1\n");
                   },
                   [](Folder folder) {
                     write_bytes(folder / "a.obj",
                                 "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a b\n"
                                 "f 1/1 2/1 3/1\nusemtl c\nf 1 3 2\n");
                     expect_mesh_back(read_mesh_file(folder / "a.obj"), folder / "again.ply");
                   }});
  const auto placed = [] {
    ThreeMfFile out;
    out.resources += ThreeMfFile::object(
        2, ThreeMfFile::components({{1, "transform=\"1 0 0 0 1 0 0 0 1 2 3 4\""}}));
    out.build += "<item objectid=\"2\"/>";
    return out;
  };
  kinds.push_back(of_mesh("3mf", "a.3mf", [=](const fs::path& file) {
    write_bytes(file, placed().bytes({.method = 0}));
  }));
  kinds.push_back({"3mf-model",
                   "3dmodel.model",
                   [=](Folder folder) { write_bytes(folder / "3dmodel.model", placed().model()); },
                   [](Folder folder) {
                     const fs::path file = folder / "3dmodel.model";
                     (void)parse_threemf_model(read_bytes(file), file);
                   }});
}

}  // namespace

std::vector<FileKind> asset_kinds() {
  Kinds kinds;
  add_splats(kinds);
  add_own_meshes(kinds);
  add_meshes(kinds);
  return kinds;
}

}  // namespace cgs::test
