// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/given_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/scenes/camera_checks.h"
#include "io/scenes/colmap_depth.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/fisheye_map.h"
#include "io/scenes/lens.h"
#include "io/scenes/orientation.h"
#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/core/remedy.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

constexpr float kSameSurface = 0.05f;  // relative step between values that may be averaged

// The file in a folder "depth" that goes with that of a photograph.
fs::path depth_beside(const SceneRoot& root, const fs::path& photograph) {
  for (const fs::path& folder : companion_folders(root, photograph.parent_path(), "depth")) {
    const fs::path inside = resolve_in_scene(root, folder.string(), root.folder);
    fs::path file = depth_file_of({inside, root.allow_external}, photograph.filename());
    if (!file.empty()) return file;
  }
  return {};
}

// Takes out what a file calls 0: low.
void drop_low_confidence(const fs::path& file, Raster<float>& values) {
  const Raster<float> confidence = read_samples(file).values;
  if (confidence.width != values.width || confidence.height != values.height) {
    throw BadInput(Defect::Mismatch, file, "is not of the size of its depth");
  }
  for (size_t i = 0; i < values.data.size(); ++i) {
    if (!(confidence.data[i] > 0)) values.data[i] = kNaN;
  }
}

// Values whose shape is that of the photograph: upright, as masks are, or else as it is stored.
Raster<float> upright(const Raster<float>& values, const View& view, const ImageSize& photograph) {
  const auto fits = [&](const ImageSize& size) {
    const double difference =
        double(size.height) * values.width - double(size.width) * values.height;
    const int longest = std::max({size.width, size.height, values.width, values.height});
    return std::abs(difference) <= longest;  // one size is the other, rounded to whole pixels
  };
  const bool is_turned = view.orientation >= 5;
  const ImageSize stored = is_turned ? ImageSize{photograph.height, photograph.width} : photograph;
  if (fits(photograph)) return values;
  if (fits(stored)) return turned(values, view.orientation);
  throw BadInput(Defect::Mismatch,
                 view.depth_path,
                 "the depth has " + std::to_string(values.width) + " x " +
                     std::to_string(values.height) + " pixels, its photograph " +
                     std::to_string(photograph.width) + " x " + std::to_string(photograph.height) +
                     ", which is another shape");
}

// COLMAP makes depth maps of pictures that it has undistorted itself, of another camera than this.
void refuse_map_of_distorted(const View& view) {
  if (!has_lens_distortion(view) || !is_colmap_depth_name(view.depth_path)) return;
  throw BadInput(Defect::Mismatch,
                 view.depth_path,
                 "is the depth of COLMAP's undistorted picture, but this photograph has lens "
                 "distortion; open the folder with images/, sparse/ and stereo/ instead");
}

// Where a pixel of the undistorted picture lies in the photograph; NaN where the lens never put it.
class Lens {
 public:
  explicit Lens(const View& view)
      : camera_(view.camera), k_(view.distortion), fold_(fold_radius(view.distortion)) {
    if (view.fisheye) fisheye_.emplace(*view.fisheye);
  }

  /// As shares of width and height of the photograph.
  Eigen::Array2d operator()(double u, double v) const {
    if (!fisheye_) return bent(u, v).array() / size_of(camera_);
    const Eigen::Array2d full =
        Eigen::Array2d(u, v) / size_of(camera_) * size_of(fisheye_->picture());
    return fisheye_->in_photograph(full).array() / size_of(fisheye_->photograph());
  }
  /// Share of width and height under a pixel on the axis.
  Eigen::Array2d pixel() const {
    if (!fisheye_) return size_of(camera_).inverse();
    return size_of(fisheye_->picture()) / size_of(camera_) / size_of(fisheye_->photograph());
  }

 private:
  static Eigen::Array2d size_of(const Camera& camera) { return {camera.width, camera.height}; }

  Eigen::Vector2d bent(double u, double v) const {
    if (k_ == std::array<double, 5>{}) return {u, v};
    const Eigen::Vector2d p = camera_.ray_in_cam(u, v).head<2>();
    if (!(p.norm() < fold_)) return Eigen::Vector2d::Constant(double(kNaN));
    const double r2 = p.squaredNorm();
    const double radial = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]));
    const double xy = p.x() * p.y();
    const Eigen::Vector2d tangential(2 * k_[2] * xy + k_[3] * (r2 + 2 * p.x() * p.x()),
                                     k_[2] * (r2 + 2 * p.y() * p.y()) + 2 * k_[3] * xy);
    const Eigen::Vector2d q = radial * p + tangential;
    return {camera_.fx * q.x() + camera_.cx, camera_.fy * q.y() + camera_.cy};
  }

  const Camera& camera_;
  const std::array<double, 5>& k_;
  double fold_;
  std::optional<FisheyeMap> fisheye_;
};

bool is_like(float value, float reference) {
  return std::abs(value - reference) <= kSameSurface * reference;  // not if NaN
}

// Between the four values around a point, of those that go with the nearest. 0 <= u < width.
float interpolated(const Raster<float>& values, double u, double v) {
  const float nearest = values(static_cast<int>(u), static_cast<int>(v));
  if (std::isnan(nearest)) return kNaN;
  const double left = std::floor(u - 0.5);
  const double top = std::floor(v - 0.5);
  const double s = u - 0.5 - left;
  const double t = v - 0.5 - top;
  double sum = 0;
  double weight = 0;
  for (int k = 0; k < 4; ++k) {
    const int x = std::clamp(static_cast<int>(left) + k % 2, 0, values.width - 1);
    const int y = std::clamp(static_cast<int>(top) + k / 2, 0, values.height - 1);
    if (!is_like(values(x, y), nearest)) continue;
    const double w = (k % 2 == 1 ? s : 1 - s) * (k / 2 == 1 ? t : 1 - t);
    sum += w * double(values(x, y));
    weight += w;
  }
  return static_cast<float>(sum / weight);  // the nearest weighs at least a quarter
}

// Of the values under a pixel of the given size around a point; NaN if most of them are.
float averaged(const Raster<float>& values, double u, double v, double width, double height) {
  const auto first = [](double at, double size) {
    return std::max(0, static_cast<int>(std::ceil(at - 0.5 * size - 0.5)));
  };
  const auto end = [](double at, double size, int side) {
    return std::min(side, static_cast<int>(std::ceil(at + 0.5 * size - 0.5)));
  };
  std::vector<float> under;
  size_t all = 0;
  for (int y = first(v, height); y < end(v, height, values.height); ++y) {
    for (int x = first(u, width); x < end(u, width, values.width); ++x) {
      ++all;
      if (!std::isnan(values(x, y))) under.push_back(values(x, y));
    }
  }
  if (under.empty() || 2 * under.size() < all) return kNaN;
  std::sort(under.begin(), under.end());
  const float median = under[(under.size() - 1) / 2];
  double sum = 0;
  int count = 0;
  for (const float value : under) {
    if (!is_like(value, median)) continue;
    sum += double(value);
    ++count;
  }
  return static_cast<float>(sum / count);
}

// Whether a value lies between those on two sides of it, far from both.
bool is_between(float a, float value, float b) {
  const auto [low, high] = std::minmax(a, b);
  return low < value && value < high && !is_like(low, value) && !is_like(high, value);
}

// Without what a sensor measured where a pixel of it saw two surfaces: on neither of them. Spread
// over several pixels of a photograph it would look like surface.
Raster<float> without_mixed(const Raster<float>& values) {
  Raster<float> out = values;
  for (int y = 0; y < values.height; ++y) {
    for (int x = 0; x < values.width; ++x) {
      const bool has_sides = x > 0 && x + 1 < values.width;
      const bool has_rows = y > 0 && y + 1 < values.height;
      const float value = values(x, y);
      const bool is_mixed = (has_sides && is_between(values(x - 1, y), value, values(x + 1, y))) ||
                            (has_rows && is_between(values(x, y - 1), value, values(x, y + 1)));
      if (is_mixed) out(x, y) = kNaN;
    }
  }
  return out;
}

// How many views would find each file beside their photograph: names repeat in folders of rigs.
std::map<fs::path, int> uses_of_files_beside(const Scene& scene, const SceneRoot& root) {
  std::map<fs::path, int> out;
  for (const View& view : scene.views) {
    if (view.image_path.empty() || !view.depth_path.empty()) continue;
    try {
      ++out[depth_beside(root, view.image_path)];
    } catch (const Error&) {
      continue;  // told of input views
    }
  }
  return out;
}

// Gives a view the file that lies beside its photograph, if it can be its depth. Nobody named it,
// so what is wrong with it is no reason to stop. \return that, or nothing
std::string find_depth_beside(View& view,
                              const SceneRoot& root,
                              const std::map<fs::path, int>& uses) {
  try {
    const fs::path file = depth_beside(root, view.image_path);
    if (file.empty()) return "";
    if (uses.at(file) > 1) throw BadInput(Defect::Ref, file, "lies beside several photographs");
    view.depth_path = file;
    refuse_map_of_distorted(view);
    (void)upright(read_depth_file(file).values, view, photograph_size(view));
    return "";
  } catch (const Error& error) {
    view.depth_path.clear();
    return error.what();
  }
}

// \return the input views whose file was left out, with a warning
std::set<int> find_all_beside(Scene& scene, const SceneRoot& root) {
  const std::map<fs::path, int> uses = uses_of_files_beside(scene, root);
  std::set<int> out;
  for (const int i : scene.input) {
    View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty() || !view.depth_path.empty()) continue;
    const std::string why = find_depth_beside(view, root, uses);
    if (why.empty()) continue;
    scene.warnings.push_back("the depth beside view " + printable(view.name) +
                             " is not used: " + why);
    out.insert(i);
  }
  return out;
}

DepthMap resampled(const Raster<float>& values, const View& view) {
  const Camera& camera = view.camera;
  const bool has_same_size = values.width == camera.width && values.height == camera.height;
  if (has_same_size && !has_lens_distortion(view)) return values;
  const Lens lens(view);
  const Eigen::Array2d size(values.width, values.height);
  const Eigen::Array2d under = lens.pixel() * size;  // values under a pixel, across and down
  DepthMap out(camera.width, camera.height, kNaN);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const Eigen::Array2d at = lens(x + 0.5, y + 0.5) * size;
      const double u = at.x();
      const double v = at.y();
      if (!(u >= 0 && v >= 0 && u < values.width && v < values.height)) continue;
      constexpr double kFiner = 1.01;
      out(x, y) = under.maxCoeff() > kFiner
                      ? averaged(values, u, v, std::max(under.x(), 1.0), std::max(under.y(), 1.0))
                      : interpolated(values, u, v);
    }
  }
  return out;
}

// Whether dense stereo has made a map of a photograph, too, in the folder of another map.
bool has_map_beside(const fs::path& map, const View& view) {
  const SceneRoot folder = {map.parent_path(), /*allow_external=*/true};
  return !colmap_depth_of(folder, view.image_path).empty();
}

// Depth maps of COLMAP are in units of the scene, and photographs that are held out may have shaped
// them.
void check_colmap_maps(Scene& scene) {
  const auto is_map = [&](int i) {
    return is_colmap_depth_name(scene.views[static_cast<size_t>(i)].depth_path);
  };
  const auto first = std::find_if(scene.input.begin(), scene.input.end(), is_map);
  if (first == scene.input.end()) return;
  if (scene.depth_kind == DepthKind::Metric || scene.depth_scale > 0) {
    throw WithRemedy<InvalidInput>(
        Remedy::SceneUnit,
        "depth maps of COLMAP are in units of the scene, not in metres: neither is their kind "
        "metric, nor have they a scale of their own; the unit of the cameras tells the scale");
  }
  const fs::path& map = scene.views[static_cast<size_t>(*first)].depth_path;
  const auto shaped_them = [&](int i) {
    return has_map_beside(map, scene.views[static_cast<size_t>(i)]);
  };
  if (std::none_of(scene.held_out.begin(), scene.held_out.end(), shaped_them)) return;
  scene.warnings.emplace_back(
      "COLMAP made these depth maps with photographs that are held out: figures on these flatter");
}

// Of two photographs with one file of depth, it belongs to one at most.
void refuse_shared_files(const Scene& scene) {
  std::map<fs::path, const View*> owners;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.depth_path.empty()) continue;
    const auto [owner, is_new] = owners.emplace(view.depth_path.lexically_normal(), &view);
    if (is_new) continue;
    throw BadInput(Defect::Ref,
                   view.depth_path,
                   "would be the depth of two views, " + printable(owner->second->name) + " and " +
                       printable(view.name));
  }
}

// A network guesses where files, if there are some, have measured.
void leave_out_files(Scene& scene) {
  size_t count = 0;
  for (View& view : scene.views) {
    count += static_cast<size_t>(!view.depth_path.empty());
    view.depth_path.clear();
  }
  if (count == 0 && !is_folder(scene.folder / "depth")) return;
  scene.warnings.emplace_back(
      "the depth files of this scene are not used, as a network guesses depth");
}

}  // namespace

std::map<std::string, DepthKind> depth_kinds() {
  return {{"auto", DepthKind::Unknown},
          {"metric", DepthKind::Metric},
          {"depth", DepthKind::Relative},
          {"disparity", DepthKind::Disparity}};
}

void DepthOptions::validate() const {
  require(scale >= 0 && std::isfinite(scale), "DepthOptions.scale must be >= 0", scale);
  if (network.empty()) return;
  require(folder.empty(), "give depth files or a network, not both; files", folder);
  require(scale == 0, "a network measures nothing: it takes no scale of depth, which is", scale);
  require(kind != DepthKind::Metric,
          "a network measures nothing: its kind is depth or disparity, the network",
          network);
}

fs::path confidence_file(const Scene& scene, const View& view, bool allow_external) {
  if (scene.kind != SceneKind::Polycam) return {};
  const fs::path depth = view.depth_path.lexically_relative(scene.folder).parent_path();
  if (depth.filename() != "depth" || *depth.begin() == "..") return {};
  const fs::path name = depth.parent_path() / "confidence";
  if (!is_folder(scene.folder / name)) return {};
  const SceneRoot root = {scene.folder, allow_external};
  const fs::path folder = resolve_in_scene(root, name.string(), scene.folder);
  return depth_file_of({folder, allow_external}, view.depth_path);
}

void find_given_depth(Scene& scene, const DepthOptions& options, bool allow_external) {
  if (options.kind != DepthKind::Unknown) scene.depth_kind = options.kind;
  if (options.scale > 0) scene.depth_scale = options.scale;
  if (!options.network.empty()) {
    leave_out_files(scene);
    if (scene.depth_kind != DepthKind::Relative) scene.depth_kind = DepthKind::Disparity;
    return;
  }
  for (View& view : scene.views) {
    if (view.image_path.empty()) continue;
    if (!options.folder.empty()) {
      view.depth_path = depth_file_of({options.folder, allow_external}, view.image_path);
    } else if (!view.depth_path.empty()) {
      (void)confidence_file(scene, view, allow_external);  // refused here or never
    }
  }
  refuse_shared_files(scene);
  std::set<int> explained;
  if (options.folder.empty()) explained = find_all_beside(scene, {scene.folder, allow_external});
  const auto has_depth = [&](int i) {
    return !scene.views[static_cast<size_t>(i)].depth_path.empty();
  };
  const auto count = std::count_if(scene.input.begin(), scene.input.end(), has_depth);
  if (count == 0 && !options.folder.empty()) {
    throw BadInput(Defect::Missing,
                   options.folder,
                   "holds no depth named as an input photograph: .exr .pfm .npy .npz .tif .png, or "
                   ".geometric.bin of COLMAP");
  }
  if (count == 0 && (options.kind != DepthKind::Unknown || options.scale > 0)) {
    throw WithRemedy<BadInput>(
        Remedy::DepthFolder,
        Defect::Missing,
        scene.folder,
        "has no depth for an input photograph, though its kind or scale was stated; a folder of "
        "depth is called 'depth', or is named");
  }
  if (count == 0) return;
  check_colmap_maps(scene);
  std::vector<std::string> lacking;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (!has_depth(i) || !may_lie_turned(view)) continue;
    scene.warnings.push_back("the photograph of view " + printable(view.name) +
                             " lies turned in its file and is shown upright; its depth is taken "
                             "to be upright already");
  }
  for (const int i : scene.input) {
    if (has_depth(i) || explained.contains(i)) continue;
    lacking.push_back(printable(scene.views[static_cast<size_t>(i)].name));
  }
  if (lacking.empty()) return;
  constexpr size_t kShown = 5;
  std::string names = lacking[0];
  for (size_t i = 1; i < std::min(lacking.size(), kShown); ++i) names += ", " + lacking[i];
  scene.warnings.push_back(
      "there is depth for other views, but none for " +
      (lacking.size() > 1 ? std::to_string(lacking.size()) + " views: " : std::string("view ")) +
      names + (lacking.size() > kShown ? ", …" : ""));
}

void load_given_depth(const Scene& scene, View& view, const ImageSize& photograph) {
  if (view.depth_path.empty()) return;
  refuse_map_of_distorted(view);
  const bool is_metric =
      scene.depth_kind == DepthKind::Metric || is_colmap_depth_name(view.depth_path);
  StoredSamples file =
      is_metric ? read_depth_file(view.depth_path) : read_relative_depth_file(view.depth_path);
  const fs::path confidence = confidence_file(scene, view, true);
  if (!confidence.empty()) drop_low_confidence(confidence, file.values);
  constexpr double kMillimetres = 1000;
  const double scale = scene.depth_scale > 0 ? scene.depth_scale
                       : file.whole_bits > 0 ? kMillimetres
                                             : 1;
  for (float& value : file.values.data) value = static_cast<float>(double(value) / scale);
  view.depth_states_metres = file.whole_bits == 16 || scene.depth_scale > 0;
  Raster<float> values = upright(file.values, view, photograph);
  const bool is_of_sensor = view.depth_states_metres || scene.depth_kind == DepthKind::Metric;
  if (is_of_sensor && values.width < view.camera.width) values = without_mixed(values);
  view.given_depth = resampled(values, view);
}

}  // namespace cgs
