// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/scratches.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include "libcgs/core/srgb.h"
#include "libcgs/priors/grey_photographs.h"
#include "libcgs/priors/mask_operations.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/shown_pixel.h"

namespace cgs {

namespace {

/// A place of one view in another one.
struct SeenThere {
  size_t view;
  int x, y;
};

class Mending {
 public:
  Mending(const Scene& scene, const std::vector<ViewPriors>& priors)
      : scene_(scene), priors_(priors) {
    if (has_grey_photographs(scene)) in_luminance_ = in_luminance(scene);
  }

  std::vector<size_t> others_of(size_t k) const { return neighbours(scene_, k, kMostCompared); }

  MaskMap contradicted(size_t k, const std::vector<size_t>& others) const {
    const Camera& camera = view(k).camera;
    MaskMap out(camera.width, camera.height, 0);
    if (others.size() < 2) return out;
    tbb::parallel_for(0, camera.height, [&](int y) {
      for (int x = 0; x < camera.width; ++x) {
        out(x, y) = view(k).is_usable(x, y) && is_contradicted(k, others, x, y) ? 1 : 0;
      }
    });
    return out;
  }

  // Mean colour of the others where they show a pixel; nothing where they tell none.
  std::optional<Eigen::Vector3f> color_of_others(size_t k,
                                                 const std::vector<size_t>& others,
                                                 int x,
                                                 int y) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (const SeenThere& seen : places(k, others, x, y)) {
      if (view(seen.view).response.is_grey && !view(k).response.is_grey) continue;
      sum += view(seen.view).image(seen.x, seen.y).unaryExpr(&linear_from_srgb);
      ++count;
    }
    if (count == 0) return std::nullopt;
    const Eigen::Vector3f color = (sum / static_cast<float>(count)).unaryExpr(&srgb_from_linear);
    if (!view(k).response.is_grey) return color;
    return Eigen::Vector3f::Constant(coded_luminance(color));
  }

 private:
  const View& view(size_t k) const { return scene_.views[static_cast<size_t>(scene_.input[k])]; }
  const ColorImage& compared(size_t k) const {
    const Scene& scene = in_luminance_ ? *in_luminance_ : scene_;
    return scene.views[static_cast<size_t>(scene.input[k])].image;
  }

  std::vector<SeenThere> places(size_t k, const std::vector<size_t>& others, int x, int y) const {
    constexpr double kSame = 0.02;  // of the depth
    std::vector<SeenThere> out;
    const double depth{priors_[k].depth(x, y)};
    if (!std::isfinite(depth) || shows_no_surface(priors_[k].origin(x, y))) return out;
    const Eigen::Vector3d point = view(k).camera.unproject(x + 0.5, y + 0.5, depth);
    for (const size_t j : others) {
      const auto at = shown_pixel(view(j).camera, priors_[j].depth, point, kSame);
      if (at && view(j).is_usable(at->x(), at->y())) out.push_back({j, at->x(), at->y()});
    }
    return out;
  }

  bool is_contradicted(size_t k, const std::vector<size_t>& others, int x, int y) const {
    const std::vector<SeenThere> seen = places(k, others, x, y);
    return seen.size() >= 2 && std::all_of(seen.begin(), seen.end(), [&](const SeenThere& there) {
             return !shows_alike(there, compared(k)(x, y));
           });
  }

  // Whether a pixel or one beside it is of a colour.
  bool shows_alike(const SeenThere& there, const Eigen::Vector3f& color) const {
    constexpr float kOther = 0.16f;  // of a channel
    const ColorImage& image = compared(there.view);
    for (int v = there.y - 1; v <= there.y + 1; ++v) {
      for (int u = there.x - 1; u <= there.x + 1; ++u) {
        if (image.contains(u, v) && (image(u, v) - color).cwiseAbs().maxCoeff() < kOther) {
          return true;
        }
      }
    }
    return false;
  }

  const Scene& scene_;
  const std::vector<ViewPriors>& priors_;
  std::optional<Scene> in_luminance_;  // where colours cannot be compared
};

}  // namespace

std::vector<MaskMap> mend_scratches(Scene& scene, const std::vector<ViewPriors>& priors) {
  const Mending mending(scene, priors);
  std::vector<MaskMap> out;
  std::vector<ColorImage> mended;
  for (size_t k = 0; k < priors.size(); ++k) {
    const std::vector<size_t> others = mending.others_of(k);
    constexpr int kRim = 1;  // [pixels] where a scratch and the picture mix
    out.push_back(dilated(mending.contradicted(k, others), kRim));
    const View& view = scene.views[static_cast<size_t>(scene.input[k])];
    mended.push_back(view.image);
    for (int y = 0; y < view.image.height; ++y) {
      for (int x = 0; x < view.image.width; ++x) {
        if (out[k](x, y) == 0) continue;
        const auto color = mending.color_of_others(k, others, x, y);
        if (color) mended[k](x, y) = *color;
        out[k](x, y) = color ? 1 : 0;
      }
    }
  }
  // All at once: none is mended by what another was.
  for (size_t k = 0; k < priors.size(); ++k) {
    scene.views[static_cast<size_t>(scene.input[k])].image = std::move(mended[k]);
  }
  return out;
}

}  // namespace cgs
