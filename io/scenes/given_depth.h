// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "io/images/image.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// Depth that comes with the photographs.
struct DepthOptions {
  std::filesystem::path folder;  ///< Holds a file per photograph, of the same stem; empty = where
                                 ///< the scene says, else a folder "depth" beside the photographs.
  DepthKind kind = DepthKind::Unknown;
  std::filesystem::path
      network;       ///< An .onnx file that guesses depth; then no files are looked for.
  double scale = 0;  ///< Values per metre; 0 = 1000 in files of whole numbers, else 1.

  /// \throws InvalidInput naming the first field out of range, or what excludes each other.
  void validate() const;
};

/// What --depth-kind takes.
std::map<std::string, DepthKind> depth_kinds();

/// Gives every view that has a photograph the file with its depth, if there is one: in the folder
/// of the options, else where the layout of the scene says, else in a folder "depth" beside that of
/// the photograph, or in it. From such a folder only input views get one, and a file that cannot be
/// used (of colours, of another shape, damaged) becomes a warning, as do input views that have none
/// while others do. So does depth that COLMAP made with photographs that are held out.
/// \throws BadInput Missing (the folder of the options holds no file for an input view), Path,
///         Ref (one file for two views); InvalidInput where the scene or the options say that depth
///         maps of COLMAP, which are in units of the scene, are in metres
void find_given_depth(Scene& scene, const DepthOptions& options, bool allow_external);

/// The file that says how far to trust the depth of a view, as Polycam lays it out; empty if there
/// is none.
/// \throws BadInput Path where it leads out of the scene and that is not allowed
std::filesystem::path confidence_file(const Scene& scene, const View& view, bool allow_external);

/// Reads the depth of a view at the size of its camera, which has no distortion. In Polycam's
/// layout there is none where a file in the folder "confidence" says 0.
///
/// Depth files may have another size than the photograph, but its shape. Where they are coarser,
/// values are interpolated between neighbours that differ by at most 5 %; where they are finer, the
/// median of the values under a pixel and what differs from it by at most 5 % are averaged: values
/// of both sides of a depth edge never mix. A photograph that is stored turned may come with depth
/// that is turned or upright.
/// Depth maps of COLMAP, of undistorted pictures, do not go with a photograph that has distortion.
/// \param photograph  size of the photograph, upright [pixels]
/// \throws BadInput Mismatch for another shape or such a map, and as read_depth_file(); LimitError
void load_given_depth(const Scene& scene, View& view, const ImageSize& photograph);

}  // namespace cgs
