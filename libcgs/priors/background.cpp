// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/background.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <tbb/parallel_for.h>

#include "libcgs/core/opencv_memory.h"
#include "libcgs/priors/mask_operations.h"

namespace cgs {

namespace {

constexpr double kLeastMasked = 0.2;   // of a picture: silhouettes, not passers-by
constexpr double kLeastBorder = 0.8;   // of it, that a backdrop runs along
constexpr double kLeastViews = 0.75;   // that show background: one or two with a bare wall do not
constexpr double kEnclosing = 0.98;    // of the border, around all of an object
constexpr float kEvenChange = 0.035f;  // largest change from pixel to pixel of it, in sRGB
constexpr double kMostMeasured = 0.1;  // of a backdrop: nothing can be matched on it
constexpr size_t kLeastPoints = 200;   // of the other views, in the picture
constexpr double kMostAgainst = 0.03;  // of these
constexpr double kMostLost = 0.25;     // of what was measured, beyond all silhouettes
constexpr int kObjectRim = 2;          // [pixels]
constexpr int kPointsAlong = 60;       // of the points along each side of a picture

double share_set(const MaskMap& mask) {
  return double(std::count(mask.data.begin(), mask.data.end(), uint8_t{1})) /
         double(mask.data.size());
}

// Calls visit(x, y) for each pixel at the border, for the corners twice.
template <typename Visit>
void each_at_border(const MaskMap& mask, const Visit& visit) {
  for (int x = 0; x < mask.width; ++x) {
    visit(x, 0);
    visit(x, mask.height - 1);
  }
  for (int y = 0; y < mask.height; ++y) {
    visit(0, y);
    visit(mask.width - 1, y);
  }
}

double border_share(const MaskMap& mask) {
  size_t count = 0;
  each_at_border(mask, [&](int x, int y) { count += mask(x, y); });
  return double(count) / (2.0 * (mask.width + mask.height));
}

// What is left out by masks, if that is much.
MaskMap masked_out(const View& view) {
  if (view.valid.empty()) return {};
  MaskMap out = inverted(view.valid);
  return share_set(out) >= kLeastMasked ? out : MaskMap();
}

// Where neighbouring pixels hardly differ, noise aside. Sky is no backdrop, nor the rim that
// undistorting leaves.
MaskMap even_pixels(const View& view, const ViewPriors& priors) {
  const ColorImage& image = view.image;
  const cv::Mat3f colors(image.height,
                         image.width,
                         reinterpret_cast<cv::Vec3f*>(const_cast<Eigen::Vector3f*>(
                             image.data.data())));  // NOLINT: a view, which is not written to
  cv::Mat3f smooth;
  cv::blur(colors, smooth, {3, 3});
  MaskMap out(image.width, image.height, 0);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const cv::Vec3f& here = smooth(y, x);
      const cv::Vec3f& right = smooth(y, std::min(x + 1, image.width - 1));
      const cv::Vec3f& below = smooth(std::min(y + 1, image.height - 1), x);
      const double change =
          std::max(cv::norm(right - here, cv::NORM_INF), cv::norm(below - here, cv::NORM_INF));
      const bool is_usable = view.is_usable(x, y) && priors.origin(x, y) != DepthOrigin::Sky;
      out(x, y) = is_usable && change < double(kEvenChange) ? 1 : 0;
    }
  }
  return out;
}

size_t measured_in(const MaskMap& mask, const ViewPriors& priors) {
  size_t out = 0;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    out += mask.data[i] != 0 && priors.origin.data[i] == DepthOrigin::Measured ? 1 : 0;
  }
  return out;
}

// The even parts that reach the border, if they are along most of it and nothing was measured
// there.
MaskMap even_backdrop(const View& view, const ViewPriors& priors) {
  MaskMap even = even_pixels(view, priors);
  cv::Mat1i labels;
  const int count = cv::connectedComponents(mask_matrix(even), labels, 4);
  std::vector<size_t> along(static_cast<size_t>(count), 0);
  each_at_border(even, [&](int x, int y) { ++along[static_cast<size_t>(labels(y, x))]; });
  along[0] = 0;  // is not even
  constexpr double kLeastPart = 0.02;
  const double border = 2.0 * (even.width + even.height);
  double sum = 0;
  for (size_t& part : along) {
    if (double(part) < kLeastPart * border) part = 0;
    sum += double(part);
  }
  if (sum < kLeastBorder * border) return {};
  for (int y = 0; y < even.height; ++y) {
    for (int x = 0; x < even.width; ++x) {
      even(x, y) = along[static_cast<size_t>(labels(y, x))] > 0 ? 1 : 0;
    }
  }
  const auto area = double(std::count(even.data.begin(), even.data.end(), uint8_t{1}));
  return double(measured_in(even, priors)) <= kMostMeasured * area ? even : MaskMap();
}

/// What every view may show of background, and what the others say of it.
class Backgrounds {
 public:
  Backgrounds(const Scene& scene, std::vector<ViewPriors>& priors)
      : priors_(priors),
        candidates_(priors.size()),
        with_rim_(priors.size()),
        is_enclosing_(priors.size(), 0) {
    for (const int i : scene.input) views_.push_back(&scene.views[static_cast<size_t>(i)]);
    tbb::parallel_for(size_t{0}, priors.size(), [&](size_t k) {
      candidates_[k] = masked_out(*views_[k]);
      if (candidates_[k].empty()) candidates_[k] = even_backdrop(*views_[k], priors[k]);
      if (candidates_[k].empty()) return;
      with_rim_[k] = dilated(inverted(candidates_[k]), kObjectRim);
      is_enclosing_[k] = border_share(candidates_[k]) >= kEnclosing ? 1 : 0;
    });
  }

  void mark() {
    const auto are_enough = [&] {
      const auto count = std::count_if(
          with_rim_.begin(), with_rim_.end(), [](const auto& m) { return !m.empty(); });
      return double(count) >= kLeastViews * double(with_rim_.size());
    };
    if (!are_enough()) return;
    std::vector<MaskMap> lost = beyond_silhouettes();
    if (share_lost(lost) > kMostLost) return;
    const std::vector<Measured> points = measured_points(lost);
    std::vector<MaskMap> confirmed(priors_.size());
    tbb::parallel_for(size_t{0}, priors_.size(), [&](size_t k) {
      if (!candidates_[k].empty()) confirmed[k] = confirm(k, lost[k], points);
    });
    bool is_less = false;
    for (size_t k = 0; k < priors_.size(); ++k) {
      if (with_rim_[k].empty() || !confirmed[k].empty()) continue;
      with_rim_[k] = {};
      is_less = true;
    }
    if (!are_enough()) return;
    if (is_less) lost = beyond_silhouettes();
    for (size_t k = 0; k < priors_.size(); ++k) {
      enter_without_depth(lost[k], DepthOrigin::Unknown, priors_[k]);
      enter_without_depth(confirmed[k], DepthOrigin::Background, priors_[k]);
    }
  }

 private:
  // Points that some views measured, evenly spread over their pictures.
  struct Measured {
    size_t view;
    Eigen::Vector3d place;
  };

  bool is_measured(size_t view, int x, int y) const {
    return priors_[view].origin(x, y) == DepthOrigin::Measured;
  }

  Eigen::Vector3d place(size_t view, int x, int y) const {
    return views_[view]->camera.unproject(x + 0.5, y + 0.5, priors_[view].depth(x, y));
  }

  enum class Sight { None, Object, Background };
  Sight sight(size_t view, const Camera& camera, const Eigen::Vector3d& place) const {
    if (with_rim_[view].empty()) return Sight::None;
    const Eigen::Vector3d at = camera.project(place);
    if (!camera.sees(at)) return is_enclosing_[view] ? Sight::Background : Sight::None;
    const bool is_object = with_rim_[view](static_cast<int>(at.x()), static_cast<int>(at.y())) != 0;
    return is_object ? Sight::Object : Sight::Background;
  }

  // Measured by mistake, where the backdrop is not quite even: most other views show background
  // there, two at least.
  std::vector<MaskMap> beyond_silhouettes() const {
    std::vector<MaskMap> out;
    for (size_t k = 0; k < priors_.size(); ++k) out.push_back(beyond_silhouettes(k));
    return out;
  }
  MaskMap beyond_silhouettes(size_t k) const {
    const Raster<DepthOrigin>& origin = priors_[k].origin;
    MaskMap out(origin.width, origin.height, 0);
    tbb::parallel_for(0, origin.height, [&](int y) {
      for (int x = 0; x < origin.width; ++x) {
        if (!is_measured(k, x, y)) continue;
        const Eigen::Vector3d at = place(k, x, y);
        int object = 0;
        int background = 0;
        for (size_t other = 0; other < views_.size(); ++other) {
          if (other == k) continue;
          const Sight seen = sight(other, views_[other]->camera, at);
          object += seen == Sight::Object ? 1 : 0;
          background += seen == Sight::Background ? 1 : 0;
        }
        out(x, y) = background >= 2 && background > object ? 1 : 0;
      }
    });
    return out;
  }

  double share_lost(const std::vector<MaskMap>& lost) const {
    size_t count = 0;
    size_t measured = 0;
    for (size_t k = 0; k < lost.size(); ++k) {
      count += size_t(std::count(lost[k].data.begin(), lost[k].data.end(), uint8_t{1}));
      const auto& origin = priors_[k].origin.data;
      measured += size_t(std::count(origin.begin(), origin.end(), DepthOrigin::Measured));
    }
    return measured > 0 ? double(count) / double(measured) : 1;
  }

  std::vector<Measured> measured_points(const std::vector<MaskMap>& lost) const {
    std::vector<Measured> out;
    for (size_t k = 0; k < priors_.size(); ++k) {
      const int dx = std::max(1, lost[k].width / kPointsAlong);
      const int dy = std::max(1, lost[k].height / kPointsAlong);
      for (int y = dy / 2; y < lost[k].height; y += dy) {
        for (int x = dx / 2; x < lost[k].width; x += dx) {
          if (is_measured(k, x, y) && lost[k](x, y) == 0) out.push_back({k, place(k, x, y)});
        }
      }
    }
    return out;
  }

  // What is left of a background after the others were asked; empty if they contradict it.
  MaskMap confirm(size_t k, const MaskMap& lost, const std::vector<Measured>& points) const {
    const Camera& camera = views_[k]->camera;
    MaskMap background = candidates_[k];
    MaskMap against(background.width, background.height, 0);
    size_t asked = 0;
    size_t contradict = 0;
    for (const Measured& point : points) {
      const Sight seen = point.view == k ? Sight::None : sight(k, camera, point.place);
      asked += seen != Sight::None ? 1 : 0;
      if (seen != Sight::Background) continue;
      ++contradict;
      const Eigen::Vector3d at = camera.project(point.place);
      if (!camera.sees(at)) continue;
      against(static_cast<int>(at.x()), static_cast<int>(at.y())) = 1;
    }
    if (asked < kLeastPoints || double(contradict) > kMostAgainst * double(asked)) return {};
    for (size_t i = 0; i < against.data.size(); ++i) {
      const bool is_kept = priors_[k].origin.data[i] == DepthOrigin::Measured && lost.data[i] == 0;
      if (is_kept && background.data[i] != 0) against.data[i] = 1;
    }
    // As far as from one of these points to the next.
    against = dilated(against, std::max(kObjectRim, background.width / kPointsAlong));
    for (size_t i = 0; i < background.data.size(); ++i) {
      if (with_rim_[k].data[i] != 0 || against.data[i] != 0) background.data[i] = 0;
    }
    return background;
  }

  std::vector<const View*> views_;
  std::vector<ViewPriors>& priors_;
  std::vector<MaskMap> candidates_;
  std::vector<MaskMap> with_rim_;      // 1 where an object may be
  std::vector<uint8_t> is_enclosing_;  // 1 where nothing of it lies outside of the picture
};

}  // namespace

void mark_background(const Scene& scene, std::vector<ViewPriors>& priors) try {
  Backgrounds(scene, priors).mark();
} catch (const cv::Exception& error) {
  throw_if_out_of_memory(error);
  throw;
}

}  // namespace cgs
