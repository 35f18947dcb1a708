// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/evidence_remark.h"

#include <nlohmann/json.hpp>

#include "convert/text/html.h"

namespace cgs {

std::string percent(double part, double whole) {
  return number(whole > 0 ? 100 * part / whole : 0, "%.1f %%");
}

std::string bridge_remark(const EvidenceTransfer& evidence, const TriangleMesh& mesh) {
  std::string out = percent(evidence.bridged, evidence.area) + " of the area bridges gaps";
  if (mesh.provenance.empty()) out += ", not marked as the file does not say what was observed";
  return out;
}

bool is_behind(const EvidenceTransfer& evidence) {
  constexpr double kNoise = 0.01;  // of the area: rims and crumpled spots
  return evidence.behind > kNoise * evidence.area;
}

}  // namespace cgs
