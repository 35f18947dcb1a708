// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "libcgs/core/photo_response.h"
#include "libcgs/core/scene.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// One thing that photographs may differ by, and whether telling it pays.
struct ResponseTerm {
  std::string name;       ///< gain, gamma, vignette, vignette of two terms, matrix
  int parameters = 0;     ///< That it adds, of all photographs together.
  double saved_bits = 0;  ///< By which the differences get shorter, less what its parameters cost.
  double residual = 0;    ///< Mean difference with it, of sRGB-coded values; where it was not
                          ///< tried, that without it.
  bool is_used = false;
};

/// How the photographs of a scene answer to light, as far as what several of them show tells.
struct PhotoResponses {
  size_t reference = 0;  ///< Position in Scene::input of the one that the others are brought to.
  std::vector<PhotoResponse> response;  ///< Per input view.
  std::vector<Eigen::Vector3f> gain;    ///< Per input view, for View::exposure.
  std::vector<ResponseTerm> terms;      ///< In the order in which they were tried.
  double residual = 0;  ///< Mean difference as the photographs are, of sRGB-coded values.
  size_t samples = 0;   ///< Places that two photographs show.
  /// Whether the photographs were corrected by them; where gains are enough, those of
  /// exposure_gains() are taken.
  bool is_applied = false;

  /// Whether more than gains is needed.
  bool is_richer() const;
};

/// Fits the responses of the input views to each other on surface that is measured in one and
/// confirmed in another.
///
/// The reference is the view with colours that shares the most such places; its gain, gamma and
/// matrix are those of the result. Falling off of the light is told of every view, the reference
/// too, since cameras that moved show one place at several distances from the middle. Where a view
/// is grey (PhotoResponse::is_grey), luminances are compared.
///
/// The differences of logarithms of corrected light are weighted back to differences of the
/// photographs, so that they count alike in light and shade and no gamma makes them small; the
/// mean of their absolute values is minimised, each up to four times their median. The terms are
/// tried in a fixed order, each with those that were found to pay: one pays if n log2 of the mean
/// difference falls by more than (k / 2) log2 n for its k parameters, n being places, and that mean
/// by more than 1 %.
///
/// \param priors  of the input views, in their order
/// \pre images of the input views are loaded, and as they were taken: View::exposure is 1, gamma, vignette and matrix are unset
/// \return the default for views that share nothing with the reference, by whatever way
/// Source: the model of gain, gamma and vignette as Goldman 2010, equations 2 to 5, with a power
///         in place of a response curve; description length as Rissanen 1978.
PhotoResponses fit_photo_responses(const Scene& scene, const std::vector<ViewPriors>& priors);

}  // namespace cgs
