// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/camera_fit.h"

#include <algorithm>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/html.h"
#include "io/orientation.h"
#include "io/resample.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr double kMostError = 0.75;  // [pixels worked on]; 1.1 cost the portal 2.7 dB

// Cameras come divided by --downscale; going back leaves rounding, which poses and the key of what
// is stored must not depend on.
double without_rounding(double pixels) { return static_cast<double>(static_cast<float>(pixels)); }

}  // namespace

Camera camera_of_file(const View& view) {
  const ImageSize size = photograph_size(view);
  Camera out = resized(view.camera, size.width, size.height);
  for (double* value : {&out.fx, &out.fy, &out.cx, &out.cy}) *value = without_rounding(*value);
  return out;
}

PosedPhoto posed_photo(const View& view, const SceneRoot& root, const FeatureOptions& options) {
  MaskMap usable;
  const ColorImage image = read_photograph(view, root, usable);
  PosedPhoto out{view.name, camera_of_file(view), detect_features(image, usable, options)};
  for (Eigen::Vector2d& at : out.features.points) {
    at = undistorted(at, out.camera, view.distortion);
  }
  return out;
}

Json camera_fit(const Scene& scene, const SceneRoot& root) {
  constexpr FeatureOptions kFew{.largest_side = 800, .most = 2000};
  std::vector<PosedPhoto> photos;
  std::vector<double> worked_on;  // pixels worked on per working pixel
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    photos.push_back(posed_photo(view, root, kFew));
    const PosedPhoto& photo = photos.back();
    worked_on.push_back(photo.features.pixel * view.camera.width / photo.camera.width);
  }
  Json pairs = Json::array();
  size_t matches = 0;
  double worst = 0;
  for (const EpipolarFit& fit : epipolar_fits(photos)) {
    const auto a = static_cast<size_t>(fit.a);
    const auto b = static_cast<size_t>(fit.b);
    const double error = 0.5 * (worked_on[a] + worked_on[b]) * fit.error;
    pairs.push_back(
        {{"views", {photos[a].name, photos[b].name}}, {"matches", fit.matches}, {"error", error}});
    matches += fit.matches;
    worst = std::max(worst, error);
  }
  if (pairs.empty()) return nullptr;
  return {{"matches", matches}, {"error", worst}, {"pairs", pairs}};
}

std::string camera_fit_warning(const Json& fit) {
  if (fit.is_null() || fit["error"].get<double>() <= kMostError) return "";
  const auto is_less = [](const Json& a, const Json& b) { return a["error"] < b["error"]; };
  const Json& worst = *std::max_element(fit["pairs"].begin(), fit["pairs"].end(), is_less);
  return "the cameras of " + worst["views"][0].get<std::string>() + " and " +
         worst["views"][1].get<std::string>() +
         " do not fit what the photographs show: " + number(worst["error"], "%.1f") +
         " pixels off in the median of " + std::to_string(worst["matches"].get<size_t>()) +
         " points; --refine-poses may put them right";
}

}  // namespace cgs
