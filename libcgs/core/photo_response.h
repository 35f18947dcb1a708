// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "libcgs/core/raster.h"

namespace cgs {

/// What makes the colours of a photograph those of the others of a scene, beside a factor per
/// channel: what film, prints, lenses and scanners did to the light. The default changes nothing.
///
/// Per pixel, on linear light: power `gamma` of each channel; a factor exp(v0 r² + v1 r⁴), where r
/// is the distance from the middle of the picture and 1 in its corners; `matrix`.
/// Source: Goldman 2010, "Vignette and exposure calibration and compensation", for the polynomial.
struct PhotoResponse {
  bool is_grey = false;  ///< Of all colours the luminance alone is a measurement.
  double gamma = 1;
  Eigen::Vector2d vignette = Eigen::Vector2d::Zero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< Rows sum to 1: grey stays grey.

  bool operator==(const PhotoResponse& other) const = default;
};

/// Applies a response to a picture. What is brighter than white then is left so.
void apply_response(ColorImage& image, const PhotoResponse& response);

/// Squared distance of a place in a picture from its middle, 1 in its corners; pixel centres lie at
/// +0.5.
double squared_radius(double x, double y, int width, int height);

/// Of linear light, ITU-R BT.709.
inline Eigen::Vector3f luminance_weights() { return {0.2126f, 0.7152f, 0.0722f}; }

/// sRGB-coded luminance of an sRGB-coded colour.
float coded_luminance(const Eigen::Vector3f& color);

/// The same with its derivative by the three coded channels; a channel below 0 counts as 0.
float coded_luminance(const Eigen::Vector3f& color, Eigen::Vector3f& derivative);

/// A picture of its luminance alone.
ColorImage in_grey(const ColorImage& image);

}  // namespace cgs
