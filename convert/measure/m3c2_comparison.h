// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/measure/comparison.h"
#include "meshing/measure/m3c2.h"

namespace cgs {

/// What `cgs compare --m3c2` is asked for; lengths as typed, empty = from the clouds' spacing.
struct M3c2Request {
  bool wanted = false;
  std::string normal_scale;
  std::string cylinder;
  std::string depth;
  std::string registration;  ///< Empty = 0.
  double scale_sigma = 0;    ///< Of one file's scale against the other's, as a share of it.
  /// The point that an error of that scale does not move [internal units].
  Eigen::Vector3d scale_center = Eigen::Vector3d::Zero();
};

/// What was found at the vertices of A.
struct M3c2Comparison {
  M3c2Options options;
  /// What the variances of the means of a side come from: "sigma", "roughness", or "mixed" where
  /// some of its points state a sigma and some do not.
  std::string variance_a;
  std::string variance_b;
  std::vector<M3c2Place> places;  ///< Of A's vertices, in their order.
  Comparison comparison;          ///< Of the places with a distance.
  double unknown_signs = 0;       ///< Share of the distances that may have the other sign.
  double split = 0;               ///< Share of the distances that are split, see M3c2Place.

  static constexpr double kNegligible = 0.01;
  bool is_sign_known() const { return unknown_signs <= kNegligible; }
  bool is_split() const { return split > kNegligible; }
};

/// Compares the vertices of A with those of B, faces aside: every vertex of a reconstruction is a
/// measurement, points between them are not. Faces, or normals that a cloud states, say which side
/// is outside (where these are 0: the nearest that are not); else normals of neighbours are made to
/// agree, and in every connected part that of the topmost point, by the up of A's frame (+z where
/// it is not known), looks up: where the surface is steep there, the sign is not known. Where both
/// A and B have faces or such normals, the other wall of what is thin is left out, as m3c2() does,
/// also if one of the two is inside out.
/// \throws InvalidInput for a length that cannot be, clouds without seen points, or where no point
///         of A has a normal, or points of B in its cylinder
M3c2Comparison compare_m3c2(const M3c2Request& request,
                            const MeasurableMesh& a,
                            const MeasurableMesh& b);

/// The levels of detection of all places that have one, ascending [internal units].
std::vector<double> known_detections(const M3c2Comparison& found);

/// comparison_json() and "m3c2": {"normal_scale", "cylinder", "cylinder_depth",
/// "registration_error", "scale_sigma", "sign_known", "variance_a": "sigma", "roughness" or
/// "mixed", "variance_b", "places", "with_distance": share, "with_detection": share, "split":
/// share of the distances, "detection": {"median", "p95"}}
nlohmann::ordered_json m3c2_json(const M3c2Comparison& found,
                                 const MeasurableMesh& a,
                                 const FigureUnit& unit);

/// The scales and the level of detection, for people.
std::string m3c2_text(const M3c2Comparison& found, const FigureUnit& unit);

/// A with the normals used, coloured where the change is significant (white: it is not; grey:
/// nothing can be told), and scalar_distance, scalar_detection, scalar_roughness_a,
/// scalar_roughness_b [world units; NaN = cannot be told], scalar_count_a, scalar_count_b,
/// scalar_change (the numbers of Change) and scalar_significant (0 or 1).
/// \throws IoError
void write_m3c2_ply(const std::filesystem::path& path,
                    const MeasurableMesh& a,
                    const M3c2Comparison& found);

}  // namespace cgs
