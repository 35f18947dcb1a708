// SPDX-License-Identifier: GPL-3.0-or-later
// Uses something of each library: closes a cube that lacks a side, writes it, reads it, measures it
// and draws a Gaussian at its middle.
#include <cmath>
#include <cstdio>
#include <cstring>

#include <io/meshes/mesh_file.h>
#include <io/meshes/mesh_ply.h>
#include <libcgs/core/version.h>
#include <libcgs/render/rasterizer.h>
#include <meshing/measure/surface_measures.h>
#include <meshing/surface/closing.h>

namespace {

int failures = 0;

void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", what);
  ++failures;
}

cgs::TriangleMesh cube_without_top() {
  cgs::TriangleMesh out;
  for (int i = 0; i < 8; ++i)
    out.vertices.emplace_back(float(i & 1), float(i >> 1 & 1), float(i >> 2));
  out.faces = {{0, 2, 3},
               {0, 3, 1},
               {0, 1, 5},
               {0, 5, 4},
               {2, 6, 7},
               {2, 7, 3},
               {0, 4, 6},
               {0, 6, 2},
               {1, 3, 7},
               {1, 7, 5}};
  return out;
}

void test_meshes() {
  const cgs::ClosedMesh closed = cgs::closed_mesh(cube_without_top());
  expect(closed.certificate.passed(), "the closed cube bounds a volume");
  cgs::write_mesh_ply("cube.ply", closed.mesh, cgs::Frame());
  const cgs::MeasurableMesh read = cgs::read_mesh_file("cube.ply").content;
  const double unit = read.frame.scale;
  const double volume = cgs::enclosed_volume(read).value * unit * unit * unit;
  expect(std::abs(volume - 1) < 1e-6, "its volume is 1");
}

void test_drawing() {
  cgs::Gaussians one;
  one.position.emplace_back(0, 0, 2);
  one.scale.emplace_back(0.1, 0.1, 0.1);
  one.rotation.emplace_back(1, 0, 0, 0);
  one.opacity.push_back(0.9f);
  one.sh.emplace_back(1, 0, 0);
  const cgs::Camera camera{32, 32, 32, 32, 16, 16, Eigen::Isometry3d::Identity()};
  const cgs::RenderBuffers drawn = cgs::rasterize(one, camera);
  expect(drawn.alpha(15, 15) > 0.8f, "a Gaussian covers the middle of the picture");
  expect(drawn.alpha(0, 0) == 0, "and not its corner");
}

}  // namespace

int main() {
  expect(std::strcmp(cgs::version(), PACKAGE_VERSION) == 0,
         "library and package are of one version");
  test_meshes();
  test_drawing();
  return failures == 0 ? 0 : 1;
}
