// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "libcgs/core/frame.h"

namespace cgs {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// What a setting costs and brings; NaN = not measured.
struct TradeoffFigures {
  double cpu = kNotMeasured;    ///< Processor time of the whole run [s].
  double wall = kNotMeasured;   ///< [s]
  double error = kNotMeasured;  ///< Of the surface [scene units].
  double psnr = kNotMeasured;   ///< On held-out views [dB].
  double bytes = kNotMeasured;  ///< Of the web asset.
  /// Errors are measured from its surface. Its own error, that of asset.glb alone, is the least,
  /// but meets no want.
  bool is_ruler = false;
};

/// How far figures of repeated runs differ, relative.
struct TradeoffNoise {
  double cpu = 0;
  double wall = 0;
};

enum class Quantity { Error, Time, Cpu, Size, Psnr };

/// A need: "error<2mm", "time<3min", "cpu<90s", "size<1MB", "psnr>24dB".
struct Want {
  Quantity quantity = Quantity::Error;
  double limit = 0;  ///< In the unit of TradeoffFigures.
  std::string text;  ///< As typed.
};

/// \throws InvalidInput that says what is allowed; for a unit of length in a scene without scale
Want parse_want(const std::string& text, const Frame& frame);

/// What to use. Indices are those of the figures.
struct Recommendation {
  std::optional<size_t> best;         ///< Empty if nothing was measured that the wants speak of.
  std::vector<std::string> unmet;     ///< Wants that `best` misses; then it is the nearest.
  std::optional<size_t> next_better;  ///< The cheapest that is better and costs more.
};

/// Chooses a setting that meets all wants.
///
/// With a want of error or PSNR the cheapest one, else the one with the least error, then the
/// highest PSNR, then the cheapest. Differences that are none do not decide: costs within the noise
/// of repeated runs, errors within 2 %, PSNR within 0.05 dB. A limit of time has to hold with the
/// noise added. If no setting meets all wants, those count as meeting them whose worst ratio of
/// figure to limit (for PSNR: decibels missing, 6 of them a factor of 2) is the least or within 2 %
/// of it.
Recommendation recommend(const std::vector<TradeoffFigures>& figures,
                         const std::vector<Want>& wants,
                         const TradeoffNoise& noise);

}  // namespace cgs
