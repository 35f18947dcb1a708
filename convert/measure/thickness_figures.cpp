// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/thickness_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/meshes/mesh_ply.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

Json part_json(const ThicknessPart& part, double unit) {
  if (part.share == 0) return nullptr;
  return {{"share", part.share},
          {"min", part.min * unit},
          {"p05", part.p05 * unit},
          {"median", part.median * unit},
          {"mean", part.mean * unit},
          {"p95", part.p95 * unit},
          {"max", part.max * unit}};
}

/// What lies between the 5th and the 95th percentile.
struct ThicknessRange {
  float low = 0;
  float high = 0;
};

ThicknessRange range_of(std::vector<float> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](float v) { return std::isnan(v); }),
               values.end());
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values[(values.size() - 1) * 5 / 100], values[(values.size() - 1) * 95 / 100]};
}

Eigen::Vector3f color_of(float value, const ThicknessRange& range) {
  if (std::isnan(value)) return Eigen::Vector3f::Constant(0.5f);
  const Eigen::Vector3f thin(0.62f, 0.0f, 0.15f);
  const Eigen::Vector3f thick(1.0f, 0.97f, 0.72f);
  const float width = range.high - range.low;
  const float t = width > 0 ? std::clamp((value - range.low) / width, 0.0f, 1.0f) : 0.5f;
  return thin + t * (thick - thin);
}

}  // namespace

Json thickness_json(const ThicknessSummary& summary, const FigureUnit& unit) {
  return {{"unit", unit.name},
          {"samples", summary.samples},
          {"without_far_side", summary.without_far_side},
          {"seen", part_json(summary.seen, unit.length)},
          {"unseen", part_json(summary.unseen, unit.length)}};
}

std::string thickness_text(const ThicknessPart& part, const FigureUnit& unit) {
  if (part.share == 0) return "none";
  std::array<char, 240> text{};
  std::snprintf(text.data(),
                text.size(),
                "median %.5g %s, 5 %% below %.5g and 5 %% above %.5g, %.5g to %.5g (%.1f %% of the "
                "surface)",
                part.median * unit.length,
                unit.name.c_str(),
                part.p05 * unit.length,
                part.p95 * unit.length,
                part.min * unit.length,
                part.max * unit.length,
                100 * part.share);
  return text.data();
}

void write_thickness_ply(const std::filesystem::path& path,
                         const MeasurableMesh& mesh,
                         const VertexThickness& thickness) {
  TriangleMesh out = mesh.mesh;
  const ThicknessRange range = range_of(thickness.value);
  VertexScalar value{"scalar_thickness", {}};
  VertexScalar unseen{"scalar_thickness_unseen", {}};
  out.colors.clear();
  for (size_t v = 0; v < thickness.value.size(); ++v) {
    const float t = thickness.value[v];
    out.colors.push_back(color_of(t, range));
    value.values.push_back(static_cast<float>(double(t) * mesh.frame.scale));
    unseen.values.push_back(static_cast<float>(thickness.is_unseen[v]));
  }
  write_mesh_ply(path, out, mesh.frame, {value, unseen});
}

}  // namespace cgs
