// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/splat_selection.h"

#include <algorithm>

namespace cgs {

size_t keep_only(Gaussians& g, const std::vector<uint8_t>& keep) {
  const auto sh_count = static_cast<size_t>(g.sh_count());
  size_t kept = 0;
  for (size_t i = 0; i < g.size(); ++i) {
    if (keep[i] == 0) continue;
    g.position[kept] = g.position[i];
    g.scale[kept] = g.scale[i];
    g.rotation[kept] = g.rotation[i];
    g.opacity[kept] = g.opacity[i];
    std::copy_n(g.sh.begin() + static_cast<std::ptrdiff_t>(i * sh_count),
                sh_count,
                g.sh.begin() + static_cast<std::ptrdiff_t>(kept * sh_count));
    if (!g.provenance.empty()) g.provenance[kept] = g.provenance[i];
    if (!g.synthetic.empty()) g.synthetic[kept] = g.synthetic[i];
    ++kept;
  }
  const size_t dropped = g.size() - kept;
  g.position.resize(kept);
  g.scale.resize(kept);
  g.rotation.resize(kept);
  g.opacity.resize(kept);
  g.sh.resize(kept * sh_count);
  if (!g.provenance.empty()) g.provenance.resize(kept);
  if (!g.synthetic.empty()) g.synthetic.resize(kept);
  return dropped;
}

}  // namespace cgs
