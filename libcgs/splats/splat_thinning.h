// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/progress.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// A setting that was tried.
struct ThinningTrial {
  float most_cost = 0;  ///< MergeOptions::most_cost
  size_t splats = 0;    ///< What was left.
  double loss = 0;      ///< Of PSNR against photographs that nobody took [dB], see thin_splats();
                        ///< of a setting that was not chosen after the first passes of fitting.
};

/// Fewer splats that look the same.
struct ThinnedSplats {
  Gaussians splats;
  std::vector<ThinningTrial> tried;
  std::optional<float>
      most_cost;  ///< Of the setting that was chosen; empty = all splats were kept.
  /// Edge of a pixel at all but the nearest hundredth of them [internal units]; 0 = nothing was
  /// chosen.
  float pixel = 0;
  /// PSNR of photographs against splats of the other photographs alone [dB]; empty = they show
  /// hardly anything of each other, so that there is nothing to judge by.
  std::optional<double> unseen_psnr;
};

/// What may be lost as thin_splats() foresees it [dB], over what splats show. Photographs that were
/// held out lose less where they lie between the input views, as less was reconstructed well there,
/// and about as much where they are nearer to what they show.
inline constexpr double kMostThinningLoss = 0.2;

/// The splats of input views without those that its pictures do not need: merge_splats() and
/// refit_splats() on the input views and on cameras between and beside them, by the strongest
/// setting of a fixed ladder of four that loses at most kMostThinningLoss. Two of them are tried,
/// by bisection, or three where only the weakest may do.
///
/// Photographs held out have no say. How well the model shows what it was not trained on is told by
/// each input photograph and the splats of the others: its mean squared error E, where they show
/// something, which must be a twentieth of what it shows itself. A picture of fewer splats that
/// differs by D from that of all, as mean_square_difference() has it, would then lose
/// 10 log10(1 + D / E) dB against a photograph taken there, as neither error knows of the other.
/// What differs by no more than a step of eight bits is always allowed: E counts as large enough
/// for that. Judged is the mean over the input views and over cameras that were not fitted to. Of
/// more than twelve input views, a dozen are fitted to and judged by, evenly chosen; which splats
/// show anything is told by all.
/// The same choice and the same bits every time, for any number of threads.
///
/// \param scene   with the pixels of its input views
/// \param counts  how many of the splats are of each input view, in their order; those of a pane
///                may follow, fewer than of a view. If there are fewer or more splats than that,
///                nobody knows whose they are, and all are kept
/// \throws Error as weigh_splats() and refit_splats()
ThinnedSplats thin_splats(const Gaussians& gaussians,
                          const Scene& scene,
                          std::span<const size_t> counts,
                          const Progress& progress = {});

}  // namespace cgs
