// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/orthophoto.h"

#include <algorithm>
#include <array>
#include <limits>

#include <Eigen/Geometry>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/mesh/projected_faces.h"

namespace cgs {

namespace {

// Centres exactly on an edge belong to both faces: rounding must not leave them to neither.
constexpr double kSlack = 1e-9;

class Drawing {
 public:
  Drawing(const MeasurableMesh& mesh, const PictureGrid& grid) : mesh_(mesh), grid_(grid) {
    out_.color = ColorImage(grid.width, grid.height, Eigen::Vector3f::Ones());
    out_.height = Raster<double>(grid.width, grid.height, std::numeric_limits<double>::quiet_NaN());
    out_.label = Raster<int8_t>(grid.width, grid.height, -1);
    places_.resize(mesh.points.size());
    tbb::parallel_for(size_t(0), places_.size(), [&](size_t v) { places_[v] = place(v); });
  }

  // Every strip of rows draws all faces in order, so any number of threads gives one picture.
  Orthophoto draw() {
    constexpr int kRows = 64;
    tbb::parallel_for(tbb::blocked_range<int>(0, grid_.height, kRows), [&](const auto& rows) {
      for (size_t f = 0; f < mesh_.mesh.faces.size(); ++f) draw(f, rows.begin(), rows.end());
    });
    return std::move(out_);
  }

 private:
  // Column, row and height of a vertex.
  Eigen::Vector3d place(size_t v) const {
    const Eigen::Vector3d& p = mesh_.points[v];
    return {(grid_.axes.right.dot(p) - grid_.corner.x()) / grid_.pixel_size,
            (grid_.corner.y() - grid_.axes.up.dot(p)) / grid_.pixel_size,
            grid_.axes.toward.dot(p)};
  }

  Eigen::Vector3f color(size_t f, const Eigen::Vector3d& weights) const {
    if (mesh_.mesh.colors.empty()) return Eigen::Vector3f::Constant(0.75f);
    Eigen::Vector3f out = Eigen::Vector3f::Zero();
    for (size_t k = 0; k < 3; ++k) {
      out += static_cast<float>(weights[static_cast<Eigen::Index>(k)]) *
             mesh_.mesh.colors[mesh_.mesh.faces[f].at(k)];
    }
    return out;
  }

  void draw(size_t f, int first_row, int last_row) {
    const auto& face = mesh_.mesh.faces[f];
    const std::array<Eigen::Vector3d, 3> corner = {
        places_[face[0]], places_[face[1]], places_[face[2]]};
    const auto [low, high] = std::minmax({corner[0].z(), corner[1].z(), corner[2].z()});
    for_each_pixel<double>(
        corner,
        {0, first_row, grid_.width, last_row},
        [&, low = low, high = high](int x, int y, const Eigen::Vector3d& weights, double height) {
          // Faces seen edge-on have weights that are mere rounding.
          const double inside = std::clamp(height, low, high);
          double& highest = out_.height(x, y);
          if (inside <= highest) return;
          highest = inside;
          out_.color(x, y) = color(f, weights);
          if (mesh_.states_provenance()) {
            out_.label(x, y) = static_cast<int8_t>(mesh_.mesh.provenance[f]);
          }
        },
        kSlack);
  }

  const MeasurableMesh& mesh_;
  const PictureGrid& grid_;
  std::vector<Eigen::Vector3d> places_;
  Orthophoto out_;
};

}  // namespace

PictureAxes picture_axes(PictureSide side, const Eigen::Vector3d& up) {
  const Eigen::Matrix3d z_up = z_up_from(up);  // rows: right, away from the viewer, up
  const Eigen::Vector3d right = z_up.row(0);
  const Eigen::Vector3d above = z_up.row(2);
  Eigen::Vector3d toward = z_up.row(2);
  if (side == PictureSide::Top) return {right, above.cross(right), above};
  if (side == PictureSide::Front) toward = right.cross(above);
  if (side == PictureSide::Back) toward = above.cross(right);
  if (side == PictureSide::Left) toward = -right;
  if (side == PictureSide::Right) toward = right;
  return {above.cross(toward), above, toward};
}

PictureAxes picture_axes(const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c) {
  const Eigen::Vector3d along = b - a;
  const Eigen::Vector3d normal = along.cross(c - a);
  constexpr double kStraight = 1e-9;  // sine of the angle at the first point
  if (!(normal.norm() > kStraight * along.norm() * (c - a).norm())) {
    throw InvalidInput("three points on one line are in no single plane");
  }
  const Eigen::Vector3d right = along.normalized();
  const Eigen::Vector3d toward = normal.normalized();
  return {right, toward.cross(right), toward};
}

Orthophoto orthophoto(const MeasurableMesh& mesh, const PictureGrid& grid) {
  require(grid.pixel_size > 0, "PictureGrid.pixel_size must be above 0", grid.pixel_size);
  require(grid.width > 0 && grid.height > 0, "PictureGrid must have pixels, width", grid.width);
  return Drawing(mesh, grid).draw();
}

}  // namespace cgs
