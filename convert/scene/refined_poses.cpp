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

/// A view and what it is used for.
using Part = std::pair<int, const char*>;

std::vector<Part> parts_of(const Scene& scene) {
  std::vector<Part> out;
  for (const int i : scene.input) out.emplace_back(i, "input");
  for (const int i : scene.held_out) out.emplace_back(i, "held out");
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
                     part.second,
                     file_hash(view.image_path),
                     view.mask_path.empty() ? "" : file_hash(view.mask_path),
                     {camera.fx, camera.fy, camera.cx, camera.cy},
                     lens_numbers(view),
                     std::vector<double>(pose.data(), pose.data() + pose.size())});
  }
  return json_text({{"program", kProgramVersion}, {"views", views}}, -1);
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

bool is_length(const Json& value) {
  return value.is_number() && std::isfinite(value.get<double>()) && value.get<double>() >= 0;
}

bool is_count(const Json& value) {
  return value.is_number_integer() && value.get<double>() >= 0 &&
         value.get<double>() <= std::numeric_limits<int>::max();
}

// Whether an entry of a report can be what is said of a view and its pose.
bool is_entry_of(const Json& entry,
                 const View& view,
                 const char* role,
                 const RefinedPoses& refined) {
  if (entry.at("view") != view.name || entry.at("role") != role) return false;
  if (!is_count(entry.at("matches")) || !is_count(entry.at("points"))) return false;
  for (const char* which : {"error_before", "error_after"}) {
    const Json& error = entry.at(which);
    if (entry.at("points") == 0 ? !error.is_null() : !is_length(error)) return false;
  }
  const auto pose = refined.poses.find(view.name);
  const bool is_refined = pose != refined.poses.end();
  const Eigen::Isometry3d& given = view.camera.world_from_cam;
  return entry.at("refined") == is_refined && is_length(entry.at("degrees")) &&
         entry.at("degrees") == (is_refined ? degrees_between(given, pose->second) : 0.0) &&
         entry.at("distance") == (is_refined ? distance_between(given, pose->second) : 0.0);
}

bool is_fit_of(const Json& fit, const Scene& scene, const RefinedPoses& refined) {
  const std::vector<Part> parts = parts_of(scene);
  const Json& views = fit.at("views");
  if (!views.is_array() || views.size() != parts.size()) return false;
  size_t moved = 0;
  bool is_refined = false;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (!is_entry_of(views[i], view_of(scene, parts[i]), parts[i].second, refined)) return false;
    moved += views[i]["refined"] == true;
    is_refined = is_refined || (views[i]["refined"] == true && views[i]["role"] == "input");
  }
  return fit.at("refined") == is_refined && moved == refined.poses.size();
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
    out.fit = record.at("fit");
    const Json& poses = record.at("poses");
    if (record.at("inputs") != inputs || record.at("hash") != hash_of(out.fit, poses)) {
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

Json view_json(const View& view, const char* role, const RefinedPose& refined) {
  const Eigen::Isometry3d& given = view.camera.world_from_cam;
  const bool moved = refined.is_refined;
  const auto error = [&](double pixels) { return refined.points > 0 ? Json(pixels) : Json(); };
  return {{"view", view.name},
          {"role", role},
          {"matches", refined.matches},
          {"points", refined.points},
          {"refined", moved},
          {"degrees", moved ? degrees_between(given, refined.world_from_cam) : 0},
          {"distance", moved ? distance_between(given, refined.world_from_cam) : 0},
          {"error_before", error(refined.error_before)},
          {"error_after", error(refined.error_after)}};
}

void add_view(const View& view, const char* role, const RefinedPose& refined, RefinedPoses& out) {
  out.fit["views"].push_back(view_json(view, role, refined));
  if (refined.is_refined) out.poses[view.name] = refined.world_from_cam;
}

// Of the input views, the worst; null if none is known.
Json worst_error(const Json& views, const char* which) {
  Json worst;
  for (const Json& view : views) {
    if (view["role"] != "input" || view[which].is_null()) continue;
    if (worst.is_null() || view[which] > worst) worst = view[which];
  }
  return worst;
}

// The fit in pixels of the photographs as worked on.
Json report_of(const Json& fit, const Scene& scene) {
  Json out = fit;
  const std::vector<Part> parts = parts_of(scene);
  for (size_t i = 0; i < parts.size(); ++i) {
    const View& view = view_of(scene, parts[i]);
    const double worked_on = double(view.camera.width) / camera_of_file(view).width;
    for (const char* which : {"error_before", "error_after"}) {
      Json& error = out["views"][i][which];
      if (!error.is_null()) error = worked_on * error.get<double>();
    }
  }
  for (const char* which : {"error_before", "error_after"}) {
    out[which] = worst_error(out["views"], which);
  }
  return out;
}

struct Names {
  std::string text;
  size_t count = 0;

  void add(const Json& name) { text += (count++ == 0 ? "" : ", ") + name.get<std::string>(); }
  const char* form(const char* one, const char* several) const {
    return count == 1 ? one : several;
  }
};

std::vector<std::string> remarks(const Json& report) {
  Names alone;
  Names far_off;
  Names left;  // behind
  for (const Json& view : report["views"]) {
    if (view["points"] != 0) continue;
    // What a held-out view shares with one input alone cannot place it, however good its camera is.
    const bool is_input = view["role"] == "input";
    (is_input && view["matches"] != 0 ? far_off : alone).add(view["view"]);
    if (view["role"] == "held out" && report["refined"] == true) left.add(view["view"]);
  }
  const std::string option = "--refine-poses: ";
  if (alone.count == report["views"].size()) {
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
  out.fit = {{"refined", false}, {"views", Json::array()}};
  for (size_t k = 0; k < inputs; ++k) {
    add_view(view_of(scene, parts[k]), parts[k].second, refined.photos[k], out);
  }
  out.fit["refined"] = !out.poses.empty();
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
  for (Json& view : refined.report["views"]) {
    view["distance"] = factor * view["distance"].get<double>();
  }
}

std::string refinement_words(const Json& report) {
  size_t inputs = 0;
  size_t held_out = 0;
  double degrees = 0;
  double distance = 0;
  for (const Json& view : report["views"]) {
    if (!view["refined"].get<bool>()) continue;
    (view["role"] == "input" ? inputs : held_out) += 1;
    degrees = std::max(degrees, view["degrees"].get<double>());
    distance = std::max(distance, view["distance"].get<double>());
  }
  if (inputs + held_out == 0) {
    if (report["error_before"].is_null()) return "cameras stay as given";
    return "the input cameras fit the photographs to " + number(report["error_before"], "%.2f") +
           " pixels; they stay as given";
  }
  return std::to_string(inputs) + " input and " + std::to_string(held_out) +
         " held-out cameras moved, by at most " + number(degrees, "%.3f") + " degrees and " +
         number(distance) + " scene units; error of the input views " +
         number(report["error_before"], "%.2f") + " -> " + number(report["error_after"], "%.2f") +
         " pixels";
}

void write_refined_poses(const std::filesystem::path& folder, const RefinedPoses& refined) {
  make_output_folder(folder);
  const Json poses = poses_json(refined);
  write_file(folder / kFileName,
             json_text({{"inputs", refined.inputs},
                        {"hash", hash_of(refined.fit, poses)},
                        {"fit", refined.fit},
                        {"poses", poses}}) +
                 "\n");
}

void forget_refined_poses(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove(folder / kFileName, error);
  if (error) throw IoError(folder / kFileName, error.message());
}

}  // namespace cgs
