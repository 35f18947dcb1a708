// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/exposure.h"

namespace cgs {

ExposureGains exposure_gains(const TriangleMesh& mesh,
                             const FaceScores& scores,
                             const std::vector<View>& views,
                             const std::vector<std::pair<size_t, size_t>>& compared) {
  constexpr size_t kMostSamples = 200000;  // of the faces of a pair, evenly taken
  const auto shared = [&](size_t a, size_t b) {
    std::vector<size_t> faces;
    for (size_t f = 0; f < mesh.faces.size(); ++f) {
      if (scores(f, a) > 0 && scores(f, b) > 0) faces.push_back(f);
    }
    std::vector<Eigen::Vector3d> middles;
    for (size_t i = 0; i < faces.size(); i += faces.size() / kMostSamples + 1) {
      const auto& face = mesh.faces[faces[i]];
      middles.emplace_back((mesh.vertices[face[0]].cast<double>() +
                            mesh.vertices[face[1]].cast<double>() +
                            mesh.vertices[face[2]].cast<double>()) /
                           3);
    }
    return middles;
  };
  std::vector<const View*> pointers;
  pointers.reserve(views.size());
  for (const View& view : views) pointers.push_back(&view);
  return exposure_gains(pointers, compared, shared);
}

}  // namespace cgs
