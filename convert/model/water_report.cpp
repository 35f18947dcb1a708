// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/water_report.h"

#include <array>
#include <cstdio>
#include <sstream>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/figures.h"
#include "convert/text/html.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

Json rgb(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// "0.4501 ± 0.0004, 0.2003 ± 0.0003, 0.1201 ± 0.0003"
std::string three_with_sigma(const Eigen::Vector3d& value, const Eigen::Vector3d& sigma) {
  std::array<char, 160> text{};
  std::snprintf(text.data(),
                text.size(),
                "%.4f ± %.4f, %.4f ± %.4f, %.4f ± %.4f",
                value.x(),
                sigma.x(),
                value.y(),
                sigma.y(),
                value.z(),
                sigma.z());
  return text.data();
}

// How much less light of a lamp gets to what is farther away; "" without one.
std::string lamp_words(const Json& water) {
  if (!water.contains("lamp_range")) return "";
  return ", times (" + number(water["lamp_range"], "%.2f") + " " +
         escaped(water["unit"].get<std::string>()) +
         " / range)<sup>2</sup>, as a lamp at the camera lights it";
}

std::string words_without_water() {
  std::array<char, 160> text{};
  std::snprintf(text.data(),
                text.size(),
                "no water was found: it is not certain that %.0f %% of the light is lost over the "
                "median range, and nothing is taken out of the photographs",
                100 * kLeastLoss);
  return text.data();
}

}  // namespace

const std::map<std::string, Medium>& media() {
  static const std::map<std::string, Medium> kNames = {{"none", Medium::None},
                                                       {"water", Medium::Water}};
  return kNames;
}

Json water_json(const Water& water, const Frame& frame) {
  const FigureUnit unit = figure_unit(frame, "");
  const Eigen::Vector3d attenuation = water.attenuation / unit.length;
  const Eigen::Vector3d attenuation_sigma = water.attenuation_sigma / unit.length;
  const Eigen::Vector3d backscatter = water.backscatter / unit.length;
  const Eigen::Vector3d backscatter_sigma = water.backscatter_sigma / unit.length;
  Json out = {{"words",
               "water was taken out of the photographs; of red, green, blue light: attenuation " +
                   three_with_sigma(attenuation, attenuation_sigma) + " and backscatter " +
                   three_with_sigma(backscatter, backscatter_sigma) + " per " +
                   (unit.name == "units" ? "unit" : unit.name) + ", veil " +
                   three_with_sigma(water.veil, water.veil_sigma) +
                   (water.lamp_range > 0 ? "; lit by a lamp at the camera" : "")},
              {"unit", unit.name},
              {"attenuation", rgb(attenuation)},
              {"attenuation_sigma", rgb(attenuation_sigma)},
              {"backscatter", rgb(backscatter)},
              {"backscatter_sigma", rgb(backscatter_sigma)},
              {"veil", rgb(water.veil)},
              {"veil_sigma", rgb(water.veil_sigma)}};
  if (water.lamp_range > 0) out["lamp_range"] = water.lamp_range * unit.length;
  return out;
}

Json water_to_json(const WaterEstimate& found, const Frame& frame) {
  Json out = {{"words", words_without_water()},
              {"found", found.water.has_value()},
              {"matches", found.matches},
              {"range_ratio", found.range_ratio}};
  if (found.water) out.update(water_json(*found.water, frame));
  return out;
}

std::string water_section(const Json& water) {
  if (!water.is_object()) return "";
  std::ostringstream html;
  html << "<h2>Water</h2>\n";
  if (!water["found"].get<bool>()) {
    html << "<p>" << escaped(water["words"].get<std::string>()) << ".</p>\n";
    return html.str();
  }
  const std::string unit = escaped(water["unit"].get<std::string>());
  html << "<p>From " << water["matches"].get<size_t>()
       << " places that two photographs show, nine of ten from ranges "
          "within "
       << percent(Json(water["range_ratio"].get<double>() - 1))
       << " of each other. Light of a surface arrives as exp(-attenuation x range)"
       << lamp_words(water)
       << ", and water before it adds veil "
          "x (1 - exp(-backscatter x range)); the veil is linear light, 1 = white. All results are "
          "made of the restored photographs below; held-out views are rendered through the "
          "water.</p>\n<table>\n<tr><th></th><th>red</th><th>green</th><th>blue</th></tr>\n";
  for (const auto& [key, name] : {std::pair("attenuation", "attenuation [1 / " + unit + "]"),
                                  std::pair("backscatter", "backscatter [1 / " + unit + "]"),
                                  std::pair("veil", std::string("veil"))}) {
    html << "<tr><td>" << name << "</td>";
    const Json& sigma = water[std::string(key) + "_sigma"];
    for (size_t c = 0; c < 3; ++c) {
      html << "<td>" << number(water[key][c], "%.4f") << " ± " << number(sigma[c], "%.4f")
           << "</td>";
    }
    html << "</tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

}  // namespace cgs
