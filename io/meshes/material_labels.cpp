// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/material_labels.h"

#include <algorithm>

#include "io/bytes/mesh_arrays.h"

namespace cgs {

std::optional<Provenance> provenance_of_material(std::string_view name) {
  const auto is_same = [](char ours, char c) { return ours == (c == '_' ? ' ' : c); };
  for (const Provenance label : kProvenanceOrder) {
    const std::string_view word = provenance_name(label);
    if (name.size() < word.size()) continue;
    if (!std::equal(word.begin(), word.end(), name.begin(), is_same)) continue;
    if (name.size() == word.size() ||
        std::string_view(" _.").find(name[word.size()]) != std::string_view::npos) {
      return label;
    }
  }
  return std::nullopt;
}

void MaterialLabels::add(std::optional<Provenance> label) {
  if (label) {
    is_named_.at(static_cast<size_t>(*label)) = true;
  } else {
    is_any_without_ = true;
  }
}

bool MaterialLabels::are_told() const {
  return !is_any_without_ && std::count(is_named_.begin(), is_named_.end(), true) > 1;
}

std::string MaterialLabels::warning(bool are_taken) const {
  if (std::count(is_named_.begin(), is_named_.end(), true) == 0) return "";
  return are_taken
             ? "labels are taken from the names of materials: another program wrote the file, "
               "and faces that it added have one of them, too"
             : "where its faces come from is not known: some materials are named after "
               "labels, but not those of all faces, or all after the same";
}

}  // namespace cgs
