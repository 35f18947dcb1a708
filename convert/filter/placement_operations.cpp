// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>
#include <sstream>

#include "convert/filter/operations.h"
#include "convert/filter/second_mesh.h"
#include "io/bytes/byte_reader.h"
#include "libcgs/core/error.h"
#include "meshing/edit/placement.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

namespace {

FilterStep motion_step(const Eigen::Affine3d& motion) {
  return [motion](FilterState& state, const Progress&) {
    move_mesh(state.mesh, state.frame, motion, state.file_origin);
    return std::string();
  };
}

FilterStep prepare_scale(FilterArguments& arguments) {
  constexpr double kMost = 1e12;
  return motion_step(Eigen::Affine3d(Eigen::Scaling(arguments.number(1 / kMost, kMost))));
}

FilterStep prepare_rotate(FilterArguments& arguments) {
  const std::string axis = arguments.word();
  if (axis != "x" && axis != "y" && axis != "z") arguments.fail("the axis is x, y or z");
  constexpr double kMost = 36000;
  const double degrees = arguments.number(-kMost, kMost);
  return motion_step(Eigen::Affine3d(
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::Unit(axis[0] - 'x'))));
}

FilterStep prepare_translate(FilterArguments& arguments) {
  return motion_step(Eigen::Affine3d(Eigen::Translation3d(arguments.point())));
}

// 16 numbers by rows, as CloudCompare and MeshLab write them; brackets and commas may stand
// between.
Eigen::Affine3d motion_in(const std::filesystem::path& path) {
  ReadLimits limits;
  limits.max_file_bytes = limits.max_header_bytes;
  std::string text = read_file(path, limits);
  for (char& c : text) {
    if (c == ',' || c == '[' || c == ']') c = ' ';
  }
  std::istringstream words(text);
  std::string word;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  Eigen::Index count = 0;
  for (; words >> word; ++count) {
    double value = 0;
    if (!parse_number(word, value) || !std::isfinite(value)) {
      throw BadInput(Defect::Value, path, "'" + word + "' is not a number");
    }
    if (count < 16) matrix(count / 4, count % 4) = value;
  }
  if (count != 16) {
    throw BadInput(Defect::Count,
                   path,
                   "a motion has 16 numbers, four rows of four, here are " + std::to_string(count));
  }
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw BadInput(Defect::Value, path, "the last row of a motion must be 0 0 0 1");
  }
  return Eigen::Affine3d(matrix);
}

FilterStep prepare_transform(FilterArguments& arguments) {
  return [path = arguments.file()](FilterState& state, const Progress&) {
    move_mesh(state.mesh, state.frame, motion_in(path), state.file_origin);
    return std::string();
  };
}

FilterStep prepare_merge(FilterArguments& arguments) {
  return [path = arguments.file()](FilterState& state, const Progress&) {
    const SecondMesh second = read_second_mesh(state, path, "merge");
    state.mesh = joined(state.mesh, second.mesh);
    return "+ " + second.remark;
  };
}

}  // namespace

std::vector<FilterOperation> placement_operations() {
  return {
      {"translate", "X,Y,Z", "Move", "translate=0,0,-2.5cm", prepare_translate},
      {"rotate", "AXIS,DEGREES", "Turn about an axis through 0,0,0", "rotate=z,90", prepare_rotate},
      {"scale", "FACTOR", "Enlarge from 0,0,0", "scale=0.001", prepare_scale},
      {"transform",
       "FILE",
       "Apply a 4x4 matrix (16 numbers by rows)",
       "transform=icp.txt",
       prepare_transform},
      {"merge", "FILE", "Add a second mesh or point cloud", "merge=back.ply", prepare_merge}};
}

}  // namespace cgs
