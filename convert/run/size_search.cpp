// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/size_search.h"

#include <algorithm>
#include <cmath>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kMostNarrowings = 8;
constexpr double kFull = 0.97;      // of the limit
constexpr double kNarrow = 1.02;    // from fine to coarse
constexpr double kAimedAt = 0.985;  // of the limit: a bit below, as sizes scatter

// Where a power law through both forms reaches a size, kept away from the ends of the interval.
double between(const TriedSize& fine, const TriedSize& coarse, double bytes) {
  const double width = std::log(coarse.detail / fine.detail);
  const double fall = std::log(double(fine.bytes) / double(coarse.bytes));
  constexpr double kNearest = 0.1;  // to an end
  const double share =
      fall > 0 ? std::log(double(fine.bytes) / bytes) / fall : 0.5;  // a size that does not fall
  return fine.detail * std::exp(width * std::clamp(share, kNearest, 1 - kNearest));
}

// The next coarser detail to try. The last ones before the coarsest are the same for every limit:
// what is said to be the smallest size is then found for that limit, too.
double next_detail(double detail, double step, double coarsest) {
  const double wished = detail * step;
  constexpr int kLast = 4;  // steps of sqrt(2)
  for (int k = 0; k < kLast; ++k) {
    const double last = coarsest * std::pow(2, 0.5 * (k - kLast));
    if (k == 0 && wished < last) return wished;
    if (last > detail) return last;
  }
  return coarsest;
}

}  // namespace

size_t SizeSearch::smallest() const {
  size_t least = tried.front().bytes;
  for (const TriedSize& form : tried) least = std::min(least, form.bytes);
  return least;
}

SizeSearch finest_within(size_t limit,
                         double finest,
                         double coarsest,
                         const std::function<size_t(double)>& bytes_at) {
  require(finest > 0 && finest <= coarsest && std::isfinite(coarsest),
          "finest_within needs 0 < finest <= coarsest, finest",
          finest);
  SizeSearch out;
  const auto at = [&](double detail) {
    return out.tried.emplace_back(TriedSize{detail, bytes_at(detail)});
  };
  const auto fits = [&](const TriedSize& form) { return form.bytes <= limit; };
  const double aim = kAimedAt * double(limit);
  TriedSize fine = at(finest);
  TriedSize coarse = fine;
  while (!fits(coarse) && coarse.detail < coarsest) {
    fine = coarse;
    // Sizes fall at least as the length; twice that far, as the interval is narrowed down later.
    const double step = std::clamp(2 * double(fine.bytes) / std::max(1.0, aim), 1.5, 4.0);
    coarse = at(next_detail(fine.detail, step, coarsest));
  }
  if (!fits(coarse)) return out;
  for (size_t k = 0; k < kMostNarrowings; ++k) {
    const bool is_narrow = coarse.detail <= fine.detail * kNarrow;
    if (is_narrow || double(coarse.bytes) >= kFull * double(limit)) break;
    const TriedSize next = at(between(fine, coarse, aim));
    (fits(next) ? coarse : fine) = next;
  }
  out.detail = coarse.detail;
  return out;
}

}  // namespace cgs
