// SPDX-License-Identifier: GPL-3.0-or-later
// Measures a mesh: every figure with its standard deviation, and with what it rests on.
// usage: sample_05_measure MESH
#include <cmath>
#include <exception>
#include <iostream>
#include <string>

#include "io/meshes/mesh_file.h"
#include "meshing/measure/surface_measures.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " MESH\n";
    return 2;
  }
  const cgs::MeasurableMesh mesh = cgs::read_mesh_file(argv[1]).content;
  const auto print = [&](const std::string& name, const cgs::MeasuredValue& figure) {
    const double unit = std::pow(mesh.frame.scale, figure.dimension);  // to units of the file
    std::cout << name << ' ' << figure.value * unit << " +- " << figure.sigma * unit;
    for (size_t label = 0; label < figure.by_provenance.size(); ++label) {
      const double share = figure.by_provenance[label] / figure.value;
      if (!(share > 0)) continue;
      std::cout << ", " << std::lround(100 * share) << " % "
                << cgs::provenance_name(cgs::Provenance(label));
    }
    std::cout << '\n';
  };
  std::cout << "unit: " << mesh.frame.unit_name() << '\n';
  print("area", cgs::surface_area(mesh));
  if (!cgs::has_rim(mesh)) print("volume", cgs::enclosed_volume(mesh));
  print("longest side", cgs::oriented_box(mesh).extents[0]);
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
