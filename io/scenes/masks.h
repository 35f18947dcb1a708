// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/bytes/scene_path.h"
#include "io/images/image.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// The masks of a scene by their photographs. Folders are listed once.
///
/// A mask lies in a folder "masks" below that of the photograph or any above it, there in the same
/// folders below it (COLMAP: masks/rig1/img.jpg.png for images/rig1/img.jpg). It is named as the
/// photograph (nerfstudio, Brush: img.png for img.jpg, any image format) or with .png after its
/// whole name (COLMAP), which comes first. Where no name is the same, letter case and Unicode
/// normal form do not count.
class MaskIndex {
 public:
  explicit MaskIndex(SceneRoot root);

  /// Says which pixels of a photograph may be used; empty if there is none.
  /// \throws BadInput Path where it is a link that leaves the scene, as resolve_in_scene(); Ref if
  ///         two files are meant equally well, naming both; LimitError
  std::filesystem::path mask_of(const std::filesystem::path& photograph);

  /// True if there is a folder of masks, and none in it is for this photograph.
  bool lacks(const std::filesystem::path& photograph);

 private:
  struct Folder {
    std::map<std::string, std::filesystem::path> files;                // by file name
    std::map<std::string, std::filesystem::path> stems;                // the first of each
    std::map<std::string, std::vector<std::filesystem::path>> folded;  // by folded stem
  };
  const Folder& listed(const std::string& folder);

  SceneRoot root_;
  std::map<std::string, Folder> folders_;
};

/// Finds the masks of views whose data set names none. Input views without one are warned of where
/// others have one; masks of another size than their photograph become a note.
/// \throws Error as MaskIndex
void find_masks(const SceneRoot& root, Scene& scene);

/// Leaves usable only the pixels where the mask of a view, if it has one, is at least half as
/// bright as white, or as the brightest where that is 1: segmentation tools count classes.
///
/// The mask of a photograph that is turned upright is upright, too: as its own Exif says, or as
/// viewers showed the photograph to whoever painted it. Only where its size tells that it lies as
/// the photograph is stored, it is turned with it.
/// \param size    of the photograph [pixels], turned as the view says
/// \param usable  in and out: 1 = may be used; empty = all may
/// \throws BadInput Mismatch for a mask of another shape, and as read_image(); of one of another size
///         each pixel takes the nearest
void apply_mask(const View& view, const ImageSize& size, MaskMap& usable);

}  // namespace cgs
