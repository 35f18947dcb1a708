// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/sky.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/directions.h"

namespace cgs {

namespace {

// Levels of sRGB, in [0, 1].
constexpr float kEven = 0.035f;      // largest change from pixel to pixel
constexpr float kRimChange = 0.12f;  // of a pixel that is half sky
constexpr float kBlueness = 0.2f;    // blue over red of a sky that need not be bright
constexpr double kBrightest = 0.98;  // share of the rest that a sky of another colour outshines,
constexpr double kBright = 0.6;      // and one along most of the border
constexpr double kLeastArea = 0.01;  // of the picture
constexpr double kLeastRim = 0.08;   // of the border that is up
constexpr double kMostRim = 0.8;
constexpr float kAlike = 0.12f;  // colours of one sky in two pictures

using Component = std::vector<std::pair<int, int>>;

// Calls visit(component) for every set of pixels with is_member(x, y) that hang together.
template <typename IsMember, typename Visit>
void for_each_component(int width, int height, const IsMember& is_member, const Visit& visit) {
  MaskMap visited(width, height, 0);
  Component component;
  const auto take = [&](int x, int y) {
    if (!visited.contains(x, y) || visited(x, y) != 0 || !is_member(x, y)) return;
    visited(x, y) = 1;
    component.emplace_back(x, y);
  };
  for (int y0 = 0; y0 < height; ++y0) {
    for (int x0 = 0; x0 < width; ++x0) {
      component.clear();
      take(x0, y0);
      for (size_t i = 0; i < component.size(); ++i) {
        const auto [x, y] = component[i];
        for (const Direction d : kNeighbors) take(x + d.dx, y + d.dy);
      }
      if (!component.empty()) visit(component);
    }
  }
}

float luminance(const Eigen::Vector3f& c) { return c.dot(Eigen::Vector3f(0.21f, 0.72f, 0.07f)); }

bool is_blue(const Eigen::Vector3f& c) {
  return c[2] - c[0] > 0.08f && c[2] >= c[1] - 0.01f && c[1] >= c[0] - 0.03f && c[2] > 0.35f;
}

bool is_white(const Eigen::Vector3f& c, float least) {
  return c.minCoeff() > least && c.maxCoeff() - c.minCoeff() < 0.2f;
}

// Means over the pixels of use among 3 x 3: noise of sensors and of compression must not tear the
// sky.
ColorImage smoothed(const View& view) {
  const ColorImage& image = view.image;
  ColorImage out = image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float count = 0;
      for (int v = std::max(0, y - 1); v <= std::min(image.height - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(image.width - 1, x + 1); ++u) {
          if (!view.is_usable(u, v)) continue;
          sum += image(u, v);
          ++count;
        }
      }
      if (count > 0) out(x, y) = sum / count;
    }
  }
  return out;
}

class SkyFinder {
 public:
  SkyFinder(const View& view, const ViewPriors& priors)
      : view_(view),
        priors_(priors),
        colors_(smoothed(view)),
        median_depth_(median_depth(priors)),
        sky_(view.image.width, view.image.height, 0) {}

  // What may be sky, if its colour says so.
  struct Candidate {
    Component pixels;
    Eigen::Vector3f color = Eigen::Vector3f::Zero();  // median
    double along_border = 0;                          // share of the one that is up
    bool stands_out = false;                          // from the rest of its picture, as sky does
  };

  // \param up  step in the picture
  std::vector<Candidate> candidates(Direction up) const {
    const double border = up.dx == 0 ? sky_.width : sky_.height;
    std::vector<Candidate> out;
    const auto may_be_sky = [&](int x, int y) { return looks_like_sky(x, y); };
    for_each_component(sky_.width, sky_.height, may_be_sky, [&](const Component& part) {
      const auto at_border = std::count_if(part.begin(), part.end(), [&](const auto& p) {
        return is_at_border(p.first, p.second, up);
      });
      const bool is_large = double(part.size()) >= kLeastArea * double(sky_.data.size());
      const double along = double(at_border) / border;
      if (!is_large || along < kLeastRim || is_measured_nearby(part)) return;
      out.push_back({part, median_color(part), along});
    });
    for (Candidate& one : out) {
      const double darker = share_darker(one, out);
      one.stands_out = one.color[2] - one.color[0] >= kBlueness || darker >= kBrightest ||
                       (one.along_border >= kMostRim && darker >= kBright);
    }
    return out;
  }

  // \param parts  those that are sky
  MaskMap grown_from(const std::vector<Candidate>& parts, Direction up) {
    if (parts.empty()) return {};
    for (const Candidate& part : parts) {
      for (const auto& [x, y] : part.pixels) sky_(x, y) = 1;
    }
    add_clouds(up);
    add_between_bars();
    for (int round = 0; round < kRimPixels; ++round) add_rim();
    return sky_;
  }

 private:
  static constexpr int kRimPixels = 3;

  // Nothing but pixels of no use, as undistorting leaves them, lies between it and the border.
  bool is_at_border(int x, int y, Direction up) const {
    for (x += up.dx, y += up.dy; sky_.contains(x, y); x += up.dx, y += up.dy) {
      if (view_.is_usable(x, y)) return false;
    }
    return true;
  }

  float change_at(int x, int y) const {
    float out = 0;
    for (const Direction d : {Direction{1, 0}, Direction{0, 1}}) {
      if (!colors_.contains(x + d.dx, y + d.dy) || !view_.is_usable(x + d.dx, y + d.dy)) continue;
      const Eigen::Vector3f step = colors_(x + d.dx, y + d.dy) - colors_(x, y);
      out = std::max(out, step.cwiseAbs().maxCoeff());
    }
    return out;
  }

  bool looks_like_sky(int x, int y) const {
    const Eigen::Vector3f& c = colors_(x, y);
    constexpr float kLeast = 0.72f;
    return view_.is_usable(x, y) && (is_blue(c) || is_white(c, kLeast)) && change_at(x, y) < kEven;
  }

  Eigen::Vector3f median_color(const Component& part) const {
    Eigen::Vector3f out;
    std::vector<float> levels(part.size());
    for (Eigen::Index c = 0; c < 3; ++c) {
      std::transform(part.begin(), part.end(), levels.begin(), [&](const auto& p) {
        return colors_(p.first, p.second)[c];
      });
      out[c] = median(levels);
    }
    return out;
  }

  bool is_measured_nearby(const Component& part) const {
    constexpr double kMost = 0.3;
    const float farther = kFarther * median_depth_;
    const auto near = std::count_if(part.begin(), part.end(), [&](const auto& p) {
      return is_well_measured(p.first, p.second) && priors_.depth(p.first, p.second) < farther;
    });
    return double(near) > kMost * double(part.size());
  }

  // Of the pixels that are not of candidates as bright, how many are darker. Those do not count, as
  // a tower may divide the sky, nor do their rims, which are sky but not even.
  double share_darker(const Candidate& one, const std::vector<Candidate>& all) const {
    constexpr float kSameLevel = 0.04f;
    constexpr int kRim = 2;  // as wide as smoothing and the next pixel reach
    const float level = luminance(one.color);
    MaskMap others = view_.valid.empty() ? MaskMap(sky_.width, sky_.height, 1) : view_.valid;
    for (const Candidate& part : all) {
      if (std::abs(luminance(part.color) - level) > kSameLevel) continue;
      for (const auto& [x, y] : part.pixels) {
        for (int v = std::max(0, y - kRim); v <= std::min(others.height - 1, y + kRim); ++v) {
          for (int u = std::max(0, x - kRim); u <= std::min(others.width - 1, x + kRim); ++u) {
            others(u, v) = 0;
          }
        }
      }
    }
    size_t count = 0;
    size_t darker = 0;
    for (size_t i = 0; i < others.data.size(); ++i) {
      if (others.data[i] == 0) continue;
      ++count;
      darker += luminance(colors_.data[i]) < level ? 1 : 0;
    }
    return count > 0 ? double(darker) / double(count) : 0;
  }

  bool is_well_measured(int x, int y) const {
    constexpr float kConfident = 0.5f;  // as a depth sensor alone is
    return !priors_.origin.empty() && priors_.origin(x, y) == DepthOrigin::Measured &&
           priors_.confidence(x, y) >= kConfident;
  }

  static float median_depth(const ViewPriors& priors) {
    std::vector<float> depths;
    for (size_t i = 0; i < priors.depth.data.size(); ++i) {
      if (priors.origin.data[i] == DepthOrigin::Measured) depths.push_back(priors.depth.data[i]);
    }
    return depths.empty() ? 0 : median(depths);
  }

  // White parts that nothing but sky and the borders beside it enclose.
  void add_clouds(Direction up) {
    Component clouds;
    for_each_component(
        sky_.width,
        sky_.height,
        [&](int x, int y) { return sky_(x, y) == 0; },
        [&](const Component& part) {
          constexpr float kCloud = 0.5f;
          Eigen::Vector3f sum = Eigen::Vector3f::Zero();
          Component seen;
          for (const auto& [x, y] : part) {
            // Whatever reaches the lower border stands on the ground.
            if (!sky_.contains(x - up.dx, y - up.dy)) return;
            if (!view_.is_usable(x, y)) continue;
            sum += colors_(x, y);
            seen.emplace_back(x, y);
          }
          if (seen.empty() || !is_white(sum / float(seen.size()), kCloud)) return;
          clouds.insert(clouds.end(), seen.begin(), seen.end());
        });
    for (const auto& [x, y] : clouds) sky_(x, y) = 1;
  }

  // Parts that look like sky a small way from it, as between bars. Farther away they may be
  // windows in which it is mirrored.
  void add_between_bars() {
    const int reach = std::max(3, (sky_.width + sky_.height) / 50);
    Component found;
    for_each_component(
        sky_.width,
        sky_.height,
        [&](int x, int y) { return sky_(x, y) == 0 && looks_like_sky(x, y); },
        [&](const Component& part) {
          const bool is_near = std::any_of(part.begin(), part.end(), [&](const auto& p) {
            return is_like_sky_nearby(p.first, p.second, reach);
          });
          if (is_near && !is_measured_nearby(part)) {
            found.insert(found.end(), part.begin(), part.end());
          }
        });
    for (const auto& [x, y] : found) sky_(x, y) = 1;
  }

  bool is_like_sky_nearby(int x, int y, int reach) const {
    constexpr float kSame = 0.06f;
    for (const Direction d : kDirections) {
      const int stride = std::max(std::abs(d.dx), std::abs(d.dy));
      for (int k = 1; k * stride <= reach; ++k) {
        const int u = x + k * d.dx;
        const int v = y + k * d.dy;
        if (!sky_.contains(u, v)) break;
        if (sky_(u, v) == 0) continue;
        if ((colors_(u, v) - colors_(x, y)).cwiseAbs().maxCoeff() < kSame) return true;
        break;  // this way; another may lead to the like
      }
    }
    return false;
  }

  // Pixels beside sky that are more sky than not: the rim of a silhouette is blurred.
  void add_rim() {
    Component found;
    for (int y = 0; y < sky_.height; ++y) {
      for (int x = 0; x < sky_.width; ++x) {
        if (sky_(x, y) != 0 || !view_.is_usable(x, y)) continue;
        const bool is_rim = std::any_of(kNeighbors.begin(), kNeighbors.end(), [&](Direction d) {
          const int u = x + d.dx;
          const int v = y + d.dy;
          return sky_.contains(u, v) && sky_(u, v) != 0 &&
                 (view_.image(u, v) - view_.image(x, y)).cwiseAbs().maxCoeff() < kRimChange;
        });
        if (is_rim) found.emplace_back(x, y);
      }
    }
    for (const auto& [x, y] : found) sky_(x, y) = 1;
  }

  static constexpr float kFarther = 3;  // than what is measured mostly: clouds may be matched

  const View& view_;
  const ViewPriors& priors_;
  ColorImage colors_;
  float median_depth_;  // of what was measured; 0 = nothing
  MaskMap sky_;
};

// The border of the picture that a world direction points to most.
Direction step_towards(const Eigen::Vector3d& up, const Camera& camera) {
  const Eigen::Vector3d in_cam = camera.world_from_cam.linear().transpose() * up;
  constexpr double kClear = 0.3;  // looking up or down, no border is
  if (!(in_cam.head<2>().norm() > kClear)) return {0, -1};
  if (std::abs(in_cam.x()) > std::abs(in_cam.y())) return {in_cam.x() > 0 ? 1 : -1, 0};
  return {0, in_cam.y() > 0 ? 1 : -1};
}

}  // namespace

MaskMap find_sky(const View& view, const ViewPriors& priors, const Eigen::Vector3d& up) {
  const Direction step = step_towards(up, view.camera);
  SkyFinder finder(view, priors);
  std::vector<SkyFinder::Candidate> found = finder.candidates(step);
  std::erase_if(found, [](const auto& part) { return !part.stands_out; });
  return finder.grown_from(found, step);
}

namespace {

// \param steps  per view, towards the border where its sky begins
std::vector<MaskMap> skies_towards(const Scene& scene,
                                   const std::vector<ViewPriors>& priors,
                                   const std::vector<Direction>& steps) {
  std::vector<SkyFinder> finders;
  std::vector<std::vector<SkyFinder::Candidate>> found;
  std::vector<Eigen::Vector3f> skies;
  const auto view = [&](size_t i) -> const View& {
    return scene.views[static_cast<size_t>(scene.input[i])];
  };
  for (size_t i = 0; i < priors.size(); ++i) {
    finders.emplace_back(view(i), priors[i]);
    found.push_back(finders.back().candidates(steps[i]));
    for (const auto& part : found.back()) {
      if (part.stands_out) skies.push_back(part.color);
    }
  }
  std::vector<MaskMap> out;
  for (size_t i = 0; i < priors.size(); ++i) {
    std::erase_if(found[i], [&](const auto& part) {
      return !part.stands_out && std::none_of(skies.begin(), skies.end(), [&](const auto& sky) {
        return (part.color - sky).cwiseAbs().maxCoeff() < kAlike;
      });
    });
    out.push_back(finders[i].grown_from(found[i], steps[i]));
  }
  return out;
}

}  // namespace

std::vector<MaskMap> find_sky(const Scene& scene, const std::vector<ViewPriors>& priors) {
  const Direction upright{0, -1};
  std::vector<Direction> stated;
  for (const int i : scene.input) {
    const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
    stated.push_back(scene.frame.knows_up() ? step_towards(scene.frame.up, camera) : upright);
  }
  // People hold cameras upright, and what is up in the world is a guess where cameras only moved
  // on: it counts first only for those that lie on their side beside others that do not.
  std::vector<Direction> as_held = stated;
  const auto lies = [](const Direction& step) { return step.dx != 0; };
  const bool all_lie = std::all_of(stated.begin(), stated.end(), lies);
  for (Direction& step : as_held) {
    if (all_lie || !lies(step)) step = upright;
  }
  std::vector<MaskMap> out = skies_towards(scene, priors, as_held);
  const bool is_any =
      std::any_of(out.begin(), out.end(), [](const MaskMap& sky) { return !sky.empty(); });
  return is_any || !scene.frame.knows_up() ? out : skies_towards(scene, priors, stated);
}

void enter_sky(const MaskMap& sky, ViewPriors& priors) {
  enter_without_depth(sky, DepthOrigin::Sky, priors);
}

void set_backdrop(std::vector<ViewPriors>& views) {
  constexpr float kBehind = 4;        // times the farthest that is measured
  constexpr float kUncertain = 0.5f;  // of the depth
  std::vector<float> depths;
  for (const ViewPriors& view : views) {
    for (size_t i = 0; i < view.depth.data.size(); ++i) {
      if (view.origin.data[i] == DepthOrigin::Measured) depths.push_back(view.depth.data[i]);
    }
  }
  if (depths.empty()) return;
  const float depth = kBehind * nth_smallest(depths, (depths.size() - 1) * 99 / 100);
  for (ViewPriors& view : views) {
    for (size_t i = 0; i < view.depth.data.size(); ++i) {
      if (view.origin.data[i] != DepthOrigin::Sky) continue;
      view.depth.data[i] = depth;
      view.sigma.data[i] = kUncertain * depth;
    }
  }
}

std::optional<float> median_depth(std::span<const ViewPriors> views) {
  std::vector<float> of_surfaces;
  std::vector<float> of_sky;
  for (const ViewPriors& view : views) {
    for (size_t i = 0; i < view.depth.data.size(); ++i) {
      const float z = view.depth.data[i];
      if (!(z > 0) || !std::isfinite(z)) continue;
      (view.origin.data[i] == DepthOrigin::Sky ? of_sky : of_surfaces).push_back(z);
    }
  }
  std::vector<float>& depths = of_surfaces.empty() ? of_sky : of_surfaces;
  if (depths.empty()) return std::nullopt;
  return median(depths);
}

}  // namespace cgs
