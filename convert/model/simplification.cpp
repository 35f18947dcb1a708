// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/simplification.h"

#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "meshing/mesh/certificate.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

Json distances_to_json(const MeshDistance& distance, double scale) {
  return {{"max", distance.hausdorff() * scale},
          {"max_from_simplified", distance.accuracy.max * scale},
          {"max_from_original", distance.completeness.max * scale},
          {"rms_from_simplified", distance.accuracy.rms * scale},
          {"rms_from_original", distance.completeness.rms * scale}};
}

Json result_to_json(const SimplifyResult& result, const Frame& frame) {
  const auto observed = size_t(Provenance::Observed);
  const bool has_inferred = result.area_before.at(size_t(Provenance::Inferred)) > 0 ||
                            result.area_before.at(size_t(Provenance::Estimated)) > 0;
  const double area_unit = frame.scale * frame.scale;
  return {
      {"faces_before", result.faces_before},
      {"faces_after", result.faces_after},
      {"error_with_evidence", distances_to_json(result.evidence, frame.scale)},
      {"error_inferred", has_inferred ? distances_to_json(result.inferred, frame.scale) : Json()},
      {"area_observed_before", result.area_before.at(observed) * area_unit},
      {"area_observed_after", result.area_after.at(observed) * area_unit},
      {"rounds", result.rounds}};
}

}  // namespace

std::optional<SimplifyOptions> simplify_options(const std::string& length,
                                                double voxel,
                                                const Frame& frame) {
  if (length == "0") return std::nullopt;
  constexpr double kPartOfVoxel = 0.25;
  constexpr double kLooserWhereInferred = 4;
  SimplifyOptions options;
  options.max_error = length.empty() ? kPartOfVoxel * voxel : parse_length(length, frame);
  options.max_error_inferred = kLooserWhereInferred * options.max_error;
  return options;
}

Json simplify_meshes(TriangleMesh& open_surface,
                     WatertightResult& watertight,
                     const std::optional<SimplifyOptions>& options,
                     const Frame& frame,
                     const Progress& progress) {
  if (!options) return nullptr;
  SimplifyResult open = simplify(open_surface, *options, part_of(progress, 0, 0.3));
  SimplifyResult closed = simplify(watertight.mesh, *options, part_of(progress, 0.3, 1));
  Json json = {{"max_error", options->max_error * frame.scale},
               {"max_error_inferred", options->max_error_inferred * frame.scale},
               {"max_color_error", options->max_color_error},
               {"units", frame.unit_name()},
               {"open_surface", result_to_json(open, frame)}};
  open_surface = std::move(open.mesh);
  const Certificate certificate = certify(closed.mesh);
  const bool kept = certificate.passed() || !watertight.certificate.passed();
  json["watertight"] = kept ? result_to_json(closed, frame) : Json(nullptr);
  json["volume_before"] = watertight.certificate.volume * std::pow(frame.scale, 3);
  if (kept) {
    watertight.mesh = std::move(closed.mesh);
    watertight.certificate = certificate;
  }
  json["volume_after"] = watertight.certificate.volume * std::pow(frame.scale, 3);
  return json;
}

}  // namespace cgs
