// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/control_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include "convert/model/model.h"
#include "convert/text/advice.h"
#include "convert/text/frame_json.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "convert/text/stated_frame.h"
#include "io/scenes/control_points.h"
#include "io/scenes/lens.h"
#include "io/scenes/orientation.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/angle_between.h"
#include "libcgs/core/error.h"
#include "libcgs/poses/control_fit.h"
#include "libcgs/poses/ray_meeting.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr double kPickSigma = 1;             // [pixels of the photograph]: of hands and of cameras
constexpr double kBadPick = 3 * kPickSigma;  // off by more, it is no pick of that point

/// A control point and what the photographs tell of it.
struct Sighted {
  ControlPoint point;
  std::optional<RayMeeting> meeting;  ///< [scene units]
  size_t photographs = 0;             ///< Whose picks count.
  double reprojection = 0;            ///< Root mean square [pixels of the photographs].
  double worst = 0;                   ///< Largest [pixels].
  std::string bad_pick;               ///< A pick that was left out, in words; empty if none was.
  std::string remark;                 ///< Why it is not used; empty if it is.
};

/// A pick as its camera sees it.
struct Seen {
  std::string view;
  Camera picture;
  LensMap lens;
  Eigen::Vector2d in_photograph;
  PicturePoint pick;  // in the undistorted picture
};

const View& view_of(const ControlPick& pick,
                    const Scene& scene,
                    const std::string& line,
                    const std::filesystem::path& file) {
  const std::vector<int> found = views_called(scene, pick.view);
  if (found.size() == 1) {
    const View& view = scene.views[static_cast<size_t>(found.front())];
    if (!view.image_path.empty()) return view;
  }
  if (found.size() > 1) {
    throw BadInput(Defect::Ref,
                   file,
                   line + std::to_string(found.size()) + " views have a photograph \"" +
                       printable(pick.view) + "\"; name the view, or the folder with it");
  }
  std::string names;
  constexpr size_t kShown = 8;
  for (size_t i = 0; i < std::min(kShown, scene.views.size()); ++i) {
    names += (i == 0 ? "" : ", ") + scene.views[i].name;
  }
  throw BadInput(Defect::Ref,
                 file,
                 line + "no photograph of view \"" + printable(pick.view) + "\"; there are " +
                     printable(names) + (scene.views.size() > kShown ? ", …" : ""));
}

Seen seen(const ControlPick& pick, const Scene& scene, const std::filesystem::path& file) {
  const std::string line = "line " + std::to_string(pick.line) + ": ";
  const View& view = view_of(pick, scene, line, file);
  const auto at = picked_pixel(view, {pick.x, pick.y});
  if (!at) {
    const ImageSize size = shown_size(view);
    throw BadInput(Defect::Value,
                   file,
                   line + "lies outside of the " + std::to_string(size.width) + " x " +
                       std::to_string(size.height) + " pixels of " + printable(view.image_path));
  }
  const Camera picture = picture_camera(view);
  const LensMap lens(view, picture);
  const Eigen::Vector2d in_photograph = *at + Eigen::Vector2d(0.5, 0.5);
  const auto undone = lens(in_photograph);
  if (!undone) {
    throw BadInput(Defect::Value,
                   file,
                   line + "lies where the lens of " + printable(view.name) + " cannot be undone");
  }
  return {view.name, picture, lens, in_photograph, *undone};
}

std::optional<RayMeeting> meeting_of(const std::vector<Seen>& picks) {
  std::vector<SightRay> rays;
  rays.reserve(picks.size());
  for (const Seen& pick : picks) {
    rays.push_back(sight_ray(pick.picture, pick.pick.at, kPickSigma * pick.pick.stretch));
  }
  return ray_meeting(rays);
}

// [pixels of the photograph]; of points that the lens does not show, as many as their angle from
// the pick covers on the axis.
double distance_to(const Seen& seen, const Eigen::Vector3d& point) {
  const Eigen::Vector3d uvz = seen.picture.project(point);
  const auto at = uvz.z() > 0 ? seen.lens.in_photograph(uvz.head<2>()) : std::nullopt;
  if (at) return (*at - seen.in_photograph).norm();
  const Camera& c = seen.picture;
  const Eigen::Vector3d ray = c.ray_in_cam(seen.pick.at.x(), seen.pick.at.y());
  const Eigen::Vector3d away = c.cam_from_world() * point;
  return std::sqrt(c.fx * c.fy) * angle_between(ray, away);
}

double largest_distance(const std::vector<Seen>& picks, const Eigen::Vector3d& point) {
  double worst = 0;
  for (const Seen& pick : picks) worst = std::max(worst, distance_to(pick, point));
  return worst;
}

// Takes out the one pick without which the others agree. Where none is that pick, or more than one
// could be it, nobody can tell which is wrong.
void leave_out_bad_pick(std::vector<Seen>& picks, Sighted& sighted) {
  if (picks.size() < 3 || largest_distance(picks, sighted.meeting->point) <= kBadPick) return;
  size_t wrong = 0;
  int suspects = 0;
  std::optional<RayMeeting> without_wrong;
  for (size_t i = 0; i < picks.size(); ++i) {
    std::vector<Seen> others = picks;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const auto meeting = meeting_of(others);
    if (!meeting || largest_distance(others, meeting->point) > kBadPick) continue;
    wrong = i;
    without_wrong = meeting;
    ++suspects;
  }
  if (suspects != 1) return;
  const double off = distance_to(picks[wrong], without_wrong->point);
  sighted.bad_pick = "its pick in " + printable(picks[wrong].view) +
                     " is left out: " + number(off, "%.1f") + " pixels off what the others say";
  sighted.meeting = without_wrong;
  picks.erase(picks.begin() + static_cast<std::ptrdiff_t>(wrong));
}

// How far the picks are from the point they make, and how much less is known of it for that.
void note_reprojection(const std::vector<Seen>& picks, Sighted& sighted) {
  double sum = 0;
  for (const Seen& pick : picks) sum += std::pow(distance_to(pick, sighted.meeting->point), 2);
  const auto count = double(picks.size());
  sighted.photographs = picks.size();
  sighted.reprojection = std::sqrt(sum / count);
  sighted.worst = largest_distance(picks, sighted.meeting->point);
  const double scatter = sum / (kPickSigma * kPickSigma * (2 * count - 3));
  sighted.meeting->covariance *= std::max(1.0, scatter);
}

std::vector<Seen> picks_of(const ControlPoint& point,
                           const Scene& scene,
                           const std::filesystem::path& file) {
  std::vector<Seen> out;
  for (const ControlPick& pick : point.picks) {
    out.push_back(seen(pick, scene, file));
    for (size_t i = 0; i + 1 < out.size(); ++i) {
      if (out[i].view != out.back().view) continue;
      throw BadInput(Defect::Mismatch,
                     file,
                     "line " + std::to_string(pick.line) + ": \"" + printable(point.name) +
                         "\" was picked in the same photograph in line " +
                         std::to_string(point.picks[i].line));
    }
  }
  return out;
}

Sighted sighted(const ControlPoint& point, const Scene& scene, const std::filesystem::path& file) {
  Sighted out;
  out.point = point;
  std::vector<Seen> picks = picks_of(point, scene, file);
  out.photographs = picks.size();
  if (picks.size() < 2) {
    out.remark = picks.empty() ? "picked in no photograph" : "picked in one photograph only";
    return out;
  }
  out.meeting = meeting_of(picks);
  if (!out.meeting) {
    out.remark = "the rays of its picks do not meet before the cameras";
    return out;
  }
  leave_out_bad_pick(picks, out);
  note_reprojection(picks, out);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(out.meeting->covariance,
                                                             Eigen::EigenvaluesOnly);
  constexpr double kWorst = 0.1;  // of the distance; beyond, the error is no ellipsoid any more
  const double distance = (out.meeting->point - picks.front().picture.center()).norm();
  if (!(std::sqrt(eigen.eigenvalues()[2]) <= kWorst * distance)) {
    out.remark = "its picks leave the distance open by more than 10 %";
    out.meeting.reset();
  }
  return out;
}

std::vector<ControlPair> pairs_of(const std::vector<Sighted>& points) {
  std::vector<ControlPair> out;
  for (const Sighted& s : points) {
    if (!s.meeting) continue;
    out.push_back({s.meeting->point,
                   s.meeting->covariance,
                   s.point.position,
                   s.point.sigma,
                   s.point.is_check});
  }
  return out;
}

ControlFit checked_fit(const std::vector<Sighted>& points, const std::filesystem::path& file) {
  try {
    return fit_control(pairs_of(points));
  } catch (const NumericalError& error) {
    std::string text = words_of(error);
    for (const Sighted& s : points) {
      if (s.meeting || s.point.is_check) continue;
      text += "; not used: \"" + printable(s.point.name) + "\", " + s.remark;
      break;
    }
    throw BadInput(Defect::Value, file, text);
  }
}

/// A control point beside the frame that all of them determine.
struct Judged {
  const Sighted& sighted;
  const ControlResidual* residual;  // null where nothing was measured
  std::string remark;               // why it is not used, or what it disagrees with

  bool is_check() const { return sighted.point.is_check; }
  bool is_used() const { return residual != nullptr && residual->is_used; }
};

std::vector<Judged> judged(const std::vector<Sighted>& points, const ControlFit& fit) {
  std::vector<Judged> out;
  size_t next = 0;
  for (const Sighted& s : points) {
    const ControlResidual* const residual = s.meeting ? &fit.residuals[next++] : nullptr;
    std::string remark = s.remark;
    if (residual != nullptr && !residual->is_used && !s.point.is_check) {
      remark = "disagrees with the others";
    }
    if (residual != nullptr && s.point.is_check && !residual->is_met) {
      remark = "disagrees with the control points";
    }
    out.push_back({s, residual, remark});
  }
  return out;
}

// Of the check points that were measured, or of the control points in use.
std::optional<ControlRms> rms_of(const std::vector<Judged>& points, bool of_checks) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Judged& point : points) {
    const bool counts = point.is_check() == of_checks && (of_checks || point.is_used());
    if (!counts || point.residual == nullptr) continue;
    sum += point.residual->off.cwiseAbs2();
    ++count;
  }
  if (count == 0) return std::nullopt;
  return ControlRms{count, (sum / count).cwiseSqrt()};
}

ComparedControlPoint compared(const Judged& point) {
  const Sighted& s = point.sighted;
  ComparedControlPoint out{.name = s.point.name,
                           .is_check = point.is_check(),
                           .known = s.point.position,
                           .sigma = s.point.sigma,
                           .photographs = s.photographs,
                           .seen = {},
                           .is_used = point.is_used(),
                           .remark = point.remark};
  if (const ControlResidual* const residual = point.residual) {
    out.seen = {s.reprojection, residual->off, residual->sigmas};
  }
  return out;
}

Json rms_json(const std::optional<ControlRms>& rms) {
  if (!rms) return nullptr;
  const Eigen::Vector3d& along = rms->along;
  return {{"points", rms->points},
          {"x", along.x()},
          {"y", along.y()},
          {"z", along.z()},
          {"all", along.norm()}};
}

Json point_json(const ComparedControlPoint& point) {
  const auto& seen = point.seen;
  return {{"name", point.name},
          {"role", point.is_check ? "check" : "control"},
          {"known", vector_to_json(point.known)},
          {"sigma", point.sigma},
          {"photographs", point.photographs},
          {"reprojection", seen ? Json(seen->reprojection) : Json()},
          {"residual", seen ? vector_to_json(seen->residual) : Json()},
          {"sigmas", seen ? Json(seen->sigmas) : Json()},
          {"used", point.is_used},
          {"remark", point.remark}};
}

void warn_of_points(const std::vector<Judged>& points, const Frame& frame, Scene& scene) {
  std::string unpicked;
  for (const Judged& point : points) {
    const Sighted& s = point.sighted;
    if (s.point.picks.empty()) {
      unpicked += (unpicked.empty() ? "" : ", ") + printable(s.point.name);
      continue;
    }
    const std::string name =
        (point.is_check() ? "check point " : "control point ") + printable(s.point.name);
    if (!point.remark.empty()) {
      const bool is_compared = point.is_check() && point.residual != nullptr;
      std::string text = name;
      text.append(is_compared ? " " : " left out: ").append(point.remark);
      if (point.residual != nullptr) {
        text += " by " + format_length(point.residual->off.norm(), frame) + ", " +
                number(point.residual->sigmas, "%.1f") + " sigma";
      }
      scene.warnings.push_back(text);
    }
    if (!s.bad_pick.empty()) scene.warnings.push_back(name + ": " + s.bad_pick);
    if (s.worst > kBadPick) {
      scene.warnings.push_back(name + ": its picks miss each other by up to " +
                               number(s.worst, "%.1f") + " pixels");
    }
  }
  if (!unpicked.empty()) {
    scene.warnings.push_back("control points picked in no photograph: " + unpicked);
  }
}

void move_scene(const Similarity& to_control, Scene& scene) {
  for (View& view : scene.views) {
    Eigen::Isometry3d& pose = view.camera.world_from_cam;
    pose.translation() = to_control(pose.translation());
    pose.linear() = to_control.rotation * pose.linear();
    view.near *= to_control.scale;
    view.far *= to_control.scale;
  }
  for (SparsePoint& point : scene.points) point.position = to_control(point.position);
  scene.world_per_stated_unit *= to_control.scale;
}

Frame control_frame(const ControlFit& fit, double metres) {
  Frame frame;
  frame.metres_per_unit = metres;
  frame.metres_sigma = metres * fit.scale_sigma / fit.control_from_scene.scale;
  frame.scale_source = ScaleSource::ControlPoints;
  frame.up = Eigen::Vector3d::UnitZ();
  return frame;
}

void warn_of_frame(const ControlFit& fit, Scene& scene) {
  constexpr double kMuch = 2;
  const auto used = std::count_if(
      fit.residuals.begin(), fit.residuals.end(), [](const auto& r) { return r.is_used; });
  if (fit.scatter > kMuch) {
    scene.warnings.push_back("the control points scatter " + number(fit.scatter, "%.1f") +
                             " times as much as their sigmas and picks say; the uncertainty of the "
                             "scale is widened to cover it" +
                             (used == 4 ? "; of four points nobody can tell which is wrong, a "
                                          "fifth would"
                                        : ""));
  }
  // Points on level ground fit mirrored coordinates as well, seen from below.
  constexpr double kUpsideDown = -0.5;
  if (world_up(scene).z() < kUpsideDown) {
    scene.warnings.push_back(
        "in the frame of the control points the photographs stand upside down: x, y, z must be a "
        "right-handed system such as east, north, up; x and y may have to change places");
  }
}

}  // namespace

ControlReport move_to_control_frame(const ControlRequest& request, Scene& scene) {
  const std::string unit = request.unit.empty() ? "m" : request.unit;
  const double metres = metres_in(unit, "--control-unit");
  std::vector<Sighted> points;
  for (const ControlPoint& point : read_control_points(request.file)) {
    points.push_back(sighted(point, scene, request.file));
  }
  const ControlFit fit = checked_fit(points, request.file);
  const double scale = fit.control_from_scene.scale;
  const std::string contradiction = scale_contradiction(
      scene.frame, "the control points", metres * scale, metres * fit.scale_sigma);
  if (!contradiction.empty()) scene.warnings.push_back(contradiction);
  move_scene(fit.control_from_scene, scene);
  scene.frame = control_frame(fit, metres);
  const std::vector<Judged> list = judged(points, fit);
  warn_of_points(list, scene.frame, scene);
  warn_of_frame(fit, scene);
  ControlReport out{.metres_per_unit = scene.frame.metres_per_unit,
                    .metres_sigma = scene.frame.metres_sigma,
                    .file = request.file,
                    .unit = unit,
                    .scale = scale,
                    .rotation_sigma = fit.rotation_sigma,
                    .scatter = fit.scatter,
                    .points = {},
                    .control_rms = rms_of(list, false),
                    .check_rms = rms_of(list, true)};
  for (const Judged& point : list) out.points.push_back(compared(point));
  return out;
}

Json control_to_json(const ControlReport& report) {
  Json points = Json::array();
  for (const ComparedControlPoint& point : report.points) points.push_back(point_json(point));
  return {{"metres_per_unit", report.metres_per_unit},
          {"metres_sigma", report.metres_sigma},
          {"control_points",
           {{"file", report.file.string()},
            {"unit", report.unit},
            {"scale", report.scale},
            {"rotation_sigma", report.rotation_sigma * 180 / std::numbers::pi},
            {"scatter", report.scatter},
            {"points", points},
            {"control_rms", rms_json(report.control_rms)},
            {"check_rms", rms_json(report.check_rms)}}}};
}

std::string control_words(const Json& scale) {
  const Json& control = scale.at("control_points");
  const auto unit = control.at("unit").get<std::string>();
  const Json& used = control.at("control_rms");
  std::string out = "control points: " + number(used.at("points"), "%.0f") + " used, " +
                    number(used.at("all"), "%.3g") + " " + unit + " rms";
  const Json& check = control.at("check_rms");
  if (check.is_null()) return out + "; none kept to check by";
  return out + "; " + number(check.at("points"), "%.0f") + " check points, " +
         number(check.at("all"), "%.3g") + " " + unit + " rms";
}

}  // namespace cgs
