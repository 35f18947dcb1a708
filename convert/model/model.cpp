// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include <Eigen/Eigenvalues>

#include "convert/text/stated_frame.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "io/images/exif.h"
#include "io/images/exr.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/masks.h"
#include "io/scenes/orientation.h"
#include "io/scenes/photographs.h"
#include "io/scenes/scene_reader.h"
#include "io/splats/gaussian_ply.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

template <typename T>
std::vector<float> as_floats(const Raster<T>& raster) {
  std::vector<float> out(raster.data.size());
  std::transform(raster.data.begin(), raster.data.end(), out.begin(), [](T value) {
    return static_cast<float>(value);
  });
  return out;
}

Raster<float> as_raster(const ExrImage& image,
                        const std::string& channel,
                        const std::string& file) {
  const std::vector<float>* values = image.find(channel);
  if (values == nullptr) {
    throw BadInput(Defect::Schema, file, "has no channel '" + channel + "'");
  }
  Raster<float> raster(image.width, image.height, 0);
  raster.data = *values;
  return raster;
}

// Of what was written as bytes. Others are refused: cut to a byte, one label would become another.
Raster<uint8_t> as_bytes(const ExrImage& image,
                         const std::string& channel,
                         const std::string& file) {
  const Raster<float> values = as_raster(image, channel, file);
  Raster<uint8_t> out(image.width, image.height, 0);
  for (int y = 0; y < values.height; ++y) {
    for (int x = 0; x < values.width; ++x) {
      const float value = values(x, y);
      if (!(value >= 0 && value <= 255 && value == std::floor(value))) {
        throw BadInput(Defect::Value,
                       file,
                       "channel '" + channel +
                           "' must hold whole numbers in 0 ... 255, but holds " +
                           std::to_string(value) + " at pixel (" + std::to_string(x) + ", " +
                           std::to_string(y) + ")");
      }
      out(x, y) = static_cast<uint8_t>(value);
    }
  }
  return out;
}

std::filesystem::path priors_path(const std::filesystem::path& folder, const View& view) {
  return folder / "priors" / (view.name + ".exr");
}

// Depths stay in internal units here: the file is for resuming, and restores the same bits.
void write_priors(const std::filesystem::path& path, const ViewPriors& priors) {
  ExrImage image;
  image.width = priors.depth.width;
  image.height = priors.depth.height;
  image.channels = {{"Z", priors.depth.data},
                    {"confidence.Y", priors.confidence.data},
                    {"layer.Y", as_floats(priors.layer)},
                    {"matched.Y", as_floats(priors.matched_views)},
                    {"origin.Y", as_floats(priors.origin)},
                    {"sigma.Y", priors.sigma.data}};
  if (!priors.shown_finer.empty()) {
    image.channels.emplace_back("shown_finer.Y", as_floats(priors.shown_finer));
  }
  image.text["cgs:units"] = "internal";
  write_exr(path, image);
}

ViewPriors read_priors(const std::filesystem::path& path, const Camera& camera) {
  const ExrImage image = read_exr(path);
  if (image.width != camera.width || image.height != camera.height) {
    throw BadInput(Defect::Mismatch,
                   path,
                   "is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                       ", its camera " + std::to_string(camera.width) + " x " +
                       std::to_string(camera.height));
  }
  const std::string file = path.string();
  ViewPriors priors;
  priors.depth = as_raster(image, "Z", file);
  priors.sigma = as_raster(image, "sigma.Y", file);
  priors.confidence = as_raster(image, "confidence.Y", file);
  priors.layer = as_bytes(image, "layer.Y", file);
  priors.matched_views = as_bytes(image, "matched.Y", file);
  if (image.find("shown_finer.Y") != nullptr) {
    priors.shown_finer = as_bytes(image, "shown_finer.Y", file);
  }
  const Raster<uint8_t> origin = as_bytes(image, "origin.Y", file);
  priors.origin = Raster<DepthOrigin>(image.width, image.height, DepthOrigin::Unknown);
  std::transform(origin.data.begin(), origin.data.end(), priors.origin.data.begin(), [](uint8_t v) {
    return v > static_cast<uint8_t>(DepthOrigin::Continued) ? DepthOrigin::Unknown
                                                            : static_cast<DepthOrigin>(v);
  });
  return priors;
}

// Cameras in the coordinates of the splats' file go where the splats went.
void move_foreign_cameras(Scene& scene, const GaussianFile& splats) {
  scene.frame = splats.frame;
  for (View& view : scene.views) {
    Eigen::Isometry3d& pose = view.camera.world_from_cam;
    const Eigen::Vector3d from_origin = scene.frame.origin - splats.file_origin;
    pose.translation() = (pose.translation() - from_origin) / scene.frame.scale;
    view.near /= scene.frame.scale;
    view.far /= scene.frame.scale;
  }
}

// What the model that lies in a folder wrote per input view; nothing if there is none.
std::set<std::filesystem::path> priors_in(const std::filesystem::path& folder) {
  std::set<std::filesystem::path> out;
  if (!is_present(folder / "cameras.json")) return out;
  try {
    const Scene scene = read_cameras_json(folder / "cameras.json");
    for (const int i : scene.input) {
      out.insert(priors_path(folder, scene.views[static_cast<size_t>(i)]));
    }
  } catch (const Error&) {
    out.clear();  // damaged, or of another program: it wrote none
  }
  return out;
}

// Removes the pictures of an earlier fill.
void remove_pictures(const std::filesystem::path& folder) {
  const std::filesystem::path pictures = folder / kSurroundingsFolder;
  if (!is_folder(pictures)) return;
  for (const std::string& name : sorted_entries(pictures)) {
    if (name.starts_with("hole_") && name.ends_with(".png")) {
      std::filesystem::remove(pictures / name);
    }
  }
  std::error_code holds_other_files;
  std::filesystem::remove(pictures, holds_other_files);
}

void write_fill(const std::filesystem::path& folder,
                const Gaussians& fill,
                const PicturesBeside& pictures,
                const Frame& frame) {
  write_pictures_beside(folder, pictures);
  if (fill.size() == 0) {
    std::filesystem::remove(folder / kFillFile);  // of another model
    return;
  }
  write_gaussian_ply(folder / kFillFile, fill, frame, "painted into holes: no photograph saw it");
}

// \throws BadInput if some of it is not said to be made up
Gaussians read_fill(const std::filesystem::path& path, const Frame& frame) {
  GaussianFile file = read_gaussian_ply(path, frame);
  const size_t made_up = synthetic_count(file.gaussians);
  if (made_up < file.gaussians.size()) {
    throw BadInput(Defect::Value,
                   path,
                   std::to_string(file.gaussians.size() - made_up) +
                       " splats are not tagged synthetic; in a fill all must be");
  }
  return std::move(file.gaussians);
}

void copy_bytes(const std::filesystem::path& from, const std::filesystem::path& to) {
  AtomicFile file(to);
  read_in_parts(from, [&](std::string_view bytes) { file.write(bytes); });
  file.commit();
}

}  // namespace

std::filesystem::path model_folder(const std::filesystem::path& folder) {
  const std::filesystem::path within = folder / "model";
  const bool is_within = is_present(folder / "run.json") || is_present(within / "gaussians.ply");
  return !is_present(folder / "gaussians.ply") && is_folder(within) && is_within ? within : folder;
}

bool holds_model(const std::filesystem::path& folder) {
  const std::filesystem::path model = model_folder(folder);
  return is_present(model / "gaussians.ply") && is_present(model / "cameras.json");
}

void write_model(const std::filesystem::path& folder, const Model& model) {
  std::set<std::filesystem::path> earlier = priors_in(folder);
  make_output_folder(folder / "priors");
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const View& view = model.scene.views[static_cast<size_t>(model.scene.input[k])];
    write_priors(priors_path(folder, view), model.priors[k]);
    earlier.erase(priors_path(folder, view));
  }
  write_gaussian_ply(folder / "gaussians.ply", model.gaussians, model.scene.frame, model.evidence);
  write_fill(folder, model.fill, {}, model.scene.frame);
  write_cameras_json(folder / "cameras.json", model.scene);  // last: by it the scale is told
  for (const std::filesystem::path& file : earlier) std::filesystem::remove(file);
}

void write_pictures_beside(const std::filesystem::path& folder, const PicturesBeside& pictures) {
  remove_pictures(folder);
  if (!pictures.empty()) make_output_folder(folder / kSurroundingsFolder);
  for (const auto& [name, bytes] : pictures) write_file(folder / name, bytes);
}

void write_filled_model(const std::filesystem::path& folder,
                        const Model& model,
                        const Gaussians& fill,
                        const PicturesBeside& pictures,
                        const std::filesystem::path& output) {
  const std::filesystem::path from = model_folder(folder);
  std::set<std::filesystem::path> earlier = priors_in(output);
  make_output_folder(output / "priors");
  for (const int i : model.scene.input) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    copy_bytes(priors_path(from, view), priors_path(output, view));
    earlier.erase(priors_path(output, view));
  }
  copy_bytes(from / "gaussians.ply", output / "gaussians.ply");
  write_fill(output, fill, pictures, model.scene.frame);
  copy_bytes(from / "cameras.json", output / "cameras.json");
  for (const std::filesystem::path& file : earlier) std::filesystem::remove(file);
}

bool restate_frame(const std::filesystem::path& folder, const Model& model) {
  const bool is_own = restate_gaussian_ply(folder / "gaussians.ply", model.scene.frame);
  if (!is_own) {
    write_gaussian_ply(
        folder / "gaussians.ply", model.gaussians, model.scene.frame, model.evidence);
  }
  write_cameras_json(folder / "cameras.json", model.scene);
  return is_own;
}

Model read_model(const std::filesystem::path& folder) {
  Model model = read_model_as_written(folder);
  use_metres_where_measured(model.scene);
  return model;
}

void use_metres_where_measured(Scene& scene) {
  const bool is_measured = scene.frame.scale_source == ScaleSource::KnownDistance ||
                           scene.frame.scale_source == ScaleSource::DepthSensor;
  if (scene.kind == SceneKind::Photographs && is_measured) scene.frame = in_metres(scene.frame);
}

Model read_model_as_written(const std::filesystem::path& folder) {
  if (!is_folder(folder)) {
    throw BadInput(Defect::Open, folder, "no such folder; give the model folder of a run");
  }
  if (model_folder(folder) != folder) return read_model_as_written(model_folder(folder));
  Model model;
  model.scene = read_cameras_json(folder / "cameras.json");
  const bool has_frame = model.scene.kind != SceneKind::ForeignCameras;
  const auto frame = has_frame ? std::optional(model.scene.frame) : std::nullopt;
  GaussianFile file = read_gaussian_ply(folder / "gaussians.ply", frame);
  if (!has_frame) move_foreign_cameras(model.scene, file);
  if (!model.scene.frame.knows_up()) model.scene.frame.up = world_up(model.scene);
  model.gaussians = std::move(file.gaussians);
  model.evidence = std::move(file.evidence);
  if (is_present(folder / kFillFile)) {
    model.fill = read_fill(folder / kFillFile, model.scene.frame);
  }
  model.scene.warnings = std::move(file.warnings);
  for (const int i : model.scene.input) {
    const View& view = model.scene.views[static_cast<size_t>(i)];
    model.priors.push_back(read_priors(priors_path(folder, view), view.camera));
  }
  return model;
}

namespace {

// Photographs whose cameras were solved for have their file names as names of views: without what
// comes after the dot, but for the second of one stem.
void relink_photographs(Scene& scene, const std::vector<PhotoFile>& photographs) {
  for (View& view : scene.views) {
    const auto find = [&](const auto& name_of) {
      return std::find_if(photographs.begin(), photographs.end(), [&](const PhotoFile& photograph) {
        return name_of(photograph.path) == view.name;
      });
    };
    auto found = find([](const std::filesystem::path& path) { return path.filename(); });
    if (found == photographs.end()) {
      found = find([](const std::filesystem::path& path) { return path.stem(); });
    }
    if (found != photographs.end()) view.image_path = found->path;
  }
}

}  // namespace

void relink_views(Scene& scene, const Scene& found) {
  for (View& view : scene.views) {
    const auto match = std::find_if(found.views.begin(), found.views.end(), [&](const View& other) {
      return other.name == view.name;
    });
    if (match == found.views.end()) continue;
    view.image_path = match->image_path;
    view.mask_path = match->mask_path;
  }
  scene.cache = found.cache;
}

void relink_images(Scene& scene, const std::filesystem::path& folder, bool allow_external) {
  scene.folder = folder;
  for (View& view : scene.views) {
    view.image_path.clear();
    view.mask_path.clear();
  }
  if (is_photographs(folder)) {
    relink_photographs(scene, list_photographs({folder, allow_external}));
    find_masks({folder, allow_external}, scene);
  } else {
    SceneOptions options;
    options.allow_external = allow_external;
    relink_views(scene, read_scene(folder, options));
  }
  for (const View& view : scene.views) {
    if (view.image_path.empty()) {
      scene.warnings.push_back(printable(folder) + " has no photograph of view " +
                               printable(view.name));
    }
  }
}

namespace {

// How a photograph is to be turned that its camera takes as it lies in the file; 1 = not at all.
int ignored_orientation(const View& view) {
  if (view.image_path.empty() || !is_present(view.image_path)) return 1;
  const int orientation = exif_orientation(view.image_path);
  return orientation == view.orientation ? 1 : orientation;
}

// Of a picture as one looks at it, in axes of the file's.
struct PictureAxes {
  Eigen::Vector3d right;
  Eigen::Vector3d down;
};

PictureAxes picture_axes(int orientation) {
  const auto at = [&](double x, double y) { return stored_pixel({x, y}, {1, 1}, orientation); };
  PictureAxes out;
  out.right << at(1, 0) - at(0, 0), 0;
  out.down << at(0, 1) - at(0, 0), 0;
  return out;
}

}  // namespace

Eigen::Vector3d world_up(const Scene& scene) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) {
    const Eigen::Matrix3d R = view.camera.world_from_cam.rotation();
    const PictureAxes axes = picture_axes(ignored_orientation(view));
    const Eigen::Vector3d right = R * axes.right;
    spread += right * right.transpose();
    mean_up -= R * axes.down;
  }
  if (!(mean_up.norm() > 1e-6)) return Eigen::Vector3d::UnitZ();
  mean_up.normalize();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  // The image x axes of level cameras lie in the horizontal plane and, once the cameras turn by
  // some degrees, span it; its normal is then free of the cameras' pitch.
  constexpr double kMinTurn = 0.004;  // second to first eigenvalue: about +-3.6 degrees
  constexpr double kLevel = 0.05;     // third to second: the axes do lie in a plane
  const Eigen::Vector3d& values = eigen.eigenvalues();
  if (values[1] < kMinTurn * values[2] || values[0] > kLevel * values[1]) return mean_up;
  const Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  return normal.dot(mean_up) < 0 ? Eigen::Vector3d(-normal) : normal;
}

Eigen::Vector3d up_of(const Scene& scene, const std::vector<double>& stated) {
  if (!stated.empty()) return up_direction(stated);
  return scene.frame.knows_up() ? scene.frame.up : world_up(scene);
}

size_t turned_photographs(const Scene& scene) {
  return static_cast<size_t>(
      std::count_if(scene.views.begin(), scene.views.end(), [](const View& view) {
        return ignored_orientation(view) != 1;
      }));
}

}  // namespace cgs
