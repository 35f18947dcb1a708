// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/marker_bars.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "convert/text/length.h"
#include "io/scenes/lens.h"
#include "io/scenes/orientation.h"
#include "libcgs/core/error.h"
#include "libcgs/poses/markers.h"
#include "libcgs/poses/ray_meeting.h"

namespace cgs {

namespace {

constexpr double kCornerSigma = 0.2;  // [pixels of the photograph]
constexpr double kCornerBias = 0.1;   // out of the marker or into it, as light and blur have it

/// A marker in a photograph.
struct MarkerObservation {
  std::array<SightRay, 4> rays;  // to its corners
  double side;                   // mean [pixels of the photograph]
};
using Observations = std::vector<MarkerObservation>;

// Nothing where the lens cannot be undone.
std::optional<MarkerObservation> observation_of(const Marker& marker,
                                                const LensMap& lens,
                                                const Camera& picture) {
  MarkerObservation out{};
  for (size_t k = 0; k < 4; ++k) {
    const auto corner = lens(marker.corners.at(k));
    if (!corner) return std::nullopt;
    out.rays.at(k) = sight_ray(picture, corner->at, kCornerSigma * corner->stretch);
    out.side += (marker.corners.at((k + 1) % 4) - marker.corners.at(k)).norm() / 4;
  }
  return out;
}

std::map<std::string, Observations> observations(const Scene& scene) {
  std::map<std::string, Observations> out;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    const Camera picture = picture_camera(view);
    const LensMap lens(view, picture);
    for (const Marker& marker : find_markers(read_photograph(view))) {
      const auto observation = observation_of(marker, lens, picture);
      if (observation) out[marker.name].push_back(*observation);
    }
  }
  return out;
}

std::vector<SightRay> rays_to(const Observations& seen, size_t corner) {
  std::vector<SightRay> out;
  out.reserve(seen.size());
  for (const MarkerObservation& s : seen) out.push_back(s.rays.at(corner));
  return out;
}

/// The mean side of a marker [internal units]; nothing where it is no square.
std::optional<std::pair<double, double>> side_and_sigma(const Observations& seen) {
  constexpr double kWorst = 15;  // [sigmas] of a corner: 3 pixels, also for cameras not quite right
  std::array<RayMeeting, 4> corners;
  for (size_t k = 0; k < 4; ++k) {
    const auto met = ray_meeting(rays_to(seen, k));
    if (!met || met->worst > kWorst) return std::nullopt;
    corners.at(k) = *met;
  }
  std::array<double, 4> sides{};
  std::array<Eigen::Vector3d, 4> gradient;
  gradient.fill(Eigen::Vector3d::Zero());
  for (size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d edge = corners.at((k + 1) % 4).point - corners.at(k).point;
    sides.at(k) = edge.norm();
    gradient.at((k + 1) % 4) += edge / (4 * sides.at(k));
    gradient.at(k) -= edge / (4 * sides.at(k));
  }
  const double mean = (sides[0] + sides[1] + sides[2] + sides[3]) / 4;
  double variance = 0;
  double scatter = 1;  // where cameras are not quite right, they are for all four corners
  for (size_t k = 0; k < 4; ++k) {
    variance += gradient.at(k).dot(corners.at(k).covariance * gradient.at(k));
    scatter = std::max(scatter, corners.at(k).scatter);
  }
  variance *= scatter;
  constexpr double kWorstSide = 0.05;  // sigma of it: nearly parallel rays make sides too long
  if (std::sqrt(variance) > kWorstSide * mean) return std::nullopt;
  const double allowed =
      std::max(0.1 * mean, 2 * 3 * std::sqrt(variance));  // of a side, not a mean
  const auto is_near = [&](double length, double wanted) {
    return std::abs(length - wanted) <= allowed;
  };
  for (size_t k = 0; k < 2; ++k) {
    const double diagonal = (corners.at(k + 2).point - corners.at(k).point).norm();
    if (!is_near(diagonal / std::numbers::sqrt2, mean)) return std::nullopt;
  }
  const bool is_square =
      std::all_of(sides.begin(), sides.end(), [&](double s) { return is_near(s, mean); });
  if (!is_square) return std::nullopt;
  return std::pair(mean, std::sqrt(variance));
}

// Both ends of a side are shifted.
double common_sigma(const Observations& seen) {
  double sum = 0;
  for (const MarkerObservation& s : seen) sum += 2 * kCornerBias / s.side;
  return sum / double(seen.size());
}

[[noreturn]] void refuse(const std::map<std::string, Observations>& seen) {
  std::string text = "--marker-size: no square marker is shown by two input photographs; found: ";
  for (const auto& [name, places] : seen) {
    text += name + " in " + std::to_string(places.size()) +
            (places.size() == 1 ? " photograph, " : " photographs, ");
  }
  if (seen.empty()) text += "none, ";
  text.resize(text.size() - 2);
  throw InvalidInput(
      text +
      "; known are AprilTag 36h11, ArUco 4x4 up to number 49, 5x5 to 99, 6x6 to 249, original; "
      "one that a photograph shows twice is left out, so print different numbers");
}

}  // namespace

std::vector<MarkerBar> marker_bars(const Scene& scene, const std::string& size) {
  if (size.empty()) return {};
  const auto [known, known_sigma] = parse_metres_with_sigma(size, "--marker-size");
  const std::map<std::string, Observations> seen = observations(scene);
  std::vector<MarkerBar> out;
  for (const auto& [name, places] : seen) {
    if (places.size() < 2) continue;
    const auto side = side_and_sigma(places);
    if (!side) continue;
    const double scale = scene.frame.scale;
    out.push_back({name,
                   static_cast<int>(places.size()),
                   {scale * side->first, scale * side->second, known, known_sigma},
                   common_sigma(places)});
  }
  if (out.empty()) refuse(seen);
  return out;
}

}  // namespace cgs
