// SPDX-License-Identifier: GPL-3.0-or-later
#include <stdexcept>

#include "io/compressed_ply.h"
#include "io/dot_splat.h"
#include "io/gaussian_ply.h"
#include "io/gltf.h"
#include "io/mesh_file.h"
#include "io/mesh_ply.h"
#include "io/obj.h"
#include "io/splat_glb.h"
#include "io/splat_reader.h"
#include "io/spz.h"
#include "io/stl.h"
#include "io/threemf.h"
#include "io/threemf_model.h"
#include "tests/fuzz/file_kinds.h"
#include "tests/support/ksplat_file.h"
#include "tests/support/packed_ply.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"
#include "tests/support/sog_file.h"
#include "tests/support/splat_ply.h"
#include "tests/support/temp_dir.h"
#include "tests/support/threemf_file.h"

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

// What was read is written as 3DGS PLY, and comes back.
void read_splats_twice(const fs::path& file) {
  const GaussianFile first = read_splats(file);
  const fs::path again = file.parent_path() / "again.ply";
  write_gaussian_ply(again, first.gaussians, first.frame);
  const GaussianFile second = read_splats(again, first.frame);
  require(second.gaussians.size() == first.gaussians.size(), "splats were lost");
}

FileKind of_splats(const std::string& name,
                   const std::string& file,
                   const std::function<void(const fs::path& file)>& write) {
  return {name,
          file,
          [=](Folder folder) { write(folder / file); },
          [=](Folder folder) { read_splats_twice(folder / file); }};
}

void add_splats(Kinds& kinds) {
  const auto ours = [] { return varied_splats(3, 1); };
  kinds.push_back(of_splats("splat-ply", "a.ply", [=](const fs::path& file) {
    write_gaussian_ply(file, ours(), centimetre_frame());
  }));
  kinds.push_back(of_splats(
      "splat-ply-ascii", "a.ply", [](const fs::path& file) { write_bytes(file, ascii_splats()); }));
  kinds.push_back(of_splats("packed-ply", "a.ply", [](const fs::path& file) {
    write_bytes(file, PackedFile{.splats = {{1, 2, 3, 4}, {}}, .coefficients = 9}.bytes());
  }));
  for (const int version : {2, 3}) {
    kinds.push_back(of_splats("spz-" + std::to_string(version), "a.spz", [=](const fs::path& file) {
      write_spz(file, ours(), centimetre_frame(), {.version = version});
    }));
  }
  kinds.push_back(of_splats("sog", "a.sog", [](const fs::path& file) {
    SogFile sog;
    sog.add_harmonics();
    write_bytes(file, sog.bytes());
  }));
  kinds.push_back(of_splats("packed-ply-of-ours", "a.ply", [=](const fs::path& file) {
    write_compressed_ply(file, ours(), centimetre_frame());
  }));
  kinds.push_back(of_splats("splat-glb", "a.glb", [=](const fs::path& file) {
    write_splat_glb(file, ours(), centimetre_frame());
  }));
  for (const uint16_t level : {0, 1, 2}) {
    const std::string name = "ksplat-" + std::to_string(level);
    kinds.push_back(of_splats(name, "a.ksplat", [=](const fs::path& file) {
      write_bytes(file, KSplatFile{.level = level, .degree = 1, .splats = {{}, {}, {}}}.bytes());
    }));
  }
  kinds.push_back(of_splats("dot-splat", "a.splat", [=](const fs::path& file) {
    write_dot_splat(file, ours(), centimetre_frame());
  }));
}

// --- meshes ---------------------------------------------------------------------------------

// What was read is written as PLY, and comes back.
void read_mesh_twice(const fs::path& file) {
  const MeasurableFile first = read_mesh_file(file);
  const fs::path again = file.parent_path() / "again.ply";
  write_mesh_ply(again, first.content.mesh, first.content.frame);
  const MeasurableFile second = read_mesh_file(again, first.content.frame);
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
          [=](Folder folder) { read_mesh_twice(folder / file); }};
}

void add_meshes(Kinds& kinds) {
  const auto sphere = [] { return labelled_sphere(4, 4); };
  kinds.push_back(of_mesh("mesh-ply", "a.ply", [=](const fs::path& file) {
    write_mesh_ply(file, sphere(), centimetre_frame());
  }));
  kinds.push_back(of_mesh("obj", "a.obj", [=](const fs::path& file) {
    write_obj(file, sphere(), centimetre_frame());
  }));
  kinds.push_back(of_mesh("stl", "a.stl", [=](const fs::path& file) {
    write_stl(file, sphere(), centimetre_frame(), Eigen::Matrix3d::Identity());
  }));
  kinds.push_back(of_mesh("stl-ascii", "a.stl", [](const fs::path& file) {
    write_bytes(file,
                "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                "vertex 0 1e0 0\nendloop\nendfacet\nendsolid a\n");
  }));
  kinds.push_back(of_mesh("off", "a.off", [](const fs::path& file) {
    write_bytes(file, "OFF\n# a\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2 255 0 0\n4 0 1 3 2\n");
  }));
  kinds.push_back(of_mesh("glb", "a.glb", [=](const fs::path& file) {
    write_glb(file, sphere(), centimetre_frame(), {.encoding = GlbEncoding::Plain});
  }));
  kinds.push_back(of_mesh("glb-meshopt", "a.glb", [=](const fs::path& file) {
    write_glb(file, sphere(), centimetre_frame(), {.encoding = GlbEncoding::Meshopt});
  }));
  kinds.push_back(of_mesh("3mf-of-ours", "a.3mf", [=](const fs::path& file) {
    write_3mf(file, sphere(), centimetre_frame(), Eigen::Matrix3d::Identity());
  }));
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
  FileKind draco = of_mesh("glb-draco", "a.glb", [=](const fs::path& file) {
    write_glb(file, sphere(), centimetre_frame());
  });
  draco.is_isolated = true;
  kinds.push_back(draco);
}

}  // namespace

std::vector<FileKind> asset_kinds() {
  Kinds kinds;
  add_splats(kinds);
  add_meshes(kinds);
  return kinds;
}

}  // namespace cgs::test
