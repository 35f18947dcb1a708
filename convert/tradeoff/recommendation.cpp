// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/recommendation.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "convert/text/length.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kEqualError = 0.02;  // relative
constexpr double kEqualPsnr = 0.05;   // [dB]
constexpr double kDecibelsOfTwo = 6;

constexpr std::array<std::pair<const char*, Quantity>, 5> kQuantities = {
    {{"error<", Quantity::Error},
     {"time<", Quantity::Time},
     {"cpu<", Quantity::Cpu},
     {"size<", Quantity::Size},
     {"psnr>", Quantity::Psnr}}};

// A positive number and one of the units, each with what it stands for; the first may be left out.
double amount(const std::string& text,
              const std::vector<std::pair<std::string, double>>& units,
              const char* example) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  if (error == std::errc() && value > 0 && std::isfinite(value)) {
    if (unit.empty()) return value * units.front().second;
    for (const auto& [name, factor] : units) {
      if (unit == name) return value * factor;
    }
  }
  throw InvalidInput("--want: '" + text + "' is not a positive amount such as " + example);
}

double limit_of(Quantity quantity, const std::string& text, const Frame& frame) {
  switch (quantity) {
    case Quantity::Error:
      return parse_length(text, frame, "--want") * frame.scale;
    case Quantity::Size:
      return static_cast<double>(parse_file_size(text, "--want"));
    case Quantity::Psnr:
      return amount(text, {{"dB", 1}}, "24dB");
    default:
      return parse_seconds(text, "--want");
  }
}

double value_of(const TradeoffFigures& figures, Quantity quantity) {
  switch (quantity) {
    case Quantity::Error:
      return figures.error;
    case Quantity::Time:
      return figures.wall;
    case Quantity::Cpu:
      return figures.cpu;
    case Quantity::Size:
      return figures.bytes;
    default:
      return figures.psnr;
  }
}

// How far a figure is beyond what is wanted: at most 1 = met; NaN = not measured.
double excess(const TradeoffFigures& figures, const Want& want, const TradeoffNoise& noise) {
  const double value = value_of(figures, want.quantity);
  switch (want.quantity) {
    case Quantity::Error:
      return figures.is_ruler ? kNotMeasured : value / want.limit;
    case Quantity::Psnr:
      return std::exp2((want.limit - value) / kDecibelsOfTwo);
    case Quantity::Time:
      return value * (1 + noise.wall) / want.limit;
    case Quantity::Cpu:
      return value * (1 + noise.cpu) / want.limit;
    default:
      return value / want.limit;
  }
}

double worst_excess(const TradeoffFigures& figures,
                    const std::vector<Want>& wants,
                    const TradeoffNoise& noise) {
  double worst = 0;
  for (const Want& want : wants) {
    const double ratio = excess(figures, want, noise);
    if (std::isnan(ratio)) return ratio;
    worst = std::max(worst, ratio);
  }
  return worst;
}

// What is as good as the best: a figure to be small, of which `limit` tells what counts as equal to
// the smallest. Where it was measured for some, the others drop out.
template <typename Figure, typename Limit>
void keep_best(std::vector<size_t>& candidates, const Figure& figure, const Limit& limit) {
  double least = std::numeric_limits<double>::infinity();
  for (const size_t i : candidates) {
    if (figure(i) < least) least = figure(i);
  }
  if (std::isinf(least)) return;
  std::erase_if(candidates, [&](size_t i) { return !(figure(i) <= limit(least)); });
}

bool is_better(const TradeoffFigures& a, const TradeoffFigures& b) {
  const bool sharper = a.error * (1 + kEqualError) < b.error;
  const bool prettier = a.psnr > b.psnr + kEqualPsnr;
  const bool coarser = a.error > b.error * (1 + kEqualError);
  const bool uglier = a.psnr < b.psnr - kEqualPsnr;
  return (sharper && !uglier) || (prettier && !coarser);
}

std::optional<size_t> cheapest_better(const std::vector<TradeoffFigures>& figures,
                                      size_t than,
                                      const TradeoffNoise& noise) {
  std::optional<size_t> out;
  for (size_t i = 0; i < figures.size(); ++i) {
    const bool costs_more = figures[i].cpu > figures[than].cpu * (1 + noise.cpu);
    if (!costs_more || !is_better(figures[i], figures[than])) continue;
    if (!out || figures[i].cpu < figures[*out].cpu) out = i;
  }
  return out;
}

// The best of the candidates. \pre there are some
size_t choose(const std::vector<TradeoffFigures>& figures,
              std::vector<size_t> candidates,
              bool cheapest_first,
              const TradeoffNoise& noise) {
  const auto cpu = [&](size_t i) { return figures[i].cpu; };
  const auto error = [&](size_t i) { return figures[i].error; };
  const auto loss = [&](size_t i) { return -figures[i].psnr; };
  const auto keep_cheap = [&] {
    keep_best(candidates, cpu, [&](double least) { return least * (1 + noise.cpu); });
  };
  if (cheapest_first) keep_cheap();
  keep_best(candidates, error, [](double least) { return least * (1 + kEqualError); });
  keep_best(candidates, loss, [](double least) { return least + kEqualPsnr; });
  return *std::min_element(
      candidates.begin(), candidates.end(), [&](size_t a, size_t b) { return cpu(a) < cpu(b); });
}

}  // namespace

Want parse_want(const std::string& text, const Frame& frame) {
  for (const auto& [beginning, quantity] : kQuantities) {
    const std::string start = beginning;
    if (text.compare(0, start.size(), start) != 0) continue;
    return {quantity, limit_of(quantity, text.substr(start.size()), frame), text};
  }
  throw InvalidInput("--want '" + text +
                     "' is not understood; write error<2mm, time<3min, cpu<90s, size<1MB or "
                     "psnr>24dB");
}

Recommendation recommend(const std::vector<TradeoffFigures>& figures,
                         const std::vector<Want>& wants,
                         const TradeoffNoise& noise) {
  Recommendation out;
  std::vector<double> ratios;
  double least = std::numeric_limits<double>::infinity();
  for (const TradeoffFigures& f : figures) {
    ratios.push_back(std::isfinite(f.cpu) ? worst_excess(f, wants, noise) : kNotMeasured);
    if (ratios.back() < least) least = ratios.back();
  }
  if (!std::isfinite(least)) return out;
  // Those that meet the wants, or else the nearest, among which differences that are none do not
  // decide either.
  const double most = least <= 1 ? 1 : least * (1 + kEqualError);
  std::vector<size_t> candidates;
  for (size_t i = 0; i < figures.size(); ++i) {
    if (ratios[i] <= most) candidates.push_back(i);
  }
  const bool accuracy = std::any_of(wants.begin(), wants.end(), [](const Want& want) {
    return want.quantity == Quantity::Error || want.quantity == Quantity::Psnr;
  });
  out.best = choose(figures, candidates, accuracy, noise);
  for (const Want& want : wants) {
    if (!(excess(figures[*out.best], want, noise) <= 1)) out.unmet.push_back(want.text);
  }
  out.next_better = cheapest_better(figures, *out.best, noise);
  return out;
}

}  // namespace cgs
