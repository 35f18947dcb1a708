// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr double kNearlyAll = 0.995;  // of what a figure rests on; the rest rounds to nothing

std::string unit_text(const FigureUnit& unit, int dimension) {
  return dimension == 1 ? unit.name : unit.name + "^" + std::to_string(dimension);
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

}  // namespace

std::string provenance_key(Provenance label) {
  std::string key(provenance_name(label));
  std::replace(key.begin(), key.end(), ' ', '_');
  return key;
}

FigureUnit figure_unit(const Frame& frame, const std::string& wanted) {
  if (!frame.has_metric_scale()) {
    if (!wanted.empty()) {
      throw InvalidInput(
          "--unit " + wanted +
          ": nobody said how long a unit of this file is; say it with --assume-unit");
    }
    return {"units", frame.scale, 0};
  }
  const std::string name = wanted.empty() ? "m" : wanted;
  return {name,
          frame.scale * frame.metres_per_unit / metres_in(name, "--unit"),
          frame.metres_sigma / frame.metres_per_unit};
}

double figure_value(const MeasuredValue& value, const FigureUnit& unit) {
  return value.value * std::pow(unit.length, value.dimension);
}

double figure_sigma(const MeasuredValue& value, const FigureUnit& unit) {
  // A scale that is off by a share is off by d times that in a figure of d dimensions.
  return std::hypot(value.sigma * std::pow(unit.length, value.dimension),
                    value.dimension * figure_value(value, unit) * unit.relative_sigma);
}

nlohmann::ordered_json figure_json(const MeasuredValue& value,
                                   const FigureUnit& unit,
                                   bool states_provenance) {
  const double sigma = figure_sigma(value, unit);
  nlohmann::ordered_json out = {{"value", figure_value(value, unit)},
                                {"sigma", nullptr},
                                {"unit", unit_text(unit, value.dimension)}};
  if (std::isfinite(sigma)) out["sigma"] = sigma;
  for (const Provenance label : kProvenanceOrder) {
    nlohmann::ordered_json& part = out[provenance_key(label)];
    if (!states_provenance) continue;
    part =
        value.by_provenance.at(static_cast<size_t>(label)) * std::pow(unit.length, value.dimension);
  }
  out["sigma_share"] = value.stated;
  return out;
}

std::string figure_text(const MeasuredValue& value,
                        const FigureUnit& unit,
                        bool states_provenance) {
  const double sigma = figure_sigma(value, unit);
  std::string out = number(figure_value(value, unit));
  if (std::isfinite(sigma)) out += " ± " + number(sigma);
  out += ' ' + unit_text(unit, value.dimension);
  if (!std::isfinite(sigma)) {
    out += " (no sigma stated)";
  } else if (value.stated < kNearlyAll) {
    out += " (± covers " + number(std::round(100 * value.stated)) + " %)";
  }
  if (!states_provenance) return out;
  std::string parts;
  for (const Provenance label : kProvenanceOrder) {
    const double part = value.by_provenance.at(static_cast<size_t>(label));
    if (part == 0) continue;
    parts += (parts.empty() ? "" : ", ") + std::string(provenance_name(label)) + ' ' +
             number(part * std::pow(unit.length, value.dimension));
  }
  return parts.empty() ? out : out + "  (" + parts + ")";
}

}  // namespace cgs
