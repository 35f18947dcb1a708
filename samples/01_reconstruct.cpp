// SPDX-License-Identifier: GPL-3.0-or-later
// Reads photographs with cameras, reconstructs, and writes the Gaussians for any 3DGS viewer.
// usage: sample_01_reconstruct SCENE OUT.ply
#include <exception>
#include <iostream>

#include "io/scenes/scene_reader.h"
#include "io/splats/gaussian_ply.h"
#include "libcgs/reconstruct/evidence_words.h"
#include "libcgs/reconstruct/reconstruct.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " SCENE OUT.ply\n";
    return 2;
  }
  cgs::Scene scene = cgs::read_scene(argv[1]);  // any layout that the program reads
  cgs::load_images(scene, scene.input);
  cgs::ReconstructionOptions options;
  options.training = cgs::training_preset("draft");
  const auto progress = [](double done) { std::cerr << '\r' << int(100 * done) << " %"; };
  const cgs::TrainedModel trained = cgs::reconstruct(std::move(scene), options, progress);
  const cgs::Model& model = trained.model;
  const std::string evidence = cgs::description_of(trained, options.training);
  cgs::write_gaussian_ply(argv[2], model.gaussians, model.scene.frame, evidence);
  std::cout << '\n' << model.gaussians.size() << " Gaussians; " << evidence << '\n';
  for (const auto& line : cgs::coverage_words(trained.priors, model.scene)) {
    std::cout << line << '\n';
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
