// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/density_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libcgs/core/error.h"
#include "libcgs/train/training_inputs.h"

namespace cgs {

namespace {

constexpr float kSmallerBy = 1.6f;  // scales of what a split leaves

// Leaves as many additions as there is room for.
void limit_growth(const std::vector<float>& gradient,
                  size_t most,
                  std::vector<DensityChange>& changes) {
  std::vector<uint32_t> growing;
  size_t after = changes.size();
  for (size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] == DensityChange::Prune) --after;
    const bool grows = changes[i] == DensityChange::Clone || changes[i] == DensityChange::Split;
    if (grows) growing.push_back(static_cast<uint32_t>(i));
  }
  const size_t room = most - std::min(most, after);
  if (growing.size() <= room) return;
  std::stable_sort(growing.begin(), growing.end(), [&](uint32_t a, uint32_t b) {
    return gradient[a] > gradient[b];
  });
  for (size_t k = room; k < growing.size(); ++k) changes[growing[k]] = DensityChange::Keep;
}

void append_copy(const Gaussians& from, size_t i, Gaussians& to) {
  const auto count = static_cast<std::ptrdiff_t>(from.sh_count());
  const auto sh = from.sh.begin() + static_cast<std::ptrdiff_t>(i) * count;
  to.position.push_back(from.position[i]);
  to.scale.push_back(from.scale[i]);
  to.rotation.push_back(from.rotation[i]);
  to.opacity.push_back(from.opacity[i]);
  to.sh.insert(to.sh.end(), sh, sh + count);
}

// In (0, 1): the logarithm of it exists.
double uniform(uint64_t seed, size_t index, uint64_t k) {
  return (double(mixed(seed, index, k) >> 11) + 0.5) * 0x1p-53;
}

// Three numbers of the normal distribution (Box and Muller 1958).
Eigen::Vector3f normal_numbers(uint64_t seed, size_t index) {
  Eigen::Vector3f out;
  for (uint64_t k = 0; k < 3; ++k) {
    const double radius = std::sqrt(-2 * std::log(uniform(seed, index, 2 * k)));
    const double angle = 2 * std::numbers::pi * uniform(seed, index, 2 * k + 1);
    out[static_cast<Eigen::Index>(k)] = static_cast<float>(radius * std::cos(angle));
  }
  return out;
}

}  // namespace

std::vector<DensityChange> density_changes(const Gaussians& gaussians,
                                           const std::vector<float>& gradient,
                                           const DensityOptions& options) {
  require(gradient.size() == gaussians.size(),
          "density_changes: there must be a gradient per Gaussian",
          gradient.size());
  std::vector<DensityChange> out(gaussians.size(), DensityChange::Keep);
  for (size_t i = 0; i < out.size(); ++i) {
    const float widest = gaussians.scale[i].maxCoeff();
    if (gaussians.opacity[i] < options.opacity || widest > options.largest) {
      out[i] = DensityChange::Prune;
    } else if (gradient[i] >= options.gradient) {
      out[i] = widest > options.split_above ? DensityChange::Split : DensityChange::Clone;
    }
  }
  limit_growth(gradient, options.most, out);
  return out;
}

ChangedDensity changed_density(const Gaussians& gaussians,
                               const std::vector<DensityChange>& changes,
                               uint64_t seed) {
  ChangedDensity out;
  out.gaussians.sh_degree = gaussians.sh_degree;
  for (size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] == DensityChange::Prune || changes[i] == DensityChange::Split) continue;
    append_copy(gaussians, i, out.gaussians);
    out.came_from.push_back(static_cast<uint32_t>(i));
  }
  for (size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] == DensityChange::Clone) append_copy(gaussians, i, out.gaussians);
  }
  for (size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] != DensityChange::Split) continue;
    const Eigen::Matrix3f R = rotation_matrix(gaussians.rotation[i]);
    for (size_t child = 0; child < 2; ++child) {
      append_copy(gaussians, i, out.gaussians);
      const Eigen::Vector3f& scale = gaussians.scale[i];
      out.gaussians.position.back() += R * scale.cwiseProduct(normal_numbers(seed, 2 * i + child));
      out.gaussians.scale.back() = scale / kSmallerBy;
    }
  }
  out.came_from.resize(out.gaussians.size(), ChangedDensity::kNone);
  return out;
}

}  // namespace cgs
