// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/files/mesh_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/bytes/significance.h"
#include "io/meshes/mesh_ply.h"
#include "io/meshes/obj.h"
#include "io/meshes/om.h"
#include "io/meshes/stl.h"
#include "io/meshes/threemf.h"
#include "io/meshes/threemf_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/edit/repair.h"

namespace cgs {

using Json = nlohmann::ordered_json;

Json certificate_to_json(const Certificate& certificate,
                         const TriangleMesh& mesh,
                         const Frame& frame) {
  const double area_unit = frame.scale * frame.scale;
  // What the mesh does not state is unknown, not nothing.
  const auto area_of = [&](double area) {
    return mesh.provenance.empty() ? Json() : Json(area * area_unit);
  };
  return {{"passed", certificate.passed()},
          {"closed", certificate.closed},
          {"edge_manifold", certificate.edge_manifold},
          {"vertex_manifold", certificate.vertex_manifold},
          {"oriented", certificate.oriented_outward},
          {"self_intersections", certificate.self_intersections},
          {"components", certificate.components},
          {"genus", certificate.genus},
          {"euler_number", certificate.euler_number},
          {"smallest_angle_degrees", certificate.smallest_angle * 180 / std::numbers::pi},
          {"volume", certificate.volume * area_unit * frame.scale},
          {"area_observed", area_of(certificate.observed_area)},
          {"area_single_view", area_of(certificate.single_view_area)},
          {"area_interpolated", area_of(certificate.interpolated_area)},
          {"area_estimated", area_of(certificate.estimated_area)},
          {"area_inferred", area_of(certificate.inferred_area)},
          {"area_virtual", area_of(certificate.virtual_area)},
          {"units", frame.unit_name()},
          {"vertices", mesh.vertices.size()},
          {"faces", mesh.faces.size()}};
}

namespace {

// What was written when the scale was known must not stand beside what comes now; a file of
// another program stays.
void remove_own(const std::filesystem::path& path) {
  const bool is_own = lower_extension(path) == ".stl" ? is_own_stl(path) : is_own_3mf(path);
  if (is_own) std::filesystem::remove(path);
}

}  // namespace

Json mesh_files_to_json(const MeshFiles& files) {
  Json left_out = Json::object();
  for (const auto& [name, why] : files.left_out) left_out[name] = why;
  return {{"files", files.written}, {"left_out", left_out}};
}

MeshFiles write_mesh_files(const std::filesystem::path& folder,
                           const TriangleMesh& open_surface,
                           const TriangleMesh& watertight,
                           const Frame& frame) {
  if (watertight.faces.empty()) {
    throw NumericalError(
        "no surface was found: the views agree on no depth; choose views that overlap more");
  }
  make_output_folder(folder);
  write_mesh_ply(folder / "surface.ply", open_surface, frame);
  write_mesh_ply(folder / "watertight.ply", watertight, frame);
  MeshFiles out{{"surface.ply", "watertight.ply"}, {}};
  for (const char* name : {"watertight.stl", "watertight.3mf"}) {
    if (!frame.has_metric_scale()) {
      out.left_out.emplace_back(
          name,
          "the scale of this scene is unknown and CAD files are in millimetres; --known-distance "
          "tells it, --assume-unit m says that one scene unit is a metre");
      remove_own(folder / name);
      continue;
    }
    const Eigen::Matrix3d z_up = z_up_from(frame.up);
    if (std::string(name) == "watertight.stl") {
      write_stl(folder / name, watertight, frame, z_up);
    } else {
      write_3mf(folder / name, watertight, frame, z_up);
    }
    out.written.emplace_back(name);
  }
  return out;
}

bool is_writable_mesh_name(const std::filesystem::path& path) {
  constexpr std::array<const char*, 6> kKnown = {".ply", ".obj", ".stl", ".om", ".3mf", ".glb"};
  return std::find(kKnown.begin(), kKnown.end(), lower_extension(path)) != kKnown.end();
}

bool is_turned_upright(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".stl" || extension == ".3mf" || extension == ".glb";
}

std::string assumed_up_text(const std::filesystem::path& from,
                            const std::filesystem::path& to,
                            const std::string& assumed) {
  const bool stays_printable = lower_extension(from) == ".stl" && lower_extension(to) != ".glb";
  if (assumed.empty() || !is_turned_upright(to) || stays_printable) return "";
  return assumed + "; --up says otherwise (--up 0 1 0 for y)";
}

void require_writable_as(const std::filesystem::path& path, const Frame& frame) {
  const std::string extension = lower_extension(path);
  if (extension != ".stl" && extension != ".3mf") return;
  require(frame.has_metric_scale(),
          "CAD files are in millimetres; say what a unit is with --assume-unit m (cm, mm, in, ft); "
          "the scale of this input must be known",
          "unknown");
}

std::string seams_text(const TriangleMesh& mesh) {
  constexpr double kMany = 0.01;
  const size_t repeated = repeated_vertices(mesh);
  if (double(repeated) <= kMany * double(mesh.vertices.size())) return "";
  return std::to_string(repeated) + " of " + std::to_string(mesh.vertices.size()) +
         " vertices lie where others do, so that faces that touch do not hang together: cgs filter "
         "--op repair joins them";
}

std::string moved_origin_text(const std::filesystem::path& path,
                              const Eigen::Vector3d& read,
                              const Eigen::Vector3d& written) {
  // Nodes of .glb state in double where they lie.
  if (read == written || lower_extension(path) == ".glb") return "";
  return "coordinates in " + printable(path) +
         " are from another origin, which the file states: floats would lose digits";
}

std::string glb_place_text(const std::filesystem::path& path,
                           const Frame& frame,
                           bool has_local_origin) {
  if (lower_extension(path) != ".glb") return "";
  const std::string name = printable(path.filename());
  if (has_local_origin) {
    std::array<char, 128> place{};
    std::snprintf(place.data(),
                  place.size(),
                  "%.15g, %.15g, %.15g",
                  frame.origin.x(),
                  frame.origin.y(),
                  frame.origin.z());
    return "(0, 0, 0) of " + name + " is " + place.data() +
           " of the input, as asset.extras.origin_in_world of the file states";
  }
  constexpr int kEnough = 14;  // binary digits; what readers warn of
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(frame.scale / 2);
  const Eigen::AlignedBox3d box(frame.origin - half, frame.origin + half);
  if (significant_bits(box, kFloatDigits) >= kEnough) return "";
  const double distance = frame.origin.norm() / frame.scale;
  return name + " lies " + format_length(distance, frame) +
         " from its (0, 0, 0): programs that place it in single precision are off by up to " +
         format_length(std::ldexp(distance, -kFloatDigits), frame) +
         "; --local-origin writes it about an origin near by";
}

std::string lost_in_file(const std::filesystem::path& path,
                         const TriangleMesh& mesh,
                         const Frame& frame) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply" || extension == ".om" || extension == ".glb") return "";
  std::string out;
  const auto add = [&](bool is_lost, const char* what) {
    if (is_lost) out += (out.empty() ? "" : ", ") + std::string(what);
  };
  add(extension == ".stl" && !mesh.provenance.empty(), "labels");
  add((extension == ".stl" || extension == ".3mf") && !mesh.colors.empty(), "colours");
  add(!mesh.sigma.empty(), "sigma");
  add(!mesh.support.empty(), "support");
  add(extension == ".stl" && frame.metres_sigma > 0, "sigma of the scale");
  return out.empty() ? out : extension + " files hold no " + out + "; .ply and .glb do";
}

std::string textures_text(bool has_textures) {
  if (!has_textures) return "";
  return "textures became colours of vertices: what is finer than the triangles is not kept";
}

std::string write_mesh_as(const std::filesystem::path& path,
                          const TriangleMesh& mesh,
                          const Frame& frame,
                          GlbOptions options) {
  require_writable_as(path, frame);
  const std::string extension = lower_extension(path);
  if (extension == ".stl") write_stl(path, mesh, frame, z_up_from(frame.up));
  if (extension == ".3mf") write_3mf(path, mesh, frame, z_up_from(frame.up));
  if (extension == ".obj") write_obj(path, mesh, frame);
  if (extension == ".om") write_om(path, mesh, frame);
  if (extension == ".ply") write_mesh_ply(path, mesh, frame);
  if (extension != ".glb") return "";
  options.y_up = y_up_from(frame.up);
  const GlbReport made = write_glb(path, mesh, frame, options);
  if (made.collapsed_triangles == 0) return "";
  return std::to_string(made.collapsed_triangles) + " of " + std::to_string(made.triangles) +
         " faces have no area in the file, as its grid is coarser than they are; a smaller "
         "--compression-error or --glb-encoding plain keeps them";
}

}  // namespace cgs
