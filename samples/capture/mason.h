// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "samples/capture/noise.h"
#include "samples/capture/portal.h"
#include "samples/capture/solids.h"

namespace cgs {

/// Puts the solids of a scene in their places.
class Mason {
 public:
  explicit Mason(PortalScene& scene) : scene_(scene) {}

  void add(const std::string& name, Material material, const TriangleMesh& mesh) {
    add_part(scene_, name, material, mesh);
  }

  /// Stone: edges no longer than max_edge [m], then made uneven.
  void add_stone(const std::string& name, Material material, TriangleMesh mesh, double max_edge) {
    refine(mesh, max_edge);
    weather(mesh, 0.004F, static_cast<uint32_t>(scene_.parts.size()) * 977U);
    add(name, material, mesh);
  }

 private:
  // Uneven stone: moves vertices by a few millimetres in all directions.
  static void weather(TriangleMesh& mesh, float amplitude, uint32_t seed) {
    const NoiseBand band{.longest = 0.5F, .shortest = 0.06F, .gain = 0.6F};
    for (auto& v : mesh.vertices) {
      const Eigen::Vector3f p = v;
      for (uint32_t k = 0; k < 3; ++k) {
        v[k] += amplitude * band_noise(p, band, 0.01F, seed + 101 * k);
      }
    }
  }

  PortalScene& scene_;
};

/// A carved front and where it stands.
struct Panel {
  Relief relief;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Of its lower middle, world [m].
};

/// Adds a panel of 15 cm that stands out of its place by a centimetre.
inline void add_panel(Mason& mason, const std::string& name, Panel panel, Material material) {
  panel.relief.depth = 0.15;
  panel.place.y() -= 0.01;
  const Eigen::Isometry3d pose(Eigen::Translation3d(panel.place));
  mason.add(name, material, moved(carved(panel.relief), pose));
}

}  // namespace cgs
