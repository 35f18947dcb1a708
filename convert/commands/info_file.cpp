// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/info_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <openvdb/tools/Count.h>

#include "convert/files/mesh_files.h"
#include "convert/files/volume_file.h"
#include "convert/measure/measured_file.h"
#include "convert/model/model.h"
#include "convert/run/run_record.h"
#include "convert/splats/splat_files.h"
#include "convert/text/frame_json.h"
#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "io/bytes/scene_path.h"
#include "io/images/exr.h"
#include "io/splats/splat_reader.h"
#include "io/volumes/vdb.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json vec3d_to_json(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

template <typename Print>
Json print_info(Json info, bool as_json, Print print) {
  if (as_json) {
    print_report(info);
  } else {
    print(info);
  }
  return info;
}

// --- meshes and splats ----------------------------------------------------------------------

Json mesh_json(const MeasurableFile& file, const Json& certificate) {
  const MeasurableMesh& mesh = file.content;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : mesh.points) box.extend(mesh.file_from_internal(p));
  return {{"kind", mesh.mesh.faces.empty() ? "point cloud" : "mesh"},
          {"counts", {{"vertices", mesh.points.size()}, {"faces", mesh.mesh.faces.size()}}},
          {"bounds", {{"min", vector_to_json(box.min())}, {"max", vector_to_json(box.max())}}},
          {"units", mesh.frame.unit_name()},
          {"scale_source", scale_source_name(mesh.frame.scale_source)},
          {"file_origin", vector_to_json(mesh.file_origin)},
          {"up", mesh.frame.knows_up() ? vector_to_json(mesh.frame.up) : Json(nullptr)},
          {"states",
           {{"provenance", mesh.states_provenance()},
            {"sigma", mesh.states_sigma()},
            {"colors", !mesh.mesh.colors.empty()}}},
          {"certificate", certificate},
          {"warnings", file.warnings}};
}

void print_mesh(const Json& info, const Certificate& certificate) {
  const Json& box = info["bounds"];
  const auto source = info["scale_source"].get<std::string>();
  const bool is_known = info["units"] != Frame().unit_name();
  const bool has_source = source != scale_source_name(ScaleSource::Unknown);
  std::printf(
      "%s: %zu vertices, %zu faces, unit %s (%s)\n",
      info["kind"].get<std::string>().c_str(),
      info["counts"]["vertices"].get<size_t>(),
      info["counts"]["faces"].get<size_t>(),
      info["units"].get<std::string>().c_str(),
      is_known && !has_source ? "nothing says how that is known" : ("scale " + source).c_str());
  std::printf("bounds: %s ... %s\n", box["min"].dump().c_str(), box["max"].dump().c_str());
  if (info["file_origin"] != Json{0.0, 0.0, 0.0}) {
    std::printf("origin: add %s to coordinates\n", info["file_origin"].dump().c_str());
  }
  if (!info["up"].is_null()) std::printf("up: %s\n", info["up"].dump().c_str());
  std::printf("provenance %s, sigma %s\n",
              info["states"]["provenance"].get<bool>() ? "stated" : "not stated",
              info["states"]["sigma"].get<bool>() ? "stated" : "not stated");
  if (!info["certificate"].is_null()) {
    const auto volume = info["certificate"]["volume"].get<double>();
    std::printf("%s: %s, Euler number %ld, smallest angle %.3g degrees%s\n",
                certificate.passed() ? "certified watertight" : "NOT watertight",
                certificate_line(certificate).c_str(),
                certificate.euler_number,
                certificate.smallest_angle * 180 / M_PI,
                certificate.closed ? (", volume " + number(volume, "%.6g")).c_str() : "");
  }
  print_warnings(info);
}

void print_splats(const Json& info) {
  const Json& counts = info["counts"];
  std::printf("%s: %zu splats of %zu in the file, harmonics of degree %d\nunits: %s\n",
              info["format"].get<std::string>().c_str(),
              counts["splats"].get<size_t>(),
              counts["in_file"].get<size_t>(),
              counts["sh_degree"].get<int>(),
              info["units"].get<std::string>().c_str());
  for (const char* corner : {"min", "max"}) {
    const Json& p = info["bounds"][corner];
    std::printf("%s %12.6g %12.6g %12.6g\n",
                corner,
                p[0].get<double>(),
                p[1].get<double>(),
                p[2].get<double>());
  }
  std::printf("fill ratio %.3g\n", info["findings"]["fill_ratio"].get<double>());
  if (!info["evidence"].is_null()) {
    std::printf("evidence: %s\n", one_line(info["evidence"].get<std::string>()).c_str());
  }
  if (!info["provenance"].is_null()) {
    std::printf("%s\n", info["provenance"]["words"].get<std::string>().c_str());
  }
  if (!info["synthetic"].is_null()) {
    std::printf("%s\n", info["synthetic"]["words"].get<std::string>().c_str());
  }
  print_warnings(info);
}

Json tell_mesh(const fs::path& path, bool as_json) {
  MeasurableFile file = read_mesh_file(path);
  const TriangleMesh& mesh = file.content.mesh;
  Certificate certificate;
  Json proved = nullptr;
  if (!mesh.faces.empty()) {
    certificate = certify(mesh);
    proved = certificate_to_json(certificate, mesh, file.content.frame);
    const std::string seams = certificate.closed ? "" : seams_text(mesh);
    if (!seams.empty()) file.warnings.push_back(seams);
  }
  return print_info(
      mesh_json(file, proved), as_json, [&](const Json& info) { print_mesh(info, certificate); });
}

Json tell_splats(const fs::path& path, bool as_json) {
  return print_info(splat_file_to_json(read_splats(path)), as_json, print_splats);
}

// --- volumes --------------------------------------------------------------------------------

// Smallest and largest of the active values, of which there must be one; null unless numbers.
Json range_json(const openvdb::GridBase& grid) {
  Json out = nullptr;
  using Numbers = openvdb::
      TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid>;
  grid.apply<Numbers>([&](const auto& numbers) {
    const auto range = openvdb::tools::minMax(numbers.tree());
    out = {range.min(), range.max()};
  });
  return out;
}

Json grid_json(const openvdb::GridBase& grid) {
  const openvdb::Index64 active = grid.activeVoxelCount();
  Json bounds = nullptr;
  Json range = nullptr;
  if (active > 0) {
    const openvdb::BBoxd box = grid.transform().indexToWorld(grid.evalActiveVoxelBoundingBox());
    bounds = {{"min", vec3d_to_json(box.min())}, {"max", vec3d_to_json(box.max())}};
    range = range_json(grid);
  }
  return {{"name", grid.getName()},
          {"values", grid.valueType()},
          {"class", openvdb::GridBase::gridClassToString(grid.getGridClass())},
          {"voxel_size", vec3d_to_json(grid.voxelSize())},
          {"active_voxels", active},
          {"bounds", bounds},
          {"range", range}};
}

Json volume_json(const fs::path& path) {
  const auto grids = read_vdb(path);
  const std::optional<VolumeStatement> stated = volume_statement(grids, path);
  Json rows = Json::array();
  for (const auto& grid : grids) rows.push_back(grid_json(*grid));
  return {{"kind", "volume"},
          {"units", stated ? stated->frame.unit_name() : "unknown"},
          {"fused_here", stated.has_value()},
          {"lengths_times", stated ? stated->stretch : 1},
          {"grids", rows}};
}

void print_volume(const Json& info) {
  const auto times = info["lengths_times"].get<double>();
  if (times != 1) std::printf("all places and lengths below are multiplied by %.0f\n", times);
  std::printf("volume: %zu grids, unit %s%s\n\n%-16s %-7s %-10s %12s %10s   %s\n",
              info["grids"].size(),
              info["units"].get<std::string>().c_str(),
              info["fused_here"].get<bool>() ? "" : ", not made by cgs",
              "grid",
              "values",
              "class",
              "active",
              "voxel",
              "range of active values");
  for (const Json& grid : info["grids"]) {
    std::printf("%-16s %-7s %-10s %12llu %10.4g",
                one_line(grid["name"].get<std::string>()).c_str(),
                grid["values"].get<std::string>().c_str(),
                grid["class"].get<std::string>().c_str(),
                grid["active_voxels"].get<unsigned long long>(),
                grid["voxel_size"][0].get<double>());
    const Json& range = grid["range"];
    if (!range.is_null()) {
      std::printf("   %.4g ... %.4g", range[0].get<double>(), range[1].get<double>());
    }
    std::printf("\n");
  }
}

// --- rasters --------------------------------------------------------------------------------

Json channel_json(const std::string& name, const std::vector<float>& values) {
  size_t finite = 0;
  double low = HUGE_VAL;
  double high = -HUGE_VAL;
  for (const float v : values) {
    if (!std::isfinite(v)) continue;
    ++finite;
    low = std::min<double>(low, v);
    high = std::max<double>(high, v);
  }
  return {{"name", name},
          {"finite", double(finite) / double(values.size())},
          {"range", finite == 0 ? Json() : Json({low, high})}};
}

Json raster_json(const ExrImage& image) {
  Json channels = Json::array();
  for (const auto& [name, values] : image.channels) channels.push_back(channel_json(name, values));
  return {{"kind", "raster"},
          {"width", image.width},
          {"height", image.height},
          {"channels", channels},
          {"attributes", image.text},
          {"camera_stated", image.world_to_camera.has_value()}};
}

void print_raster(const Json& info) {
  std::printf("raster: %d x %d pixels, %zu channels, camera %s\n",
              info["width"].get<int>(),
              info["height"].get<int>(),
              info["channels"].size(),
              info["camera_stated"].get<bool>() ? "stated" : "not stated");
  for (const Json& channel : info["channels"]) {
    std::printf("  %-16s", one_line(channel["name"].get<std::string>()).c_str());
    const Json& range = channel["range"];
    if (!range.is_null()) {
      std::printf(" %10.4g ... %-10.4g", range[0].get<double>(), range[1].get<double>());
    }
    const double finite = channel["finite"].get<double>();
    if (finite < 1) std::printf(" %.2g %% not finite", 100 * (1 - finite));
    std::printf("\n");
  }
  for (const auto& [key, value] : info["attributes"].items()) {
    std::printf("%s: %s\n", one_line(key).c_str(), one_line(value.get<std::string>()).c_str());
  }
}

// --- what run wrote -------------------------------------------------------------------------

Json run_json(const Json& record, const fs::path& path) {
  const auto asked = [&](const char* key) {
    const Json& request = record["request"];
    const bool is_text = request.is_object() && request.contains(key) && request[key].is_string();
    if (!is_text) throw BadInput(Defect::Schema, path, std::string("request states no ") + key);
    return request[key];
  };
  Json stages = Json::array();
  for (const auto& [name, stage] : record["stages"].items()) {
    stages.push_back(
        {{"name", name}, {"seconds", stage["seconds"]}, {"peak_memory", stage["peak_memory"]}});
  }
  const bool is_finished = record.contains("outputs");
  return {{"kind", "run"},
          {"scene", asked("scene")},
          {"views", asked("views")},
          {"finished", is_finished},
          {"files", is_finished ? record["outputs"].size() : 0},
          {"stages", stages}};
}

void print_run(const Json& info) {
  const std::string views = one_line(info["views"].get<std::string>());
  std::printf("%s of %s, %s %s\n",
              info["finished"].get<bool>() ? "finished run" : "run that is NOT finished",
              one_line(info["scene"].get<std::string>()).c_str(),
              views.empty() ? "all" : "views",
              views.empty() ? "views" : views.c_str());
  for (const Json& stage : info["stages"]) {
    std::printf("  %-12s %8.1f s %8.0f MiB\n",
                one_line(stage["name"].get<std::string>()).c_str(),
                stage["seconds"].get<double>(),
                stage["peak_memory"].get<double>() / (1 << 20));
  }
  if (info["finished"].get<bool>()) {
    std::printf("%zu files; report.html shows them, and cgs verify checks them\n",
                info["files"].get<size_t>());
  } else {
    std::printf("the command that began it goes on where it stopped\n");
  }
}

// Files that no mesh reader takes, and those of its kinds that hold splats.
bool holds_splats(const fs::path& path) { return !is_mesh_name(path) || is_splat_file(path); }

// What was painted into a model lies in a file of its own.
Json tell_model(const fs::path& folder, bool as_json) {
  Json info = splat_file_to_json(read_splats(folder / "gaussians.ply"));
  if (is_present(folder / kFillFile)) {
    info["synthetic"] = splat_file_to_json(read_splats(folder / kFillFile))["synthetic"];
  }
  return print_info(info, as_json, print_splats);
}

std::optional<Json> tell_folder(const fs::path& folder, bool as_json) {
  const fs::path path = folder / "run.json";
  const Json record = is_present(path) ? read_run_record(path) : Json();
  if (!record.is_null()) return print_info(run_json(record, path), as_json, print_run);
  return holds_model(folder) ? std::optional(tell_model(model_folder(folder), as_json))
                             : std::nullopt;
}

}  // namespace

void print_warnings(const Json& info) {
  for (const Json& text : info["warnings"]) {
    std::printf("warning: %s\n", one_line(text.get<std::string>()).c_str());
  }
}

std::optional<Json> print_file_info(const fs::path& path, bool as_json) {
  std::error_code none;
  if (fs::is_directory(path, none)) return tell_folder(path, as_json);
  const std::string extension = lower_extension(path);
  if (extension == ".vdb") return print_info(volume_json(path), as_json, print_volume);
  if (extension == ".exr") return print_info(raster_json(read_exr(path)), as_json, print_raster);
  if (fs::is_regular_file(path, none) && has_image_extension(path)) {
    throw BadInput(Defect::Unsupported,
                   path,
                   "is one picture; give the folder of the photographs, or a file of splats, a "
                   "mesh or a volume");
  }
  if (fs::is_regular_file(path, none) && holds_splats(path)) return tell_splats(path, as_json);
  if (is_mesh_name(path)) return tell_mesh(path, as_json);
  return std::nullopt;
}

}  // namespace cgs
