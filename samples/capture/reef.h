// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "samples/capture/portal.h"
#include "samples/capture/truth.h"

namespace cgs {

enum class ReefDate { Earlier, Later };

/// The round place where the later reef has grown, in the wall's x and z [m].
struct ReefGrowth {
  double x = -0.28;
  double z = 0.55;
  double radius = 0.11;      ///< [m]
  double thickness = 0.005;  ///< Where it is thickest and, but for its rim, everywhere [m].
};

/// The knob that the later reef lacks: a round bump [m].
struct ReefKnob {
  double x = 0.30;
  double z = 0.38;
  double radius = 0.06;
  double height = 0.035;
};

/// How much the surface has grown, or the knob stands out, at a place of the wall [m].
double grown_by(double x, double z, const ReefGrowth& growth = {});
double knob_height(double x, double z, const ReefKnob& knob = {});

/// The same two as volumes [m^3].
double reef_gain();
double reef_loss();

/// A steep wall of coral, 1.6 m wide, with three thin branches before it, at two dates: one place
/// has grown and a knob has broken off. World axes as of the portal [m]; always the same scene.
PortalScene reef_scene(ReefDate date);

/// Its views, all inputs, in the order of their names; nobody stands in the same places twice.
///
/// \param downscale  as for capture_views()
/// \throws InvalidInput for another downscale
std::vector<CaptureView> reef_views(ReefDate date, int downscale = 1);

}  // namespace cgs
