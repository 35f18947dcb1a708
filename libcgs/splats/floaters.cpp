// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/floaters.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

constexpr float kOpaque = 0.1f;   // splats that tell where the scene is
constexpr double kReach = 1.5;    // of a splat [sigma]
constexpr float kMatter = 0.25f;  // sum of opacities in a cell
constexpr float kOne = 256;       // opacity 1 in the grid, where whole numbers add up in any order
constexpr size_t kGrain = 2048;

std::vector<Eigen::Vector3f> opaque_places(const Gaussians& g) {
  std::vector<Eigen::Vector3f> out;
  for (size_t i = 0; i < g.size(); ++i) {
    if (g.opacity[i] >= kOpaque) out.push_back(g.position[i]);
  }
  return out.empty() ? g.position : out;
}

Eigen::AlignedBox3d inner_box(const std::vector<Eigen::Vector3f>& places) {
  Eigen::AlignedBox3d out;
  out.min().setZero();
  out.max().setZero();
  std::vector<float> values(places.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(
        places.begin(), places.end(), values.begin(), [&](const auto& p) { return p[axis]; });
    out.min()[axis] = quantile(values, 0.01);
    out.max()[axis] = quantile(values, 0.99);
  }
  return out;
}

/// How far apart splats usually are: the median distance to the fourth nearest, of a sample.
double usual_spacing(const std::vector<Eigen::Vector3f>& places) {
  constexpr size_t kSamples = 5000;
  constexpr size_t kFourth = 5;  // the splat itself comes first
  if (places.size() < kFourth) return 0;
  const KdTree tree(places);
  const size_t stride = 1 + places.size() / kSamples;
  std::vector<float> distances((places.size() + stride - 1) / stride);
  tbb::parallel_for(size_t{0}, distances.size(), [&](size_t k) {
    std::vector<Neighbor> found;
    tree.nearest(places[k * stride], kFourth, found);
    distances[k] = std::sqrt(found.back().squared_distance);
  });
  return quantile(distances, 0.5);
}

/// A cell that a splat reaches.
struct Touch {
  size_t cell;
  float mass;  // part of the splat; all parts sum up to 1
  float peak;  // of its Gaussian in the cell
};

/// The cells around a scene, with the opacity in each.
class CellGrid {
 public:
  CellGrid(const Eigen::AlignedBox3d& scene, double cell) : cell_(cell) {
    constexpr double kWidened = 1.5;
    const double side = kWidened * scene.sizes().maxCoeff() + 4 * cell;
    low_ = scene.center().array() - 0.5 * side;
    side_ = static_cast<int>(std::ceil(side / cell));
    opacity_.assign(size_t(side_) * size_t(side_) * size_t(side_), 0);
  }

  bool contains(const Eigen::Vector3f& p) const { return cell_at(p.cast<double>()) != kNone; }
  size_t size() const { return opacity_.size(); }
  bool is_matter(size_t cell) const { return opacity_[cell] >= fixed(kMatter); }

  /// For every cell, whether matter is in it or in one that it touches.
  std::vector<uint8_t> at_matter() const {
    std::vector<uint8_t> out(size(), 0);
    for (size_t c = 0; c < size(); ++c) {
      if (is_matter(c)) for_each_around(c, [&](size_t near) { out[near] = 1; });
    }
    return out;
  }

  /// Whether splats other than the one of these touches make matter in a cell or one that it
  /// touches.
  bool is_at_other_matter(size_t cell, const std::vector<Touch>& own, float opacity) const {
    bool out = false;
    for_each_around(cell, [&](size_t near) {
      const auto at = std::lower_bound(
          own.begin(), own.end(), near, [](const Touch& t, size_t c) { return t.cell < c; });
      const bool touched = at != own.end() && at->cell == near;
      const uint32_t mine = touched ? fixed(opacity * at->peak) : 0;
      out = out || opacity_[near] >= fixed(kMatter) + mine;
    });
    return out;
  }

  /// The cell and those that it touches, over corners, too.
  template <typename Visit>
  void for_each_around(size_t cell, const Visit& visit) const {
    const auto n = static_cast<size_t>(side_);
    for (size_t k = 0; k < 27; ++k) {
      visit(cell + k % 3 + n * (k / 3 % 3) + n * n * (k / 9) - (1 + n + n * n));
    }
  }

  /// The cells within the reach of a splat, each once.
  void touched(const Gaussians& g, size_t i, std::vector<Touch>& out) const {
    out.clear();
    const Eigen::Matrix3d axes = rotation_matrix(g.rotation[i]).cast<double>() *
                                 (kReach * g.scale[i].cast<double>()).asDiagonal();
    const Eigen::Vector3d center = g.position[i].cast<double>();
    std::array<int, 3> steps{};
    for (int axis = 0; axis < 3; ++axis) {
      steps[static_cast<size_t>(axis)] = steps_along(kReach * double{g.scale[i][axis]});
    }
    coarsen(steps);
    float all = 0;
    for (int x = -steps[0]; x <= steps[0]; ++x) {
      for (int y = -steps[1]; y <= steps[1]; ++y) {
        for (int z = -steps[2]; z <= steps[2]; ++z) {
          const Eigen::Vector3d t(part(x, steps[0]), part(y, steps[1]), part(z, steps[2]));
          const auto height =
              static_cast<float>(std::exp(-0.5 * kReach * kReach * t.squaredNorm()));
          const size_t cell = cell_at(center + axes * t);
          if (cell == kNone) continue;
          all += height;
          out.push_back({cell, height, height});
        }
      }
    }
    merge(out, all);
  }

  /// Adds a splat; may be called from many threads.
  void add(const std::vector<Touch>& touches, float opacity) {
    for (const Touch& t : touches) {
      std::atomic_ref<uint32_t>(opacity_[t.cell])
          .fetch_add(fixed(opacity * t.peak), std::memory_order_relaxed);
    }
  }

  void clear() { std::fill(opacity_.begin(), opacity_.end(), 0); }

 private:
  static constexpr size_t kNone = SIZE_MAX;

  static uint32_t fixed(float opacity) {
    return static_cast<uint32_t>(std::lround(opacity * kOne));
  }
  static double part(int step, int steps) { return steps == 0 ? 0 : double(step) / steps; }

  // To each side, a cell each.
  int steps_along(double reach) const {
    constexpr double kMost = 400;  // across all cells
    if (reach < 0.5 * cell_) return 0;
    return static_cast<int>(std::min(kMost, std::ceil(reach / cell_)));
  }

  // A disc may reach over 70 cells to each side without leaving any out; what fills space is haze,
  // however it is seen.
  static void coarsen(std::array<int, 3>& steps) {
    constexpr double kMostPlaces = 20'000;
    const auto places = [&] {
      return (2.0 * steps[0] + 1) * (2.0 * steps[1] + 1) * (2.0 * steps[2] + 1);
    };
    while (places() > kMostPlaces) {
      for (int& n : steps) n -= n > 6 ? n / 6 : 0;
    }
  }

  // None in the outermost layer, so that every cell has all its neighbours.
  size_t cell_at(const Eigen::Vector3d& p) const {
    const Eigen::Array3d at = ((p - low_) / cell_).array().floor();
    if (!((at >= 1).all() && (at < double(side_ - 1)).all())) return kNone;
    const Eigen::Vector3i c = at.cast<int>();
    return (size_t(c.z()) * size_t(side_) + size_t(c.y())) * size_t(side_) + size_t(c.x());
  }

  static void merge(std::vector<Touch>& touches, float all) {
    std::stable_sort(touches.begin(), touches.end(), [](const Touch& a, const Touch& b) {
      return a.cell < b.cell;
    });
    size_t kept = 0;
    for (const Touch& t : touches) {
      if (kept > 0 && touches[kept - 1].cell == t.cell) {
        touches[kept - 1].mass += t.mass;
        touches[kept - 1].peak = std::max(touches[kept - 1].peak, t.peak);
      } else {
        touches[kept++] = t;
      }
    }
    touches.resize(kept);
    for (Touch& t : touches) t.mass /= all;
  }

  double cell_;
  Eigen::Vector3d low_;
  int side_ = 0;  // [cells]
  std::vector<uint32_t> opacity_;
};

template <typename Visit>
void for_each_splat(const CellGrid& grid, const Gaussians& g, const Visit& visit) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, g.size(), kGrain), [&](const auto& range) {
    std::vector<Touch> touches;
    for (size_t i = range.begin(); i != range.end(); ++i) {
      if (!grid.contains(g.position[i])) continue;
      grid.touched(g, i, touches);
      visit(i, touches);
    }
  });
}

enum class Kind : uint8_t { Surface, Outside, Haze, Needle, Island };

bool is_needle(const Eigen::Vector3f& scale, double cell) {
  constexpr float kSlender = 5;
  Eigen::Vector3f s = scale;
  std::sort(s.begin(), s.end());
  return s[2] > kSlender * s[1] && kReach * double{s[2]} > cell;
}

Kind kind_of(const CellGrid& grid,
             const std::vector<uint8_t>& at_matter,
             const std::vector<Touch>& touches,
             float opacity,
             bool needle) {
  constexpr float kLeastInMatter = 0.5f;
  constexpr float kLeastOfNeedle = 0.25f;
  float in_matter = 0;
  float with_others = 0;
  for (const Touch& t : touches) {
    if (at_matter[t.cell] != 0) in_matter += t.mass;
    if (needle && grid.is_at_other_matter(t.cell, touches, opacity)) with_others += t.mass;
  }
  if (needle && with_others < kLeastOfNeedle) return Kind::Needle;
  return in_matter < kLeastInMatter ? Kind::Haze : Kind::Surface;
}

/// The parts of matter that touch, over corners too, or through one splat.
class Parts {
 public:
  Parts(const CellGrid& grid, const Gaussians& g, const std::vector<Kind>& kinds)
      : grid_(grid), number_(grid.size(), kNone) {
    for (size_t c = 0; c < grid.size(); ++c) {
      if (grid.is_matter(c)) number_[c] = count_++;
    }
    sets_ = DisjointSets(count_);
    join_neighbours();
    of_splat_.assign(g.size(), kNone);
    std::vector<Touch> touches;
    for (size_t i = 0; i < g.size(); ++i) {
      if (kinds[i] != Kind::Surface) continue;
      grid.touched(g, i, touches);
      for (const Touch& t : touches) join(of_splat_[i], number_[t.cell]);
      for (size_t k = 0; k < touches.size() && of_splat_[i] == kNone; ++k) {
        grid.for_each_around(touches[k].cell,
                             [&](size_t near) { join(of_splat_[i], number_[near]); });
      }
    }
  }

  /// Splats in the part of each splat; 0 where it is in none.
  std::vector<uint32_t> sizes() {
    std::vector<uint32_t> members(count_, 0);
    for (uint32_t& part : of_splat_) {
      if (part != kNone) ++members[part = sets_.root(part)];
    }
    std::vector<uint32_t> out(of_splat_.size(), 0);
    for (size_t i = 0; i < out.size(); ++i) {
      if (of_splat_[i] != kNone) out[i] = members[of_splat_[i]];
    }
    return out;
  }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  void join(uint32_t& part, uint32_t other) {
    if (other == kNone) return;
    if (part == kNone) part = other;
    sets_.join(part, other);
  }

  void join_neighbours() {
    for (size_t c = 0; c < number_.size(); ++c) {
      if (number_[c] == kNone) continue;
      grid_.for_each_around(c, [&](size_t near) { join(number_[c], number_[near]); });
    }
  }

  const CellGrid& grid_;
  std::vector<uint32_t> number_;  // of a cell of matter
  uint32_t count_ = 0;
  DisjointSets sets_{0};
  std::vector<uint32_t> of_splat_;
};

void mark_islands(CellGrid& grid, const Gaussians& g, std::vector<Kind>& kinds) {
  grid.clear();
  for_each_splat(grid, g, [&](size_t i, const std::vector<Touch>& touches) {
    if (kinds[i] == Kind::Surface) grid.add(touches, g.opacity[i]);
  });
  const auto n = static_cast<double>(g.size());
  const double least = std::max(n / 2000, std::min(30.0, n / 100));
  const std::vector<uint32_t> sizes = Parts(grid, g, kinds).sizes();
  const uint32_t largest = *std::max_element(sizes.begin(), sizes.end());
  for (size_t i = 0; i < g.size(); ++i) {
    if (kinds[i] != Kind::Surface || sizes[i] >= least || sizes[i] >= largest) continue;
    kinds[i] = sizes[i] == 0 ? Kind::Haze : Kind::Island;
  }
}

}  // namespace

Floaters find_floaters(const Gaussians& g) {
  require(g.size() > 0, "find_floaters: number of Gaussians must be > 0", 0);
  constexpr double kCellsAcross = 200;
  constexpr double kMostPart = 0.25;  // of the splats
  Floaters out;
  out.keep.assign(g.size(), 1);
  Eigen::AlignedBox3d scene;
  {
    const std::vector<Eigen::Vector3f> places = opaque_places(g);
    scene = inner_box(places);
    out.cell = std::max(scene.sizes().maxCoeff() / kCellsAcross, usual_spacing(places));
  }
  if (!(out.cell > 0)) return out;  // all in one place
  CellGrid grid(scene, out.cell);
  for_each_splat(grid, g, [&](size_t i, const std::vector<Touch>& touches) {
    grid.add(touches, g.opacity[i]);
  });
  std::vector<Kind> kinds(g.size(), Kind::Outside);
  const std::vector<uint8_t> at_matter = grid.at_matter();
  for_each_splat(grid, g, [&](size_t i, const std::vector<Touch>& touches) {
    kinds[i] = kind_of(grid, at_matter, touches, g.opacity[i], is_needle(g.scale[i], out.cell));
  });
  mark_islands(grid, g, kinds);
  const auto count = [&](Kind kind) {
    return static_cast<size_t>(std::count(kinds.begin(), kinds.end(), kind));
  };
  out.haze = count(Kind::Haze);
  out.needles = count(Kind::Needle);
  out.islands = count(Kind::Island);
  out.outside = count(Kind::Outside);
  out.doubtful = double(out.count()) > kMostPart * double(g.size());
  if (out.doubtful) return out;
  for (size_t i = 0; i < g.size(); ++i) {
    out.keep[i] = kinds[i] == Kind::Surface || kinds[i] == Kind::Outside ? 1 : 0;
  }
  return out;
}

std::string floaters_text(const Floaters& f) {
  const std::string kinds = std::to_string(f.haze) + " haze, " + std::to_string(f.needles) +
                            " needles, " + std::to_string(f.islands) + " in small islands";
  const std::string all = std::to_string(f.keep.size()) + " splats";
  const std::string some = std::to_string(f.count()) + " of " + all;
  std::string out = f.doubtful
                        ? some + " look like floaters (" + kinds + "): too many, none was removed"
                        : "removed " + some + " as floaters: " + kinds;
  if (f.outside > 0) {
    out += "; " + std::to_string(f.outside) + " too far from the scene to judge were kept";
  }
  return out;
}

}  // namespace cgs
