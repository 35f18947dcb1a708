// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// The label that a material of ours is named after: "single view" and "single view <photograph>",
/// and what other programs make of them: "single_view", "single_view.001".
/// \return none for other names
std::optional<Provenance> provenance_of_material(std::string_view name);

/// What names of materials tell of the faces of a file that does not say that it is one of ours:
/// another program wrote it since, and kept no more than the names.
class MaterialLabels {
 public:
  /// What provenance_of_material() says of the material of a face, or of all faces of a part.
  void add(std::optional<Provenance> label);

  /// Whether every face has a label, and not all the same: one material that happens to be called
  /// "virtual" makes no file one of ours.
  bool are_told() const;

  /// One line that says whether labels were taken from names; empty where no name is a label's.
  std::string warning(bool are_taken) const;

 private:
  std::array<bool, kProvenanceCount> is_named_ = {};
  bool is_any_without_ = false;
};

/// Warning for a file that states that it had labels, which it has no longer for every face.
inline constexpr const char* kLostLabels =
    "where its faces come from is no longer known: another program left out or changed the labels "
    "that it had";

}  // namespace cgs
