// SPDX-License-Identifier: GPL-3.0-or-later
// Draws splats of any format from the cameras of a scene and from halfway between them.
// usage: sample_02_render_path SPLATS SCENE OUT_FOLDER
#include <exception>
#include <iostream>

#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "io/splats/splat_reader.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::cerr << "usage: " << argv[0] << " SPLATS SCENE OUT_FOLDER\n";
    return 2;
  }
  const cgs::GaussianFile splats = cgs::read_splats(argv[1]);
  const cgs::Scene scene = cgs::read_scene(argv[2]);  // in world coordinates
  std::filesystem::create_directories(argv[3]);
  for (size_t i = 0; i < 2 * scene.input.size() - 1; ++i) {
    const auto view = [&](size_t k) { return scene.views[size_t(scene.input[k])].camera; };
    cgs::Camera camera = view(i / 2);
    const Eigen::Isometry3d next = view((i + 1) / 2).world_from_cam;
    const double t = i % 2 == 0 ? 0 : 0.5;
    const Eigen::Quaterniond turn(camera.world_from_cam.linear());
    const Eigen::Vector3d at = (1 - t) * camera.center() + t * next.translation();
    camera.world_from_cam.linear() =
        turn.slerp(t, Eigen::Quaterniond(next.linear())).toRotationMatrix();
    camera.world_from_cam.translation() = splats.frame.internal_from_world(at);
    const auto file = std::filesystem::path(argv[3]) / (std::to_string(i) + ".png");
    cgs::write_png(file, cgs::picture(cgs::rasterize(splats.gaussians, camera)));
    std::cout << file.string() << '\n';
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
