// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/web_splats.h"

#include <nlohmann/json.hpp>

#include "io/splat_glb.h"
#include "io/spz.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"

namespace cgs {

using Json = nlohmann::ordered_json;

Json write_web_splats(const std::filesystem::path& folder, const Model& model) {
  const Frame& frame = model.scene.frame;
  const Eigen::Matrix3d y_up = y_up_from(model.scene.frame.up);
  const size_t glb_bytes =
      write_splat_glb(folder / "splats.glb", model.gaussians, frame, {.y_up = y_up});
  Json out = {{"splats.glb", {{"bytes", glb_bytes}}}};
  try {
    const SpzReport spz = write_spz(folder / "splats.spz", model.gaussians, frame);
    out["splats.spz"] = {{"bytes", spz.bytes},
                         {"fractional_bits", spz.fractional_bits},
                         {"clamped_splats", spz.clamped}};
  } catch (const InvalidInput& error) {
    out["left_out"] = {{"splats.spz", error.what()}};
  }
  return out;
}

}  // namespace cgs
