// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/scene.h"
#include "libcgs/core/water.h"
#include "libcgs/priors/view_priors.h"
#include "libcgs/priors/water_evidence.h"

namespace cgs {

/// What the surface is lit by.
enum class WaterLight : uint8_t { Everywhere, Lamp };

/// One channel of Water, in any unit of length.
struct WaterChannel {
  double attenuation = 0;
  double backscatter = 0;
  double veil = 0;
};

/// What one channel of a match contradicts the water by, in linear light, and its derivatives by
/// attenuation, backscatter and veil.
struct WaterResidual {
  double value = 0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

/// The light of the surface itself is unknown. Of two photographs of it, with t = exp(-attenuation
/// R), over R^2 with a lamp, and h the haze at its range, least squares over that light leave
///
///   (t_b (I_a - h_a) - t_a (I_b - h_b)) / sqrt(t_a^2 + t_b^2),
///
/// in which noise of both photographs counts as it does in them, however dim one is.
/// Source: Golub and Pereyra 1973, "The Differentiation of Pseudo-Inverses and Nonlinear Least
/// Squares Problems Whose Variables Separate".
WaterResidual water_residual(const WaterMatch& match,
                             int channel,
                             const WaterChannel& water,
                             WaterLight light = WaterLight::Everywhere);

/// What estimate_water() finds.
struct WaterEstimate {
  std::optional<Water> water;  ///< Empty = the photographs show none.
  size_t matches = 0;          ///< That it rests on.
  double range = 0;            ///< Their median [internal units].
  double range_ratio = 1;      ///< Of the two ranges of a match, larger to smaller: nine of ten
                               ///< have less.
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();  ///< Robust, per channel, linear light.
};

/// Fits the nine numbers of the water by robust non-linear least squares (Huber, then Tukey, by
/// Levenberg and Marquardt), per channel from three starts, in the order of the matches.
///
/// Where matches say nothing of it, backscatter is held near attenuation (within one of optical
/// depth) and the veil near the middle of what is possible, with a weight that any match outweighs.
/// Sigma is that of the normal equations, with residuals of one group taken as dependent (Liang and
/// Zeger 1986, "Longitudinal Data Analysis Using Generalized Linear Models").
///
/// The same with a lamp at the camera counts where it explains the matches better: if it leaves
/// residuals smaller by a twentieth, and a description of all of them that is shorter by 10 nats,
/// one residual a group. Its lamp_range is the median range.
///
/// Water is found where a channel loses kLeastLoss of the light over the median range, two standard
/// deviations less taken, or a lamp was found.
/// \throws NumericalError if there are too few matches, or ranges vary too little to tell the
///         transmission over the median range to kMostDoubt
WaterEstimate fit_water(const WaterEvidence& evidence);

/// Share of light below which a loss is none: wrong matches and blur make as much.
inline constexpr double kLeastLoss = 0.06;
/// Standard deviation of attenuation times range above which a correction would be a guess.
inline constexpr double kMostDoubt = 0.15;

/// The water in the photographs of a scene: fit_water() of water_evidence().
WaterEstimate estimate_water(const Scene& scene, const std::vector<ViewPriors>& priors);

/// Takes the water out of the loaded photograph of an input view, but for what shows no surface:
/// sky, which under water is open water.
void take_out_water(const ViewPriors& priors, const Water& water, View& view);

/// The same for all input views of a scene that states water; else does nothing.
void take_out_water(const std::vector<ViewPriors>& priors, Scene& scene);

}  // namespace cgs
