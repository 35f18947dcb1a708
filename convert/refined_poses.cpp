// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/refined_poses.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "convert/camera_fit.h"
#include "convert/html.h"
#include "convert/run_record.h"
#include "io/atomic_file.h"
#include "io/json_file.h"
#include "io/masks.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/refine_poses.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kFileName = "refined_poses.json";
constexpr size_t kNumbers = 16;  // of a pose: its matrix, by columns

// Everything the result depends on.
std::string inputs_text(const Scene& scene, const SceneRoot& root) {
  Json views = Json::array();
  const auto add = [&](int index, const char* role) {
    const View& view = scene.views[static_cast<size_t>(index)];
    const Camera camera = camera_of_file(view);
    const Eigen::Matrix4d pose = camera.world_from_cam.matrix();
    const auto mask = mask_file(root, view.image_path);
    views.push_back({view.name,
                     role,
                     file_hash(view.image_path),
                     mask ? file_hash(*mask) : "",
                     {camera.fx, camera.fy, camera.cx, camera.cy},
                     view.distortion,
                     std::vector<double>(pose.data(), pose.data() + pose.size())});
  };
  for (const int i : scene.input) add(i, "input");
  for (const int i : scene.held_out) add(i, "held out");
  return json_text({{"program", kProgramVersion}, {"views", views}}, -1);
}

std::optional<RefinedPoses> stored_poses(const std::filesystem::path& folder,
                                         const std::string& inputs) {
  if (folder.empty() || !is_present(folder / kFileName)) return std::nullopt;
  try {
    (void)read_json(folder / kFileName);  // refuses what is nested too deep to be copied
    const Json record = Json::parse(read_file(folder / kFileName));
    if (record.at("inputs") != inputs) return std::nullopt;
    RefinedPoses out;
    out.report = record.at("report");
    out.warnings = record.at("warnings").get<std::vector<std::string>>();
    for (const auto& [name, numbers] : record.at("poses").items()) {
      const auto values = numbers.get<std::vector<double>>();
      if (values.size() != kNumbers) return std::nullopt;
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      std::copy(values.begin(), values.end(), pose.data());
      out.poses[name] = pose;
    }
    out.inputs = inputs;
    out.is_stored = true;
    return out;
  } catch (const BadInput&) {
    return std::nullopt;  // damaged: refine again
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

Json view_json(const View& view, const char* role, const RefinedPose& refined) {
  const Eigen::Isometry3d& given = view.camera.world_from_cam;
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(refined.world_from_cam.linear() * given.linear().transpose()));
  const bool moved = refined.is_refined;
  return {
      {"view", view.name},
      {"role", role},
      {"points", refined.points},
      {"refined", moved},
      {"degrees", moved ? turn.angle() * 180 / M_PI : 0},
      {"distance", moved ? (refined.world_from_cam.translation() - given.translation()).norm() : 0},
      {"error_before", refined.error_before},
      {"error_after", refined.error_after}};
}

void add_view(const View& view, const char* role, const RefinedPose& refined, RefinedPoses& out) {
  out.report["views"].push_back(view_json(view, role, refined));
  if (refined.is_refined) out.poses[view.name] = refined.world_from_cam;
}

// Of the input views, the worst.
double worst_error(const Json& views, const char* which) {
  double worst = 0;
  for (const Json& view : views) {
    if (view["role"] == "input") worst = std::max(worst, view[which].get<double>());
  }
  return worst;
}

std::vector<std::string> remarks(const Json& report) {
  std::string alone;
  bool any_points = false;
  for (const Json& view : report["views"]) {
    if (view["points"] == 0) {
      alone += (alone.empty() ? "" : ", ") + view["view"].get<std::string>();
    } else {
      any_points = true;
    }
  }
  const std::string option = "--refine-poses: ";
  if (!any_points) {
    return {option + "the photographs share too little to tell; the cameras stay as given"};
  }
  std::vector<std::string> out;
  if (!report["refined"].get<bool>()) {
    out.push_back(option + "the cameras fit the photographs to " +
                  number(report["error_before"], "%.2f") +
                  " pixels, and refining betters that too little; they stay as given");
  }
  if (!alone.empty()) {
    out.push_back(option + "too little of what " + alone +
                  (alone.find(", ") == std::string::npos ? " shows" : " show") +
                  " is in the others to refine their cameras");
  }
  return out;
}

}  // namespace

RefinedPoses refined_poses(const Scene& scene,
                           const SceneRoot& root,
                           const std::filesystem::path& stored,
                           Terminal& terminal) {
  const std::string inputs = inputs_text(scene, root);
  if (auto known = stored_poses(stored, inputs)) return *known;
  const Progress progress = terminal.begin("refining cameras");
  const double photographs = static_cast<double>(scene.input.size() + scene.held_out.size());
  double done = 0;
  std::vector<PosedPhoto> photos;
  for (const int i : scene.input) {
    report(progress, done++ / photographs);
    photos.push_back(posed_photo(scene.views[static_cast<size_t>(i)], root));
  }
  const PoseRefinement refined = refine_poses(photos);
  RefinedPoses out;
  out.inputs = inputs;
  out.report = {{"refined", !out.poses.empty()}, {"views", Json::array()}};
  for (size_t k = 0; k < photos.size(); ++k) {
    add_view(scene.views[static_cast<size_t>(scene.input[k])], "input", refined.photos[k], out);
  }
  out.report["refined"] = !out.poses.empty();
  for (const int i : scene.held_out) {
    report(progress, done++ / photographs);
    const View& view = scene.views[static_cast<size_t>(i)];
    add_view(view, "held out", refine_pose(posed_photo(view, root), refined.points), out);
  }
  for (const char* which : {"error_before", "error_after"}) {
    out.report[which] = worst_error(out.report["views"], which);
  }
  out.warnings = remarks(out.report);
  terminal.end(refinement_words(out.report));
  return out;
}

void move_cameras(const RefinedPoses& refined, Scene& scene) {
  for (View& view : scene.views) {
    const auto pose = refined.poses.find(view.name);
    if (pose != refined.poses.end()) view.camera.world_from_cam = pose->second;
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
  if (inputs + held_out == 0) return "cameras stay as given";
  return std::to_string(inputs) + " input and " + std::to_string(held_out) +
         " held-out cameras moved, by at most " + number(degrees, "%.3f") + " degrees and " +
         number(distance) + " scene units; error of the input views " +
         number(report["error_before"], "%.2f") + " -> " + number(report["error_after"], "%.2f") +
         " pixels";
}

void write_refined_poses(const std::filesystem::path& folder, const RefinedPoses& refined) {
  make_output_folder(folder);
  Json poses = Json::object();
  for (const auto& [name, pose] : refined.poses) {
    const double* const numbers = pose.data();
    poses[name] = std::vector<double>(numbers, numbers + kNumbers);
  }
  write_file(folder / kFileName,
             json_text({{"inputs", refined.inputs},
                        {"report", refined.report},
                        {"warnings", refined.warnings},
                        {"poses", poses}}) +
                 "\n");
}

void forget_refined_poses(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove(folder / kFileName, error);
  if (error) throw IoError(folder / kFileName, error.message());
}

}  // namespace cgs
