// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/stated_frame.h"

#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/text/html.h"
#include "convert/text/length.h"
#include "libcgs/core/error.h"

namespace cgs {

std::string assume_unit(Frame& frame, const std::string& unit) {
  const double metres = metres_in(unit, "--assume-unit");
  if (!frame.has_metric_scale()) {
    frame.metres_per_unit = metres;
    frame.scale_source = ScaleSource::Assumed;
    return "";
  }
  if (std::abs(frame.metres_per_unit / metres - 1) <= 1e-9) return "";
  return "--assume-unit " + unit + " left out: the input says its unit is " + frame.unit_name();
}

std::string scale_contradiction(const Frame& stated,
                                const std::string& by,
                                double metres,
                                double sigma) {
  constexpr double kSigmas = 3;
  if (!stated.has_metric_scale()) return "";
  const double own =
      stated.metres_sigma > 0 ? stated.metres_sigma / stated.metres_per_unit : kTrackedScale;
  const double off = std::abs(std::log(metres / stated.metres_per_unit));
  if (off <= kSigmas * std::hypot(own, sigma / metres)) return "";
  const bool is_by_depth = stated.scale_source == ScaleSource::DepthSensor;
  return std::string(is_by_depth ? "the depth files say" : "the scene states") +
         " that its unit is " + number(stated.metres_per_unit, "%.4g") + " m, " + by +
         " that it is " + number(metres, "%.4g") +
         " m; the latter was taken, so check the unit and the picks";
}

void widen_by_focal(Frame& frame, double focal_sigma) {
  if (!frame.has_metric_scale()) return;
  frame.metres_sigma = std::hypot(frame.metres_sigma, focal_sigma * frame.metres_per_unit);
}

std::string turned_text(const Frame& a, const Frame& b) {
  constexpr double kSame = 0.9998;  // about a degree
  if (!a.knows_up() || !b.knows_up() || a.up.dot(b.up) > kSame) return "";
  const auto words = [](const Eigen::Vector3d& up) {
    return number(up.x(), "%.3g") + ", " + number(up.y(), "%.3g") + ", " + number(up.z(), "%.3g");
  };
  return "up is " + words(a.up) + " in the first file and " + words(b.up) +
         " in the second, as STL and 3MF are written with z up: if they show one thing, the second "
         "has to be turned (cgs filter --op rotate) or laid on (cgs compare --icp)";
}

std::string settle_up(Frame& frame, const std::vector<double>& given, bool is_of_splats) {
  if (!given.empty()) {
    frame.up = up_direction(given);
    return "";
  }
  if (frame.knows_up()) return "";
  frame.up = is_of_splats ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : Eigen::Vector3d::UnitZ();
  return std::string("the file does not say what is up: ") + (is_of_splats ? "-y" : "+z") +
         " is assumed";
}

Eigen::Vector3d up_direction(const std::vector<double>& numbers) {
  require(numbers.size() == 3,
          "--up must be three numbers",
          std::to_string(numbers.size()) + " numbers");
  const Eigen::Vector3d up(numbers[0], numbers[1], numbers[2]);
  require(up.allFinite() && up.norm() > 0, "--up must be a direction", up.transpose());
  return up.normalized();
}

}  // namespace cgs
