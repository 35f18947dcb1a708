// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/tsdf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "meshing/depth_field.h"

namespace cgs {

namespace {

using openvdb::Coord;
using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using ColorLeaf = openvdb::Vec3STree::LeafNodeType;
using StateLeaf = openvdb::Int32Tree::LeafNodeType;

constexpr int kBlock = 8;  // Voxels along the edge of an OpenVDB leaf.
constexpr int kBlockVoxels = kBlock * kBlock * kBlock;
constexpr double kMargin = 2;  // Voxels around the band.

void validate_views(std::span<const TsdfView> views) {
  require(!views.empty(), "fuse needs at least one view, their number", views.size());
  for (size_t i = 0; i < views.size(); ++i) {
    const TsdfView& v = views[i];
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
};

double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Extent surface_extent(std::span<const TsdfView> views, double depth_trunc) {
  Extent out;
  std::vector<double> footprints;
  std::vector<double> sigmas;
  for (const TsdfView& view : views) {
    for (const Pixel& p : trustworthy_pixels(view, depth_trunc)) {
      const float sigma = view.sigma.empty() ? 0 : view.sigma(p.x, p.y);
      if (sigma > 0) sigmas.push_back(double(sigma));
      out.surface.extend(view.camera.unproject(p.x + 0.5, p.y + 0.5, double(p.depth)));
      footprints.push_back(2 * double(p.depth) / (view.camera.fx + view.camera.fy));
    }
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

// The blocks of 8 x 8 x 8 voxels that cover the bounds, in x-major order.
struct BlockGrid {
  Coord first;  // in blocks
  Coord count;
  double voxel = 0;

  size_t size() const { return size_t(count.x()) * size_t(count.y()) * size_t(count.z()); }
  Coord origin(size_t i) const {
    const auto nz = size_t(count.z());
    const auto ny = size_t(count.y());
    const Coord at(int(i / (ny * nz)), int(i / nz % ny), int(i % nz));
    return {(first.x() + at.x()) * kBlock,
            (first.y() + at.y()) * kBlock,
            (first.z() + at.z()) * kBlock};
  }
  Eigen::AlignedBox3f box(size_t i) const {
    const Coord o = origin(i);
    const Eigen::Vector3d low = voxel * Eigen::Vector3d(o.x(), o.y(), o.z());
    return {low.cast<float>(), (low.array() + voxel * (kBlock - 1)).matrix().cast<float>()};
  }
};

BlockGrid block_grid(const Eigen::AlignedBox3d& bounds, double voxel) {
  const Eigen::Vector3d low = (bounds.min() / (voxel * kBlock)).array().floor();
  const Eigen::Vector3d high = (bounds.max() / (voxel * kBlock)).array().floor();
  constexpr double kMaxIndex = 1 << 20;  // Far inside what OpenVDB and float coordinates bear.
  const double largest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) * kBlock;
  const double blocks = (high - low + Eigen::Vector3d::Ones()).prod();
  constexpr double kMaxBlocks = 1 << 28;
  if (!(largest < kMaxIndex) || !(blocks < kMaxBlocks)) {
    throw LimitError("voxel size " + std::to_string(voxel) + " is too small for the bounds");
  }
  const Eigen::Vector3i first = low.cast<int>();
  const Eigen::Vector3i count = (high - low).cast<int>() + Eigen::Vector3i::Ones();
  return {{first.x(), first.y(), first.z()}, {count.x(), count.y(), count.z()}, voxel};
}

// What the views together say about a block without looking into it; Band is never returned.
Sight block_sight(const std::vector<DepthField>& fields, const Eigen::AlignedBox3f& box) {
  bool free = false;
  bool hidden = false;
  for (const DepthField& field : fields) {
    const Sight sight = field.over(box);
    if (sight == Sight::Mixed) return Sight::Mixed;
    free |= sight == Sight::Free;
    hidden |= sight == Sight::Hidden;
  }
  return free ? Sight::Free : hidden ? Sight::Hidden : Sight::Nothing;
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

// What views with a voxel in their band say about it.
struct BandSums {
  double weight = 0, distance = 0, spread = 0, variance = 0;  // weighted sums
  int count = 0;                                              // of views
  int known = 0;  // of those that are photographs and no guess
  bool is_guessed = false;
  bool has_sigma = true;
  double color_weight = 0;
  Eigen::Vector3d color = Eigen::Vector3d::Zero();

  void add(const Sighting& s, const TsdfView& view) {
    const auto w = double(s.weight);
    const auto d = double(s.distance);
    weight += w;
    distance += w * d;
    spread += w * d * d;
    variance += w * w * double(s.sigma) * double(s.sigma);
    has_sigma = has_sigma && s.sigma > 0;
    ++count;
    const bool is_guess = !view.guessed.empty() && view.guessed(s.x, s.y) != 0;
    if (!view.is_virtual && !is_guess) ++known;
    is_guessed = is_guessed || is_guess;
    if (view.color.empty()) return;
    color += w * view.color(s.x, s.y).cast<double>();
    color_weight += w;
  }
  double mean() const { return distance / weight; }
  // Guesses that agree still rest on one view each.
  float support() const { return static_cast<float>(std::max(known, is_guessed ? 1 : 0)); }
  // The larger of what the views promise and how far they disagree.
  double sigma() const {
    const double promised = variance / (weight * weight);
    if (count < 2) return std::sqrt(promised);
    const double between = std::max(0.0, spread / weight - mean() * mean());
    return std::sqrt(std::max(promised, between / (count - 1)));
  }
};

// Everything the views say about one voxel.
struct Evidence {
  BandSums measured, assumed;
  float free_weight = 0;
  bool hidden = false;

  void add(const Sighting& s, const TsdfView& view) {
    if (s.sight == Sight::Hidden) hidden = true;
    if (s.sight == Sight::Free) free_weight += s.weight;
    if (s.sight == Sight::Band) (s.is_assumed ? assumed : measured).add(s, view);
  }
  // Averaged, what one view assumes behind its surface would push out the surface that another one
  // measures there: thin plates and edges would grow.
  const BandSums& band() const { return measured.weight > 0 ? measured : assumed; }
};

class BlockFuser {
 public:
  BlockFuser(std::span<const TsdfView> views,
             const std::vector<DepthField>& fields,
             double voxel,
             float min_weight)
      : views_(views), fields_(fields), voxel_(voxel), min_weight_(min_weight) {}

  Block operator()(const Coord& origin) const {
    Block block;
    block.state = std::make_unique<StateLeaf>(origin, 0, false);
    for (int n = 0; n < kBlockVoxels; ++n) {
      const Coord at = origin + StateLeaf::offsetToLocalCoord(openvdb::Index(n));
      const Eigen::Vector3f point =
          (voxel_ * Eigen::Vector3d(at.x(), at.y(), at.z())).cast<float>();
      Evidence e;
      for (size_t i = 0; i < fields_.size(); ++i) e.add(fields_[i].at(point), views_[i]);
      store(block, openvdb::Index(n), origin, e);
    }
    for (const auto& [count, sight] : {std::pair(block.counts.free, Sight::Free),
                                       std::pair(block.counts.hidden, Sight::Hidden),
                                       std::pair(block.counts.unseen, Sight::Nothing)}) {
      if (count == kBlockVoxels) block.whole = sight;
    }
    if (block.whole != Sight::Mixed) block.state.reset();
    return block;
  }

 private:
  void store(Block& block, openvdb::Index n, const Coord& origin, const Evidence& e) const {
    Counts& counts = block.counts;
    const BandSums& band = e.band();
    const bool seen = band.weight > 0 && band.weight >= double(min_weight_);
    const bool conflict = seen && e.free_weight > 0 && std::abs(band.mean()) < voxel_;
    // In front of the surface both say the same.
    const bool carved = seen && band.distance < 0 && double(e.free_weight) > band.weight;
    counts.conflicts += conflict;
    counts.carved += conflict && carved;
    if (seen && !carved) {
      ++counts.occupied;
      block.state->setValueOn(n, int(VoxelState::Occupied));
      store_band(block, n, origin, band);
    } else if (e.free_weight > 0) {
      ++counts.free;
      block.state->setValueOn(n, int(VoxelState::Free));
    } else if (e.hidden || (band.weight > 0 && band.distance < 0)) {
      ++counts.hidden;
      block.state->setValueOn(n, int(VoxelState::NeverSeen));
    } else {
      ++counts.unseen;
    }
  }

  static void store_band(Block& block, openvdb::Index n, const Coord& origin, const BandSums& e) {
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

  std::span<const TsdfView> views_;
  const std::vector<DepthField>& fields_;
  double voxel_;
  float min_weight_;
};

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

// Upper bound: all mixed blocks get leaves of every grid.
size_t predicted_bytes(std::span<const TsdfView> views, size_t blocks, size_t mixed) {
  constexpr size_t kLeafBytes = 4 * sizeof(FloatLeaf) + sizeof(ColorLeaf) + sizeof(StateLeaf) +
                                kBlockVoxels * (5 * sizeof(float) + 3 * sizeof(float));
  constexpr size_t kPixelBytes = 80;  // A prepared depth map, with its pyramid and normals.
  size_t pixels = 0;
  for (const TsdfView& view : views) pixels += view.depth.data.size();
  return pixels * kPixelBytes + blocks * 16 + mixed * kLeafBytes;
}

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
  validate_views(views);
  const Extent extent = surface_extent(views, options.depth_trunc);
  const double voxel = chosen_voxel_size(extent, options);
  const Eigen::Vector3d margin =
      Eigen::Vector3d::Constant((double(options.truncation) + kMargin) * voxel);
  const Eigen::AlignedBox3d bounds(extent.surface.min() - margin, extent.surface.max() + margin);
  const BlockGrid grid = block_grid(bounds, voxel);

  std::vector<DepthField> fields;
  fields.reserve(views.size());
  for (const TsdfView& view : views) fields.emplace_back(view, options, voxel);
  report(progress, 0.1);

  std::vector<Sight> sights(grid.size());
  tbb::parallel_for(
      size_t(0), sights.size(), [&](size_t i) { sights[i] = block_sight(fields, grid.box(i)); });
  FusedVolume out;
  out.report.voxel_size = voxel;
  out.report.bounds = bounds;
  out.report.voxels = grid.size() * kBlockVoxels;
  const auto mixed = size_t(std::count(sights.begin(), sights.end(), Sight::Mixed));
  out.report.predicted_bytes = predicted_bytes(views, grid.size(), mixed);
  if (out.report.predicted_bytes > options.memory_limit) {
    constexpr size_t kMebi = size_t{1} << 20;
    const size_t needed = (out.report.predicted_bytes + kMebi - 1) / kMebi;
    throw LimitError("fusing " + std::to_string(out.report.voxels) + " voxels may take " +
                     std::to_string(needed) + " MiB, allowed are " +
                     std::to_string(options.memory_limit / kMebi) +
                     " MiB; larger voxels need less, a larger memory limit allows it");
  }
  report(progress, 0.15);

  out.volume = empty_volume(voxel, bounds, double(options.truncation));
  const BlockFuser fuse_block(views, fields, voxel, options.min_weight);
  constexpr size_t kBatch = 4096;
  std::vector<Block> blocks(std::min(kBatch, sights.size()));
  for (size_t begin = 0; begin < sights.size(); begin += kBatch) {
    const size_t end = std::min(begin + kBatch, sights.size());
    tbb::parallel_for(begin, end, [&](size_t i) {
      blocks[i - begin] = Block();
      blocks[i - begin].whole = sights[i];
      if (sights[i] == Sight::Mixed) blocks[i - begin] = fuse_block(grid.origin(i));
    });
    for (size_t i = begin; i < end; ++i) {
      count(out.report, blocks[i - begin]);
      insert(out.volume, grid.origin(i), blocks[i - begin]);
    }
    report(progress, 0.15 + 0.85 * static_cast<double>(end) / static_cast<double>(sights.size()));
  }
  const Volume& v = out.volume;
  out.report.unseen = out.report.voxels - out.report.free - out.report.occupied - out.report.hidden;
  out.report.actual_bytes = v.tsdf->memUsage() + v.weight->memUsage() + v.color->memUsage() +
                            v.support->memUsage() + v.sigma->memUsage() + v.state->memUsage();
  return out;
}

}  // namespace cgs
