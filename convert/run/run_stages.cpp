// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/run_stages.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "convert/files/volume_file.h"
#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/model/simplification.h"
#include "convert/model/texture.h"
#include "convert/run/asset.h"
#include "convert/run/deviation_ledger.h"
#include "convert/run/written_surface.h"
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

// What simplification for asset.glb and its compression move, told by the file itself.
Json asset_deviations(const Model& model,
                      const TriangleMesh& mesh,
                      const std::filesystem::path& asset) {
  const Frame& frame = model.scene.frame;
  DeviationLedger ledger(measured_points(model, DeviationLedger::kSamples));
  ledger.go_on_from("watertight.ply", mesh);
  ledger.add("asset.glb", read_mesh_file(asset, frame).content.mesh);
  return ledger.json(frame);
}

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

/// The two meshes of a volume.
struct Surfaces {
  TriangleMesh open;
  WatertightResult closed;
};

/// What became of them on disk, for the report.
struct WrittenSurfaces {
  Surfaces surfaces;
  Json simplification;
  Json files;
  Json promise;  ///< null without one
};

WrittenSurfaces write_surfaces(Surfaces surfaces,
                               const std::optional<SimplifyOptions>& options,
                               const Scene& scene,
                               const std::filesystem::path& folder,
                               const Progress& progress) {
  WrittenSurfaces out{std::move(surfaces), {}, {}, {}};
  TriangleMesh& open = out.surfaces.open;
  WatertightResult& closed = out.surfaces.closed;
  out.simplification = simplify_meshes(open, closed, options, scene.frame, progress);
  out.files = write_mesh_files(folder, open, closed.mesh, scene.frame);
  return out;
}

/// What the mesh files are once they are read again.
struct FileDeviations {
  std::map<std::string, double> largest;  ///< Distance from what was fused [internal units].
  std::vector<std::string> too_large;     ///< Files that are above what is read of their format.
};

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
  for (const Json& file : written.files["files"]) {
    const auto name = file.get<std::string>();
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

std::string words_for(const FileDeviations& deviations,
                      double promise,
                      const KnownArea& known,
                      const Frame& frame) {
  std::string out;
  for (const auto& [file, deviation] : deviations.largest) {
    out += (out.empty() ? "" : ", ") + file + " is at most " + format_length(deviation, frame);
  }
  out += " off the fused surface, " + format_length(promise, frame) + " were asked for. ";
  for (const std::string& file : deviations.too_large) {
    out += file + " was not read again because of its size. ";
  }
  return out +
         "That is the conversion; what the photographs tell is another matter: "
         "of the surface they show, " +
         number(100 * known.share(), "%.1f") + " % is known to " + format_length(promise, frame) +
         " (one standard deviation)";
}

// Simplifies less and less until what was written, read again, lies within the promise.
WrittenSurfaces write_surfaces_within(const Surfaces& fused,
                                      double promise,
                                      const Scene& scene,
                                      const std::filesystem::path& folder,
                                      const Progress& progress) {
  const Frame& frame = scene.frame;
  Json files;
  for (const double share : {0.7, 0.35, 0.0}) {
    std::optional<SimplifyOptions> options;
    if (share > 0) options = SimplifyOptions{.max_error = share * promise};
    WrittenSurfaces out = write_surfaces(fused, options, scene, folder, progress);
    files = out.files["files"];
    const FileDeviations deviations = deviations_of_files(fused, out, scene, folder);
    double worst = 0;
    for (const auto& [file, deviation] : deviations.largest) worst = std::max(worst, deviation);
    // Twice the room: other samples of the same surface may lie somewhat farther off.
    if (worst > (1 - 2 * kRoomForRounding) * promise) continue;
    const KnownArea known = known_within(fused.closed.mesh, promise);
    const double area_unit = frame.scale * frame.scale;
    out.promise = {{"promised", promise * frame.scale},
                   {"units", frame.unit_name()},
                   {"files", Json::object()},
                   {"not_read_again", deviations.too_large},
                   {"area_seen", known.seen * area_unit},
                   {"area_known_as_well", known.within * area_unit},
                   {"words", words_for(deviations, promise, known, frame)}};
    for (const auto& [file, deviation] : deviations.largest) {
      out.promise["files"][file] = deviation * frame.scale;
    }
    return out;
  }
  for (const Json& file : files) {
    std::filesystem::remove(folder / file.get<std::string>());  // none of what was asked for
  }
  throw NumericalError("--max-error: the files hold no coordinates as fine as " +
                       format_length(promise, frame));
}

// The OBJ is written from the mesh that was held against the promise before; its decimals may not
// take up what that left.
void require_obj_in_place(const RunRequest& request, const TriangleMesh& mesh, const Frame& frame) {
  const double moved = vertex_moves(request.output / "mesh/watertight.obj", mesh, frame);
  if (moved <= kRoomForRounding * parse_length(request.max_error, frame)) return;
  throw NumericalError("--max-error: watertight.obj was rounded by " + format_length(moved, frame));
}

// What asset.glb may go off the watertight mesh [internal units]: as much as that may go off the
// fused surface, where nothing was promised of both.
double as_much_again(const Json& simplification, const RunRequest& request, const Frame& frame) {
  if (simplification.is_null() || !request.max_error.empty()) return 0;
  return simplification.at("max_error").get<double>() / frame.scale;
}

}  // namespace

Json write_meshes(const Model& model, const RunRequest& request, const Progress& progress) {
  const Scene& scene = model.scene;
  const Frame& frame = scene.frame;
  const double promise = request.max_error.empty() ? 0 : parse_length(request.max_error, frame);
  FusedVolume fused =
      fuse_model(model,
                 {request.voxel_size, request.estimated, request.memory_limit, promise},
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
  if (!written.simplification.is_null()) ledger.add("simplified", closed.mesh);
  write_mesh_pictures(scene, closed.mesh, folder);
  report(progress, 1);
  return {{"fusion", fusion_to_json(fused.report, frame)},
          {"method", closed.method},
          {"certificate", certificate_to_json(closed.certificate, closed.mesh, frame)},
          {"simplification", written.simplification},
          {"promise", written.promise},
          {"deviations", ledger.json(frame)},
          {"open_surface_faces", written.surfaces.open.faces.size()},
          {"output", written.files}};
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
                  const Json& description,
                  const Json& mesh_report,
                  const Progress& progress) {
  report(progress, 0);
  make_output_folder(request.output / "web");
  Json texture_report;
  const PhotoTexture texture = texture_from_photographs(model.scene, mesh, texture_report);
  report(progress, 0.3);
  write_obj(request.output / "mesh/watertight.obj", mesh, texture, model.scene.frame);
  if (!request.max_error.empty()) require_obj_in_place(request, mesh, model.scene.frame);
  const double simplify =
      as_much_again(mesh_report.at("simplification"), request, model.scene.frame);
  const Json summary = {{"model", description}, {"certificate", mesh_report.at("certificate")}};
  const WrittenAsset written =
      write_asset(model, {mesh, texture, simplify, summary}, request, part_of(progress, 0.4, 0.9));
  Json out = {{"texture", texture_report},
              {"deviations", asset_deviations(model, mesh, request.output / "web/asset.glb")},
              {"asset.glb", written.asset}};
  if (request.lods > 0) out["levels"] = written.levels;
  if (texture_report.contains("left_out")) {
    out["warnings"] = {"no photographs on the meshes: " +
                       texture_report["left_out"].get<std::string>()};
  }
  return out;
}

}  // namespace cgs
