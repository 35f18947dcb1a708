// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/block_evidence.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace cgs {

namespace {

constexpr size_t kPartSide = 4;

size_t part_x(size_t part) { return part / 2 * kPartSide; }
// Stays at the largest number.
void count_up(uint16_t& count) { count = static_cast<uint16_t>(count + (count < UINT16_MAX)); }

size_t part_y(size_t part) { return part % 2 * kPartSide; }

}  // namespace

BlockEvidence::BlockEvidence(unsigned touched)
    : touched_(touched),
      free_weight_(touched != 0 ? std::make_unique<std::array<float, kBlockVoxels>>() : nullptr) {}

BlockEvidence::Place::Place(const openvdb::Coord& origin, double voxel) {
  for (int i = 0; i < kBlockSide; ++i) {
    const auto at = static_cast<size_t>(i);
    x[at] = static_cast<float>(voxel * (origin.x() + i));
    y[at] = static_cast<float>(voxel * (origin.y() + i));
    z[at] = static_cast<float>(voxel * (origin.z() + i));
  }
}

Eigen::AlignedBox3f BlockEvidence::Place::box() const {
  return {Eigen::Vector3f(x.front(), y.front(), z.front()),
          Eigen::Vector3f(x.back(), y.back(), z.back())};
}

Eigen::AlignedBox3f BlockEvidence::Place::part_box(size_t part) const {
  const size_t i = part_x(part);
  const size_t j = part_y(part);
  return {Eigen::Vector3f(x[i], y[j], z.front()),
          Eigen::Vector3f(x[i + kPartSide - 1], y[j + kPartSide - 1], z.back())};
}

void BlockEvidence::add(const Place& place, const DepthField& field, const TsdfView& view) {
  for (size_t part = 0; part < kParts; ++part) {
    const DepthField::Look look = field.look(place.part_box(part));
    if (look.sight == Sight::Nothing) continue;
    const bool may_hide_only = !look.may_touch && !look.may_free;
    const bool is_touched = (touched_ >> part & 1) != 0;
    for (size_t i = part_x(part); i < part_x(part) + kPartSide; ++i) {
      for (size_t j = part_y(part); j < part_y(part) + kPartSide; ++j) {
        const size_t row = i * kBlockSide + j;
        // What is free stays so, whatever hides it elsewhere.
        const int told = may_hide_only ? free_[row] | hidden_[row] : is_touched ? 0 : free_[row];
        if (told == 0xff) continue;
        if (look.sight == Sight::Hidden) {
          hidden_[row] = 0xff;
        } else if (look.sight == Sight::Free && !is_touched) {
          free_[row] = 0xff;
        } else {
          add_row(row, field.row(place.x[i], place.y[j], place.z), view);
        }
      }
    }
  }
}

void BlockEvidence::add_row(size_t row, const SightingRow& sightings, const TsdfView& view) {
  hidden_[row] = static_cast<uint8_t>(hidden_[row] | sightings.hidden);
  free_[row] = static_cast<uint8_t>(free_[row] | sightings.free);
  if (!has_band()) return;
  const size_t first = row * kBlockSide;
  for (unsigned left = sightings.free; left != 0; left &= left - 1) {
    const auto lane = size_t(std::countr_zero(left));
    (*free_weight_)[first + lane] += sightings.weight[lane];
  }
  if (sightings.band != 0) add_band(row, sightings, view);
}

void BlockEvidence::add_band(size_t at, const SightingRow& row, const TsdfView& view) {
  if (!sums_) sums_ = std::make_unique<Sums>();
  Sums& s = *sums_;
  const bool has_color = !view.color.empty();
  if (row.has_sigma && !sigma_) sigma_ = std::make_unique<SigmaSums>();
  if (has_color && !color_) color_ = std::make_unique<ColorSums>();
  const size_t first = at * kBlockSide;
  const unsigned measured = row.band & ~row.assumed;
  for (unsigned left = measured & ~unsigned{measured_[at]}; left != 0; left &= left - 1) {
    forget_band(first + size_t(std::countr_zero(left)));
  }
  measured_[at] = static_cast<uint8_t>(measured_[at] | measured);
  const unsigned taken = measured | (row.band & ~unsigned{measured_[at]});
  for (size_t lane = 0; lane < kBlockSide; ++lane) {  // others than taken add 0
    const size_t n = first + lane;
    const auto w = double(row.weight_in_band[lane]) * double(taken >> lane & 1);
    const auto d = double(row.distance_in_band[lane]);
    s.weight[n] += w;
    s.distance[n] += w * d;
    if (!row.has_sigma) continue;
    const auto sigma = double(row.sigma[lane]);
    sigma_->spread[n] += w * d * d;
    sigma_->variance[n] += w * w * sigma * sigma;
  }
  for (unsigned left = taken; left != 0; left &= left - 1) {
    const auto lane = size_t(std::countr_zero(left));
    const size_t n = first + lane;
    const int x = row.x[lane];
    const int y = row.y[lane];
    const bool is_guess = !view.guessed.empty() && view.guessed(x, y) != 0;
    count_up(s.count[n]);
    if (!view.is_virtual && !is_guess) count_up(s.known[n]);
    if (is_guess) s.is_guessed[n] = 1;
    if (!row.has_sigma || !(row.sigma[lane] > 0)) s.lacks_sigma[n] = 1;
    if (!has_color) continue;
    const auto w = double(row.weight_in_band[lane]);
    const Eigen::Vector3f& c = view.color(x, y);
    color_->weight[n] += w;
    for (size_t k = 0; k < 3; ++k) color_->color[k][n] += w * double(c[Eigen::Index(k)]);
  }
}

void BlockEvidence::forget_band(size_t n) {
  Sums& s = *sums_;
  s.weight[n] = s.distance[n] = 0;
  s.count[n] = s.known[n] = 0;
  s.is_guessed[n] = s.lacks_sigma[n] = 0;
  if (sigma_) sigma_->spread[n] = sigma_->variance[n] = 0;
  if (!color_) return;
  color_->weight[n] = 0;
  for (auto& channel : color_->color) channel[n] = 0;
}

bool BlockEvidence::is_settled() const {
  return !has_band() &&
         std::all_of(free_.begin(), free_.end(), [](uint8_t row) { return row == 0xff; });
}

void BlockEvidence::add_whole(Sight sight) {
  if (sight == Sight::Hidden) hidden_.fill(0xff);
  if (sight == Sight::Free) free_.fill(0xff);
}

BlockEvidence::Voxel BlockEvidence::operator[](size_t n) const {
  Voxel out;
  out.free = (free_[n / kBlockSide] >> n % kBlockSide & 1) != 0;
  out.hidden = (hidden_[n / kBlockSide] >> n % kBlockSide & 1) != 0;
  if (has_band()) out.free_weight = (*free_weight_)[n];
  if (!sums_) return out;
  out.weight = sums_->weight[n];
  out.distance = sums_->distance[n];
  out.count = sums_->count[n];
  out.known = sums_->known[n];
  out.is_guessed = sums_->is_guessed[n] != 0;
  out.has_sigma = sums_->lacks_sigma[n] == 0;
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

void BlockEvidence::clear() {
  free_ = {};
  hidden_ = {};
  measured_ = {};
  if (free_weight_) *free_weight_ = {};
  if (sums_) *sums_ = {};
  if (sigma_) *sigma_ = {};
  if (color_) *color_ = {};
}

float BlockEvidence::Voxel::support() const {
  return static_cast<float>(std::max(known, is_guessed ? 1 : 0));
}

double BlockEvidence::Voxel::sigma() const {
  const double promised = variance / (weight * weight);
  if (count < 2) return std::sqrt(promised);
  const double between = std::max(0.0, spread / weight - mean() * mean());
  return std::sqrt(std::max(promised, between / (count - 1)));
}

}  // namespace cgs
