// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run_stages.h"

#include <nlohmann/json.hpp>

#include "convert/length.h"
#include "convert/mesh_files.h"
#include "convert/simplification.h"
#include "convert/texture.h"
#include "convert/volume_file.h"
#include "convert/web_splats.h"
#include "io/atomic_file.h"
#include "io/gltf.h"
#include "io/mesh_ply.h"
#include "io/obj.h"
#include "io/png.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/isosurface.h"
#include "meshing/preview.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Two pictures of the mesh for the report: as the middle input camera sees it, and from the side.
void write_mesh_pictures(const Scene& scene,
                         const TriangleMesh& mesh,
                         const std::filesystem::path& folder) {
  const Camera& reference =
      scene.views[static_cast<size_t>(scene.input[scene.input.size() / 2])].camera;
  constexpr double kSide = 0.6;       // [rad]
  constexpr double kFromAbove = 0.3;  // [rad]
  const Camera front = overview_camera(mesh, reference, 0, 0);
  const Camera side = overview_camera(mesh, reference, kSide, kFromAbove);
  write_png(folder / "front.png", preview(mesh, front, {}));
  write_png(folder / "side.png", preview(mesh, side, {}));
  write_png(folder / "front.provenance.png", preview(mesh, front, {.by_provenance = true}));
  write_png(folder / "side.provenance.png", preview(mesh, side, {.by_provenance = true}));
}

}  // namespace

Json write_meshes(const Model& model, const RunRequest& request, const Progress& progress) {
  const Frame& frame = model.scene.frame;
  FusedVolume fused =
      fuse_model(model, request.voxel_size, request.memory_limit, part_of(progress, 0, 0.3));
  TriangleMesh open = open_surface(fused.volume, {});
  WatertightResult closed = watertight_surface(fused.volume, {}, part_of(progress, 0.35, 0.6));
  const Json simplification =
      simplify_meshes(open,
                      closed,
                      simplify_options(request.simplify, fused.volume.voxel_size, frame),
                      frame,
                      part_of(progress, 0.6, 0.9));
  write_volume(request.output / "volume.vdb", fused.volume, frame);
  const std::filesystem::path folder = request.output / "mesh";
  const Json files = write_mesh_files(folder, open, closed.mesh, frame, world_up(model.scene));
  write_mesh_pictures(model.scene, closed.mesh, folder);
  report(progress, 1);
  return {{"fusion", fusion_to_json(fused.report, frame)},
          {"method", closed.method},
          {"certificate", certificate_to_json(closed.certificate, closed.mesh, frame)},
          {"simplification", simplification},
          {"open_surface_faces", open.faces.size()},
          {"output", files}};
}

TriangleMesh read_watertight(const std::filesystem::path& output, const Frame& frame) {
  const std::filesystem::path path = output / "mesh/watertight.ply";
  TriangleMesh mesh = read_mesh_ply(path, frame).mesh;
  if (mesh.faces.empty()) throw BadInput(Defect::Empty, path, "has no faces");
  return mesh;
}

Json write_assets(const Model& model,
                  const TriangleMesh& mesh,
                  const RunRequest& request,
                  const Json& summary,
                  const Progress& progress) {
  const Frame& frame = model.scene.frame;
  report(progress, 0);
  GlbOptions options;
  options.y_up = y_up_from(world_up(model.scene));
  if (!request.max_error.empty()) {
    options.max_error = parse_length(request.max_error, frame) * frame.scale;
  }
  options.summary_json = summary.dump();
  make_output_folder(request.output / "web");
  Json texture_report;
  const PhotoTexture texture = texture_from_photographs(model.scene, mesh, texture_report);
  report(progress, 0.5);
  write_obj(request.output / "mesh/watertight.obj", mesh, texture, frame);
  const GlbReport glb = write_glb(request.output / "web/asset.glb", mesh, texture, frame, options);
  return {{"texture", texture_report},
          {"splats", write_web_splats(request.output / "web", model)},
          {"asset.glb",
           {{"bytes", glb.bytes},
            {"texture_bytes", glb.texture_bytes},
            {"textured_triangles", glb.textured_triangles},
            {"measured_texture_error", glb.measured_texture_error},
            {"position_bits", glb.position_bits},
            {"measured_max_error", glb.measured_max_error},
            {"units", frame.unit_name()}}}};
}

}  // namespace cgs
