// SPDX-License-Identifier: GPL-3.0-or-later
// Makes any mesh bound a volume, and says what was done to it and what can be proved of the result.
// usage: sample_04_close_and_certify MESH OUT.ply
#include <exception>
#include <iostream>

#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "meshing/surface/closing.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " MESH OUT.ply\n";
    return 2;
  }
  const cgs::MeasurableMesh input = cgs::read_mesh_file(argv[1]).content;
  const cgs::ClosedMesh closed = cgs::closed_mesh(input.mesh);
  cgs::write_mesh_ply(argv[2], closed.mesh, input.frame);
  for (const cgs::ClosingAttempt& attempt : closed.attempts) {
    std::cout << attempt.way << (attempt.reason.empty() ? "" : ": ") << attempt.reason << '\n';
  }
  const cgs::Certificate& proof = closed.certificate;
  const double scale = input.frame.scale;  // file units per internal unit
  std::cout << (proof.passed() ? "closed, manifold, outward, " : "fails, ")
            << proof.self_intersections << " self-intersections, genus " << proof.genus << ", "
            << proof.components << " components\n"
            << "volume " << proof.volume * scale * scale * scale << ", of "
            << proof.area * scale * scale << " area " << proof.inferred_area * scale * scale
            << " was invented to close it\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
