// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/volume/tsdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "meshing/volume/block_evidence.h"
#include "meshing/volume/block_grid.h"
#include "meshing/volume/depth_field.h"
#include "meshing/volume/fused_block.h"
#include "meshing/volume/fusion_views.h"

namespace cgs {

namespace {

using openvdb::Coord;

constexpr size_t kEvidenceBytes =
    BlockEvidence::kBandBytes + BlockEvidence::kSigmaBytes + BlockEvidence::kColorBytes;
constexpr size_t kHeldPixelBytes = DepthField::kPixelBytes + sizeof(Eigen::Vector3f) + 1;
constexpr size_t kBlockBytes = 16;  // Of any block, in lists.
constexpr size_t kPixelBytes = 80;  // A prepared depth map, with its bounds and normals.

std::string mebibytes(size_t bytes) {
  constexpr size_t kMebi = size_t{1} << 20;
  return std::to_string((bytes + kMebi - 1) / kMebi) + " MiB";
}

void check_memory(TsdfReport& report, size_t predicted, size_t limit) {
  report.predicted_bytes = predicted;
  if (predicted <= limit) return;
  throw WithRemedy<LimitError>(
      Remedy::LargerVoxels,
      "fusing " + std::to_string(report.voxels) + " voxels may take " + mebibytes(predicted) +
          ", allowed are " + std::to_string(limit >> 20) +
          " MiB; larger voxels need less, a larger memory limit allows it");
}

// A view that is held, ready to be asked.
struct Witness {
  TsdfView own;  // Of a source: what is still needed of it.
  const TsdfView* in_memory = nullptr;
  DepthField field;

  const TsdfView& view() const { return in_memory != nullptr ? *in_memory : own; }
};

using Fields = std::vector<std::optional<DepthField>>;

// From the first of them to before the last.
struct ViewRange {
  size_t first, last;
};

// \param made  fields of the first views, which are taken
std::vector<std::optional<Witness>> witnesses(const FusionViews& views,
                                              ViewRange range,
                                              const TsdfOptions& options,
                                              double voxel,
                                              Fields& made) {
  const size_t first = range.first;
  std::vector<std::optional<Witness>> out(range.last - first);
  views.each(first, range.last, true, [&](size_t i, auto&& view) {
    DepthField field = i < made.size() ? std::move(*made[i]) : DepthField(view, options, voxel);
    if (views.are_in_memory()) {
      out[i - first] = Witness{{}, &view, std::move(field)};
      return;
    }
    out[i - first] = Witness{{}, nullptr, std::move(field)};
    TsdfView& own = out[i - first]->own;
    own.camera = view.camera;
    own.color = std::move(view.color);
    own.evidence = std::move(view.evidence);
    own.is_virtual = view.is_virtual;
  });
  return out;
}

// What the fields say about the blocks of a cube, without looking into them.
class CubeLook {
 public:
  CubeLook(const std::vector<const DepthField*>& fields, const BlockGrid& grid, size_t cube)
      : of_fields_(fields.size()) {
    const Eigen::AlignedBox3f box = grid.cube_box(cube);
    std::vector<EightBoxes> eights;
    for (size_t i = 0; i < fields.size(); ++i) {
      of_fields_[i].all = fields[i]->look(box);
      if (of_fields_[i].all.sight != Sight::Mixed) continue;
      if (eights.empty()) eights = grid.block_boxes(cube);
      for (size_t k = 0; k < eights.size(); ++k) {
        of_fields_[i].of_eights[k] = fields[i]->look(eights[k]);
      }
    }
  }
  // True if nothing differs within the cube.
  bool is_told() const {
    return std::none_of(of_fields_.begin(), of_fields_.end(), [](const OfField& field) {
      return field.all.sight == Sight::Mixed;
    });
  }
  // Of a field about the n-th block.
  Look at(size_t field, size_t n) const {
    const OfField& of = of_fields_[field];
    return of.all.sight != Sight::Mixed ? of.all : of.of_eights[n / kLanes][n % kLanes];
  }
  // Of all fields about the n-th block: Mixed if that is any, else what they say together.
  Sight together(size_t n) const {
    Sight out = Sight::Nothing;
    for (size_t i = 0; i < of_fields_.size(); ++i) {
      const Sight sight = at(i, n).sight;
      if (sight == Sight::Mixed) return sight;
      if (sight == Sight::Free || out == Sight::Nothing) out = sight;
    }
    return out;
  }

 private:
  struct OfField {
    Look all;
    std::array<Looks, BlockGrid::kBlocksPerCube / kLanes> of_eights;
  };
  std::vector<OfField> of_fields_;
};

// Fuses views in portions, each of as many as are held at once.
class Fuser {
 public:
  Fuser(const FusionViews& views, const TsdfOptions& options, const Progress& progress)
      : views_(views), options_(options), progress_(progress) {}

  FusedVolume run(size_t view_memory) {
    prepare(view_memory);
    if (portion_ < views_.size()) {
      fuse_in_portions();
    } else {
      fuse_at_once();
    }
    TsdfReport& r = out_.report;
    r.unseen = r.voxels - r.free - r.occupied - r.estimated - r.hidden;
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
    const SurfaceExtent extent = surface_extent(views_, options_.depth_trunc, most, part(0, 0.1));
    pixels_ = extent.pixels;
    const double voxel = chosen_voxel_size(extent, options_);
    const Eigen::Vector3d margin =
        Eigen::Vector3d::Constant((double(options_.truncation) + kFusionMargin) * voxel);
    const Eigen::AlignedBox3d bounds(extent.surface.min() - margin, extent.surface.max() + margin);
    grid_ = block_grid(bounds, voxel);
    rules_ = {voxel, options_.min_weight, options_.common_sigma};
    out_.report.voxel_size = voxel;
    out_.report.bounds = bounds;
    out_.report.voxels = grid_.size() * kBlockVoxels;
    out_.volume = empty_volume(voxel, bounds, double(options_.truncation));
    const size_t one = pixels_ / views_.size() * kHeldPixelBytes;
    portion_ = views_.are_in_memory() ? views_.size() : std::max(size_t{1}, view_memory / one);
    out_.report.portions = (views_.size() + portion_ - 1) / portion_;
  }

  void fuse_at_once() {
    const size_t before_looking = pixels_ * kPixelBytes + grid_.size() * kBlockBytes;
    check_memory(out_.report, before_looking, options_.memory_limit);
    Fields none;
    const auto held = witnesses(views_, {0, views_.size()}, options_, rules_.voxel, none);
    const std::vector<const DepthField*> fields = fields_of(held);
    std::vector<Sight> sights(grid_.size());
    tbb::parallel_for(size_t(0), grid_.cube_count(), [&](size_t c) {
      const CubeLook look(fields, grid_, c);
      grid_.each_in_cube(c, [&](size_t i, size_t n) { sights[i] = look.together(n); });
    });
    const auto mixed = size_t(std::count(sights.begin(), sights.end(), Sight::Mixed));
    constexpr size_t kMostThreads = 16;  // whose cubes hold evidence: foreseen alike everywhere
    const size_t held_blocks =
        std::min(mixed, std::min(kMostThreads, grid_.cube_count()) * BlockGrid::kBlocksPerCube);
    check_memory(out_.report,
                 before_looking + mixed * kLeafBytes + held_blocks * kEvidenceBytes,
                 options_.memory_limit);
    evidence_.resize(grid_.size());
    collect(0.15, [&](size_t c, const auto& keep) {
      const CubeLook look(fields, grid_, c);
      grid_.each_in_cube(c, [&](size_t i, size_t n) {
        if (sights[i] != Sight::Mixed) return;
        const BlockEvidence::Place place(grid_.origin(i), rules_.voxel);
        unsigned touched = 0;
        for (size_t v = 0; v < fields.size(); ++v) {
          if (look.at(v, n).may_touch) touched |= fields[v]->look(place.part_boxes()).may_touch;
        }
        evidence_[i] = std::make_unique<BlockEvidence>(touched);
      });
      ask(c, held, look);
      grid_.each_in_cube(c, [&](size_t i, size_t) { keep(i, finished(i, sights[i])); });
    });
  }

  void fuse_in_portions() {
    Fields made(portion_);
    find_surface(made, part(0.1, 0.4));
    evidence_.resize(grid_.size());
    std::vector<Sight> whole(grid_.size(), Sight::Nothing);  // Where there is no evidence.
    for (size_t first = 0; first < views_.size(); first += portion_) {
      const size_t last = std::min(first + portion_, views_.size());
      const auto held = witnesses(views_, {first, last}, options_, rules_.voxel, made);
      made.clear();
      const std::vector<const DepthField*> fields = fields_of(held);
      tbb::parallel_for(size_t(0), grid_.cube_count(), [&](size_t c) {
        const CubeLook look(fields, grid_, c);
        grid_.each_in_cube(c, [&](size_t i, size_t n) { begin(i, look.together(n), whole[i]); });
        ask(c, held, look);
        grid_.each_in_cube(c, [&](size_t i, size_t) {
          if (!evidence_[i] || !evidence_[i]->is_settled()) return;
          evidence_[i].reset();
          whole[i] = Sight::Free;
        });
      });
      report(progress_, 0.4 + 0.5 * static_cast<double>(last) / static_cast<double>(views_.size()));
    }
    collect(0.9, [&](size_t c, const auto& keep) {
      grid_.each_in_cube(c, [&](size_t i, size_t) { keep(i, finished(i, whole[i])); });
    });
  }

  // Marks the blocks that the surface of any view may touch, and those that must be looked into.
  // Keeps the fields of as many views as `made` has room for.
  void find_surface(Fields& made, const Progress& progress) {
    const size_t view_bytes = pixels_ / views_.size() * kHeldPixelBytes * portion_;
    check_memory(out_.report, view_bytes + grid_.size() * kBlockBytes, options_.memory_limit);
    touched_.assign(grid_.size(), 0);
    std::vector<uint8_t> is_mixed(grid_.size(), 0);
    struct Found {
      std::vector<std::pair<size_t, uint8_t>> mixed;  // Blocks, and what of them is touched.
    };
    std::vector<Found> found(kViewsAtOnce);
    for (size_t first = 0; first < views_.size(); first += kViewsAtOnce) {
      const size_t last = std::min(first + kViewsAtOnce, views_.size());
      views_.each(first, last, false, [&](size_t v, const TsdfView& view) {
        using Asked = DepthField::Asked;
        const bool is_kept = v < made.size();
        DepthField field(view, options_, rules_.voxel, is_kept ? Asked::Points : Asked::Boxes);
        const std::vector<const DepthField*> fields = {&field};
        Found& of_view = found[v - first];
        of_view = {};
        for (size_t c = 0; c < grid_.cube_count(); ++c) {
          const CubeLook look(fields, grid_, c);
          if (look.is_told()) continue;
          grid_.each_in_cube(c, [&](size_t i, size_t n) {
            const Look of_block = look.at(0, n);
            if (of_block.sight != Sight::Mixed) return;
            unsigned parts = 0;
            if (of_block.may_touch) {
              const BlockEvidence::Place place(grid_.origin(i), rules_.voxel);
              parts = field.look(place.part_boxes()).may_touch;
            }
            of_view.mixed.emplace_back(i, static_cast<uint8_t>(parts));
          });
        }
        if (is_kept) made[v] = std::move(field);
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
    constexpr size_t kTouchedBytes = std::max(kLeafBytes, kEvidenceBytes);
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

  // What a portion says together about a block either is all there is to say, or evidence begins.
  void begin(size_t i, Sight together, Sight& whole) {
    if (whole == Sight::Free || evidence_[i]) return;
    if (touched_[i] == 0 && together != Sight::Mixed) {
      if (together != Sight::Nothing) whole = together;
      return;
    }
    evidence_[i] = std::make_unique<BlockEvidence>(touched_[i]);
    evidence_[i]->add_whole(whole);
  }

  // Adds what views say to the evidence in a cube: one view after the other, since a cube is small
  // in its picture.
  void ask(size_t cube, const Held& held, const CubeLook& look) {
    for (size_t v = 0; v < held.size(); ++v) {
      grid_.each_in_cube(cube, [&](size_t i, size_t n) {
        if (!evidence_[i]) return;
        BlockEvidence& evidence = *evidence_[i];
        const Sight sight = look.at(v, n).sight;
        if (sight == Sight::Nothing || evidence.is_settled()) return;
        if (sight == Sight::Hidden || (sight == Sight::Free && !evidence.has_band())) {
          evidence.add_whole(sight);
        } else {
          evidence.add({grid_.origin(i), rules_.voxel}, held[v]->field, held[v]->view());
        }
      });
    }
  }

  // A block of which all is known, or that has no evidence since it is one thing.
  FusedBlock finished(size_t i, Sight whole) {
    if (!evidence_[i]) return whole_block(whole);
    FusedBlock block = fused_block(*evidence_[i], grid_.origin(i), rules_);
    evidence_[i].reset();
    return block;
  }

  static FusedBlock whole_block(Sight sight) {
    FusedBlock block;
    block.whole = sight;
    return block;
  }

  // Puts the blocks that work(cube, keep) makes into the volume.
  template <typename Work>
  void collect(double from, const Work& work) {
    constexpr size_t kBatch = 64;
    const size_t cubes = grid_.cube_count();
    std::vector<std::vector<std::pair<size_t, FusedBlock>>> made(std::min(kBatch, cubes));
    for (size_t begin = 0; begin < cubes; begin += kBatch) {
      const size_t end = std::min(begin + kBatch, cubes);
      tbb::parallel_for(begin, end, [&](size_t c) {
        auto& mine = made[c - begin];
        mine.clear();
        work(c, [&](size_t i, FusedBlock&& block) { mine.emplace_back(i, std::move(block)); });
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

  FusionViews views_;
  const TsdfOptions& options_;
  const Progress& progress_;
  FusedVolume out_;
  BlockGrid grid_;
  FusionRules rules_;
  size_t pixels_ = 0;             // Of all views.
  size_t portion_ = 0;            // Views held at once.
  std::vector<uint8_t> touched_;  // A bit per part, by the surface of any view.
  std::vector<std::unique_ptr<BlockEvidence>> evidence_;  // Null where a block is one thing.
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
  // However large the voxels are, the bounds hold the band around the surface.
  const double across_band = 2 * (double(truncation) + kFusionMargin);
  require(voxel_size > 0 || double(max_voxels) > std::pow(across_band, 3),
          "TsdfOptions.max_voxels must be > (2 truncation + 4)^3",
          max_voxels);
  require(coarsest_voxel >= 0, "TsdfOptions.coarsest_voxel must be >= 0", coarsest_voxel);
  require(min_weight >= 0, "TsdfOptions.min_weight must be >= 0", min_weight);
  require(common_sigma >= 0 && common_sigma <= 1,
          "TsdfOptions.common_sigma must be in [0, 1]",
          common_sigma);
  require(depth_trunc >= 0, "TsdfOptions.depth_trunc must be >= 0", depth_trunc);
  require(gap_pixels >= 0 && gap_pixels <= 4096,
          "TsdfOptions.gap_pixels must be in [0, 4096]",
          gap_pixels);
}

void check_view_memory(size_t pixels, size_t limit) {
  if (pixels * kPixelBytes <= limit) return;
  throw LimitError("fusing depth maps of " + std::to_string(pixels) + " pixels may take " +
                   mebibytes(pixels * kPixelBytes) + ", allowed are " +
                   std::to_string(limit >> 20) + " MiB; a larger memory limit allows it");
}

FusedVolume fuse(std::span<const TsdfView> views,
                 const TsdfOptions& options,
                 const Progress& progress) {
  options.validate();
  for (size_t i = 0; i < views.size(); ++i) validate_view(views[i], i);
  size_t pixels = 0;
  for (const TsdfView& view : views) pixels += view.depth.data.size();
  check_view_memory(pixels, options.memory_limit);
  return Fuser(FusionViews(views), options, progress).run(0);
}

FusedVolume fuse_streamed(const TsdfSource& source,
                          const TsdfOptions& options,
                          const Progress& progress,
                          size_t view_memory) {
  options.validate();
  require(view_memory > 0, "fuse needs memory for views [bytes]", view_memory);
  // The rest of a small limit is for the voxels.
  const size_t most = std::max(size_t{1}, options.memory_limit / 4);
  return Fuser(FusionViews(source), options, progress).run(std::min(view_memory, most));
}

}  // namespace cgs
