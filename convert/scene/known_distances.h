// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/model/model.h"
#include "convert/scene/marker_bars.h"

namespace cgs {

/// Two points picked in photographs and how far they are apart.
struct KnownDistance {
  /// A pixel of a photograph as its file has it, numbered as image viewers do: 0, 0 is the first.
  struct Pick {
    int view = 0;  ///< Index into Scene::views.
    double x = 0;  ///< [pixels of the file]
    double y = 0;
  };
  Pick a;
  Pick b;
  double metres = 0;
  double sigma = 0;  ///< [m]; 0 where the user states none.
  std::string text;  ///< As typed.
};

/// A distance as users type it: "view:x,y", "view:x,y" and "1.2m", the last with "+-3mm" after it
/// where its uncertainty is known.
using DistanceWords = std::array<std::string, 3>;

/// A known distance beside what the model, in the scale that all of them make, says of it.
struct ComparedDistance {
  std::string name;      ///< As typed, or which marker's side.
  double known = 0;      ///< [m]
  double measured = 0;   ///< [m]
  double sigma = 0;      ///< Of measured [m].
  bool is_used = false;  ///< The scale is also of it.
};

/// The scale that known distances make.
struct DistanceScale {
  double metres_per_unit = 0;
  double metres_sigma = 0;
  std::vector<ComparedDistance> distances;
  std::vector<std::string> warnings;
};

/// \throws InvalidInput for what cannot be read, a view that is no input view, or a pixel outside
///         of its photograph
std::vector<KnownDistance> known_distances(const std::vector<DistanceWords>& typed,
                                           const Scene& scene);

/// Whether distances can be read and their views exist, before their cameras are known.
/// \param named  all photographs, by their names
/// \throws InvalidInput
void check_known_distances(const std::vector<DistanceWords>& typed, const Scene& named);

/// Whether depth was measured where every distance ends: known before the training.
/// \throws InvalidInput as scale_by()
void check_picks(const std::vector<KnownDistance>& distances, const Model& model);

/// Gives a model the scale by which its depths fit the distances, and its cameras the markers; with
/// neither, does nothing.
///
/// The sigma of a picked length in the scene is that of the depths at both ends and of half a pixel
/// of the images worked on.
/// \throws InvalidInput where no depth was measured at a pixel, or both ends fall together
std::optional<DistanceScale> scale_by(const std::vector<KnownDistance>& distances,
                                      const std::vector<MarkerBar>& markers,
                                      Model& model);

/// {"metres_per_unit", "metres_sigma", "distances": [{"distance", "known", "measured", "sigma",
/// "residual", "used"}], "warnings"}, lengths in metres; residual is measured minus known.
nlohmann::ordered_json distances_to_json(const DistanceScale& scale);

}  // namespace cgs
