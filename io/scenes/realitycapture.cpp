// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/realitycapture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/byte_reader.h"
#include "io/bytes/text_lines.h"
#include "io/images/image.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/photograph_index.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStart = "#name,";

constexpr std::array<std::string_view, 8> kCameraColumns = {
    "name", "x", "y", "alt", "heading", "pitch", "roll", "f"};

// Tables of points on the ground start alike, but do not turn.
bool has_needed_columns(std::string_view header) {
  const std::vector<std::string_view> names = fields(header.substr(1), ',');
  return std::all_of(kCameraColumns.begin(), kCameraColumns.end(), [&](std::string_view needed) {
    return std::find(names.begin(), names.end(), needed) != names.end();
  });
}

bool has_cameras(const fs::path& file) {
  constexpr uint64_t kEnough = 4096;
  try {
    const std::string start = read_file_start(file, kEnough);
    TextLines lines(start, file);
    while (const auto line = lines.next()) {
      if (line->starts_with(kStart)) return has_needed_columns(*line);
    }
    return false;
  } catch (const Error&) {
    return false;  // what cannot be read has none
  }
}

std::optional<std::string> csv_name(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (lower_extension(entry->path()) == ".csv") files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  const auto found = std::find_if(files.begin(), files.end(), has_cameras);
  if (found == files.end()) return std::nullopt;
  return found->filename().string();
}

// One line with the columns of the table.
class Row {
 public:
  Row(const std::map<std::string, size_t>& columns, const TextLines& lines, std::string_view line)
      : columns_(columns), lines_(lines), fields_(fields(line, ',')) {
    if (fields_.size() < columns.size()) {
      lines.fail(Defect::Schema,
                 "has " + std::to_string(fields_.size()) + " of " + std::to_string(columns.size()) +
                     " fields");
    }
  }
  std::string_view text(const std::string& column) const { return fields_[columns_.at(column)]; }
  double number(const std::string& column) const { return lines_.number(text(column)); }
  double number_or_0(const std::string& column) const {
    return columns_.contains(column) ? number(column) : 0;
  }

 private:
  const std::map<std::string, size_t>& columns_;
  const TextLines& lines_;
  std::vector<std::string_view> fields_;
};

Eigen::Isometry3d read_pose(const Row& row, const Refuse& refuse) {
  const auto turn = [&](const std::string& column, double sign, const Eigen::Vector3d& axis) {
    constexpr double kRadians = std::numbers::pi / 180;  // per degree
    return Eigen::AngleAxisd(sign * row.number(column) * kRadians, axis);
  };
  const Eigen::Matrix3d world_from_opengl =
      (turn("heading", -1, Eigen::Vector3d::UnitZ()) * turn("pitch", 1, Eigen::Vector3d::UnitX()) *
       turn("roll", 1, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const Eigen::Matrix3d opengl_from_opencv = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return checked_pose(world_from_opengl * opengl_from_opencv,
                      {row.number("x"), row.number("y"), row.number("alt")},
                      refuse);
}

void read_intrinsics(const Row& row, const Refuse& refuse, View& view) {
  constexpr double kFilm = 36;  // [mm]
  Camera& camera = view.camera;
  const ImageSize size = image_size(view.image_path);
  camera.width = size.width;
  camera.height = size.height;
  const double longer = std::max(size.width, size.height);
  camera.fx = camera.fy = row.number("f") * longer / kFilm;
  camera.cx = 0.5 * size.width + row.number_or_0("px") * longer;
  camera.cy = 0.5 * size.height + row.number_or_0("py") * longer;
  view.distortion = {row.number_or_0("k1"),
                     row.number_or_0("k2"),
                     row.number_or_0("t2"),  // t1 goes with r^2 + 2 x^2: it is p2 of OpenCV
                     row.number_or_0("t1"),
                     row.number_or_0("k3")};
  if (row.number_or_0("k4") != 0) {
    refuse(Defect::Unsupported, "k4 is not read: export undistorted images, or with fewer terms");
  }
  check_intrinsics(camera, refuse);
  check_distortion(camera, view.distortion, refuse);
}

std::map<std::string, size_t> read_columns(TextLines& lines) {
  while (const auto line = lines.next()) {
    if (!line->starts_with(kStart)) continue;
    std::map<std::string, size_t> out;
    const std::vector<std::string_view> names = fields(line->substr(1), ',');
    for (size_t i = 0; i < names.size(); ++i) {
      if (out.emplace(names[i], i).second) continue;
      lines.fail(Defect::Schema, "two columns are called " + std::string(names[i]));
    }
    for (const std::string_view needed : kCameraColumns) {
      if (!out.contains(std::string(needed))) {
        lines.fail(Defect::Schema,
                   "there is no column " + std::string(needed) +
                       "; export \"Internal/External camera parameters\"");
      }
    }
    return out;
  }
  throw BadInput(Defect::Schema, lines.path(), "no line starts with #name");
}

}  // namespace

bool is_realitycapture(const fs::path& folder) { return csv_name(folder).has_value(); }

Scene read_realitycapture(const SceneRoot& root) {
  const std::string name = csv_name(root.folder).value_or("cameras.csv");
  const fs::path path = resolve_in_scene(root, name, root.folder);
  ReadLimits limits;
  limits.max_file_bytes = limits.max_json_bytes;
  const std::string bytes = read_file(path, limits);
  TextLines lines(bytes, path);
  const std::map<std::string, size_t> columns = read_columns(lines);
  PhotographIndex photographs(root);
  const Refuse refuse = [&](Defect defect, const std::string& why) { lines.fail(defect, why); };
  Scene scene;
  scene.kind = SceneKind::RealityCapture;
  scene.folder = root.folder;
  scene.frame.up = Eigen::Vector3d::UnitZ();  // heading, pitch and altitude are about it
  while (const auto line = lines.next_data()) {
    const Row row(columns, lines, *line);
    View view;
    view.camera.world_from_cam = read_pose(row, refuse);
    view.image_path = photographs.take(row.text("name"));
    if (view.image_path.empty()) {
      scene.missing.emplace_back(row.text("name"));  // nothing would ever tell its size
      continue;
    }
    view.name = name_below(root.folder, view.image_path);
    read_intrinsics(row, refuse, view);
    if (scene.views.size() >= limits.max_views) lines.fail(Defect::Count, "too many cameras");
    scene.views.push_back(std::move(view));
  }
  for (const std::string& note : photographs.notes()) scene.notes.push_back(note);
  if (scene.views.empty() && scene.missing.empty()) {
    throw BadInput(Defect::Empty, path, "there is no camera");
  }
  return scene;
}

}  // namespace cgs
