// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/scenes/colmap_model.h"
#include "io/scenes/given_depth.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// What to take of a scene on disk.
struct SceneOptions {
  /// Input views: comma-separated names (file stems) or indices in name order; a name wins where
  /// both fit. Empty = choose: all of at most four, of more those that together show the most and
  /// others far from these, up to kMostPixels but at least three, seven of eight at most; of an
  /// LLFF scene those of its protocol.
  std::string views;
  bool all_views = false;  ///< Where `views` is empty, take every one.
  /// Divide image sizes by this; >= 1. Empty = choose: the smallest that leaves no side above
  /// kLongestSide or, of many photographs that are chosen among, lets kWantedViews of them in;
  /// photographs much smaller than the largest have one of their own. What was chosen becomes a
  /// note.
  std::optional<int> downscale;
  /// Of Metashape's cameras, the chunk to read: its label or its index from 0. Empty = the first
  /// with aligned cameras.
  std::string chunk;
  bool allow_external = false;  ///< Follow links and absolute paths that leave the scene folder.
  DepthOptions depth;

  /// Three photographs of this size take minutes on two cores; time grows with their pixels.
  static constexpr int kLongestSide = 1024;  // [pixels]
  /// Of all input views that are chosen together: some five minutes on two cores.
  static constexpr double kMostPixels = 3.2e6;
  /// So many input views, where there are, are worth smaller pictures, but of this longest side at
  /// least [pixels].
  static constexpr size_t kWantedViews = 12;
  static constexpr int kShortestChosen = 400;

  /// How many of so many photographs are wanted as input views where `views` names none: all of few
  /// or where that is asked for, of more kWantedViews.
  size_t wanted_views(size_t photographs) const;

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// Recognises the layout of a folder (see layout_of()) and reads cameras and image sizes, but no
/// pixels.
///
/// The result is in world coordinates with the identity frame, views sorted by name. Cameras have
/// the size of the image file divided by `downscale`, rounded down; where the layout states
/// another size of the same shape, intrinsics are scaled to the file. Input views as the options
/// say, else as choose_input_views() does; of an LLFF scene, and where that finds none, by the
/// LLFF protocol. Held out are all others that have a file. LLFF protocol (of the views that have a
/// file, in name order: those at 0, 8, 16 … are not taken, three at even distances of the rest
/// are): Niemeyer et al. 2022, "RegNeRF", supplement.
///
/// \throws InvalidInput (options; a view that does not exist, is named twice or has no file),
///         BadInput Open (no such folder), Schema (layout not recognised), Empty (fewer than two
///         views), Missing (no image at all), Mismatch (image of another shape than its camera),
///         Value (input cameras in one place; as check_significance()), and as the readers of the
///         layouts.
Scene read_scene(const std::filesystem::path& folder, const SceneOptions& options = {});

/// The scene of photographs whose cameras were solved for, as read_scene() gives it for a folder
/// that states them; `kind` is SceneKind::Photographs.
///
/// \param folder  holds the photographs
/// \throws Error as read_scene()
Scene scene_of_photographs(const std::filesystem::path& folder,
                           const ColmapModel& model,
                           const SceneOptions& options = {});

/// Decodes the images of some views, takes lens distortion out and averages them down to the size
/// of their camera, in place. View::distortion stays, as it describes the file; View::valid marks
/// the usable pixels where not all are. Odd pictures (constant, fully masked, identical) become
/// warnings.
///
/// \param views  indices into scene.views that have an image file
/// \throws BadInput as read_image(), Missing; Mismatch if a file has changed its shape; LimitError.
void load_images(Scene& scene, const std::vector<int>& views, const Progress& progress = {});

/// A copy of one view, loaded as by load_images(). Any number of threads may ask at once.
///
/// \param with_image  false leaves `image` empty where it can be, which is much quicker
/// \param warnings    gets what is odd
/// \throws Error as load_images()
View loaded_view(const Scene& scene, int view, bool with_image, std::vector<std::string>& warnings);

}  // namespace cgs
