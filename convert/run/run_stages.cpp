// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_stages.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/files/volume_file.h"
#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/model/texture_atlas.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/images/png.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "io/meshes/obj.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/pictures/preview.h"
#include "meshing/surface/isosurface.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Nothing to compare is left to the writers of meshes, which say so in words for people.
DeviationLedger fusion_ledger(const Model& model,
                              const Volume& volume,
                              const TriangleMesh& open_surface,
                              const TriangleMesh& watertight) {
  DeviationLedger ledger(measured_points(model, DeviationLedger::kSamples));
  ledger.add("volume", volume);
  if (!open_surface.faces.empty()) ledger.add("open surface", open_surface);
  if (!watertight.faces.empty()) ledger.add("watertight mesh", watertight);
  return ledger;
}

DeviationStep asset_deviation(const Model& model,
                              const TriangleMesh& mesh,
                              const std::filesystem::path& asset) {
  DeviationLedger ledger(measured_points(model, DeviationLedger::kSamples));
  ledger.go_on_from("watertight.ply", mesh);
  ledger.add("asset.glb", read_mesh_file(asset, model.scene.frame).content.mesh);
  return ledger.steps().front();
}

// Two pictures of the mesh for the report: as the middle input camera sees it, and from the side.
void write_mesh_pictures(const Scene& scene,
                         const TriangleMesh& mesh,
                         const std::filesystem::path& folder) {
  const Camera& reference =
      scene.views[static_cast<size_t>(scene.input[scene.input.size() / 2])].camera;
  constexpr double kSide = 0.6;       // [rad]
  constexpr double kFromAbove = 0.3;  // [rad]
  const Camera side = turned_camera(mesh, reference, kSide, kFromAbove);
  write_png(folder / "front.png", preview(mesh, reference, {}));
  write_png(folder / "side.png", preview(mesh, side, {}));
  write_png(folder / "front.provenance.png", preview(mesh, reference, {.by_provenance = true}));
  write_png(folder / "side.provenance.png", preview(mesh, side, {.by_provenance = true}));
}

/// The two meshes of a volume.
struct Surfaces {
  TriangleMesh open;
  WatertightResult closed;
};

/// What became of them on disk.
struct WrittenSurfaces {
  Surfaces surfaces;
  std::optional<Simplification> simplification;
  MeshFiles files;
  std::optional<MeshPromise> promise;
};

WrittenSurfaces write_surfaces(Surfaces surfaces,
                               const std::optional<SimplifyOptions>& options,
                               const Scene& scene,
                               const std::filesystem::path& folder,
                               const Progress& progress) {
  WrittenSurfaces out{std::move(surfaces), {}, {}, {}};
  TriangleMesh& open = out.surfaces.open;
  WatertightResult& closed = out.surfaces.closed;
  out.simplification = simplify_meshes(open, closed, options, progress);
  out.files = write_mesh_files(folder, open, closed.mesh, scene.frame);
  return out;
}

FileDeviations deviations_of_files(const Surfaces& fused,
                                   const WrittenSurfaces& written,
                                   const Scene& scene,
                                   const std::filesystem::path& folder) {
  const Frame& frame = scene.frame;
  FileDeviations out;
  if (!fused.open.faces.empty()) {
    const TriangleMesh read = read_mesh_ply(folder / "surface.ply", frame).mesh;
    out.largest["surface.ply"] = surface_deviation(read, fused.open).max();
  }
  const TriangleMesh read = read_mesh_ply(folder / "watertight.ply", frame).mesh;
  const double of_mesh = surface_deviation(read, fused.closed.mesh).max();
  out.largest["watertight.ply"] = of_mesh;
  for (const std::string& name : written.files.written) {
    if (name != "watertight.stl" && name != "watertight.3mf") continue;
    // The same mesh: it is as far off, and what its vertices were rounded by.
    try {
      out.largest[name] = of_mesh + vertex_moves(folder / name, read, frame);
    } catch (const LimitError&) {
      if (name != "watertight.3mf") throw;  // its text is many times as long as the others
      out.too_large.push_back(name);
    }
  }
  return out;
}

// Simplifies less and less until what was written, read again, lies within the promise.
WrittenSurfaces write_surfaces_within(const Surfaces& fused,
                                      double promise,
                                      const Scene& scene,
                                      const std::filesystem::path& folder,
                                      const Progress& progress) {
  const Frame& frame = scene.frame;
  MeshFiles files;
  for (const double share : {0.7, 0.35, 0.0}) {
    std::optional<SimplifyOptions> options;
    if (share > 0) options = SimplifyOptions{.max_error = share * promise};
    WrittenSurfaces out = write_surfaces(fused, options, scene, folder, progress);
    files = out.files;
    const FileDeviations deviations = deviations_of_files(fused, out, scene, folder);
    double worst = 0;
    for (const auto& [file, deviation] : deviations.largest) worst = std::max(worst, deviation);
    // Twice the room: other samples of the same surface may lie somewhat farther off.
    if (worst > (1 - 2 * kRoomForRounding) * promise) continue;
    out.promise = {promise, deviations, known_within(fused.closed.mesh, promise)};
    return out;
  }
  for (const std::string& file : files.written) {
    std::filesystem::remove(folder / file);  // none of what was asked for
  }
  throw NumericalError("--max-error: the files hold no coordinates as fine as " +
                       format_length(promise, frame));
}

// The OBJ is written from the mesh that was held against the promise before; its decimals may not
// take up what that left.
void require_obj_in_place(const RunRequest& request, const TriangleMesh& mesh, const Frame& frame) {
  const std::filesystem::path file = request.output / "mesh/watertight.obj";
  const double moved = vertex_moves(file, mesh, frame);
  if (moved <= kRoomForRounding * parse_length(request.max_error, frame)) return;
  std::filesystem::remove(file);
  throw NumericalError("--max-error: watertight.obj was rounded by " + format_length(moved, frame));
}

std::string words_for(const MeshPromise& promise, const Frame& frame) {
  const std::string length = format_length(promise.length, frame);
  std::string out;
  for (const auto& [file, deviation] : promise.files.largest) {
    out += (out.empty() ? "" : ", ") + file + " is at most " + format_length(deviation, frame);
  }
  out += " off the fused surface, " + length + " were asked for. ";
  for (const std::string& file : promise.files.too_large) {
    out += file + " was not read again because of its size. ";
  }
  return out +
         "That is the conversion; what the photographs tell is another matter: "
         "of the surface they show, " +
         number(100 * promise.known.share(), "%.1f") + " % is known to " + length +
         " (one standard deviation)";
}

Json promise_to_json(const MeshPromise& promise, const Frame& frame) {
  const double area_unit = frame.scale * frame.scale;
  Json files = Json::object();
  for (const auto& [file, deviation] : promise.files.largest) files[file] = deviation * frame.scale;
  return {{"promised", promise.length * frame.scale},
          {"units", frame.unit_name()},
          {"files", files},
          {"not_read_again", promise.files.too_large},
          {"area_seen", promise.known.seen * area_unit},
          {"area_known_as_well", promise.known.within * area_unit},
          {"words", words_for(promise, frame)}};
}

}  // namespace

Json meshes_to_json(const MeshesReport& report, const Frame& frame) {
  return {{"fusion", fusion_to_json(report.fusion, frame)},
          {"method", report.method},
          {"certificate", report.certificate},
          {"simplification", simplification_to_json(report.simplification, frame)},
          {"promise", report.promise ? promise_to_json(*report.promise, frame) : Json()},
          {"deviations", deviations_to_json(report.deviations, frame)},
          {"open_surface_faces", report.open_surface_faces},
          {"output", mesh_files_to_json(report.files)}};
}

MeshFindings mesh_findings(const Json& report, const Frame& frame) {
  MeshFindings out{0, report.at("certificate")};
  const Json& simplification = report.at("simplification");
  if (simplification.is_null()) return out;
  out.simplified = simplification.at("max_error").get<double>() / frame.scale;
  return out;
}

MeshesReport write_meshes(const Model& model, const RunRequest& request, const Progress& progress) {
  const Scene& scene = model.scene;
  const Frame& frame = scene.frame;
  const double promise = length_or_zero(request.max_error, frame);
  FusedVolume fused = fuse_model(model,
                                 {length_or_zero(request.voxel_size, frame),
                                  request.estimated,
                                  memory_budget(request.memory_limit),
                                  promise,
                                  request.max_voxels},
                                 part_of(progress, 0, 0.3));
  Surfaces surfaces;
  surfaces.open = open_surface(fused.volume, {});
  WatertightOptions closing;
  closing.memory_limit = memory_budget(request.memory_limit);
  surfaces.closed = watertight_surface(fused.volume, closing, part_of(progress, 0.35, 0.6));
  DeviationLedger ledger = fusion_ledger(model, fused.volume, surfaces.open, surfaces.closed.mesh);
  const std::filesystem::path folder = request.output / "mesh";
  const Progress rest = part_of(progress, 0.6, 0.9);
  const WrittenSurfaces written =
      promise > 0
          ? write_surfaces_within(surfaces, promise, scene, folder, rest)
          : write_surfaces(std::move(surfaces),
                           simplify_options(request.simplify, fused.volume.voxel_size, frame),
                           scene,
                           folder,
                           rest);
  write_volume(request.output / "volume.vdb", fused.volume, frame);
  const WatertightResult& closed = written.surfaces.closed;
  if (written.simplification) ledger.add("simplified", closed.mesh);
  write_mesh_pictures(scene, closed.mesh, folder);
  report(progress, 1);
  return {fused.report,
          closed.method,
          certificate_to_json(closed.certificate, closed.mesh, frame),
          written.simplification,
          written.promise,
          ledger.steps(),
          written.surfaces.open.faces.size(),
          written.files};
}

TriangleMesh read_watertight(const std::filesystem::path& output, const Frame& frame) {
  const std::filesystem::path path = output / "mesh/watertight.ply";
  TriangleMesh mesh = read_mesh_ply(path, frame).mesh;
  if (mesh.faces.empty()) throw BadInput(Defect::Empty, path, "has no faces");
  return mesh;
}

AssetsReport write_assets(const Model& model,
                          const TriangleMesh& mesh,
                          const RunRequest& request,
                          const std::string& description,
                          const MeshFindings& findings,
                          const Progress& progress) {
  report(progress, 0);
  make_output_folder(request.output / "web");
  auto [texture, texture_report] = texture_from_photographs(model.scene, model.priors, mesh);
  report(progress, 0.3);
  const std::optional<double> texel = atlas_texel(request, model.scene.frame);
  std::optional<PackedTexture> atlas;
  if (texel && texture.shows_any()) {
    atlas = packed_texture(mesh, texture, *texel);
    texture_report.atlas = {.size = atlas->texture.atlas->size,
                            .charts = atlas->texture.photographs.size(),
                            .texel = atlas->texel * model.scene.frame.scale};
  }
  write_obj(request.output / "mesh/watertight.obj",
            mesh,
            atlas ? atlas->texture : texture,
            model.scene.frame);
  if (!request.max_error.empty()) require_obj_in_place(request, mesh, model.scene.frame);
  // As much as the watertight mesh may go off the fused surface, where nothing was promised of
  // both.
  const double simplify = request.max_error.empty() ? findings.simplified : 0;
  WrittenAsset written = write_asset(model,
                                     {mesh, texture, simplify, description, findings.certificate},
                                     request,
                                     part_of(progress, 0.4, 0.9));
  return {texture_report,
          asset_deviation(model, mesh, request.output / "web/asset.glb"),
          std::move(written)};
}

Json assets_to_json(const AssetsReport& report, const Frame& frame) {
  Json out = {{"texture", texture_to_json(report.texture, frame)},
              {"deviations", deviations_to_json({report.deviation}, frame)},
              {"asset.glb", asset_to_json(report.asset, frame)}};
  if (!report.asset.levels.empty()) out["levels"] = levels_to_json(report.asset, frame);
  if (!report.texture.left_out.empty()) {
    out["warnings"] = {"no photographs on the meshes: " + report.texture.left_out};
  }
  return out;
}

}  // namespace cgs
