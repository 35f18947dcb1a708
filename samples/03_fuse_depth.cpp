// SPDX-License-Identifier: GPL-3.0-or-later
// Fuses metric depth, a file per photograph of a scene in metres, into the surface that it shows.
// usage: sample_03_fuse_depth SCENE OUT.ply
#include <exception>
#include <iostream>

#include "io/meshes/mesh_ply.h"
#include "io/scenes/scene_reader.h"
#include "meshing/surface/isosurface.h"
#include "meshing/volume/tsdf.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " SCENE OUT.ply\n";
    return 2;
  }
  cgs::SceneOptions options;
  options.all_views = true;
  options.depth.kind = cgs::DepthKind::Metric;
  cgs::Scene scene = cgs::read_scene(argv[1], options);
  scene.frame.metres_per_unit = 1;
  scene.frame.scale_source = cgs::ScaleSource::Assumed;
  cgs::load_images(scene, scene.input);
  cgs::to_canonical(scene);  // cameras are in internal units from here on
  std::vector<cgs::TsdfView> frames(scene.input.size());
  for (size_t k = 0; k < frames.size(); ++k) {
    const cgs::View& view = scene.views[size_t(scene.input[k])];
    frames[k].camera = view.camera;
    frames[k].color = view.image;
    frames[k].depth = view.given_depth;
    for (float& z : frames[k].depth.data) z = float(z / scene.frame.scale);
  }
  const cgs::FusedVolume fused = cgs::fuse(frames, {});
  const cgs::TriangleMesh mesh = cgs::open_surface(fused.volume, {});
  cgs::write_mesh_ply(argv[2], mesh, scene.frame);
  std::cout << frames.size() << " frames, " << mesh.faces.size() << " faces\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
