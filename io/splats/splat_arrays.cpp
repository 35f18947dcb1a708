// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_arrays.h"

#include "libcgs/core/error.h"

namespace cgs {

void require_writable(const Gaussians& g) {
  require(g.sh_degree >= 0 && g.sh_degree <= 3, "Gaussians.sh_degree must be 0 to 3", g.sh_degree);
  const size_t n = g.size();
  const size_t sh = n * static_cast<size_t>(g.sh_count());
  require(g.scale.size() == n, "Gaussians.scale must be as long as position", g.scale.size());
  require(
      g.rotation.size() == n, "Gaussians.rotation must be as long as position", g.rotation.size());
  require(g.opacity.size() == n, "Gaussians.opacity must be as long as position", g.opacity.size());
  require(g.sh.size() == sh, "Gaussians.sh must have sh_count() entries per Gaussian", g.sh.size());
  require(g.provenance.empty() || g.provenance.size() == n,
          "Gaussians.provenance must be empty or as long as position",
          g.provenance.size());
  require(g.synthetic.empty() || g.synthetic.size() == n,
          "Gaussians.synthetic must be empty or as long as position",
          g.synthetic.size());
  for (const uint8_t tag : g.synthetic) {
    require(tag <= g.synthetic_sources.size(),
            "Gaussians.synthetic must be at most the number of sources",
            int{tag});
  }
  for (size_t i = 0; i < n; ++i) {
    require(g.position[i].allFinite() && g.rotation[i].allFinite(),
            "Gaussians: positions and rotations must be finite; index",
            i);
    require(g.scale[i].allFinite() && g.scale[i].minCoeff() > 0,
            "Gaussians.scale must be > 0",
            g.scale[i].transpose());
    require(
        g.opacity[i] > 0 && g.opacity[i] < 1, "Gaussians.opacity must be in (0, 1)", g.opacity[i]);
  }
  for (const Eigen::Vector3f& c : g.sh) {
    require(c.allFinite(), "Gaussians.sh must be finite", c.transpose());
  }
  for (const Provenance label : g.provenance) {
    const auto number = static_cast<size_t>(label);
    require(number < kProvenanceCount, "Gaussians.provenance must be 0 to 5", number);
  }
}

void require_rotation(const Eigen::Matrix3d& matrix, const char* rule) {
  const double off = (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm();
  require(off < 1e-6 && matrix.determinant() > 0, rule, off);
}

}  // namespace cgs
