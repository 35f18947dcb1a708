// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "libcgs/core/gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/render/training_rasterizer.h"
#include "libcgs/train/adam.h"
#include "libcgs/train/density_control.h"
#include "libcgs/train/step_report.h"
#include "libcgs/train/training_options.h"

namespace cgs {

/// How the number of free Gaussians came about.
struct DensityReport {
  bool is_from_splats = false;  ///< Begun from given ones: their number stays.
  size_t begun_with = 0;
  size_t cloned = 0;
  size_t split = 0;
  size_t pruned = 0;
};

/// Gaussians to begin from where nothing is given: of every 4 x 4 pixels of an input view one whose
/// depth is measured and that the view draws (draws()), of its colour, opacity 0.1, as large as its
/// three nearest neighbours are far. They stand for the points that structure from motion would
/// give.
/// \throws NumericalError if no depth is measured
Gaussians measured_points(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Optimises free Gaussians against the photographs of the input views: classical 3D Gaussian
/// Splatting, without anything that holds them together. Positions, scales, rotations, opacities
/// and colours of degree 0 … 3 are moved by Adam, one view a step, views in random order; every
/// round of density control clones and splits those that pull at the picture, and prunes.
///
/// Of `options` it takes steps, sh_degree, l1_weight, ssim_weight and l1_levels. The published
/// schedule has 30 000 steps; here all its times are scaled to `steps`. Rates stay (with the root
/// of what the schedule is shorter by, three photographs are learnt by heart the sooner). Rounds of
/// density control stay 100 steps apart, but where there are fewer than 3000 steps: then there are
/// still 15 of them. Beside that, the background is of another colour in every step; there are at
/// most as many Gaussians as input pixels; and the extent of the scene is no less than the median
/// depth. The publication takes that of the cameras, by which nearly all of a scene is too wide to
/// stay where few stand side by side.
///
/// Everything depends on the arguments and the number of steps done, and on nothing else: the same
/// bits on any number of threads.
/// Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering",
///         sections 5 and 7.1; here on our own rasterizer.
class FreeSplats {
 public:
  /// \param scene   canonical, input images loaded
  /// \param priors  in the order of scene.input
  /// \param start   if given, begins from these and in the middle of the schedule, after which
  ///                neither density nor opacity is controlled; else from measured_points()
  ///                [internal units]
  /// \throws InvalidInput as options.validate(), or without an input view; as measured_points()
  FreeSplats(const Scene& scene,
             const std::vector<ViewPriors>& priors,
             const TrainingOptions& options,
             std::optional<Gaussians> start = {});

  bool done() const { return step_ >= options_.steps; }
  int steps_done() const { return step_; }
  /// \throws NumericalError if the loss is not finite
  StepReport step();

  const Gaussians& gaussians() const { return gaussians_; }
  const DensityReport& density() const { return density_; }
  const std::vector<StepReport>& history() const { return history_; }  ///< Of all steps done.

 private:
  struct PictureOfView {
    Camera camera;
    ColorPlanes photograph;
    MaskMap use;
  };
  // What Adam moves; base is the constant harmonic, harmonics are all others.
  enum Part : size_t { kPosition, kScale, kRotation, kOpacity, kBase, kHarmonics, kParts };

  double time() const;
  size_t view_of_step() const;
  size_t parameters_of(Part part) const;  ///< Of one Gaussian.
  void encode();
  void decode();
  void take_gradients(const GaussianGradients& sum);
  void add_image_gradients(const GaussianGradients& sum, const Camera& camera);
  std::array<float, kParts> rates() const;
  void control_density();
  void keep_states(const std::vector<uint32_t>& came_from);
  void reset_opacity();

  TrainingOptions options_;
  std::vector<PictureOfView> views_;
  float extent_ = 0;  // of the scene [internal units]
  size_t most_ = 0;   // Gaussians
  Gaussians gaussians_;
  std::array<ParameterBlock, kParts> parameters_;
  std::array<AdamState, kParts> states_;
  TrainingRasterizer rasterizer_;
  GaussianGradients gradients_;        // of one step; kept for its memory
  std::vector<float> image_gradient_;  // sum since the last round of density control
  std::vector<uint32_t> drawn_;        // steps since then that drew it
  DensityReport density_;
  std::vector<StepReport> history_;
  int step_ = 0;
};

}  // namespace cgs
