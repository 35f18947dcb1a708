// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/camera.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// From where two files of splats are looked at.
struct ComparedView {
  std::string name;
  Camera camera;          ///< In the frame of the splats [internal units].
  ColorImage photograph;  ///< What was seen from there, sRGB-coded; empty = nobody was.
  MaskMap valid;          ///< Empty = all of it may be used.
};

/// What a picture of one of two files shows. A pixel that the splats cover less than half is
/// unseen.
struct ShownSplats {
  double unseen = 0;  ///< Share of the pixels.
  double alone = 0;   ///< Share that it shows and the other file does not.
  /// Against the photograph, unseen pixels as black [dB]; empty where there is none.
  std::optional<double> psnr;
  /// The same over pixels that both files show; empty also where there are none.
  std::optional<double> psnr_shared;
};

/// Pictures of two files from one camera, or over all of them.
struct ComparedPictures {
  std::string name;  ///< Of the view.
  ShownSplats a, b;
  /// Between the two, on black, over pixels that either shows [dB]; infinity = the same; empty =
  /// neither shows anything.
  std::optional<double> psnr;
};

struct SplatComparison {
  /// Shares over all pixels, PSNR between the two over all pixels together, against photographs
  /// the mean of the views.
  ComparedPictures all;
  std::vector<ComparedPictures> views;
};

/// Eight cameras around, or within, the larger of two sets of splats in one frame.
/// \throws Error as virtual_cameras()
std::vector<ComparedView> views_around(const Gaussians& a,
                                       const Gaussians& b,
                                       const Progress& progress = {});

/// Draws two sets of splats from the same cameras. Both in one frame.
/// \param load  of a view its photograph, where there is one; may be empty. Called once per view
/// \param show  gets a picture per view: the photograph, if there is one, A, B, and four times their
///              difference, side by side; what is unseen in magenta; may be empty
/// \throws InvalidInput if there is no view, or a photograph is of another size than its camera;
///         LimitError as rasterize()
SplatComparison compare_splats(
    const Gaussians& a,
    const Gaussians& b,
    std::vector<ComparedView> views,
    const std::function<void(ComparedView&)>& load,
    const std::function<void(const std::string& name, const ColorImage&)>& show,
    const Progress& progress = {});

/// What one file lacks that the other shows, a line each; none where that is less than a hundredth
/// of the pixels.
std::vector<std::string> lacking_words(const ComparedPictures& all);

/// {"psnr": [dB], "same" or null, "a": {"unseen", "alone", "psnr", "psnr_shared"}, "b": {…},
/// "views": [{"name", "psnr", "a", "b"}]}
nlohmann::ordered_json splat_comparison_to_json(const SplatComparison& comparison);

}  // namespace cgs
