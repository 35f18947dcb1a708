// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/refined_poses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "convert/scene/camera_fit.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/scenes/lens.h"
#include "libcgs/core/error.h"
#include "libcgs/poses/refine_poses.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kFileName = "refined_poses.json";
constexpr size_t kNumbers = 16;  // of a pose: its matrix, by columns

/// A view, and whether it is an input; else it is held out.
using Part = std::pair<int, bool>;

const char* role_name(bool is_input) { return is_input ? "input" : "held out"; }

std::vector<Part> parts_of(const Scene& scene) {
  std::vector<Part> out;
  for (const int i : scene.input) out.emplace_back(i, true);
  for (const int i : scene.held_out) out.emplace_back(i, false);
  return out;
}

const View& view_of(const Scene& scene, const Part& part) {
  return scene.views[static_cast<size_t>(part.first)];
}

// Everything the result depends on.
std::string inputs_text(const Scene& scene) {
  Json views = Json::array();
  for (const Part& part : parts_of(scene)) {
    const View& view = view_of(scene, part);
    const Camera camera = camera_of_file(view);
    const Eigen::Matrix4d pose = camera.world_from_cam.matrix();
    views.push_back({view.name,
                     role_name(part.second),
                     file_hash(view.image_path),
                     view.mask_path.empty() ? "" : file_hash(view.mask_path),
                     {camera.fx, camera.fy, camera.cx, camera.cy},
                     lens_numbers(view),
                     std::vector<double>(pose.data(), pose.data() + pose.size())});
  }
  return json_text({{"program", program_version()}, {"views", views}}, -1);
}

double degrees_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(b.linear() * a.linear().transpose()));
  return turn.angle() * 180 / M_PI;
}

double distance_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (b.translation() - a.translation()).norm();
}

std::string hash_of(const Json& fit, const Json& poses) {
  return std::to_string(content_hash(json_text({fit, poses}, -1)));
}

Json poses_json(const RefinedPoses& refined) {
  Json out = Json::object();
  for (const auto& [name, pose] : refined.poses) {
    const double* const numbers = pose.data();
    out[name] = std::vector<double>(numbers, numbers + kNumbers);
  }
  return out;
}

std::optional<Eigen::Isometry3d> pose_from(const Json& numbers) {
  const auto values = numbers.get<std::vector<double>>();
  if (values.size() != kNumbers) return std::nullopt;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::copy(values.begin(), values.end(), pose.data());
  constexpr double kRounding = 1e-9;
  const Eigen::Matrix3d R = pose.linear();
  const bool is_pose = pose.matrix().allFinite() &&
                       pose.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                       (R.transpose() * R).isIdentity(kRounding) && R.determinant() > 0;
  return is_pose ? std::optional(pose) : std::nullopt;
}

Json error_json(const std::optional<double>& pixels) { return pixels ? Json(*pixels) : Json(); }

// Without what refinement_to_json() adds of all views.
Json fit_to_json(const Refinement& fit) {
  Json views = Json::array();
  for (const RefinedView& view : fit.views) {
    views.push_back({{"view", view.view},
                     {"role", role_name(view.is_input)},
                     {"matches", view.matches},
                     {"points", view.points},
                     {"refined", view.is_refined},
                     {"degrees", view.degrees},
                     {"distance", view.distance},
                     {"error_before", error_json(view.error_before)},
                     {"error_after", error_json(view.error_after)}});
  }
  return {{"refined", fit.is_refined}, {"views", views}};
}

bool is_length(const std::optional<double>& value) {
  return value && std::isfinite(*value) && *value >= 0;
}

// Whether an entry can be what is said of a view and its pose.
bool is_entry_of(const RefinedView& entry,
                 const View& view,
                 bool is_input,
                 const RefinedPoses& refined) {
  if (entry.view != view.name || entry.is_input != is_input) return false;
  if (entry.matches < 0 || entry.points < 0) return false;
  for (const std::optional<double>& error : {entry.error_before, entry.error_after}) {
    if (entry.points == 0 ? error.has_value() : !is_length(error)) return false;
  }
  const auto pose = refined.poses.find(view.name);
  const bool is_refined = pose != refined.poses.end();
  const Eigen::Isometry3d& given = view.camera.world_from_cam;
  return entry.is_refined == is_refined && is_length(entry.degrees) &&
         entry.degrees == (is_refined ? degrees_between(given, pose->second) : 0.0) &&
         entry.distance == (is_refined ? distance_between(given, pose->second) : 0.0);
}

bool is_fit_of(const Refinement& fit, const Scene& scene, const RefinedPoses& refined) {
  const std::vector<Part> parts = parts_of(scene);
  if (fit.views.size() != parts.size()) return false;
  size_t moved = 0;
  bool is_refined = false;
  for (size_t i = 0; i < parts.size(); ++i) {
    const RefinedView& view = fit.views[i];
    if (!is_entry_of(view, view_of(scene, parts[i]), parts[i].second, refined)) return false;
    moved += view.is_refined ? 1 : 0;
    is_refined = is_refined || (view.is_refined && view.is_input);
  }
  return fit.is_refined == is_refined && moved == refined.poses.size();
}

// Damaged or odd: nothing, and what was stored is made anew.
std::optional<RefinedPoses> stored_poses(const std::filesystem::path& folder,
                                         const Scene& scene,
                                         const std::string& inputs) {
  if (folder.empty() || !is_present(folder / kFileName)) return std::nullopt;
  try {
    const std::string text =
        read_file(folder / kFileName, {.max_file_bytes = ReadLimits{}.max_json_bytes});
    (void)parse_json(text, folder / kFileName);  // refuses what is nested too deep to be copied
    const Json record = Json::parse(text);
    RefinedPoses out;
    const Json& fit = record.at("fit");
    out.fit = refinement_from_json(fit);
    const Json& poses = record.at("poses");
    if (record.at("inputs") != inputs || record.at("hash") != hash_of(fit, poses) ||
        fit_to_json(out.fit) != fit) {
      return std::nullopt;
    }
    for (const auto& [name, numbers] : poses.items()) {
      const auto pose = pose_from(numbers);
      if (!pose) return std::nullopt;
      out.poses[name] = *pose;
    }
    if (!is_fit_of(out.fit, scene, out)) return std::nullopt;
    out.inputs = inputs;
    out.is_stored = true;
    return out;
  } catch (const BadInput&) {
    return std::nullopt;
  } catch (const LimitError&) {
    return std::nullopt;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

void add_view(const View& view, bool is_input, const RefinedPose& refined, RefinedPoses& out) {
  const Eigen::Isometry3d& given = view.camera.world_from_cam;
  RefinedView& entry = out.fit.views.emplace_back();
  entry.view = view.name;
  entry.is_input = is_input;
  entry.matches = refined.matches;
  entry.points = refined.points;
  entry.is_refined = refined.is_refined;
  if (refined.points > 0) {
    entry.error_before = refined.error_before;
    entry.error_after = refined.error_after;
  }
  if (!refined.is_refined) return;
  entry.degrees = degrees_between(given, refined.world_from_cam);
  entry.distance = distance_between(given, refined.world_from_cam);
  out.poses[view.name] = refined.world_from_cam;
}

std::optional<double> worst_error(const std::vector<RefinedView>& views,
                                  std::optional<double> RefinedView::*error) {
  std::optional<double> worst;
  for (const RefinedView& view : views) {
    if (view.is_input) worst = std::max(worst, view.*error);  // none is less than any
  }
  return worst;
}

// The fit in pixels of the photographs as worked on.
Refinement report_of(const Refinement& fit, const Scene& scene) {
  Refinement out = fit;
  const std::vector<Part> parts = parts_of(scene);
  for (size_t i = 0; i < parts.size(); ++i) {
    const View& view = view_of(scene, parts[i]);
    const double worked_on = double(view.camera.width) / camera_of_file(view).width;
    for (std::optional<double>* error : {&out.views[i].error_before, &out.views[i].error_after}) {
      if (*error) **error *= worked_on;
    }
  }
  return out;
}

struct Names {
  std::string text;
  size_t count = 0;

  void add(const std::string& name) { text += (count++ == 0 ? "" : ", ") + name; }
  const char* form(const char* one, const char* several) const {
    return count == 1 ? one : several;
  }
};

std::vector<std::string> remarks(const Refinement& report) {
  Names alone;
  Names far_off;
  Names left;  // behind
  for (const RefinedView& view : report.views) {
    if (view.points != 0) continue;
    // What a held-out view shares with one input alone cannot place it, however good its camera is.
    (view.is_input && view.matches != 0 ? far_off : alone).add(view.view);
    if (!view.is_input && report.is_refined) left.add(view.view);
  }
  const std::string option = "--refine-poses: ";
  if (alone.count == report.views.size()) {
    return {option + "the photographs share too little to tell; the cameras stay as given"};
  }
  std::vector<std::string> out;
  if (far_off.count > 0) {
    out.push_back(option + "the " + far_off.form("camera of ", "cameras of ") + far_off.text +
                  far_off.form(" is", " are") + " too far off to be refined, or what " +
                  far_off.form("it shows", "they show") +
                  " lies where too few others see it; leave " + far_off.form("it", "them") +
                  " out or give the photographs without cameras");
  }
  if (alone.count > 0) {
    out.push_back(option + "too little of what " + alone.text + alone.form(" shows", " show") +
                  " is in the others to refine " + alone.form("its camera", "their cameras"));
  }
  if (left.count > 0) {
    out.push_back(option + "held-out " + left.form("view ", "views ") + left.text +
                  left.form(" stays", " stay") + " as given while others moved; figures on " +
                  left.form("it", "them") + " tell of " + left.form("its camera", "their cameras"));
  }
  return out;
}

RefinedPoses reported(RefinedPoses refined, const Scene& scene) {
  refined.report = report_of(refined.fit, scene);
  refined.warnings = remarks(refined.report);
  return refined;
}

RefinedPoses solved_poses(const Scene& scene, const Progress& progress) {
  const std::vector<Part> parts = parts_of(scene);
  const size_t inputs = scene.input.size();
  std::vector<PosedPhoto> photos;
  for (size_t k = 0; k < inputs; ++k) {
    report(progress, 0.4 * double(k) / double(inputs));
    photos.push_back(posed_photo(view_of(scene, parts[k])));
  }
  const PoseRefinement refined = refine_poses(photos, part_of(progress, 0.4, 0.7));
  RefinedPoses out;
  for (size_t k = 0; k < inputs; ++k) {
    add_view(view_of(scene, parts[k]), parts[k].second, refined.photos[k], out);
  }
  out.fit.is_refined = !out.poses.empty();
  const double step = 0.3 / double(std::max<size_t>(1, parts.size() - inputs));
  for (size_t k = inputs; k < parts.size(); ++k) {
    const double done = 0.7 + step * double(k - inputs);
    report(progress, done);
    const View& view = view_of(scene, parts[k]);
    const Progress of_view = part_of(progress, done, done + step);
    add_view(view, parts[k].second, refine_pose(posed_photo(view), refined.points, of_view), out);
  }
  return out;
}

}  // namespace

RefinedPoses refined_poses(const Scene& scene,
                           const std::filesystem::path& stored,
                           Terminal& terminal) {
  const std::string inputs = inputs_text(scene);
  if (auto known = stored_poses(stored, scene, inputs)) return reported(std::move(*known), scene);
  RefinedPoses out = reported(solved_poses(scene, terminal.begin("refining cameras")), scene);
  out.inputs = inputs;
  terminal.end(refinement_words(out.report));
  return out;
}

void move_cameras(const RefinedPoses& refined, Scene& scene) {
  for (View& view : scene.views) {
    const auto pose = refined.poses.find(view.name);
    if (pose != refined.poses.end()) view.camera.world_from_cam = pose->second;
  }
}

void state_in_units(double factor, RefinedPoses& refined) {
  for (RefinedView& view : refined.report.views) view.distance *= factor;
}

std::optional<double> Refinement::error_before() const {
  return worst_error(views, &RefinedView::error_before);
}

std::optional<double> Refinement::error_after() const {
  return worst_error(views, &RefinedView::error_after);
}

Json refinement_to_json(const Refinement& refinement) {
  Json out = fit_to_json(refinement);
  out["error_before"] = error_json(refinement.error_before());
  out["error_after"] = error_json(refinement.error_after());
  return out;
}

Refinement refinement_from_json(const Json& json) {
  const auto error = [](const Json& pixels) {
    return pixels.is_null() ? std::nullopt : std::optional(pixels.get<double>());
  };
  Refinement out;
  out.is_refined = json.at("refined").get<bool>();
  for (const Json& view : json.at("views")) {
    out.views.push_back({view.at("view").get<std::string>(),
                         view.at("role") == role_name(true),
                         view.at("matches").get<int>(),
                         view.at("points").get<int>(),
                         view.at("refined").get<bool>(),
                         view.at("degrees").get<double>(),
                         view.at("distance").get<double>(),
                         error(view.at("error_before")),
                         error(view.at("error_after"))});
  }
  return out;
}

std::string refinement_words(const Refinement& report) {
  size_t inputs = 0;
  size_t held_out = 0;
  double degrees = 0;
  double distance = 0;
  for (const RefinedView& view : report.views) {
    if (!view.is_refined) continue;
    (view.is_input ? inputs : held_out) += 1;
    degrees = std::max(degrees, view.degrees);
    distance = std::max(distance, view.distance);
  }
  const std::string before = number(error_json(report.error_before()), "%.2f");
  if (inputs + held_out == 0) {
    if (!report.error_before()) return "cameras stay as given";
    return "the input cameras fit the photographs to " + before + " pixels; they stay as given";
  }
  return std::to_string(inputs) + " input and " + std::to_string(held_out) +
         " held-out cameras moved, by at most " + number(degrees, "%.3f") + " degrees and " +
         number(distance) + " scene units; error of the input views " + before + " -> " +
         number(error_json(report.error_after()), "%.2f") + " pixels";
}

void write_refined_poses(const std::filesystem::path& folder, const RefinedPoses& refined) {
  make_output_folder(folder);
  const Json poses = poses_json(refined);
  const Json fit = fit_to_json(refined.fit);
  write_file(folder / kFileName,
             json_text({{"inputs", refined.inputs},
                        {"hash", hash_of(fit, poses)},
                        {"fit", fit},
                        {"poses", poses}}) +
                 "\n");
}

void forget_refined_poses(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove(folder / kFileName, error);
  if (error) throw IoError(folder / kFileName, error.message());
}

}  // namespace cgs
