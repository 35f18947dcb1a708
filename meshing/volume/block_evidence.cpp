// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/block_evidence.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "libcgs/core/lanes.h"

namespace cgs {

namespace {

using Four = double __attribute__((vector_size(sizeof(double) * 4)));
constexpr size_t kHalf = 4;

Four as_doubles(const float* four) { return _mm256_cvtps_pd(_mm_loadu_ps(four)); }

void increase(double* four, Four by) { store(load<Four>(four) + by, four); }

Ints lanes_of(unsigned bits_set) {
  return ((Ints{} + static_cast<int>(bits_set)) & Ints{1, 2, 4, 8, 16, 32, 64, 128}) != 0;
}

// Adds 1 where a bit is set; stays at the largest number.
void count_up(uint16_t* counts, unsigned bits_set) {
  const auto bit = _mm_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128);
  const auto is_set = _mm_and_si128(_mm_set1_epi16(static_cast<short>(bits_set)), bit);
  const auto one = _mm_min_epi16(is_set, _mm_set1_epi16(1));
  store(_mm_adds_epu16(load<__m128i>(counts), one), counts);
}

// A bit per point.
unsigned points_of(DepthEvidence kind, const Observations& seen, const EvidenceMap& evidence) {
  unsigned out = 0;
  for (size_t lane = 0; lane < kLanes; ++lane) {
    if (evidence.data[size_t(seen.pixel[lane])] == kind) out |= 1U << lane;
  }
  return out;
}

// Positions of voxels, or of anything eight of which make up a cube: bits of x, y, z from each of
// a part, a group and a voxel in it.
size_t bit_x(size_t of_eight) { return of_eight >> 2 & 1; }
size_t bit_y(size_t of_eight) { return of_eight >> 1 & 1; }
size_t bit_z(size_t of_eight) { return of_eight & 1; }

constexpr size_t kGroupsPerPart = 8;

// The position in the order of groups of the voxel at position n of an OpenVDB leaf.
constexpr std::array<uint16_t, kBlockVoxels> order_of_groups() {
  std::array<uint16_t, kBlockVoxels> out{};
  for (size_t n = 0; n < out.size(); ++n) {
    size_t at = 0;
    for (size_t bit = 0; bit < 3; ++bit) {
      at |= ((n >> (6 + bit) & 1) << 2 | (n >> (3 + bit) & 1) << 1 | (n >> bit & 1)) << 3 * bit;
    }
    out[n] = static_cast<uint16_t>(at);
  }
  return out;
}
constexpr std::array<uint16_t, kBlockVoxels> kOrderOfGroups = order_of_groups();

}  // namespace

BlockEvidence::BlockEvidence(unsigned touched)
    : touched_(touched),
      free_weight_(touched != 0 ? std::make_unique<std::array<float, kBlockVoxels>>() : nullptr) {}

BlockEvidence::Place::Place(const openvdb::Coord& origin, double voxel_size)
    : voxel(static_cast<float>(voxel_size)) {
  for (int i = 0; i < kBlockSide; ++i) {
    const auto at = static_cast<size_t>(i);
    x[at] = static_cast<float>(voxel_size * (origin.x() + i));
    y[at] = static_cast<float>(voxel_size * (origin.y() + i));
    z[at] = static_cast<float>(voxel_size * (origin.z() + i));
  }
}

EightBoxes BlockEvidence::Place::part_boxes() const {
  EightBoxes out;
  const auto middle = [](const auto& at, size_t upper) {
    return 0.5f * (at[4 * upper] + at[4 * upper + 3]);
  };
  for (size_t part = 0; part < kParts; ++part) {
    out.x[part] = middle(x, bit_x(part));
    out.y[part] = middle(y, bit_y(part));
    out.z[part] = middle(z, bit_z(part));
  }
  out.half.setConstant(1.5f * voxel);
  return out;
}

EightPoints BlockEvidence::Place::group(size_t g) const {
  const size_t part = g / kGroupsPerPart;
  const size_t i = 4 * bit_x(part) + 2 * bit_x(g);
  const size_t j = 4 * bit_y(part) + 2 * bit_y(g);
  const size_t k = 4 * bit_z(part) + 2 * bit_z(g);
  EightPoints out;
  store(Floats{x[i], x[i], x[i], x[i], x[i + 1], x[i + 1], x[i + 1], x[i + 1]}, out.x.data());
  store(Floats{y[j], y[j], y[j + 1], y[j + 1], y[j], y[j], y[j + 1], y[j + 1]}, out.y.data());
  store(Floats{z[k], z[k + 1], z[k], z[k + 1], z[k], z[k + 1], z[k], z[k + 1]}, out.z.data());
  return out;
}

void BlockEvidence::add(const Place& place, const DepthField& field, const TsdfView& view) {
  constexpr size_t kMiddle = kBlockSide / 2;
  const Eigen::Vector3f middle(place.x[kMiddle], place.y[kMiddle], place.z[kMiddle]);
  looks_ = (middle - view.camera.center().cast<float>()).stableNormalized();
  const Looks looks = field.look(place.part_boxes());
  for (size_t part = 0; part < kParts; ++part) {
    const Look look = looks[part];
    if (look.sight == Sight::Nothing) continue;
    const bool may_hide_only = !look.may_touch && !look.may_free;
    const bool is_touched = (touched_ >> part & 1) != 0;
    std::array<size_t, kGroupsPerPart> asked;
    std::array<EightPoints, kGroupsPerPart> points;
    size_t count = 0;
    for (size_t g = part * kGroupsPerPart; g < (part + 1) * kGroupsPerPart; ++g) {
      // What is free stays so, whatever hides it elsewhere.
      const int told = may_hide_only ? free_[g] | hidden_[g] : is_touched ? 0 : free_[g];
      if (told == 0xff) continue;
      if (look.sight == Sight::Hidden) {
        hidden_[g] = 0xff;
      } else if (look.sight == Sight::Free && !is_touched) {
        free_[g] = 0xff;
      } else {
        asked[count] = g;
        points[count++] = place.group(g);
      }
    }
    std::array<Observations, kGroupsPerPart> observations;
    field.at(std::span(points).first(count), observations.data());
    for (size_t k = 0; k < count; ++k) add_group(asked[k], observations[k], view);
  }
}

void BlockEvidence::add_group(size_t group,
                              const Observations& observations,
                              const TsdfView& view) {
  hidden_[group] = static_cast<uint8_t>(hidden_[group] | observations.hidden);
  free_[group] = static_cast<uint8_t>(free_[group] | observations.free);
  if (!has_band()) return;
  if (observations.free != 0) {
    float* const sum = &(*free_weight_)[group * kLanes];
    store(load<Floats>(sum) + load<Floats>(observations.free_weight.data()), sum);
  }
  if (observations.band != 0) add_band(group, observations, view);
}

void BlockEvidence::add_band(size_t group, const Observations& seen, const TsdfView& view) {
  if (!sums_) sums_ = std::make_unique<Sums>();
  Sums& s = *sums_;
  const size_t first = group * kLanes;
  const unsigned measured = seen.band & ~seen.assumed;
  for (unsigned left = measured & ~unsigned{measured_[group]}; left != 0; left &= left - 1) {
    forget_band(first + size_t(std::countr_zero(left)));
  }
  measured_[group] = static_cast<uint8_t>(measured_[group] | measured);
  const unsigned taken = measured | (seen.band & ~unsigned{measured_[group]});
  alignas(32) std::array<float, kLanes> weight;  // others than taken add 0
  const auto in_band = load<Floats>(seen.weight_in_band.data());
  store(select(lanes_of(taken), in_band, Floats{}), weight.data());
  unsigned has_sigma = 0;
  if (seen.has_sigma) {
    if (!sigma_) sigma_ = std::make_unique<SigmaSums>();
    has_sigma = bits(load<Floats>(seen.sigma.data()) > 0.0f);
  }
  for (size_t half = 0; half < kLanes; half += kHalf) {
    const size_t n = first + half;
    const Four w = as_doubles(&weight[half]);
    const Four d = as_doubles(&seen.distance_in_band[half]);
    increase(&s.weight[n], w);
    increase(&s.distance[n], w * d);
    if (!seen.has_sigma) continue;
    const Four sigma = as_doubles(&seen.sigma[half]);
    increase(&sigma_->spread[n], w * d * d);
    increase(&sigma_->variance[n], w * w * sigma * sigma);
  }
  const auto taken_of = [&](DepthEvidence kind) {
    return view.evidence.empty() ? 0 : taken & points_of(kind, seen, view.evidence);
  };
  const unsigned adjoining = taken_of(DepthEvidence::Adjoining);
  const unsigned estimated = taken_of(DepthEvidence::Estimated);
  count_up(&s.count[first], taken);
  if (!view.is_virtual) {
    // The two sides of a thin plate lie in one band, and are no place that two photographs show.
    constexpr float kOpposite = -0.5f;
    if (first_looks_.isZero(0)) first_looks_ = looks_;
    const bool is_behind = looks_.dot(first_looks_) < kOpposite;
    count_up(&(is_behind ? s.known_behind : s.known)[first], taken & ~adjoining & ~estimated);
  }
  s.is_adjoining[group] = static_cast<uint8_t>(s.is_adjoining[group] | adjoining);
  s.is_estimated[group] = static_cast<uint8_t>(s.is_estimated[group] | estimated);
  s.lacks_sigma[group] = static_cast<uint8_t>(s.lacks_sigma[group] | (taken & ~has_sigma));
  if (!view.color.empty()) add_color(first, taken, seen, view.color);
}

void BlockEvidence::add_color(size_t first,
                              unsigned taken,
                              const Observations& seen,
                              const ColorImage& image) {
  if (!color_) color_ = std::make_unique<ColorSums>();
  for (unsigned left = taken; left != 0; left &= left - 1) {
    const auto lane = size_t(std::countr_zero(left));
    const size_t n = first + lane;
    const auto w = double(seen.weight_in_band[lane]);
    const Eigen::Vector3f& c = image.data[size_t(seen.pixel[lane])];
    color_->weight[n] += w;
    for (size_t k = 0; k < 3; ++k) color_->color[k][n] += w * double(c[Eigen::Index(k)]);
  }
}

void BlockEvidence::forget_band(size_t n) {
  Sums& s = *sums_;
  s.weight[n] = s.distance[n] = 0;
  s.count[n] = s.known[n] = s.known_behind[n] = 0;
  const auto others = static_cast<uint8_t>(~(1U << n % kLanes));
  s.is_adjoining[n / kLanes] &= others;
  s.is_estimated[n / kLanes] &= others;
  s.lacks_sigma[n / kLanes] &= others;
  if (sigma_) sigma_->spread[n] = sigma_->variance[n] = 0;
  if (!color_) return;
  color_->weight[n] = 0;
  for (auto& channel : color_->color) channel[n] = 0;
}

bool BlockEvidence::is_settled() const {
  return !has_band() &&
         std::all_of(free_.begin(), free_.end(), [](uint8_t group) { return group == 0xff; });
}

void BlockEvidence::add_whole(Sight sight) {
  if (sight == Sight::Hidden) hidden_.fill(0xff);
  if (sight == Sight::Free) free_.fill(0xff);
}

BlockEvidence::Voxel BlockEvidence::operator[](size_t in_leaf) const {
  const size_t n = kOrderOfGroups[in_leaf];
  Voxel out;
  const auto is_set = [&](const auto& bits_of) {
    return (bits_of[n / kLanes] >> n % kLanes & 1) != 0;
  };
  out.free = is_set(free_);
  out.hidden = is_set(hidden_);
  if (has_band()) out.free_weight = (*free_weight_)[n];
  if (!sums_) return out;
  out.weight = sums_->weight[n];
  out.distance = sums_->distance[n];
  out.count = sums_->count[n];
  out.known = std::max(sums_->known[n], sums_->known_behind[n]);
  out.is_adjoining = is_set(sums_->is_adjoining);
  out.is_estimated = is_set(sums_->is_estimated);
  out.has_sigma = !is_set(sums_->lacks_sigma);
  if (sigma_) {
    out.spread = sigma_->spread[n];
    out.variance = sigma_->variance[n];
  }
  if (color_) {
    out.color_weight = color_->weight[n];
    for (size_t k = 0; k < 3; ++k) out.color[Eigen::Index(k)] = color_->color[k][n];
  }
  return out;
}

float BlockEvidence::Voxel::support() const {
  return static_cast<float>(std::max(known, is_adjoining ? 1 : 0));
}

double BlockEvidence::Voxel::sigma(double common) const {
  const double alone = variance / (weight * weight);  // were they off independently
  if (count < 2) return std::sqrt(alone);
  const double shared = common * common;
  const double promised = (1 - shared) * alone + shared * count * alone;
  const double between = std::max(0.0, spread / weight - mean() * mean());
  return std::sqrt(std::max(promised, between / (count - 1)));
}

}  // namespace cgs
