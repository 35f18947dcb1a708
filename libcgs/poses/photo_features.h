// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include <Eigen/Core>

#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// Points of a photograph that can be found again in others, and what they look like.
struct PhotoFeatures {
  std::vector<Eigen::Vector2d> points;  ///< [pixels], pixel centres at +0.5.
  /// Rows of unit length (SIFT, square-rooted), one or more per point.
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> descriptors;
  std::vector<int> point_of;  ///< Of each row; empty = row i is of point i.
  double pixel = 1;  ///< Side of a pixel of the picture searched, in pixels of the photograph.
  /// The picture searched, grey, levels 0 ... 255, in which refine_observations() measures places
  /// more finely. Empty = the points no longer lie where they were found, and are used as they are.
  Raster<uint8_t> picture;
};

struct FeatureOptions {
  int largest_side = 1600;  ///< Larger photographs are searched at this size [pixels].
  int most = 8000;          ///< Points kept, those of the highest contrast.

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Finds SIFT features. The same for any number of threads.
///
/// \param image   at least 8 pixels wide and high
/// \param usable  where features may lie, of the size of the image; empty = everywhere
/// Source: Lowe 2004, "Distinctive image features from scale-invariant keypoints"; Arandjelovic and
///         Zisserman 2012, "Three things everyone should know to improve object retrieval"
///         (square root).
PhotoFeatures detect_features(const ColorImage& image,
                              const MaskMap& usable = {},
                              const FeatureOptions& options = {});

/// Finds SIFT features also as they would look from the side, in the picture compressed by the
/// square root of two along four directions; a point has a descriptor for each picture in which it
/// was found. Photographs from far apart share more of them. Takes five times as long, holds up to
/// twice `most` descriptors.
///
/// Source: Morel and Yu 2009, "ASIFT: A New Framework for Fully Affine Invariant Image Comparison".
PhotoFeatures detect_tilted_features(const ColorImage& image,
                                     const MaskMap& usable = {},
                                     const FeatureOptions& options = {},
                                     const Progress& progress = {});

/// A pair of features of two photographs.
struct FeatureMatch {
  int a = 0;
  int b = 0;
};

/// Features that are each other's nearest, and nearer than 0.8 times the second nearest, in both
/// directions; each once, in the order of a.
std::vector<FeatureMatch> match_features(const PhotoFeatures& a,
                                         const PhotoFeatures& b,
                                         const Progress& progress = {});

}  // namespace cgs
