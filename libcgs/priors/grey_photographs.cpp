// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/grey_photographs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/photo_response.h"
#include "libcgs/core/srgb.h"
#include "libcgs/priors/shown_pixel.h"

namespace cgs {

namespace {

const View& photograph_of(const Scene& scene, size_t k) {
  return scene.views[static_cast<size_t>(scene.input[k])];
}

// What the outer channels differ from the middle one by.
Eigen::Vector2d chroma(const Eigen::Vector3f& color) {
  return {double{color.x()} - double{color.y()}, double{color.z()} - double{color.y()}};
}

/// Sums over pixels about as light.
struct LevelSums {
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0;
};

// Linear light of that luminance, of the colour as far as no channel gets brighter than white.
Eigen::Vector3f at_luminance(const Eigen::Vector3f& light, float wanted) {
  const Eigen::Vector3f grey = Eigen::Vector3f::Constant(wanted);
  const float luminance = luminance_weights().dot(light);
  if (!(luminance > 0)) return grey;
  const Eigen::Vector3f away = light * (wanted / luminance) - grey;
  const float highest = away.maxCoeff();
  const float share = highest > 1 - wanted ? std::max(0.0f, 1 - wanted) / highest : 1;
  return grey + share * away;
}

bool shows_surface(const ViewPriors& priors, int x, int y) {
  return !shows_no_surface(priors.origin(x, y)) && std::isfinite(priors.depth(x, y));
}

// Mean linear light by which other views with colours show a pixel; zero where none does.
Eigen::Vector3f light_of_others(
    const Scene& scene, const std::vector<ViewPriors>& priors, size_t k, int x, int y) {
  constexpr double kSame = 0.02;  // of the depth
  const Eigen::Vector3d point =
      photograph_of(scene, k).camera.unproject(x + 0.5, y + 0.5, double{priors[k].depth(x, y)});
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (size_t j = 0; j < priors.size(); ++j) {
    const View& other = photograph_of(scene, j);
    if (other.response.is_grey) continue;
    const auto at = shown_pixel(other.camera, priors[j].depth, point, kSame);
    if (!at || !other.is_usable(at->x(), at->y())) continue;
    sum += other.image(at->x(), at->y()).unaryExpr(&linear_from_srgb);
    ++count;
  }
  return count > 0 ? Eigen::Vector3f(sum / static_cast<float>(count)) : sum;
}

}  // namespace

bool has_no_colors(const ColorImage& image, const MaskMap& valid) {
  constexpr double kMostChroma = 2.0 / 255;  // root mean square; rounding and JPEG make as much
  constexpr int kLevels = 64;
  std::array<LevelSums, kLevels> levels = {};
  double pixels = 0;
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (!valid.empty() && valid.data[i] == 0) continue;
    const Eigen::Vector3f& color = image.data[i];
    const int level = std::clamp(static_cast<int>(color.mean() * kLevels), 0, kLevels - 1);
    LevelSums& sums = levels.at(static_cast<size_t>(level));
    const Eigen::Vector2d difference = chroma(color);
    sums.count += 1;
    sums.sum += difference;
    sums.squares += difference.squaredNorm();
    pixels += 1;
  }
  double around_means = 0;
  for (const LevelSums& sums : levels) {
    if (sums.count > 0) around_means += sums.squares - sums.sum.squaredNorm() / sums.count;
  }
  return pixels > 0 && around_means <= kMostChroma * kMostChroma * pixels;
}

bool mark_grey_photographs(Scene& scene) {
  std::vector<View*> grey;
  for (const int i : scene.input) {
    View& view = scene.views[static_cast<size_t>(i)];
    if (has_no_colors(view.image, view.valid)) grey.push_back(&view);
  }
  if (grey.empty() || grey.size() == scene.input.size()) return false;
  for (View* view : grey) {
    view->response.is_grey = true;
    view->image = in_grey(view->image);
  }
  return true;
}

bool has_grey_photographs(const Scene& scene) {
  return std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
    return scene.views[static_cast<size_t>(i)].response.is_grey;
  });
}

Scene in_luminance(const Scene& scene) {
  Scene out = scene;
  for (const int i : out.input) {
    View& view = out.views[static_cast<size_t>(i)];
    view.image = in_grey(view.image);
  }
  return out;
}

std::vector<MaskMap> color_grey_photographs(Scene& scene, const std::vector<ViewPriors>& priors) {
  std::vector<MaskMap> unknown(priors.size());
  for (size_t k = 0; k < priors.size(); ++k) {
    View& view = scene.views[static_cast<size_t>(scene.input[k])];
    if (!view.response.is_grey) continue;
    unknown[k] = MaskMap(view.image.width, view.image.height, 0);
    ColorImage colored = view.image;
    tbb::parallel_for(0, view.image.height, [&](int y) {
      for (int x = 0; x < view.image.width; ++x) {
        if (!view.is_usable(x, y) || !shows_surface(priors[k], x, y)) continue;
        const Eigen::Vector3f light = light_of_others(scene, priors, k, x, y);
        if (light.isZero()) {
          unknown[k](x, y) = 1;
          continue;
        }
        const float luminance = linear_from_srgb(coded_luminance(view.image(x, y)));
        colored(x, y) = at_luminance(light, luminance).unaryExpr(&srgb_from_linear);
      }
    });
    view.image = std::move(colored);
  }
  return unknown;
}

}  // namespace cgs
