// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/stage.h"

namespace cgs {

const std::array<StageTraits, kStages>& stage_table() {
  constexpr double kMebi = 1 << 20;
  static const std::array<StageTraits, kStages> kTable = {
      {{Stage::Model,
        "model",
        "depth and Gaussians",
        {115 * kMebi, 930, 0, 0, 0},
        {"model/gaussians.ply", "model/cameras.json", "model/priors/<input>.exr"},
        {"model/training.json"}},
       {Stage::Scale, "scale", "scale", {}, {}, {"model/gaussians.ply", "model/cameras.json"}},
       {Stage::Views,
        "views",
        "views",
        {105 * kMebi, 160, 231, 0, 0},
        {"views/<view>.exr",
         "views/<view>.color.png",
         "views/<view>.depth.png",
         "views/<view>.normal.png",
         "views/<view>.hole.png"},
        {"views/*.restored.png", "views/*.transient.png"}},
       {Stage::Evaluation, "evaluation", "held-out views", {105 * kMebi, 160, 231, 0, 0}},
       {Stage::Splats,
        "splats",
        "splats for browsers",
        {124 * kMebi, 745, 0, 0, 0},
        {"web/splats.glb"},
        {"web/splats.spz", "web/surroundings/hole_*.png"}},
       {Stage::Mesh,
        "mesh",
        "volume and mesh",
        {160 * kMebi, 112, 0, 2000, 720},
        {"volume.vdb",
         "mesh/surface.ply",
         "mesh/watertight.ply",
         "mesh/front.png",
         "mesh/side.png",
         "mesh/front.provenance.png",
         "mesh/side.provenance.png"},
        {"mesh/watertight.stl", "mesh/watertight.3mf"}},
       {Stage::Web,
        "web",
        "textured assets",
        {124 * kMebi, 155, 0, 235, 1410},
        {"web/asset.glb", "mesh/watertight.obj", "mesh/watertight.mtl", "web/<level>"},
        // Pictures of the texture, levels of a run that wanted more of them.
        {"mesh/watertight.*.jpg", "web/asset.lod*.glb", "web/tileset.json"}},
       {Stage::Report,
        "report",
        "report",
        {150 * kMebi, 105, 0, 126, 0},
        {"report.html", "report.json"}}}};
  return kTable;
}

const StageTraits& traits(Stage stage) { return stage_table().at(static_cast<size_t>(stage)); }

}  // namespace cgs
