// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/known_distances.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <tuple>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "convert/text/stated_frame.h"
#include "io/scenes/lens.h"
#include "io/scenes/orientation.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/core/scale_bars.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

[[noreturn]] void refuse_pick(const std::string& pick) {
  throw InvalidInput("--known-distance: '" + printable(pick) +
                     "' is not VIEW:X,Y, a pixel of a photograph such as church_02:1510,842");
}

double pixel_number(const std::string& text, const std::string& pick) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_all = error == std::errc() && end == text.data() + text.size();
  if (!is_all || !std::isfinite(value)) refuse_pick(pick);
  return value;
}

// Whose pixel may lie outside of its photograph.
KnownDistance::Pick typed_pick(const std::string& text, const Scene& scene) {
  const size_t colon = text.rfind(':');
  const size_t comma = text.find(',', colon == std::string::npos ? 0 : colon);
  if (colon == std::string::npos || comma == std::string::npos) refuse_pick(text);
  KnownDistance::Pick pick;
  pick.view = find_view(scene, text.substr(0, colon), "--known-distance");
  pick.x = pixel_number(text.substr(colon + 1, comma - colon - 1), text);
  pick.y = pixel_number(text.substr(comma + 1), text);
  return pick;
}

KnownDistance::Pick pick_of(const std::string& text, const Scene& scene) {
  KnownDistance::Pick pick = typed_pick(text, scene);
  const View& view = scene.views[static_cast<size_t>(pick.view)];
  if (std::find(scene.input.begin(), scene.input.end(), pick.view) == scene.input.end()) {
    throw InvalidInput("--known-distance: view " + printable(text.substr(0, text.rfind(':'))) +
                       " is held out, so no depth is measured there; pick in an input view");
  }
  const auto at = picked_pixel(view, {pick.x, pick.y});
  if (!at) {
    const ImageSize size = shown_size(view);
    throw InvalidInput("--known-distance: " + printable(text) + " lies outside of the " +
                       std::to_string(size.width) + " x " + std::to_string(size.height) +
                       " pixels of " + printable(view.image_path));
  }
  pick.x = at->x();
  pick.y = at->y();
  return pick;
}

/// A picked point of the surface [internal units].
struct Picked {
  Eigen::Vector3d point;
  Eigen::Vector3d along_ray;  ///< Change of the point with its depth.
  double depth_sigma;
  double sideways_sigma;  ///< Across the ray.
};

// The pixel with a measured depth that is next to a point of the image, within reach; -1 if none.
int next_measured(const ViewPriors& priors, const Eigen::Vector2d& at) {
  constexpr int kReach = 2;  // [pixels]; corners, which people pick, are often not matched
  const int x0 = static_cast<int>(std::floor(at.x()));
  const int y0 = static_cast<int>(std::floor(at.y()));
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int y = std::max(0, y0 - kReach); y <= std::min(priors.origin.height - 1, y0 + kReach);
       ++y) {
    for (int x = std::max(0, x0 - kReach); x <= std::min(priors.origin.width - 1, x0 + kReach);
         ++x) {
      const double distance = (Eigen::Vector2d(x + 0.5, y + 0.5) - at).squaredNorm();
      if (priors.origin(x, y) != DepthOrigin::Measured || distance >= least) continue;
      least = distance;
      best = y * priors.origin.width + x;
    }
  }
  return best;
}

Picked picked_point(const KnownDistance::Pick& pick, const Model& model, const std::string& text) {
  const auto& input = model.scene.input;
  const auto k =
      static_cast<size_t>(std::find(input.begin(), input.end(), pick.view) - input.begin());
  const View& view = model.scene.views[static_cast<size_t>(pick.view)];
  const ViewPriors& priors = model.priors.at(k);
  const Camera picture = picture_camera(view);
  const auto undone = LensMap(view, picture)({pick.x + 0.5, pick.y + 0.5});
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // in the picture worked on
  if (undone) {
    at = {undone->at.x() * view.camera.width / picture.width,
          undone->at.y() * view.camera.height / picture.height};
  }
  const int pixel = undone ? next_measured(priors, at) : -1;
  if (pixel < 0) {
    throw InvalidInput("--known-distance " + printable(text) + ": no depth was measured at " +
                       printable(view.name) + ":" + std::to_string(std::lround(pick.x)) + "," +
                       std::to_string(std::lround(pick.y)) +
                       "; pick a point with texture that a second photograph shows, too");
  }
  constexpr double kTapeEndSigma = 0.5;  // [pixels of the image worked on]
  const double z = priors.depth.data[static_cast<size_t>(pixel)];
  return {view.camera.unproject(at.x(), at.y(), z),
          view.camera.world_from_cam.linear() * view.camera.ray_in_cam(at.x(), at.y()),
          priors.sigma.data[static_cast<size_t>(pixel)],
          kTapeEndSigma * z / std::sqrt(view.camera.fx * view.camera.fy)};
}

// Variance of a length by one of its ends; `direction` is that of the length.
double variance_of_end(const Picked& end, const Eigen::Vector3d& direction) {
  const double along = direction.dot(end.along_ray);
  const double across = 1 - std::pow(direction.dot(end.along_ray.normalized()), 2);
  return std::pow(along * end.depth_sigma, 2) + across * std::pow(end.sideways_sigma, 2);
}

/// A scale bar as messages call it.
struct NamedBar {
  std::string name;
  ScaleBar bar;
};

ScaleBar bar_of(const KnownDistance& distance, const Model& model) {
  const Picked a = picked_point(distance.a, model, distance.text);
  const Picked b = picked_point(distance.b, model, distance.text);
  const Eigen::Vector3d between = b.point - a.point;
  const double length = between.norm();
  if (!(length > 0)) {
    throw InvalidInput("--known-distance " + printable(distance.text) +
                       ": both ends are one point");
  }
  const double variance =
      variance_of_end(a, between / length) + variance_of_end(b, between / length);
  const double scale = model.scene.frame.scale;
  return {scale * length, scale * std::sqrt(variance), distance.metres, distance.sigma};
}

std::vector<std::string> warnings_of(const BarScale& scale, const std::vector<NamedBar>& bars) {
  std::vector<std::string> out;
  for (size_t i = 0; i < bars.size(); ++i) {
    if (scale.used[i]) continue;
    out.push_back("known distance " + printable(bars[i].name) +
                  " disagrees with the others by more than 3 sigma and is left out");
  }
  if (!scale.is_consistent) {
    std::string text =
        "the known distances disagree by more than 3 sigma; the uncertainty of the scale is "
        "widened to cover it";
    if (bars.size() == 2) text += ", and a third distance may tell which is wrong";
    out.push_back(std::move(text));
  }
  return out;
}

std::vector<NamedBar> sides_of(const std::vector<MarkerBar>& markers) {
  std::vector<NamedBar> out;
  out.reserve(markers.size());
  for (const MarkerBar& marker : markers) {
    const std::string shown = std::to_string(marker.photographs) + " photographs";
    out.push_back({"side of marker " + marker.name + ", " + shown, marker.bar});
    out.back().bar.known_sigma = 0;  // is that of all of them
  }
  return out;
}

std::vector<ScaleBar> bars_of(const std::vector<NamedBar>& named) {
  std::vector<ScaleBar> out;
  out.reserve(named.size());
  for (const NamedBar& bar : named) out.push_back(bar.bar);
  return out;
}

// All markers as one bar: one size is stated for all, and their corners are found alike, so what is
// wrong with either is not less wrong of many markers.
ScaleBar bar_of_all(const std::vector<MarkerBar>& markers, const BarScale& scale) {
  ScaleBar out = markers.front().bar;
  double common = 0;
  for (const MarkerBar& marker : markers) common += marker.common_sigma / double(markers.size());
  out.measured = out.known / scale.metres_per_unit;
  out.measured_sigma = out.measured * std::hypot(scale.sigma / scale.metres_per_unit, common);
  return out;
}

ComparedDistance compared(const NamedBar& named, double metres_per_unit, bool is_used) {
  const ScaleBar& bar = named.bar;
  return {named.name,
          bar.known,
          bar.measured * metres_per_unit,
          bar.measured_sigma * metres_per_unit,
          is_used};
}

}  // namespace

std::vector<KnownDistance> known_distances(const std::vector<DistanceWords>& typed,
                                           const Scene& scene) {
  std::vector<KnownDistance> out;
  out.reserve(typed.size());
  for (const DistanceWords& words : typed) {
    KnownDistance distance;
    distance.a = pick_of(words[0], scene);
    distance.b = pick_of(words[1], scene);
    std::tie(distance.metres, distance.sigma) =
        parse_metres_with_sigma(words[2], "--known-distance");
    distance.text = words[0] + " " + words[1] + " " + words[2];
    out.push_back(std::move(distance));
  }
  return out;
}

void check_known_distances(const std::vector<DistanceWords>& typed, const Scene& named) {
  for (const DistanceWords& words : typed) {
    (void)typed_pick(words[0], named);
    (void)typed_pick(words[1], named);
    (void)parse_metres_with_sigma(words[2], "--known-distance");
  }
}

void check_picks(const std::vector<KnownDistance>& distances, const Model& model) {
  for (const KnownDistance& distance : distances) (void)bar_of(distance, model);
}

std::optional<DistanceScale> scale_by(const std::vector<KnownDistance>& distances,
                                      const std::vector<MarkerBar>& markers,
                                      Model& model) {
  std::vector<NamedBar> picked;
  picked.reserve(distances.size());
  for (const KnownDistance& distance : distances) {
    picked.push_back({distance.text, bar_of(distance, model)});
  }
  if (picked.empty() && markers.empty()) return std::nullopt;
  const std::vector<NamedBar> sides = sides_of(markers);
  BarScale by_markers;
  std::vector<NamedBar> all = picked;
  if (!sides.empty()) {
    by_markers = scale_of(bars_of(sides));
    all.push_back({"of the markers", bar_of_all(markers, by_markers)});
  }
  const BarScale scale = scale_of(bars_of(all));
  DistanceScale out{scale.metres_per_unit, scale.sigma, {}, {}};
  for (size_t i = 0; i < picked.size(); ++i) {
    out.distances.push_back(compared(picked[i], scale.metres_per_unit, scale.used[i]));
  }
  for (size_t i = 0; i < sides.size(); ++i) {
    const bool is_used = by_markers.used[i] && scale.used.back();
    out.distances.push_back(compared(sides[i], scale.metres_per_unit, is_used));
  }
  if (!sides.empty()) out.warnings = warnings_of(by_markers, sides);
  for (std::string& warning : warnings_of(scale, all)) out.warnings.push_back(std::move(warning));
  Frame& frame = model.scene.frame;
  const std::string contradiction =
      scale_contradiction(frame,
                          sides.empty() ? "the known distances" : "the markers",
                          scale.metres_per_unit,
                          scale.sigma);
  if (!contradiction.empty()) out.warnings.push_back(contradiction);
  frame.metres_per_unit = scale.metres_per_unit;
  frame.metres_sigma = scale.sigma;
  frame.scale_source = ScaleSource::KnownDistance;
  return out;
}

Json distances_to_json(const DistanceScale& scale) {
  Json list = Json::array();
  for (const ComparedDistance& d : scale.distances) {
    list.push_back({{"distance", d.name},
                    {"known", d.known},
                    {"measured", d.measured},
                    {"sigma", d.sigma},
                    {"residual", d.measured - d.known},
                    {"used", d.is_used}});
  }
  return {{"metres_per_unit", scale.metres_per_unit},
          {"metres_sigma", scale.metres_sigma},
          {"distances", list},
          {"warnings", scale.warnings}};
}

}  // namespace cgs
