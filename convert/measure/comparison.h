// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "convert/text/figures.h"
#include "meshing/measure/deviation.h"
#include "meshing/measure/registration.h"

namespace cgs {

/// A mesh in the frame of another: units are matched where both state them, else taken as equal.
MeasurableMesh in_frame_of(const MeasurableMesh& mesh, const Frame& frame);

/// The mesh after a motion of its points; sigma grows with the scale.
MeasurableMesh moved(const MeasurableMesh& mesh, const Registration& motion);

/// The motion that lays a mesh onto another one, near which it lies already, by places that
/// somebody saw, or all of a surface that nobody saw.
/// \param surface  of `b`
/// \throws Error as register_points()
Registration motion_onto(const MeasurableMesh& a,
                         const MeasurableMesh& b,
                         const NearestSurface& surface,
                         bool with_scale);

/// The box around its points [internal units].
Eigen::AlignedBox3d box_of(const MeasurableMesh& mesh);

/// Relative standard deviation of one scale against the other.
double relative_scale_sigma(const Frame& a, const Frame& b);

/// The place that an error of the scale leaves where it is [internal units of `a`]: units were
/// matched about the zero of the world. Where A was laid onto B afterwards, it is held in the
/// middle; and control points hold what lies among them, however far from that zero.
Eigen::Vector3d unmoved_by_scale(const MeasurableMesh& a, const Frame& b, bool is_registered);

/// Takes over how long a unit is from a frame, one unit of which has grown into `growth` of those
/// of `to`. Both may be one.
void take_scale(Frame& to, const Frame& from, double growth);

/// How much of both surfaces lies within a distance of the other.
struct SurfaceAgreement {
  double threshold = 0;     ///< [internal units]
  double accuracy = 0;      ///< Share of A's points within it of B.
  double completeness = 0;  ///< Share of B's points within it of A.
  double f_score() const {
    const double sum = accuracy + completeness;
    return sum > 0 ? 2 * accuracy * completeness / sum : 0;
  }
};

/// What was found of A against B.
struct Comparison {
  std::vector<Deviation> by_area;
  DeviationSummary summary;
  std::optional<Registration> registration;
  std::optional<SurfaceAgreement> agreement;
  double half_range = 0;        ///< Of histogram and colours [internal units]: 98 % lie within.
  size_t without_distance = 0;  ///< Points of A that are not in by_area, as B has nothing there.
  std::string change_rule = "beyond 2 sigma";  ///< What counts as change, for people.
  std::string no_change_rule =                 ///< Why no change can be told where it cannot.
      "no place that B reaches has a sigma in both and was observed in both";
};

/// Half the width of a histogram that holds 98 % of the distances; > 0 [internal units].
double range_of(const std::vector<Deviation>& deviations);

/// Blue for -1, white for 0, red for 1, and what lies between.
Eigen::Vector3f diverging_color(double t);

/// {"unit", "distance": {…}, "histogram": {"low", "high", "counts"}, "change": shares of A's
/// points (of what is "not_comparable", "beyond_rim" is where an open B ends before it gets there;
/// distances hold that to its rim), "registration", "agreement"}; see docs/measuring.md.
nlohmann::ordered_json comparison_json(const Comparison& comparison,
                                       const MeasurableMesh& a,
                                       const FigureUnit& unit);

/// The same for people, with the histogram as bars.
std::string comparison_text(const Comparison& comparison, const FigureUnit& unit);

/// The histogram as a picture.
void write_histogram_svg(const std::filesystem::path& path,
                         const Comparison& comparison,
                         const FigureUnit& unit,
                         const std::string& title);

/// The mesh with every vertex coloured by its distance (blue on the inner side of B, white on it,
/// red on the outer side), scalar_distance [world units] and scalar_change (the numbers of Change).
void write_colored(const std::filesystem::path& path,
                   const MeasurableMesh& mesh,
                   const std::vector<Deviation>& of_vertices,
                   double half_range);

}  // namespace cgs
