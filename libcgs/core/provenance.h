// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <Eigen/Core>

namespace cgs {

/// Where a face comes from. The numbers are those in files.
enum class Provenance : uint8_t {
  Inferred = 0,      ///< No input view saw it: closes the surface, invented.
  SingleView = 1,    ///< One input view saw it, and a depth sensor or the surface that was measured
                     ///< right beside it tells its depth.
  Observed = 2,      ///< Two or more input views saw it.
  Interpolated = 3,  ///< Bridges a hole whose whole rim photographs saw.
  Virtual = 4,       ///< Seen by virtual cameras alone, in splats that came without photographs:
                     ///< nobody can vouch for it.
  Estimated = 5,     ///< An input view shows it, but nothing measured its depth: filled in from its
                     ///< surroundings.
};
inline constexpr size_t kProvenanceCount = 6;

/// All that is said and shown of a label, wherever it is: files, reports, orthophotos.
struct ProvenanceTraits {
  std::string_view name;         ///< In files and reports.
  std::string_view meaning;      ///< For people, after the name.
  std::array<uint8_t, 3> color;  ///< sRGB-coded. What shines through in glTF is of the same hue.
  int evidence_rank;             ///< The more evidence it stands for, the higher.
  bool was_seen;                 ///< Whether photographs vouch for such surface.
  bool has_evidence;             ///< Whether anything at all does.
};

/// By the number of the label. What was observed is neutral, so that shape stays visible and the
/// rest stands out.
inline constexpr std::array<ProvenanceTraits, kProvenanceCount> kProvenanceTraits = {{
    {"inferred", "no photograph saw it, invented", {242, 26, 217}, 0, false, false},
    {"single view", "one photograph saw it", {91, 155, 213}, 4, true, true},
    {"observed", "two or more photographs saw it", {196, 200, 204}, 5, true, true},
    {"interpolated", "between rims that photographs saw", {255, 128, 26}, 3, false, true},
    {"virtual", "seen in splats only", {154, 127, 209}, 2, false, true},
    {"estimated",
     "a photograph shows it, nothing measured its depth",
     {255, 204, 0},
     1,
     false,
     false},
}};

/// From best to no evidence: the order in which files list the labels.
inline constexpr std::array<Provenance, kProvenanceCount> kProvenanceOrder = {
    Provenance::Observed,
    Provenance::SingleView,
    Provenance::Interpolated,
    Provenance::Estimated,
    Provenance::Inferred,
    Provenance::Virtual};

constexpr const ProvenanceTraits& traits(Provenance label) {
  return kProvenanceTraits.at(static_cast<size_t>(label));
}

/// "observed", "single view", …: the words in files and reports.
constexpr std::string_view provenance_name(Provenance label) { return traits(label).name; }

/// sRGB-coded colour in [0, 1].
inline Eigen::Vector3f provenance_color(Provenance label) {
  const auto& [red, green, blue] = traits(label).color;
  return Eigen::Vector3f(red, green, blue) / 255;
}

/// How much evidence a label stands for: the more, the higher. Inferred surface has none, estimated
/// surface at least a photograph, virtual surface splats.
constexpr int evidence_rank(Provenance label) { return traits(label).evidence_rank; }

constexpr Provenance weaker_evidence(Provenance a, Provenance b) {
  return evidence_rank(a) < evidence_rank(b) ? a : b;
}

/// Whether photographs vouch for surface of this label: observed, or seen by one.
constexpr bool was_seen(Provenance label) { return traits(label).was_seen; }

/// Whether a photograph shows such surface, be its depth measured or not.
constexpr bool is_shown(Provenance label) {
  return was_seen(label) || label == Provenance::Estimated;
}

/// Whether anything vouches for surface of this label. Nothing does where it was inferred or
/// estimated: it has no sigma, and no figure rests on it.
constexpr bool has_evidence(Provenance label) { return traits(label).has_evidence; }

}  // namespace cgs
