// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/gaussians.h"

#include <algorithm>

#include "libcgs/core/error.h"

namespace cgs {

size_t synthetic_count(const Gaussians& gaussians) {
  const auto& tags = gaussians.synthetic;
  return tags.size() - static_cast<size_t>(std::count(tags.begin(), tags.end(), uint8_t{0}));
}

void append(Gaussians& g, const Gaussians& more) {
  require(more.sh_degree <= g.sh_degree,
          "Gaussians to append must not have harmonics of a higher degree",
          more.sh_degree);
  const size_t sources = g.synthetic_sources.size();
  constexpr size_t kMost = 255;
  require(sources + more.synthetic_sources.size() <= kMost,
          "Gaussians may be made up from 255 pictures at most, together",
          sources + more.synthetic_sources.size());
  const size_t before = g.size();
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  add(g.synthetic_sources, more.synthetic_sources);
  if (more.size() == 0) return;  // nothing comes that could lack labels
  const bool is_labelled = (before == 0 || !g.provenance.empty()) && !more.provenance.empty();
  if (is_labelled) add(g.provenance, more.provenance);
  if (!is_labelled) g.provenance.clear();
  if (!g.synthetic.empty() || !more.synthetic.empty()) {
    g.synthetic.resize(before, 0);
    for (const uint8_t tag : more.synthetic) {
      g.synthetic.push_back(tag > 0 ? static_cast<uint8_t>(sources + tag) : uint8_t{0});
    }
    g.synthetic.resize(before + more.size(), 0);
  }
  add(g.position, more.position);
  add(g.scale, more.scale);
  add(g.rotation, more.rotation);
  add(g.opacity, more.opacity);
  const auto own = static_cast<size_t>(g.sh_count());
  const auto theirs = static_cast<size_t>(more.sh_count());
  g.sh.resize(own * (before + more.size()), Eigen::Vector3f::Zero());
  for (size_t i = 0; i < more.size(); ++i) {
    std::copy_n(more.sh.begin() + static_cast<std::ptrdiff_t>(i * theirs),
                theirs,
                g.sh.begin() + static_cast<std::ptrdiff_t>((before + i) * own));
  }
}

Eigen::Matrix3f rotation_matrix(const Eigen::Vector4f& rotation) {
  // Divided by its largest entry first: squaring 1e-23 or 1e20 would leave the float range.
  const float largest = rotation.cwiseAbs().maxCoeff();
  if (!(largest > 0)) return Eigen::Matrix3f::Identity();
  const Eigen::Vector4f q = (rotation / largest).normalized();
  return Eigen::Quaternionf(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Eigen::Matrix3f covariance(const Eigen::Vector3f& scale, const Eigen::Vector4f& rotation) {
  const Eigen::Matrix3f M = rotation_matrix(rotation) * scale.asDiagonal();
  return M * M.transpose();  // Eq. 6 with M = R S
}

}  // namespace cgs
