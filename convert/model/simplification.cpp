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
  options.max_error =
      length.empty() ? kPartOfVoxel * voxel : parse_length(length, frame, "--simplify");
  options.max_error_inferred = kLooserWhereInferred * options.max_error;
  return options;
}

std::optional<Simplification> simplify_meshes(TriangleMesh& open_surface,
                                              WatertightResult& watertight,
                                              const std::optional<SimplifyOptions>& options,
                                              const Progress& progress) {
  if (!options) return std::nullopt;
  Simplification out;
  out.options = *options;
  out.open_surface = simplify(open_surface, *options, part_of(progress, 0, 0.3));
  SimplifyResult closed = simplify(watertight.mesh, *options, part_of(progress, 0.3, 1));
  open_surface = std::exchange(out.open_surface.mesh, {});
  TriangleMesh simplified = std::exchange(closed.mesh, {});
  const Certificate certificate = certify(simplified);
  out.volume_before = watertight.certificate.volume;
  if (certificate.passed() || !watertight.certificate.passed()) {
    watertight.mesh = std::move(simplified);
    watertight.certificate = certificate;
    out.watertight = std::move(closed);
  }
  out.volume_after = watertight.certificate.volume;
  return out;
}

Json simplification_to_json(const std::optional<Simplification>& done, const Frame& frame) {
  if (!done) return nullptr;
  const double volume_unit = std::pow(frame.scale, 3);
  return {{"max_error", done->options.max_error * frame.scale},
          {"max_error_inferred", done->options.max_error_inferred * frame.scale},
          {"max_color_error", done->options.max_color_error},
          {"units", frame.unit_name()},
          {"open_surface", result_to_json(done->open_surface, frame)},
          {"watertight", done->watertight ? result_to_json(*done->watertight, frame) : Json()},
          {"volume_before", done->volume_before * volume_unit},
          {"volume_after", done->volume_after * volume_unit}};
}

}  // namespace cgs
