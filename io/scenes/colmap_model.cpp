// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_model.h"

#include <algorithm>
#include <set>
#include <span>

#include "io/bytes/text_lines.h"
#include "io/scenes/camera_checks.h"
#include "io/scenes/fisheye_map.h"

namespace cgs {

namespace {

struct CameraModel {
  int id;
  std::string_view name;
  size_t parameters;
};

// Those that are read.
constexpr std::array<CameraModel, 8> kModels = {{{0, "SIMPLE_PINHOLE", 3},
                                                 {1, "PINHOLE", 4},
                                                 {2, "SIMPLE_RADIAL", 4},
                                                 {3, "RADIAL", 5},
                                                 {4, "OPENCV", 8},
                                                 {5, "OPENCV_FISHEYE", 8},
                                                 {8, "SIMPLE_RADIAL_FISHEYE", 4},
                                                 {9, "RADIAL_FISHEYE", 5}}};

// How many parameters stand in a binary file for the others.
constexpr std::array<CameraModel, 10> kOtherModels = {{{6, "FULL_OPENCV", 12},
                                                       {7, "FOV", 5},
                                                       {10, "THIN_PRISM_FISHEYE", 12},
                                                       {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16},
                                                       {12, "SIMPLE_DIVISION", 4},
                                                       {13, "DIVISION", 5},
                                                       {14, "SIMPLE_FISHEYE", 3},
                                                       {15, "FISHEYE", 4},
                                                       {16, "EUCM", 6},
                                                       {17, "EQUIRECTANGULAR", 2}}};

// Null if the list has no such model.
template <size_t N>
const CameraModel* model_of(const std::array<CameraModel, N>& models, int32_t id) {
  const auto* const found = std::find_if(
      models.begin(), models.end(), [&](const CameraModel& model) { return model.id == id; });
  return found == models.end() ? nullptr : found;
}

std::string unsupported(const std::string& model) {
  return "camera model " + model +
         " is not read; known are SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, "
         "SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE and OPENCV_FISHEYE: undistort the images first "
         "(colmap image_undistorter)";
}

// Parameters in COLMAP's order: f | fx fy, cx, cy, distortion.
ColmapCamera camera_from(const CameraModel& model,
                         uint64_t width,
                         uint64_t height,
                         std::span<const double> p,
                         const Refuse& refuse) {
  constexpr uint64_t kMaxSide = (uint64_t{1} << 31) - 1;
  if (width > kMaxSide || height > kMaxSide) {
    refuse(Defect::Value, "declares " + std::to_string(width) + " x " + std::to_string(height));
  }
  ColmapCamera out;
  out.camera.width = static_cast<int>(width);
  out.camera.height = static_cast<int>(height);
  const bool has_two_focals =
      model.name == "PINHOLE" || model.name == "OPENCV" || model.name == "OPENCV_FISHEYE";
  const size_t rest = has_two_focals ? 2 : 1;
  out.camera.fx = p[0];
  out.camera.fy = has_two_focals ? p[1] : p[0];
  out.camera.cx = p[rest];
  out.camera.cy = p[rest + 1];
  const auto distortion = p.subspan(rest + 2);
  if (model.name.ends_with("FISHEYE")) {
    out.fisheye = Fisheye{out.camera, {}, {}, 0};
    std::copy(distortion.begin(), distortion.end(), out.fisheye->k.begin());
    check_fisheye(*out.fisheye, refuse);
    return out;
  }
  // k1 | k1 k2 | k1 k2 p1 p2: our order
  std::copy(distortion.begin(), distortion.end(), out.distortion.begin());
  check_intrinsics(out.camera, refuse);
  check_distortion(out.camera, out.distortion, refuse);
  return out;
}

void check_unique(std::set<uint32_t>& ids, uint32_t id, const Refuse& refuse) {
  if (!ids.insert(id).second) refuse(Defect::Syntax, "id " + std::to_string(id) + " occurs twice");
}

uint32_t id_from(const TextLines& lines, std::string_view token) {
  const uint64_t id = lines.count(token);
  if (id > UINT32_MAX) lines.fail(Defect::Syntax, "id above 2^32");
  return static_cast<uint32_t>(id);
}

}  // namespace

ColmapCameras read_colmap_cameras_binary(const std::filesystem::path& path,
                                         const std::set<uint32_t>* used) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "a COLMAP model");
  ByteReader file(bytes, path);
  const auto count = file.get<uint64_t>("number of cameras");
  file.expect_records(count, 24 + 2 * 8, "cameras");
  ColmapCameras cameras;
  std::set<uint32_t> ids;
  for (uint64_t i = 0; i < count; ++i) {
    const auto id = file.get<uint32_t>("camera id");
    const Refuse refuse = [&](Defect defect, const std::string& reason) {
      file.fail(defect, "camera " + std::to_string(id) + ": " + reason);
    };
    const auto model_id = file.get<int32_t>("camera model");
    const bool is_used = used == nullptr || used->contains(id);
    const CameraModel* const model = model_of(kModels, model_id);
    const CameraModel* const other = model_of(kOtherModels, model_id);
    if (model == nullptr && (other == nullptr || is_used)) {
      refuse(Defect::Unsupported,
             unsupported(other != nullptr ? std::string(other->name) : std::to_string(model_id)));
    }
    const auto width = file.get<uint64_t>("camera width");
    const auto height = file.get<uint64_t>("camera height");
    std::vector<double> parameters(model != nullptr ? model->parameters : other->parameters);
    for (double& p : parameters) p = file.get<double>("camera parameter");
    if (!ids.insert(id).second) refuse(Defect::Syntax, "the id occurs twice");
    if (is_used) cameras.emplace(id, camera_from(*model, width, height, parameters, refuse));
  }
  return cameras;
}

ColmapCameras read_colmap_cameras_text(const std::filesystem::path& path,
                                       const std::set<uint32_t>* used) {
  const std::string text = read_file(path);
  refuse_foreign_content(path, text, "a COLMAP model");
  TextLines lines(text, path);
  ColmapCameras cameras;
  std::set<uint32_t> ids;
  while (const auto line = lines.next_data()) {
    const auto parts = tokens(*line);
    if (parts.size() < 4) lines.fail(Defect::Syntax, "expected id, model, width and height");
    const uint32_t id = id_from(lines, parts[0]);
    const Refuse refuse = [&](Defect defect, const std::string& reason) {
      lines.fail(defect, "camera " + std::to_string(id) + ": " + reason);
    };
    if (!ids.insert(id).second) refuse(Defect::Syntax, "the id occurs twice");
    if (used != nullptr && !used->contains(id)) continue;
    const auto* const model = std::find_if(
        kModels.begin(), kModels.end(), [&](const CameraModel& m) { return m.name == parts[1]; });
    if (model == kModels.end()) {
      refuse(Defect::Unsupported, unsupported(printable(std::string(parts[1].substr(0, 40)))));
    }
    if (parts.size() != 4 + model->parameters) {
      refuse(Defect::Syntax, "expected " + std::to_string(model->parameters) + " parameters");
    }
    std::vector<double> parameters;
    for (const auto& part : std::span(parts).subspan(4)) parameters.push_back(lines.number(part));
    cameras.emplace(
        id, camera_from(*model, lines.count(parts[2]), lines.count(parts[3]), parameters, refuse));
  }
  return cameras;
}

std::vector<ColmapImage> read_colmap_images_binary(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "a COLMAP model");
  ByteReader file(bytes, path);
  const auto count = file.get<uint64_t>("number of images");
  file.expect_records(count, 4 + 7 * 8 + 4 + 1 + 8, "images");
  std::vector<ColmapImage> images(count);
  std::set<uint32_t> ids;
  for (ColmapImage& image : images) {
    image.id = file.get<uint32_t>("image id");
    check_unique(ids, image.id, [&](Defect d, const std::string& why) { file.fail(d, why); });
    for (double& q : image.rotation) q = file.get<double>("rotation");
    for (double& t : image.translation) t = file.get<double>("translation");
    image.camera_id = file.get<uint32_t>("camera id");
    image.name = file.take_c_string(ReadLimits{}.max_name_bytes, "image name");
    image.keypoints = file.get<uint64_t>("number of keypoints");
    constexpr uint64_t kKeypointBytes = 24;
    file.expect_records(image.keypoints, kKeypointBytes, "keypoints");
    file.take(image.keypoints * kKeypointBytes, "keypoints");
  }
  return images;
}

std::vector<ColmapImage> read_colmap_images_text(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  refuse_foreign_content(path, text, "a COLMAP model");
  TextLines lines(text, path);
  std::vector<ColmapImage> images;
  std::set<uint32_t> ids;
  while (const auto line = lines.next_data()) {
    const auto parts = tokens(*line);
    constexpr size_t kBeforeName = 9;
    if (parts.size() <= kBeforeName) {
      lines.fail(Defect::Syntax, "expected id, rotation, translation, camera id and name");
    }
    ColmapImage image;
    image.id = id_from(lines, parts[0]);
    check_unique(ids, image.id, [&](Defect d, const std::string& why) { lines.fail(d, why); });
    for (size_t i = 0; i < 4; ++i) {
      image.rotation[Eigen::Index(i)] = lines.number(parts[1 + i]);
    }
    for (size_t i = 0; i < 3; ++i) {
      image.translation[Eigen::Index(i)] = lines.number(parts[5 + i]);
    }
    image.camera_id = id_from(lines, parts[8]);
    // Names may contain spaces: everything up to the end of the last part.
    const char* const begin = parts[kBeforeName].data();
    image.name.assign(begin, parts.back().data() + parts.back().size());
    const auto keypoints = lines.next();
    if (!keypoints) lines.fail(Defect::Syntax, "an image without its line of keypoints");
    const size_t numbers = tokens(*keypoints).size();
    if (numbers % 3 != 0) lines.fail(Defect::Syntax, "keypoints are triples X, Y, POINT3D_ID");
    image.keypoints = numbers / 3;
    images.push_back(std::move(image));
  }
  return images;
}

std::vector<ColmapPoint> read_colmap_points_binary(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "a COLMAP model");
  ByteReader file(bytes, path);
  const auto count = file.get<uint64_t>("number of points");
  file.expect_records(count, 8 + 3 * 8 + 3 + 8 + 8, "points");
  std::vector<ColmapPoint> points(count);
  for (ColmapPoint& point : points) {
    file.get<uint64_t>("point id");
    for (double& x : point.position) x = file.get<double>("position");
    file.take(3 + 8, "colour and error");
    const auto length = file.get<uint64_t>("track length");
    file.expect_records(length, 8, "observations");
    point.track.resize(length);
    for (auto& [image_id, index] : point.track) {
      image_id = file.get<uint32_t>("image id");
      index = file.get<uint32_t>("keypoint index");
    }
  }
  return points;
}

std::vector<ColmapPoint> read_colmap_points_text(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::file_size(path, ignored) == 0) {
    return {};
  }
  const std::string text = read_file(path);
  refuse_foreign_content(path, text, "a COLMAP model");
  TextLines lines(text, path);
  std::vector<ColmapPoint> points;
  while (const auto line = lines.next_data()) {
    const auto parts = tokens(*line);
    constexpr size_t kBeforeTrack = 8;
    if (parts.size() < kBeforeTrack || parts.size() % 2 != 0) {
      lines.fail(Defect::Syntax, "expected id, position, colour, error and pairs of a track");
    }
    ColmapPoint point;
    for (size_t i = 0; i < 3; ++i) {
      point.position[Eigen::Index(i)] = lines.number(parts[1 + i]);
    }
    for (size_t i = kBeforeTrack; i < parts.size(); i += 2) {
      point.track.emplace_back(id_from(lines, parts[i]), id_from(lines, parts[i + 1]));
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace cgs
