// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "io/bytes/scene_path.h"
#include "io/meshes/glb_reader.h"
#include "io/meshes/mesh_ply.h"
#include "io/meshes/obj_reader.h"
#include "io/meshes/off.h"
#include "io/meshes/om_reader.h"
#include "io/meshes/stl_reader.h"
#include "io/meshes/threemf_reader.h"
#include "io/ply/frame.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// What is up in a file, in its axes.
struct UpAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // 0 = nobody knows
  std::string assumed;                                  // why, where neither file nor format says
};

// Blender writes OBJ files with y up unless it is told otherwise, and its name on the first line.
UpAxis up_of_obj(const ParsedMesh& parsed) {
  const auto says = [&](const char* start) {
    return std::any_of(parsed.comments.begin(), parsed.comments.end(), [&](const auto& comment) {
      return comment.starts_with(start);
    });
  };
  if (!says("Blender") || says("up ")) return {};
  return {Eigen::Vector3d::UnitY(),
          "the file does not say what is up: +y is assumed, as Blender writes OBJ files"};
}

ParsedMesh parse(const std::filesystem::path& path, UpAxis& up) {
  const std::string extension = lower_extension(path);
  if (extension == ".ply") return parse_mesh_ply(path);
  if (extension == ".obj") {
    ParsedMesh out = read_obj(path);
    up = up_of_obj(out);
    return out;
  }
  if (extension == ".stl") {  // no rule of the format, but of the programs that print it
    up = {Eigen::Vector3d::UnitZ(),
          "the file does not say what is up: +z is assumed, as programs write STL files"};
    return read_stl(path);
  }
  if (extension == ".3mf") {
    up.direction = Eigen::Vector3d::UnitZ();
    return read_3mf(path);
  }
  if (extension == ".off") return read_off(path);
  if (extension == ".om") return read_om(path);
  throw BadInput(Defect::Unsupported,
                 path,
                 "'" + extension +
                     "' is not a mesh format that is read; known are .ply, .obj, "
                     ".stl, .off, .om, .3mf, .glb and .gltf");
}

// Three corners in one place or on one line: no area. Others keep such faces, so do we.
size_t faces_without_area(const MeasurableMesh& content) {
  size_t count = 0;
  for (const auto& f : content.mesh.faces) {
    const Eigen::Vector3d u = content.points[f[1]] - content.points[f[0]];
    const Eigen::Vector3d v = content.points[f[2]] - content.points[f[0]];
    if (u.cross(v).squaredNorm() == 0) ++count;
  }
  return count;
}

// One absurd number takes the middle of a mesh to where no frame can lie.
void refuse_far_away(const std::vector<Eigen::Vector3d>& points,
                     const Frame& frame,
                     const std::filesystem::path& path) {
  try {
    frame.validate();
  } catch (const InvalidInput& error) {
    const auto size_of = [](const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff(); };
    const auto farthest =
        std::max_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
          return size_of(a) < size_of(b);
        });
    std::ostringstream words;
    words << "vertex " << farthest - points.begin() << " lies at " << farthest->transpose() << ": "
          << error.what();
    throw BadInput(Defect::Value, path, words.str());
  }
}

MeasurableFile measurable(ParsedMesh parsed,
                          const UpAxis& up,
                          const std::filesystem::path& path,
                          const std::optional<Frame>& frame) {
  check_significance(parsed, path);
  PlyPlacement placement =
      ply_placement(parsed.comments, opposite_corners(parsed.positions), frame);
  const bool tells_up = !frame && !up.direction.isZero(0);
  if (tells_up) placement.frame.up = up.direction.normalized();
  refuse_far_away(parsed.positions, placement.frame, path);
  MeasurableFile out{
      {std::move(parsed.mesh), std::move(parsed.positions), placement.frame, placement.file_origin},
      std::move(parsed.warnings),
      parsed.has_textures,
      tells_up ? up.assumed : ""};
  out.warnings.insert(out.warnings.end(), placement.warnings.begin(), placement.warnings.end());
  out.content.mesh.vertices.reserve(out.content.points.size());
  for (Eigen::Vector3d& p : out.content.points) {
    p = out.content.internal_from_file(p);
    out.content.mesh.vertices.emplace_back(p.cast<float>());
  }
  for (float& sigma : out.content.mesh.sigma) sigma = internal_sigma(sigma, placement.frame);
  if (const size_t flat = faces_without_area(out.content); flat > 0) {
    out.warnings.push_back(std::to_string(flat) + " faces have no area");
  }
  return out;
}

MeasurableFile measurable(GlbMesh glb,
                          const std::filesystem::path& path,
                          const std::optional<Frame>& frame) {
  return measurable(std::move(glb.parsed), {glb.up, ""}, path, frame);
}

}  // namespace

bool is_mesh_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  const auto known = {".ply", ".obj", ".stl", ".off", ".om", ".3mf"};
  return has_gltf_extension(path) ||
         std::find(known.begin(), known.end(), extension) != known.end();
}

MeasurableFile read_mesh_file(const std::filesystem::path& path,
                              const std::optional<Frame>& frame) {
  if (has_gltf_extension(path)) return measurable(read_glb(path), path, frame);
  UpAxis up;
  ParsedMesh parsed = parse(path, up);
  return measurable(std::move(parsed), up, path, frame);
}

MeasurableFile parse_glb_file(std::string content,
                              const std::filesystem::path& path,
                              const std::optional<Frame>& frame) {
  return measurable(parse_glb(std::move(content), path), path, frame);
}

}  // namespace cgs
