// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_sizes.h"

#include <algorithm>
#include <cmath>

#include "io/bytes/byte_reader.h"
#include "io/scenes/fisheye_map.h"
#include "io/scenes/orientation.h"
#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

bool have_same_shape(int width_a, int height_a, int width_b, int height_b) {
  const double difference =
      static_cast<double>(height_a) * width_b - static_cast<double>(height_b) * width_a;
  return std::abs(difference) <= std::max({width_a, height_a, width_b, height_b});
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

void fit_cameras(Scene& scene) {
  int rescaled = 0;
  for (View& view : scene.views) {
    Camera& camera = view.camera;
    if (!view.image_path.empty()) {
      const ImageSize size = photograph_size(view);
      if (!have_same_shape(camera.width, camera.height, size.width, size.height)) {
        throw BadInput(Defect::Mismatch,
                       view.image_path,
                       "the image has " + size_text(size.width, size.height) +
                           " pixels, its camera is for " + size_text(camera.width, camera.height));
      }
      rescaled += camera.width != size.width ? 1 : 0;
      camera = resized(camera, size.width, size.height);
    }
  }
  const bool is_expected =
      scene.kind == SceneKind::Llff;  // states the size of the full photographs
  if (rescaled > 0 && !is_expected) {
    scene.warnings.push_back(std::to_string(rescaled) +
                             " images are of another size than their camera states; intrinsics "
                             "were scaled to the images");
  }
}

void make_pinholes(Scene& scene) {
  int cropped = 0;
  for (View& view : scene.views) {
    if (!view.fisheye) continue;
    const Eigen::Isometry3d pose = view.camera.world_from_cam;
    view.fisheye->radius *= double(view.camera.width) / view.fisheye->photograph.width;
    view.fisheye->photograph = view.camera;
    view.fisheye->photograph.world_from_cam.setIdentity();
    check_fisheye(*view.fisheye, [&](Defect defect, const std::string& why) {
      throw BadInput(defect, scene.folder, "view " + printable(view.name) + ": " + why);
    });
    const FisheyeMap map(*view.fisheye);
    view.camera = map.picture();
    view.camera.world_from_cam = pose;
    cropped += map.is_cropped() ? 1 : 0;
  }
  if (cropped > 0) {
    scene.warnings.push_back(std::to_string(cropped) +
                             " fisheye photographs show more than 60 degrees to a side of their "
                             "axis; what lies beyond is left out");
  }
}

void divide_sizes(Scene& scene, const std::vector<int>& divisors) {
  for (size_t i = 0; i < divisors.size(); ++i) {
    const View& view = scene.views[i];
    Camera& camera = scene.views[i].camera;
    const int width = camera.width / divisors[i];
    const int height = camera.height / divisors[i];
    constexpr int kSmallest = 8;  // below, no stage has anything to work on
    if (width < kSmallest || height < kSmallest) {
      throw InvalidInput("downscale " + std::to_string(divisors[i]) + " leaves " +
                         size_text(width, height) + " pixels of view " + printable(view.name));
    }
    camera = resized(camera, width, height);
  }
}

namespace {

int longest_side(const View& view) {
  return view.image_path.empty() ? 0 : std::max(view.camera.width, view.camera.height);
}

const View& largest_of(const Scene& scene) {
  const auto is_shorter = [](const View& a, const View& b) {
    return longest_side(a) < longest_side(b);
  };
  return *std::max_element(scene.views.begin(), scene.views.end(), is_shorter);
}

}  // namespace

std::vector<int> divisors_to(const Scene& scene, int longest) {
  const auto divisor = [&](const View& view) {
    return std::max(1, (longest_side(view) + longest - 1) / longest);
  };
  const int common = divisor(largest_of(scene));
  std::vector<int> out(scene.views.size(), common);
  for (size_t i = 0; i < out.size(); ++i) {
    const View& view = scene.views[i];
    if (!view.image_path.empty() && 2 * divisor(view) <= common) out[i] = divisor(view);
  }
  return out;
}

std::string divisors_text(const Scene& scene, const std::vector<int>& divisors) {
  const int common = *std::max_element(divisors.begin(), divisors.end());
  if (common == 1) return "";
  const View& largest = largest_of(scene);
  const bool has_smaller =
      std::any_of(divisors.begin(), divisors.end(), [&](int d) { return d < common; });
  return (largest.fisheye ? "undistorted pictures of " : "photographs of ") +
         size_text(largest.camera.width, largest.camera.height) + " pixels are worked on at 1/" +
         std::to_string(common) + " of their size" + (has_smaller ? ", smaller ones at more" : "") +
         "; a downscale of 1 takes all of it, and longer";
}

}  // namespace cgs
