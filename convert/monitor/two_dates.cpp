// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/two_dates.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "convert/measure/comparison.h"
#include "convert/measure/measured_file.h"
#include "convert/model/model.h"
#include "convert/monitor/date_registration.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

MeasurableMesh surface_of(const std::filesystem::path& run, const Terminal& terminal) {
  const std::filesystem::path file = run / "mesh/surface.ply";
  if (!is_present(file)) {
    throw BadInput(Defect::Missing, file, "no open surface; give two folders of cgs run");
  }
  MeasurableFile read = read_measured(file, "");
  terminal.warn(read.warnings);
  return std::move(read.content);
}

Registration after(const Registration& second, const Registration& first) {
  Registration out = second;
  out.scale = second.scale * first.scale;
  out.rotation = second.rotation * first.rotation;
  out.translation = second.apply(first.translation);
  return out;
}

// By places that photographs of both dates show: models of photographs alone have nothing else in
// common, not even which way is up.
void lay_by_photographs(TwoDates& dates, bool with_scale, Terminal& terminal) {
  constexpr size_t kFewest = 12;
  std::vector<PlacePair> pairs =
      places_of_both(dates.earlier, dates.later, terminal.begin("places that both dates show"));
  const Frame& frame = dates.earlier_surface.frame;
  for (PlacePair& pair : pairs) {
    pair.from = dates.from_later(pair.from);
    pair.to = dates.from_earlier(pair.to);
    pair.tolerance /= frame.scale;
  }
  const PlaceFit fit = fit_places(pairs, with_scale);
  terminal.end(std::to_string(fit.agreeing) + " of " + std::to_string(pairs.size()) + " agree");
  if (fit.agreeing < kFewest) {
    throw NumericalError(
        "the photographs of the two dates agree on " + std::to_string(fit.agreeing) +
        " places, fewer than " + std::to_string(kFewest) +
        ": photographs from about the same directions share more; --registered takes both as being "
        "in one frame, as surveyed control points or given cameras make it");
  }
  dates.shared_places = pairs.size();
  dates.agreeing_places = fit.agreeing;
  dates.motion = fit.motion;
  dates.later_surface = moved(dates.later_surface, fit.motion);
}

void lay_by_surfaces(TwoDates& dates, bool with_scale, Terminal& terminal) {
  terminal.begin("laying the surfaces onto each other");
  const NearestSurface surface(dates.earlier_surface);
  const Registration refined =
      motion_onto(dates.later_surface, dates.earlier_surface, surface, with_scale);
  dates.motion = after(refined, dates.motion);
  dates.later_surface = moved(dates.later_surface, refined);
  terminal.end(std::to_string(std::lround(100 * refined.share)) + " % take part");
}

// What a scale that only the later date knows says of the earlier.
void share_scale(TwoDates& dates, const Frame& later) {
  Frame& frame = dates.earlier_surface.frame;
  if (!frame.has_metric_scale() && later.has_metric_scale()) {
    take_scale(frame, later, dates.motion.scale);
  }
  dates.later_surface.frame = frame;
}

Json side_json(const Changes& changes, const FigureUnit& unit, const Frame& frame) {
  const double area = unit.length * unit.length;
  const double volume = area * unit.length;
  const ChangeTotal total = total_of(changes.patches);
  // A wrong scale is wrong everywhere: it does not average out over patches.
  const auto with_scale = [&](double value, double sigma) {
    return volume * std::hypot(sigma, 3 * unit.relative_sigma * value);
  };
  Json patches = Json::array();
  for (const ChangePatch& patch : changes.patches) {
    const Eigen::Vector3d center = frame.world_from_internal(patch.center);
    patches.push_back(
        {{"area", area * patch.area},
         {"distance", unit.length * patch.distance},
         {"volume", patch.volume ? Json(volume * *patch.volume) : Json()},
         {"volume_sigma",
          patch.volume ? Json(with_scale(*patch.volume, patch.volume_sigma)) : Json()},
         {"center", {center.x(), center.y(), center.z()}}});
  }
  const std::vector<double> detections = known_detections(changes.found);
  const Json detection =
      detections.empty() ? Json()
                         : Json(unit.length * changes.noise * detections[detections.size() / 2]);
  return {{"area", area * total.area},
          {"volume", volume * total.volume},
          {"volume_sigma", with_scale(total.volume, total.volume_sigma)},
          {"without_volume", total.without_volume},
          {"comparable", changes.comparable},
          {"noise", changes.noise},
          {"detection", detection},
          {"patches", patches}};
}

}  // namespace

TwoDates read_two_dates(const std::filesystem::path& earlier,
                        const std::filesystem::path& later,
                        bool is_registered,
                        Terminal& terminal) {
  TwoDates out;
  out.earlier_surface = surface_of(earlier, terminal);
  MeasurableMesh surface = surface_of(later, terminal);
  out.earlier = read_model(earlier / "model");
  out.later = read_model(later / "model");
  const Frame& before = out.earlier_surface.frame;
  const bool are_metric = before.has_metric_scale() && surface.frame.has_metric_scale();
  if (are_metric) out.ratio = surface.frame.metres_per_unit / before.metres_per_unit;
  out.later_surface = in_frame_of(surface, before);
  if (!is_registered) {
    lay_by_photographs(out, !are_metric, terminal);
    lay_by_surfaces(out, !are_metric, terminal);
  }
  if (are_metric) {
    out.scale_sigma = relative_scale_sigma(before, surface.frame);
    out.scale_center = unmoved_by_scale(out.later_surface, surface.frame, !is_registered);
  }
  share_scale(out, surface.frame);
  return out;
}

DateChanges changes_between(const TwoDates& dates, const Progress& progress) {
  M3c2Request request;
  request.scale_sigma = dates.scale_sigma;
  request.scale_center = dates.scale_center;
  DateChanges out;
  out.gained = standing_out(dates.later_surface, dates.earlier_surface, request);
  report(progress, 0.5);
  out.lost = standing_out(dates.earlier_surface, dates.later_surface, request);
  report(progress, 1);
  return out;
}

Json monitor_json(const TwoDates& dates, const DateChanges& changes, const FigureUnit& unit) {
  const Frame& frame = dates.earlier_surface.frame;
  return {{"unit", unit.name},
          {"registration",
           {{"shared_places", dates.shared_places},
            {"agreeing_places", dates.agreeing_places},
            {"scale", dates.ratio * dates.motion.scale},
            {"rms", unit.length * dates.motion.rms_after},
            {"share", dates.motion.share}}},
          {"gained", side_json(changes.gained, unit, frame)},
          {"lost", side_json(changes.lost, unit, frame)}};
}

}  // namespace cgs
