// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/fusion.h"

#include <nlohmann/json.hpp>

namespace cgs {

using Json = nlohmann::ordered_json;

std::map<std::string, EstimatedSurface> estimated_surfaces() {
  return {{"keep", EstimatedSurface::Keep},
          {"fill-only", EstimatedSurface::FillOnly},
          {"drop", EstimatedSurface::Drop}};
}

Json fusion_to_json(const TsdfReport& report, const Frame& frame) {
  const auto corner = [&](const Eigen::Vector3d& p) -> Json {
    const Eigen::Vector3d q = frame.file_from_internal(p);
    return {q.x(), q.y(), q.z()};
  };
  return {{"voxel_size", report.voxel_size * frame.scale},
          {"units", frame.unit_name()},
          {"bounds", {corner(report.bounds.min()), corner(report.bounds.max())}},
          {"voxels",
           {{"free", report.free},
            {"occupied", report.occupied},
            {"estimated", report.estimated},
            {"never_seen_hidden", report.hidden},
            {"never_seen_outside", report.unseen},
            {"conflicts", report.conflicts},
            {"carved", report.carved}}},
          {"predicted_bytes", report.predicted_bytes},
          {"actual_bytes", report.actual_bytes}};
}

}  // namespace cgs
