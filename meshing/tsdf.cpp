// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/tsdf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "libcgs/core/error.h"
#include "meshing/block_evidence.h"
#include "meshing/depth_field.h"

namespace cgs {

namespace {

using openvdb::Coord;
using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using ColorLeaf = openvdb::Vec3STree::LeafNodeType;
using StateLeaf = openvdb::Int32Tree::LeafNodeType;

constexpr double kMargin = 2;  // Voxels around the band.

void validate_view(const TsdfView& v, size_t i) {
  const auto fits = [&](const auto& raster) {
    return raster.width == v.camera.width && raster.height == v.camera.height;
  };
  const bool ok = fits(v.depth) && (v.sigma.empty() || fits(v.sigma)) &&
                  (v.color.empty() || fits(v.color)) && (v.usable.empty() || fits(v.usable)) &&
                  (v.guessed.empty() || fits(v.guessed));
  require(ok && v.camera.width > 1 && v.camera.height > 1,
          "every raster must have the size of its camera, the view where one has not",
          i);
}

struct Pixel {
  float depth;
  int x, y;
};

// The pixels of a view whose depth lies within its 1st and 99th percentile.
std::vector<Pixel> trustworthy_pixels(const TsdfView& view, double depth_trunc) {
  std::vector<Pixel> pixels;
  std::vector<float> depths;
  for (int y = 0; y < view.depth.height; ++y) {
    for (int x = 0; x < view.depth.width; ++x) {
      const float d = view.depth(x, y);
      if (!std::isfinite(d) || d <= 0 || (depth_trunc > 0 && d > depth_trunc)) continue;
      if (!view.usable.empty() && view.usable(x, y) == 0) continue;
      pixels.push_back({d, x, y});
      depths.push_back(d);
    }
  }
  if (pixels.empty()) return pixels;
  const auto percentile = [&](size_t percent) {
    const auto at = depths.begin() + std::ptrdiff_t((depths.size() - 1) * percent / 100);
    std::nth_element(depths.begin(), at, depths.end());
    return *at;
  };
  const float low = percentile(1);
  const float high = percentile(99);
  std::erase_if(pixels, [&](const Pixel& p) { return p.depth < low || p.depth > high; });
  return pixels;
}

struct Extent {
  Eigen::AlignedBox3d surface;
  double footprint = 0;  // Median size of a pixel on the surface [internal units].
  double sigma = 0;      // Median of the known ones [internal units].
  size_t pixels = 0;     // Of all views.
};

// What one view adds to it.
struct ViewExtent {
  Eigen::AlignedBox3d surface;
  size_t pixels = 0;
  std::vector<double> footprints, sigmas;
};

// Footprints and sigmas are those of at most `most` pixels, evenly spaced.
ViewExtent view_extent(const TsdfView& view, double depth_trunc, size_t most) {
  ViewExtent out;
  out.pixels = view.depth.data.size();
  const size_t stride = 1 + (out.pixels - 1) / most;
  size_t i = 0;
  for (const Pixel& p : trustworthy_pixels(view, depth_trunc)) {
    out.surface.extend(view.camera.unproject(p.x + 0.5, p.y + 0.5, double(p.depth)));
    if (i++ % stride != 0) continue;
    const float sigma = view.sigma.empty() ? 0 : view.sigma(p.x, p.y);
    if (sigma > 0) out.sigmas.push_back(double(sigma));
    out.footprints.push_back(2 * double(p.depth) / (view.camera.fx + view.camera.fy));
  }
  return out;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Views that are in memory, or come one after the other.
class Views {
 public:
  explicit Views(std::span<const TsdfView> views) : views_(views), count_(views.size()) {}
  explicit Views(const TsdfSource& source) : source_(&source), count_(source.count) {}

  size_t size() const { return count_; }
  bool are_in_memory() const { return source_ == nullptr; }
  // Calls work(i, view) for views first ... last - 1, several at once.
  template <typename Work>
  void each(size_t first, size_t last, bool with_color, const Work& work) const {
    tbb::parallel_for(first, last, [&](size_t i) {
      if (are_in_memory()) {
        work(i, views_[i]);
        return;
      }
      TsdfView view = source_->view(i, with_color);
      validate_view(view, i);
      // Nested loops of a waiting thread must not begin another view: that would hold one more.
      tbb::this_task_arena::isolate([&] { work(i, std::move(view)); });
    });
  }

 private:
  std::span<const TsdfView> views_;
  const TsdfSource* source_ = nullptr;
  size_t count_;
};

constexpr size_t kHeldPixelBytes = DepthField::kPixelBytes + sizeof(Eigen::Vector3f) + 1;
constexpr size_t kAtOnce = 16;  // Views between two reports of progress.

Extent surface_extent(const Views& views,
                      double depth_trunc,
                      size_t most_footprints,
                      const Progress& progress) {
  Extent out;
  const size_t most = std::max(size_t{1}, most_footprints / views.size());
  std::vector<double> footprints;
  std::vector<double> sigmas;
  std::vector<ViewExtent> parts(kAtOnce);
  for (size_t first = 0; first < views.size(); first += kAtOnce) {
    const size_t last = std::min(first + kAtOnce, views.size());
    views.each(first, last, false, [&](size_t i, const TsdfView& view) {
      parts[i - first] = view_extent(view, depth_trunc, most);
    });
    for (size_t i = first; i < last; ++i) {
      const ViewExtent& part = parts[i - first];
      out.surface.extend(part.surface);
      out.pixels += part.pixels;
      footprints.insert(footprints.end(), part.footprints.begin(), part.footprints.end());
      sigmas.insert(sigmas.end(), part.sigmas.begin(), part.sigmas.end());
    }
    report(progress, static_cast<double>(last) / static_cast<double>(views.size()));
  }
  require(!footprints.empty(), "fuse needs pixels with a depth, their number", 0);
  out.footprint = median(footprints);
  if (!sigmas.empty()) out.sigma = median(sigmas);
  return out;
}

double voxels_in(const Eigen::AlignedBox3d& surface, double voxel, double margin) {
  return ((surface.sizes().array() / voxel) + 2 * margin).prod();
}

double chosen_voxel_size(const Extent& extent, const TsdfOptions& options) {
  if (options.voxel_size > 0) return options.voxel_size;
  const double margin = double(options.truncation) + kMargin;
  const auto limit = static_cast<double>(options.max_voxels);
  const double coarsest = options.coarsest_voxel > 0
                              ? std::max({options.coarsest_voxel, extent.footprint, extent.sigma})
                              : std::numeric_limits<double>::infinity();
  double voxel = extent.footprint;
  while (voxels_in(extent.surface, voxel, margin) > limit) voxel *= 1.02;
  return std::min(voxel, coarsest);
}

// The blocks of 8 x 8 x 8 voxels that cover the bounds, in x-major order, and cubes of 4 x 4 x 4 of
// them.
struct BlockGrid {
  static constexpr int kCube = 4;

  Coord first;  // in blocks
  Coord count;
  double voxel = 0;

  size_t size() const { return size_t(count.x()) * size_t(count.y()) * size_t(count.z()); }
  Coord cubes() const {
    return {(count.x() + kCube - 1) / kCube,
            (count.y() + kCube - 1) / kCube,
            (count.z() + kCube - 1) / kCube};
  }
  size_t cube_count() const {
    return size_t(cubes().x()) * size_t(cubes().y()) * size_t(cubes().z());
  }
  static Coord unravelled(size_t i, const Coord& count) {
    const auto nz = size_t(count.z());
    const auto ny = size_t(count.y());
    return {int(i / (ny * nz)), int(i / nz % ny), int(i % nz)};
  }
  Coord origin(size_t i) const {
    const Coord at = unravelled(i, count);
    return {(first.x() + at.x()) * kBlockSide,
            (first.y() + at.y()) * kBlockSide,
            (first.z() + at.z()) * kBlockSide};
  }
  // The blocks of a cube, from low to below high.
  std::pair<Coord, Coord> cube(size_t c) const {
    const Coord at = unravelled(c, cubes());
    const Coord low(at.x() * kCube, at.y() * kCube, at.z() * kCube);
    return {low, Coord::minComponent(low.offsetBy(kCube), count)};
  }
  template <typename Visit>
  void each_in_cube(size_t c, const Visit& visit) const {
    const auto [low, high] = cube(c);
    for (int x = low.x(); x < high.x(); ++x) {
      for (int y = low.y(); y < high.y(); ++y) {
        for (int z = low.z(); z < high.z(); ++z) {
          visit((size_t(x) * size_t(count.y()) + size_t(y)) * size_t(count.z()) + size_t(z));
        }
      }
    }
  }
  Eigen::AlignedBox3f cube_box(size_t c) const {
    const auto [low, high] = cube(c);
    const auto corner = [&](const Coord& block, int last) -> Eigen::Vector3f {
      const Coord at = first + block;
      return (voxel * (Eigen::Vector3d(at.x(), at.y(), at.z()) * kBlockSide -
                       Eigen::Vector3d::Constant(last)))
          .cast<float>();
    };
    return {corner(low, 0), corner(high, 1)};
  }
};

BlockGrid block_grid(const Eigen::AlignedBox3d& bounds, double voxel) {
  const Eigen::Vector3d low = (bounds.min() / (voxel * kBlockSide)).array().floor();
  const Eigen::Vector3d high = (bounds.max() / (voxel * kBlockSide)).array().floor();
  constexpr double kMaxIndex = 1 << 20;  // Far inside what OpenVDB and float coordinates bear.
  const double largest =
      std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) * kBlockSide;
  const double blocks = (high - low + Eigen::Vector3d::Ones()).prod();
  constexpr double kMaxBlocks = 1 << 28;
  if (!(largest < kMaxIndex) || !(blocks < kMaxBlocks)) {
    throw LimitError("voxel size " + std::to_string(voxel) + " is too small for the bounds");
  }
  const Eigen::Vector3i first = low.cast<int>();
  const Eigen::Vector3i count = (high - low).cast<int>() + Eigen::Vector3i::Ones();
  return {{first.x(), first.y(), first.z()}, {count.x(), count.y(), count.z()}, voxel};
}

struct Counts {
  size_t free = 0, occupied = 0, hidden = 0, unseen = 0, conflicts = 0, carved = 0;
};

// One evaluated block: leaves where it is mixed, else only what it is.
struct Block {
  Sight whole = Sight::Mixed;
  std::unique_ptr<FloatLeaf> tsdf, weight, support, sigma;
  std::unique_ptr<ColorLeaf> color;
  std::unique_ptr<StateLeaf> state;
  Counts counts;
};

// What decides between evidence.
struct Rules {
  double voxel = 0;
  float min_weight = 0;
};

void store_band(Block& block,
                openvdb::Index n,
                const Coord& origin,
                const BlockEvidence::Voxel& e) {
  const auto leaf = [&](auto& pointer) -> auto& {
    using Leaf = std::remove_reference_t<decltype(*pointer)>;
    if (!pointer) pointer = std::make_unique<Leaf>(origin, typename Leaf::ValueType(0), false);
    return *pointer;
  };
  leaf(block.tsdf).setValueOn(n, static_cast<float>(e.mean()));
  leaf(block.weight).setValueOn(n, static_cast<float>(e.weight));
  leaf(block.support).setValueOn(n, e.support());
  if (e.has_sigma) leaf(block.sigma).setValueOn(n, static_cast<float>(e.sigma()));
  if (e.color_weight <= 0) return;
  const Eigen::Vector3f c = (e.color / e.color_weight).cast<float>();
  leaf(block.color).setValueOn(n, openvdb::Vec3f(c.x(), c.y(), c.z()));
}

void store(Block& block,
           openvdb::Index n,
           const Coord& origin,
           const BlockEvidence::Voxel& e,
           const Rules& rules) {
  Counts& counts = block.counts;
  const bool seen = e.weight > 0 && e.weight >= double(rules.min_weight);
  const bool conflict = seen && e.free_weight > 0 && std::abs(e.mean()) < rules.voxel;
  // In front of the surface both say the same.
  const bool carved = seen && e.distance < 0 && double(e.free_weight) > e.weight;
  counts.conflicts += conflict;
  counts.carved += conflict && carved;
  if (seen && !carved) {
    ++counts.occupied;
    block.state->setValueOn(n, int(VoxelState::Occupied));
    store_band(block, n, origin, e);
  } else if (e.free) {
    ++counts.free;
    block.state->setValueOn(n, int(VoxelState::Free));
  } else if (e.hidden || (e.weight > 0 && e.distance < 0)) {
    ++counts.hidden;
    block.state->setValueOn(n, int(VoxelState::NeverSeen));
  } else {
    ++counts.unseen;
  }
}

// The leaves of a block, from all that is known about it.
Block finished(const BlockEvidence& evidence, const Coord& origin, const Rules& rules) {
  Block block;
  block.state = std::make_unique<StateLeaf>(origin, 0, false);
  for (int n = 0; n < kBlockVoxels; ++n) {
    store(block, openvdb::Index(n), origin, evidence[size_t(n)], rules);
  }
  for (const auto& [count, sight] : {std::pair(block.counts.free, Sight::Free),
                                     std::pair(block.counts.hidden, Sight::Hidden),
                                     std::pair(block.counts.unseen, Sight::Nothing)}) {
    if (count == kBlockVoxels) block.whole = sight;
  }
  if (block.whole != Sight::Mixed) block.state.reset();
  return block;
}

template <typename Grid>
typename Grid::Ptr empty_grid(const std::string& name,
                              const typename Grid::ValueType& background,
                              double voxel) {
  auto grid = Grid::create(background);
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  return grid;
}

Volume empty_volume(double voxel, const Eigen::AlignedBox3d& bounds, double truncation) {
  Volume volume;
  volume.voxel_size = static_cast<float>(voxel);
  volume.bounds = bounds;
  volume.tsdf =
      empty_grid<openvdb::FloatGrid>("tsdf", static_cast<float>(truncation * voxel), voxel);
  volume.weight = empty_grid<openvdb::FloatGrid>("weight", 0, voxel);
  volume.color = empty_grid<openvdb::Vec3SGrid>("color", openvdb::Vec3f(0), voxel);
  volume.support = empty_grid<openvdb::FloatGrid>("support", 0, voxel);
  volume.sigma = empty_grid<openvdb::FloatGrid>("sigma", 0, voxel);
  volume.state = empty_grid<openvdb::Int32Grid>("state", int(VoxelState::NeverSeen), voxel);
  return volume;
}

void insert(Volume& volume, const Coord& origin, Block& block) {
  constexpr openvdb::Index kTileLevel = 1;  // A tile of the size of a leaf.
  if (block.whole == Sight::Free) {
    volume.state->tree().addTile(kTileLevel, origin, int(VoxelState::Free), true);
  } else if (block.whole == Sight::Hidden) {
    volume.state->tree().addTile(kTileLevel, origin, int(VoxelState::NeverSeen), true);
  }
  const auto add = [](auto& grid, auto& leaf) {
    if (leaf) grid->tree().addLeaf(leaf.release());
  };
  add(volume.tsdf, block.tsdf);
  add(volume.weight, block.weight);
  add(volume.color, block.color);
  add(volume.support, block.support);
  add(volume.sigma, block.sigma);
  add(volume.state, block.state);
}

void count(TsdfReport& report, const Block& block) {
  report.free += block.counts.free +
                 (block.counts.free == 0 && block.whole == Sight::Free ? size_t(kBlockVoxels) : 0);
  report.hidden +=
      block.counts.hidden +
      (block.counts.hidden == 0 && block.whole == Sight::Hidden ? size_t(kBlockVoxels) : 0);
  report.occupied += block.counts.occupied;
  report.conflicts += block.counts.conflicts;
  report.carved += block.counts.carved;
}

constexpr size_t kLeafBytes = 4 * sizeof(FloatLeaf) + sizeof(ColorLeaf) + sizeof(StateLeaf) +
                              kBlockVoxels * (5 * sizeof(float) + 3 * sizeof(float));
constexpr size_t kStateLeafBytes = sizeof(StateLeaf) + kBlockVoxels * sizeof(int32_t);
constexpr size_t kBlockBytes = 16;  // Of any block, in lists.

void check_memory(TsdfReport& report, size_t predicted, size_t limit) {
  report.predicted_bytes = predicted;
  if (predicted <= limit) return;
  constexpr size_t kMebi = size_t{1} << 20;
  throw LimitError("fusing " + std::to_string(report.voxels) + " voxels may take " +
                   std::to_string((predicted + kMebi - 1) / kMebi) + " MiB, allowed are " +
                   std::to_string(limit / kMebi) +
                   " MiB; larger voxels need less, a larger memory limit allows it");
}

// A view that is held, ready to be asked.
struct Witness {
  TsdfView own;  // Of a source: what is still needed of it.
  const TsdfView* in_memory = nullptr;
  DepthField field;

  const TsdfView& view() const { return in_memory != nullptr ? *in_memory : own; }
};

std::vector<std::optional<Witness>> witnesses(
    const Views& views, size_t first, size_t last, const TsdfOptions& options, double voxel) {
  std::vector<std::optional<Witness>> out(last - first);
  views.each(first, last, true, [&](size_t i, auto&& view) {
    DepthField field(view, options, voxel);
    if (views.are_in_memory()) {
      out[i - first] = Witness{{}, &view, std::move(field)};
      return;
    }
    out[i - first] = Witness{{}, nullptr, std::move(field)};
    TsdfView& own = out[i - first]->own;
    own.color = std::move(view.color);
    own.guessed = std::move(view.guessed);
    own.is_virtual = view.is_virtual;
  });
  return out;
}

// What the fields say about the blocks of a cube, without looking into them.
class CubeLook {
 public:
  CubeLook(const std::vector<const DepthField*>& fields, const BlockGrid& grid, size_t cube)
      : fields_(fields), of_cube_(fields.size()), of_block_(fields.size()) {
    const Eigen::AlignedBox3f box = grid.cube_box(cube);
    for (size_t i = 0; i < fields.size(); ++i) of_cube_[i] = fields[i]->look(box);
  }
  // True if nothing differs within the cube.
  bool is_told() const {
    return std::none_of(of_cube_.begin(), of_cube_.end(), [](const auto& look) {
      return look.sight == Sight::Mixed;
    });
  }
  // Of each field; valid until the next call.
  const std::vector<DepthField::Look>& at(const BlockEvidence::Place& place) {
    const Eigen::AlignedBox3f box = place.box();
    for (size_t i = 0; i < fields_.size(); ++i) {
      const bool is_told = of_cube_[i].sight != Sight::Mixed;
      of_block_[i] = is_told ? of_cube_[i] : fields_[i]->look(box);
    }
    return of_block_;
  }

 private:
  const std::vector<const DepthField*>& fields_;
  std::vector<DepthField::Look> of_cube_, of_block_;
};

using Looks = std::vector<DepthField::Look>;

// Mixed if any is, else what they say together.
Sight together(const Looks& looks) {
  Sight out = Sight::Nothing;
  for (const DepthField::Look& look : looks) {
    if (look.sight == Sight::Mixed) return Sight::Mixed;
    if (look.sight == Sight::Free || out == Sight::Nothing) out = look.sight;
  }
  return out;
}

bool any_touches(const Looks& looks) {
  return std::any_of(looks.begin(), looks.end(), [](const auto& look) { return look.may_touch; });
}

// Fuses views in portions, each of as many as are held at once.
class Fuser {
 public:
  Fuser(const Views& views, const TsdfOptions& options, const Progress& progress)
      : views_(views), options_(options), progress_(progress) {}

  FusedVolume run(size_t view_memory) {
    prepare(view_memory);
    if (portion_ < views_.size()) {
      fuse_in_portions();
    } else {
      fuse_at_once();
    }
    TsdfReport& r = out_.report;
    r.unseen = r.voxels - r.free - r.occupied - r.hidden;
    const Volume& v = out_.volume;
    r.actual_bytes = v.tsdf->memUsage() + v.weight->memUsage() + v.color->memUsage() +
                     v.support->memUsage() + v.sigma->memUsage() + v.state->memUsage();
    report(progress_, 1);
    return std::move(out_);
  }

 private:
  void prepare(size_t view_memory) {
    require(views_.size() > 0, "fuse needs at least one view, their number", views_.size());
    const size_t most = views_.are_in_memory() ? std::numeric_limits<size_t>::max() : kFootprints;
    const Extent extent = surface_extent(views_, options_.depth_trunc, most, part(0, 0.1));
    pixels_ = extent.pixels;
    const double voxel = chosen_voxel_size(extent, options_);
    const Eigen::Vector3d margin =
        Eigen::Vector3d::Constant((double(options_.truncation) + kMargin) * voxel);
    const Eigen::AlignedBox3d bounds(extent.surface.min() - margin, extent.surface.max() + margin);
    grid_ = block_grid(bounds, voxel);
    rules_ = {voxel, options_.min_weight};
    out_.report.voxel_size = voxel;
    out_.report.bounds = bounds;
    out_.report.voxels = grid_.size() * kBlockVoxels;
    out_.volume = empty_volume(voxel, bounds, double(options_.truncation));
    const size_t one = pixels_ / views_.size() * kHeldPixelBytes;
    portion_ = views_.are_in_memory() ? views_.size() : std::max(size_t{1}, view_memory / one);
    out_.report.portions = (views_.size() + portion_ - 1) / portion_;
  }

  void fuse_at_once() {
    const auto held = witnesses(views_, 0, views_.size(), options_, rules_.voxel);
    const std::vector<const DepthField*> fields = fields_of(held);
    std::vector<Sight> sights(grid_.size());
    tbb::parallel_for(size_t(0), grid_.cube_count(), [&](size_t c) {
      CubeLook look(fields, grid_, c);
      grid_.each_in_cube(c, [&](size_t i) {
        sights[i] = together(look.at({grid_.origin(i), rules_.voxel}));
      });
    });
    const auto mixed = size_t(std::count(sights.begin(), sights.end(), Sight::Mixed));
    constexpr size_t kPixelBytes = 80;  // A prepared depth map, with its pyramid and normals.
    check_memory(out_.report,
                 pixels_ * kPixelBytes + grid_.size() * kBlockBytes + mixed * kLeafBytes,
                 options_.memory_limit);
    tbb::enumerable_thread_specific<BlockEvidence> scratch(
        [] { return BlockEvidence(BlockEvidence::kAllParts); });
    collect(0.15, [&](size_t c, const auto& keep) {
      CubeLook look(fields, grid_, c);
      grid_.each_in_cube(c, [&](size_t i) {
        if (sights[i] != Sight::Mixed) {
          keep(i, whole_block(sights[i]));
          return;
        }
        const BlockEvidence::Place place(grid_.origin(i), rules_.voxel);
        const Looks& looks = look.at(place);
        if (!any_touches(looks)) {
          BlockEvidence plain(0);
          ask(held, looks, place, plain);
          keep(i, finished(plain, grid_.origin(i), rules_));
          return;
        }
        BlockEvidence& evidence = scratch.local();
        evidence.clear();
        ask(held, looks, place, evidence);
        keep(i, finished(evidence, grid_.origin(i), rules_));
      });
    });
  }

  void fuse_in_portions() {
    find_surface(part(0.1, 0.4));
    evidence_.resize(grid_.size());
    whole_.assign(grid_.size(), Sight::Nothing);
    for (size_t first = 0; first < views_.size(); first += portion_) {
      const size_t last = std::min(first + portion_, views_.size());
      const auto held = witnesses(views_, first, last, options_, rules_.voxel);
      const std::vector<const DepthField*> fields = fields_of(held);
      tbb::parallel_for(size_t(0), grid_.cube_count(), [&](size_t c) {
        CubeLook look(fields, grid_, c);
        grid_.each_in_cube(c, [&](size_t i) {
          const BlockEvidence::Place place(grid_.origin(i), rules_.voxel);
          ask_portion(i, held, look.at(place), place);
        });
      });
      report(progress_, 0.4 + 0.5 * static_cast<double>(last) / static_cast<double>(views_.size()));
    }
    collect(0.9, [&](size_t c, const auto& keep) {
      grid_.each_in_cube(c, [&](size_t i) {
        if (!evidence_[i]) {
          keep(i, whole_block(whole_[i]));
          return;
        }
        keep(i, finished(*evidence_[i], grid_.origin(i), rules_));
        evidence_[i].reset();
      });
    });
  }

  // Marks the blocks that the surface of any view may touch, and those that must be looked into.
  void find_surface(const Progress& progress) {
    touched_.assign(grid_.size(), 0);
    std::vector<uint8_t> is_mixed(grid_.size(), 0);
    struct Found {
      std::vector<std::pair<size_t, uint8_t>> mixed;  // Blocks, and what of them is touched.
    };
    std::vector<Found> found(kAtOnce);
    for (size_t first = 0; first < views_.size(); first += kAtOnce) {
      const size_t last = std::min(first + kAtOnce, views_.size());
      views_.each(first, last, false, [&](size_t v, const TsdfView& view) {
        const DepthField field(view, options_, rules_.voxel);
        const std::vector<const DepthField*> fields = {&field};
        Found& of_view = found[v - first];
        of_view = {};
        for (size_t c = 0; c < grid_.cube_count(); ++c) {
          CubeLook look(fields, grid_, c);
          if (look.is_told()) continue;
          grid_.each_in_cube(c, [&](size_t i) {
            const BlockEvidence::Place place(grid_.origin(i), rules_.voxel);
            const DepthField::Look of_block = look.at(place)[0];
            if (of_block.sight != Sight::Mixed) return;
            unsigned parts = 0;
            for (size_t p = 0; of_block.may_touch && p < BlockEvidence::kParts; ++p) {
              if (field.look(place.part_box(p)).may_touch) parts |= 1U << p;
            }
            of_view.mixed.emplace_back(i, static_cast<uint8_t>(parts));
          });
        }
      });
      for (size_t v = first; v < last; ++v) {
        for (const auto& [i, parts] : found[v - first].mixed) {
          touched_[i] = static_cast<uint8_t>(touched_[i] | parts);
          is_mixed[i] = 1;
        }
      }
      report(progress, static_cast<double>(last) / static_cast<double>(views_.size()));
    }
    size_t touched = 0;
    size_t mixed = 0;
    for (size_t i = 0; i < touched_.size(); ++i) {
      touched += touched_[i] != 0 ? 1 : 0;
      mixed += touched_[i] == 0 && is_mixed[i] != 0 ? 1 : 0;
    }
    // Of a block on the surface, leaves take the place of evidence.
    constexpr size_t kTouchedBytes = std::max(
        kLeafBytes,
        BlockEvidence::kBandBytes + BlockEvidence::kSigmaBytes + BlockEvidence::kColorBytes);
    const size_t view_bytes = pixels_ / views_.size() * kHeldPixelBytes * portion_;
    check_memory(out_.report,
                 view_bytes + grid_.size() * kBlockBytes + touched * kTouchedBytes +
                     mixed * (BlockEvidence::kPlainBytes + kStateLeafBytes),
                 options_.memory_limit);
  }

  using Held = std::vector<std::optional<Witness>>;

  static std::vector<const DepthField*> fields_of(const Held& held) {
    std::vector<const DepthField*> out;
    for (const auto& witness : held) out.push_back(&witness->field);
    return out;
  }

  static void ask(const Held& held,
                  const Looks& looks,
                  const BlockEvidence::Place& place,
                  BlockEvidence& evidence) {
    for (size_t i = 0; i < held.size() && !evidence.is_settled(); ++i) {
      const Sight sight = looks[i].sight;
      if (sight == Sight::Nothing) continue;
      if (sight == Sight::Hidden || (sight == Sight::Free && !evidence.has_band())) {
        evidence.add_whole(sight);
      } else {
        evidence.add(place, held[i]->field, held[i]->view());
      }
    }
  }

  void ask_portion(size_t i,
                   const Held& held,
                   const Looks& looks,
                   const BlockEvidence::Place& place) {
    if (whole_[i] == Sight::Free) return;
    std::unique_ptr<BlockEvidence>& evidence = evidence_[i];
    const Sight sight = together(looks);
    if (!evidence && touched_[i] == 0 && sight != Sight::Mixed) {
      if (sight != Sight::Nothing) whole_[i] = sight;
      return;
    }
    if (!evidence) {
      evidence = std::make_unique<BlockEvidence>(touched_[i]);
      evidence->add_whole(whole_[i]);
    }
    ask(held, looks, place, *evidence);
    if (!evidence->is_settled()) return;
    evidence.reset();
    whole_[i] = Sight::Free;
  }

  static Block whole_block(Sight sight) {
    Block block;
    block.whole = sight;
    return block;
  }

  // Puts the blocks that work(cube, keep) makes into the volume.
  template <typename Work>
  void collect(double from, const Work& work) {
    constexpr size_t kBatch = 64;
    const size_t cubes = grid_.cube_count();
    std::vector<std::vector<std::pair<size_t, Block>>> made(std::min(kBatch, cubes));
    for (size_t begin = 0; begin < cubes; begin += kBatch) {
      const size_t end = std::min(begin + kBatch, cubes);
      tbb::parallel_for(begin, end, [&](size_t c) {
        auto& mine = made[c - begin];
        mine.clear();
        work(c, [&](size_t i, Block&& block) { mine.emplace_back(i, std::move(block)); });
      });
      for (size_t c = begin; c < end; ++c) {
        for (auto& [i, block] : made[c - begin]) {
          count(out_.report, block);
          insert(out_.volume, grid_.origin(i), block);
        }
      }
      report(progress_, from + (1 - from) * static_cast<double>(end) / static_cast<double>(cubes));
    }
  }

  Progress part(double from, double to) const { return part_of(progress_, from, to); }

  Views views_;
  const TsdfOptions& options_;
  const Progress& progress_;
  FusedVolume out_;
  BlockGrid grid_;
  Rules rules_;
  size_t pixels_ = 0;             // Of all views.
  size_t portion_ = 0;            // Views held at once.
  std::vector<uint8_t> touched_;  // A bit per part, by the surface of any view.
  std::vector<std::unique_ptr<BlockEvidence>> evidence_;  // Null where a block is one thing …
  std::vector<Sight> whole_;                              // … namely this.
};

}  // namespace

void TsdfOptions::validate() const {
  require(voxel_size >= 0 && std::isfinite(voxel_size),
          "TsdfOptions.voxel_size must be >= 0 and finite",
          voxel_size);
  require(truncation >= 2 && std::isfinite(truncation),
          "TsdfOptions.truncation must be >= 2 voxels and finite",
          truncation);
  require(max_voxels >= 4096, "TsdfOptions.max_voxels must be >= 4096", max_voxels);
  require(coarsest_voxel >= 0, "TsdfOptions.coarsest_voxel must be >= 0", coarsest_voxel);
  require(min_weight >= 0, "TsdfOptions.min_weight must be >= 0", min_weight);
  require(depth_trunc >= 0, "TsdfOptions.depth_trunc must be >= 0", depth_trunc);
  require(gap_pixels >= 0 && gap_pixels <= 4096,
          "TsdfOptions.gap_pixels must be in [0, 4096]",
          gap_pixels);
}

FusedVolume fuse(std::span<const TsdfView> views,
                 const TsdfOptions& options,
                 const Progress& progress) {
  options.validate();
  for (size_t i = 0; i < views.size(); ++i) validate_view(views[i], i);
  return Fuser(Views(views), options, progress).run(0);
}

FusedVolume fuse_streamed(const TsdfSource& source,
                          const TsdfOptions& options,
                          const Progress& progress,
                          size_t view_memory) {
  options.validate();
  require(view_memory > 0, "fuse needs memory for views [bytes]", view_memory);
  return Fuser(Views(source), options, progress).run(view_memory);
}

}  // namespace cgs
