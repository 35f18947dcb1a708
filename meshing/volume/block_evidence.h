// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <openvdb/openvdb.h>

#include "meshing/volume/depth_field.h"

namespace cgs {

inline constexpr int kBlockSide = 8;  ///< Voxels along the edge of an OpenVDB leaf.
inline constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

/// What views say about the voxels of one block, summed up in the order in which they are added:
/// the same views in the same order give the same bits, however they come in portions.
class BlockEvidence {
 public:
  /// An eighth of a block: 4 x 4 x 4 voxels.
  static constexpr size_t kParts = 8;

  /// \param touched  a bit per part that the surface of any view may touch; what is free and hidden
  ///                 in others is quick to tell, and needs a hundredth of the memory if all are
  explicit BlockEvidence(unsigned touched);
  BlockEvidence(BlockEvidence&&) noexcept = default;
  BlockEvidence& operator=(BlockEvidence&&) noexcept = default;

  /// Where the voxel centres of a block are [internal units].
  struct Place {
    Place(const openvdb::Coord& origin, double voxel);
    EightBoxes part_boxes() const;
    /// Of 2 x 2 x 2 voxels, x first, z last; groups of a part follow each other, in that order too.
    EightPoints group(size_t g) const;
    std::array<float, kBlockSide> x, y, z;
    float voxel;
  };

  /// Adds what a view says, voxel by voxel; never Band in parts that are not touched.
  void add(const Place& place, const DepthField& field, const TsdfView& view);
  /// The same where the view says one thing about all of it: Hidden, or Free where no part is
  /// touched.
  void add_whole(Sight sight);

  bool has_band() const { return touched_ != 0; }
  /// True if nothing can change any more: without band, and free all over.
  bool is_settled() const;

  /// Everything known about a voxel. What a view only assumes behind its surface counts where no
  /// view measures: averaged, it would push out the surface that another one sees there, and thin
  /// plates and edges would grow.
  struct Voxel {
    double weight = 0, distance = 0, spread = 0, variance = 0;  // weighted sums
    float free_weight = 0;
    int count = 0;  // of views in the band
    int known = 0;  // of those that are photographs, measured it, and look from one side
    bool is_adjoining = false, is_estimated = false, has_sigma = true;
    bool free = false, hidden = false;
    double color_weight = 0;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();

    double mean() const { return distance / weight; }
    /// Depth of one view alone still rests on one view where such views agree.
    float support() const;
    /// Whether nothing but estimates say that there is surface.
    bool is_estimate() const { return is_estimated && support() == 0; }
    /// The larger of what the views promise and how far they disagree.
    /// \param common  share of the sigma of each by which all are off alike
    double sigma(double common) const;
  };
  /// \param n  position in an OpenVDB leaf
  Voxel operator[](size_t n) const;

 private:
  static constexpr size_t kGroups = kBlockVoxels / 8;
  using Doubles = std::array<double, kBlockVoxels>;
  struct Sums {
    Doubles weight = {}, distance = {};
    std::array<uint16_t, kBlockVoxels> count = {}, known = {}, known_behind = {};
    std::array<uint8_t, kGroups> is_adjoining = {}, is_estimated = {}, lacks_sigma = {};
  };
  struct SigmaSums {
    Doubles spread = {}, variance = {};
  };
  struct ColorSums {
    Doubles weight = {};
    std::array<Doubles, 3> color = {};
  };

  void add_group(size_t group, const Observations& seen, const TsdfView& view);
  void add_band(size_t group, const Observations& seen, const TsdfView& view);
  void add_color(size_t first, unsigned taken, const Observations& seen, const ColorImage& image);
  void forget_band(size_t n);

  unsigned touched_;
  // Where the view that is added looks, and the first one of the band; 0 = none yet.
  Eigen::Vector3f looks_ = Eigen::Vector3f::Zero(), first_looks_ = Eigen::Vector3f::Zero();
  // Voxels in the order of groups. A bit per voxel, a byte per group of them.
  std::array<uint8_t, kGroups> free_ = {}, hidden_ = {};
  std::array<uint8_t, kGroups> measured_ = {};  // what is summed up is no assumption
  std::unique_ptr<std::array<float, kBlockVoxels>> free_weight_;  // null without band
  std::unique_ptr<Sums> sums_;        // null until a voxel is in the band of a view
  std::unique_ptr<SigmaSums> sigma_;  // null until a view has a sigma
  std::unique_ptr<ColorSums> color_;  // null until a view has colour

 public:
  /// Memory of one block [bytes].
  static constexpr size_t kPlainBytes = 3 * kBlockVoxels / 8 + 8 * sizeof(void*);
  static constexpr size_t kBandBytes = kPlainBytes + kBlockVoxels * sizeof(float) + sizeof(Sums);
  static constexpr size_t kSigmaBytes = sizeof(SigmaSums);
  static constexpr size_t kColorBytes = sizeof(ColorSums);
};

}  // namespace cgs
