// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/camera_fit.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "convert/text/html.h"
#include "io/scenes/lens.h"
#include "io/scenes/orientation.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Of good data sets 0.1 ... 0.41, of the portal with cameras 0.1 degrees off up to 1.1, which cost
// it 2.7 dB.
constexpr double kMostError = 0.5;     // [working pixels]
constexpr double kWrongMatches = 2.5;  // [working pixels]

// Cameras come divided by --downscale; going back leaves rounding, which poses and the key of what
// is stored must not depend on.
double without_rounding(double pixels) {
  // By way of memory: GCC 12 drops the two conversions where it inlines them into camera_of_file().
  const volatile float rounded = static_cast<float>(pixels);
  return static_cast<double>(rounded);
}

void take_out_distortion(const LensMap& lens, const Camera& picture, PhotoFeatures& features) {
  size_t kept = 0;
  for (size_t i = 0; i < features.points.size(); ++i) {
    const auto undone = lens(features.points[i]);
    if (!undone || !picture.sees({undone->at.x(), undone->at.y(), 1})) continue;
    features.points[kept] = undone->at;
    features.descriptors.row(Eigen::Index(kept)) = features.descriptors.row(Eigen::Index(i));
    ++kept;
  }
  features.points.resize(kept);
  features.descriptors.conservativeResize(Eigen::Index(kept), Eigen::NoChange);
  features.picture = {};  // it shows them elsewhere
}

/// How far a view is off, in the pixels it was searched in, as its pairs have it.
double error_of(int photo, const std::vector<EpipolarFit>& fits) {
  std::vector<double> errors;
  for (const EpipolarFit& fit : fits) {
    if (fit.a == photo || fit.b == photo) errors.push_back(fit.error);
  }
  if (errors.empty()) return 0;
  std::sort(errors.begin(), errors.end());
  // Among pairs that fit, one that is far off has wrong matches.
  if (errors[(errors.size() - 1) / 2] <= kMostError) {
    std::erase_if(errors, [](double error) { return error > kWrongMatches; });
  }
  return 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
}

}  // namespace

Camera camera_of_file(const View& view) {
  Camera out = picture_camera(view);
  out.fx = without_rounding(out.fx);
  out.fy = without_rounding(out.fy);
  out.cx = without_rounding(out.cx);
  out.cy = without_rounding(out.cy);
  return out;
}

PosedPhoto posed_photo(const View& view, const FeatureOptions& options) {
  MaskMap usable;
  const ColorImage image = read_photograph(view, usable);
  PosedPhoto out{view.name, camera_of_file(view), detect_features(image, usable, options)};
  take_out_distortion(LensMap(view, out.camera), out.camera, out.features);
  return out;
}

std::optional<CameraFit> camera_fit(const Scene& scene, const Progress& progress) {
  constexpr FeatureOptions kFew{.largest_side = 800, .most = 2000};
  const double count = static_cast<double>(scene.input.size());
  std::vector<PosedPhoto> photos;
  std::vector<double> worked_on;  // pixels worked on per working pixel
  for (const int i : scene.input) {
    report(progress, 0.7 * double(photos.size()) / count);
    const View& view = scene.views[static_cast<size_t>(i)];
    photos.push_back(posed_photo(view, kFew));
    const PosedPhoto& photo = photos.back();
    worked_on.push_back(photo.features.pixel * view.camera.width / photo.camera.width);
  }
  const std::vector<EpipolarFit> fits = epipolar_fits(photos, part_of(progress, 0.7, 1));
  if (fits.empty()) return std::nullopt;
  CameraFit out;
  for (const EpipolarFit& fit : fits) {
    const auto a = static_cast<size_t>(fit.a);
    const auto b = static_cast<size_t>(fit.b);
    const double error = 0.5 * (worked_on[a] + worked_on[b]) * fit.error;
    out.pairs.push_back({photos[a].name, photos[b].name, fit.matches, error});
    out.matches += fit.matches;
  }
  double worst = 0;  // [working pixels]
  for (size_t i = 0; i < photos.size(); ++i) {
    const double error = error_of(static_cast<int>(i), fits);
    if (error == 0) continue;
    out.views.push_back({photos[i].name, worked_on[i] * error, error <= kMostError});
    if (error <= worst) continue;
    worst = error;
    out.error = worked_on[i] * error;
  }
  out.fits = worst <= kMostError;
  return out;
}

Json camera_fit_to_json(const std::optional<CameraFit>& fit) {
  if (!fit) return nullptr;
  Json views = Json::array();
  for (const CameraFit::OfView& view : fit->views) {
    views.push_back({{"view", view.view}, {"error", view.error}, {"fits", view.fits}});
  }
  Json pairs = Json::array();
  for (const CameraFit::OfPair& pair : fit->pairs) {
    pairs.push_back(
        {{"views", {pair.a, pair.b}}, {"matches", pair.matches}, {"error", pair.error}});
  }
  return {{"fits", fit->fits},
          {"matches", fit->matches},
          {"error", fit->error},
          {"views", views},
          {"pairs", pairs}};
}

std::string camera_fit_warning(const CameraFit& fit) {
  if (fit.fits) return "";
  std::string names;
  size_t count = 0;
  for (const CameraFit::OfView& view : fit.views) {
    if (view.fits) continue;
    names += (count++ == 0 ? "" : ", ") + view.view;
  }
  return std::string("the ") + (count == 1 ? "camera of " : "cameras of ") + names +
         (count == 1 ? " does" : " do") + " not fit what the photographs show, by up to " +
         number(fit.error, "%.1f") + " pixels; --refine-poses may put " +
         (count == 1 ? "it" : "them") + " right";
}

}  // namespace cgs
