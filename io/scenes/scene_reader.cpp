// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>
#include <type_traits>
#include <utility>

#include "io/bytes/byte_reader.h"
#include "io/bytes/significance.h"
#include "io/images/exif.h"
#include "io/images/image.h"
#include "io/scenes/colmap.h"
#include "io/scenes/fisheye_map.h"
#include "io/scenes/lens.h"
#include "io/scenes/masks.h"
#include "io/scenes/metashape.h"
#include "io/scenes/orientation.h"
#include "io/scenes/photographs.h"
#include "io/scenes/resample.h"
#include "io/scenes/scene_layouts.h"
#include "io/scenes/view_choice.h"
#include "io/scenes/view_names.h"
#include "io/scenes/view_sizes.h"
#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "libcgs/core/photograph_cache.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

// What may be meant by a folder in no layout.
std::string hints(const fs::path& folder) {
  std::string out;
  for (const std::string& line : unread_files(folder)) out += line + "; ";
  std::vector<std::string> found;
  for (const std::string& name : sorted_entries(folder)) {
    if (is_photographs(folder / name)) found.push_back(name);
  }
  if (found.empty()) return out;
  out += "photographs lie in " + first_few(found);
  return out + (found.size() > 1 ? ": give one of these; " : ": give that; ");
}

Scene read_layout(const SceneRoot& root, const std::string& chunk) {
  std::error_code error;
  const fs::file_status status = fs::status(root.folder, error);
  if (!fs::exists(status)) {
    throw BadInput(Defect::Open, root.folder, error ? error.message() : "no such folder");
  }
  if (!fs::is_directory(status)) throw BadInput(Defect::Open, root.folder, "not a folder");
  const SceneLayout* const layout = layout_of(root.folder);
  if (!chunk.empty()) {
    if (layout != nullptr && layout->read == read_metashape)
      return read_metashape_chunk(root, chunk);
    throw InvalidInput("chunk \"" + one_line(chunk) + "\" is asked for, but the cameras in " +
                       printable(root.folder) + " are not of Metashape");
  }
  if (layout != nullptr) return layout->read(root);
  throw BadInput(Defect::Schema,
                 root.folder,
                 hints(root.folder) +
                     "no known layout: understood are LLFF (poses_bounds.npy), transforms.json "
                     "(nerfstudio, instant-ngp), COLMAP (sparse/0/cameras.bin or .txt), Strecha "
                     "(<image>.camera), Polycam (keyframes/), frames of a depth camera (7-Scenes, "
                     "Open3D), Metashape (.xml), RealityCapture (.csv), cameras.json (3DGS) and "
                     "photographs with nothing else");
}

void sort_views(Scene& scene) {
  std::vector<size_t> order(scene.views.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return scene.views[a].name < scene.views[b].name;
  });
  std::vector<int> new_index(order.size());
  std::vector<View> sorted;
  for (size_t i = 0; i < order.size(); ++i) {
    new_index[order[i]] = static_cast<int>(i);
    sorted.push_back(std::move(scene.views[order[i]]));
  }
  scene.views = std::move(sorted);
  for (SparsePoint& point : scene.points) {
    for (int& view : point.views) view = new_index[static_cast<size_t>(view)];
    std::sort(point.views.begin(), point.views.end());
  }
  std::sort(scene.missing.begin(), scene.missing.end());
}

void check_presence(Scene& scene) {
  if (scene.missing.empty()) return;
  const size_t present = views_with_files(scene).size();
  const std::string text = std::to_string(scene.missing.size()) + " of " +
                           std::to_string(scene.missing.size() + present) +
                           " images are missing: " + first_few(scene.missing);
  if (present == 0) throw BadInput(Defect::Missing, scene.folder, text);
  scene.warnings.push_back(text);
}

void check_baselines(const Scene& scene) {
  constexpr double kRounding = 0x1p-49;  // eight steps of double
  const auto& first = scene.views[static_cast<size_t>(scene.input[0])].camera;
  for (const int i : scene.input) {
    const auto& camera = scene.views[static_cast<size_t>(i)].camera;
    const double baseline = (camera.center() - first.center()).norm();
    if (baseline > kRounding * first.center().norm()) return;
  }
  throw BadInput(Defect::Value,
                 scene.folder,
                 "all input cameras share one centre (baseline 0), so no depth can be measured");
}

// Refuses cameras that stand too near to each other for what they look at, or too far from the
// origin for any of it.
void check_places(const Scene& scene) {
  const std::vector<Eigen::Vector3d> points = subject_points(scene);  // camera, subject, camera, …
  double baseline = 0;
  double distance = std::numeric_limits<double>::infinity();
  Eigen::AlignedBox3d box;
  for (size_t i = 0; i < points.size(); i += 2) {
    baseline = std::max(baseline, (points[i] - points[0]).norm());
    distance = std::min(distance, (points[i + 1] - points[i]).norm());
    box.extend(points[i]).extend(points[i + 1]);
  }
  constexpr double kSmallest = 1e-6;  // less than a hundredth of a pixel at any focal length
  if (baseline < kSmallest * distance) {
    std::ostringstream text;
    text << "the input cameras are at most " << baseline << " apart and their subject is "
         << distance << " away, so no depth can be measured; choose views from different places";
    throw BadInput(Defect::Value, scene.folder, text.str());
  }
  (void)check_significance(scene.folder, box, kDoubleDigits);
}

// True if every pixel of a photograph may be used, which its name and its camera tell.
bool is_whole(const View& view) {
  const fs::path extension = view.image_path.extension();
  const bool is_jpeg = extension == ".jpg" || extension == ".jpeg";  // has no transparent pixels
  return is_jpeg && !has_lens_distortion(view) && view.mask_path.empty() && !view.may_have_border;
}

// The bytes of a number.
template <typename T>
void append(std::string& key, const T& number) {
  static_assert(std::is_arithmetic_v<T>);
  key.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(std::string& key, const fs::path& file) {
  key += file.string() + '\0';
  if (file.empty()) return;
  append(key, fs::last_write_time(file).time_since_epoch().count());
  append(key, fs::file_size(file));
}

void append(std::string& key, const Camera& camera) {
  for (const int side : {camera.width, camera.height}) append(key, side);
  for (const double length : {camera.fx, camera.fy, camera.cx, camera.cy}) append(key, length);
}

// All that the pixels of a view depend on, but for its response and exposure.
std::string cache_key(const View& view) {
  std::string key;
  append(key, view.image_path);
  append(key, view.mask_path);
  append(key, view.orientation);
  append(key, view.may_have_border);
  append(key, view.camera);
  for (const double k : view.distortion) append(key, k);
  if (view.fisheye) {
    append(key, view.fisheye->photograph);
    for (const double k : view.fisheye->k) append(key, k);
    for (const double p : view.fisheye->p) append(key, p);
    append(key, view.fisheye->radius);
  }
  return key;
}

// Decoded, without lens distortion, of the size of the camera.
void load_pixels(View& view) {
  const Camera& camera = view.camera;
  view.image = read_photograph(view, view.valid);
  const int width = view.image.width;
  const int height = view.image.height;
  const Camera& taken = view.fisheye ? view.fisheye->photograph : camera;
  const auto refuse_size = [&] {
    throw BadInput(Defect::Mismatch,
                   view.image_path,
                   "the image has " + size_text(width, height) + " pixels, its camera is for " +
                       size_text(taken.width, taken.height));
  };
  if (!have_same_shape(taken.width, taken.height, width, height)) refuse_size();
  if (view.fisheye) {
    undistort(view.image, view.valid, FisheyeMap(*view.fisheye).resized(width, height));
  } else if (view.distortion != std::array<double, 5>{}) {
    undistort(view.image, view.valid, resized(camera, width, height), view.distortion);
  }
  if (view.image.width < camera.width || view.image.height < camera.height) refuse_size();
  area_downscale(view.image, view.valid, camera.width, camera.height);
}

void take_pixels(PhotographCache* cache, View& view) {
  if (cache == nullptr) {
    load_pixels(view);
    return;
  }
  const std::string key = cache_key(view);
  if (auto kept = cache->find(key)) {
    view.image = std::move(kept->image);
    view.valid = std::move(kept->valid);
    return;
  }
  load_pixels(view);
  cache->keep(key, {view.image, view.valid});
}

void load_image(const Scene& scene, View& view, std::vector<std::string>& warnings) {
  if (view.image_path.empty()) {
    throw BadInput(Defect::Missing, scene.folder, "view " + printable(view.name) + " has no image");
  }
  take_pixels(scene.cache.get(), view);
  apply_exposure(view);
  load_given_depth(scene, view, photograph_size(view));
  const auto is_set = [](uint8_t set) { return set != 0; };
  const bool is_masked =
      !view.valid.empty() && std::none_of(view.valid.data.begin(), view.valid.data.end(), is_set);
  if (is_masked) warnings.push_back("view " + printable(view.name) + " is fully masked");
  const auto is_first = [&](const Eigen::Vector3f& c) { return c == view.image.data.front(); };
  if (std::all_of(view.image.data.begin(), view.image.data.end(), is_first)) {
    warnings.push_back("view " + printable(view.name) + " has one colour everywhere");
  }
}

void warn_of_identical_images(Scene& scene, const std::vector<int>& views) {
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = i + 1; j < views.size(); ++j) {
      const View& a = scene.views[static_cast<size_t>(views[i])];
      const View& b = scene.views[static_cast<size_t>(views[j])];
      if (a.image.data != b.image.data) continue;
      scene.warnings.push_back("views " + printable(a.name) + " and " + printable(b.name) +
                               " are the same picture");
    }
  }
}

Scene prepared(Scene scene, const SceneOptions& options) {
  name_views(scene);
  sort_views(scene);
  check_presence(scene);
  fit_cameras(scene);
  make_pinholes(scene);
  divide_sizes(scene,
               options.downscale ? std::vector<int>(scene.views.size(), *options.downscale)
                                 : choose_divisors(scene, options));
  choose_views(scene, options);
  check_baselines(scene);
  check_places(scene);
  find_masks({scene.folder, options.allow_external}, scene);
  find_given_depth(scene, options.depth, options.allow_external);
  return scene;
}

}  // namespace

Scene read_scene(const fs::path& folder, const SceneOptions& options) {
  options.validate();
  return prepared(read_layout({folder, options.allow_external}, options.chunk), options);
}

Scene scene_of_photographs(const fs::path& folder,
                           const ColmapModel& model,
                           const SceneOptions& options) {
  options.validate();
  const fs::path photographs = folder_of_photographs(folder);
  Scene scene = scene_of_colmap({folder, options.allow_external}, model, photographs);
  scene.kind = SceneKind::Photographs;
  for (const PhotoFile& photograph : list_photographs({folder, options.allow_external})) {
    scene.photographs.push_back(photograph.path.filename().string());
  }
  for (const std::string& line : unread_files(folder)) scene.warnings.push_back(line);
  if (photographs != ".") {
    scene.notes.push_back("the photographs are those in " + printable(photographs));
  }
  for (View& view : scene.views) {
    if (!view.image_path.empty()) view.orientation = exif_orientation(view.image_path);
  }
  return prepared(std::move(scene), options);
}

void load_images(Scene& scene, const std::vector<int>& views, const Progress& progress) {
  for (size_t i = 0; i < views.size(); ++i) {
    report(progress, static_cast<double>(i) / static_cast<double>(views.size()));
    load_image(scene, scene.views.at(static_cast<size_t>(views[i])), scene.warnings);
  }
  warn_of_identical_images(scene, views);
  report(progress, 1);
}

View loaded_view(const Scene& scene,
                 int view,
                 bool with_image,
                 std::vector<std::string>& warnings) {
  View out = scene.views.at(static_cast<size_t>(view));
  if (!with_image && is_whole(out)) {
    load_given_depth(scene, out, photograph_size(out));
  } else {
    load_image(scene, out, warnings);
  }
  return out;
}

}  // namespace cgs
