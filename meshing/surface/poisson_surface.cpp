// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/poisson_surface.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/SignedFloodFill.h>

#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/point_normals.h"
#include "meshing/points/down_sampling.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/poisson_function.h"

namespace cgs {

namespace {

constexpr std::ptrdiff_t kLeast = 10;  // points with a normal

void check_cloud(const TriangleMesh& cloud) {
  require(cloud.faces.empty(),
          "Poisson's surface needs a point cloud: the number of faces must be 0",
          cloud.faces.size());
  const auto known = std::count_if(cloud.normals.begin(), cloud.normals.end(), is_known_normal);
  require(known >= kLeast,
          "the number of points that state a normal must be >= 10 for Poisson's surface",
          known);
}

double default_spacing(size_t points, double point_spacing) {
  constexpr double kAtFullDetail = 200'000;
  require(point_spacing > 0,
          "most points lie in one place: the spacing between them must be > 0",
          point_spacing);
  return point_spacing * std::max(1.0, std::sqrt(double(points) / kAtFullDetail));
}

TriangleMesh thinned(const TriangleMesh& cloud, double side) {
  TriangleMesh bare;
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    if (!is_known_normal(cloud.normals[v])) continue;
    bare.vertices.push_back(cloud.vertices[v]);
    bare.normals.emplace_back(cloud.normals[v].stableNormalized());
    if (!cloud.sigma.empty()) bare.sigma.push_back(cloud.sigma[v]);
  }
  TriangleMesh out = down_sampled(bare, side);
  const std::string count = std::to_string(out.vertices.size());
  if (out.vertices.size() < size_t{kLeast}) {
    throw NumericalError("thinned to the spacing, " + count +
                         " points are left, Poisson's surface needs 10; state a smaller spacing");
  }
  constexpr size_t kMost = 2'000'000;
  if (out.vertices.size() <= kMost) return out;
  throw LimitError("Poisson's surface of " + count +
                   " points would take hours and 10 GB, allowed are 2000000; state a larger "
                   "spacing");
}

/// A cell of the function as a linear one.
struct LinearPart {
  Eigen::AlignedBox3d box;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double at_origin = 0;
  double area = 0;  // of its zero surface, about: the mean over its values, by the coarea formula

  explicit LinearPart(const PoissonFunction::Cell& cell) {
    Eigen::Matrix3d edges;
    Eigen::Vector3d rise;
    for (size_t k = 0; k < 4; ++k) box.extend(cell.corners.at(k));
    for (size_t k = 0; k < 3; ++k) {
      edges.row(Eigen::Index(k)) = cell.corners.at(k + 1) - cell.corners[0];
      rise[Eigen::Index(k)] = cell.values.at(k + 1) - cell.values[0];
    }
    gradient = edges.inverse() * rise;
    at_origin = cell.values[0] - gradient.dot(cell.corners[0]);
    const auto [low, high] = std::minmax_element(cell.values.begin(), cell.values.end());
    area = std::abs(edges.determinant()) / 6 * gradient.norm() / (*high - *low);
  }
  // Flat cells have no gradient; others lie around them.
  bool is_sound() const { return std::isfinite(area) && gradient.squaredNorm() > 0; }
  double value(const Eigen::Vector3d& p) const { return at_origin + gradient.dot(p); }
};

/// The grid points around the zero surface of a function: all corners of every voxel that it comes
/// into. Beyond a box around the points, to which sheets that nothing closes run out, is outside.
/// The grid counts in voxels, for OpenVDB takes no tiny ones.
class PoissonBand {
 public:
  PoissonBand(const Eigen::AlignedBox3d& box, double voxel) : box_(box), voxel_(voxel) {}

  /// \throws LimitError if that takes too many grid points
  void add(const LinearPart& part) {
    reaches_box_ = reaches_box_ || !box_.contains(part.box);
    const Eigen::AlignedBox3d box = part.box.intersection(box_);
    if (box.isEmpty()) return;
    const double slope = voxel_ * part.gradient.norm();
    const double reach = std::sqrt(3.0) * slope;
    const auto [low, high] = corners_of(box);
    for (int i = low.x(); i <= high.x(); ++i) {
      for (int j = low.y(); j <= high.y(); ++j) {
        const auto [first, last] = near_zero(part, {i, j}, 1.01 * reach, {low.z(), high.z()});
        for (int k = first; k <= last; ++k) {
          const openvdb::Coord at(i, j, k);
          if (std::abs(part.value(place(at))) <= reach) add(at, slope);
        }
      }
    }
  }

  /// About the distance to the zero surface, near it [voxels].
  openvdb::FloatGrid::Ptr distances(const PoissonFunction& function) {
    constexpr float kBackground = 3;
    if (reaches_box_) add_box();
    for (auto it = slopes_->beginValueOn(); it; ++it) {
      const openvdb::Coord at = it.getCoord();
      const Eigen::Vector3d p = place(at);
      // Where the function is flat, in gaps, dividing by its slope keeps it from being rounded to
      // nothing; at the box alone its sign is enough.
      const int count = counts_at_.getValue(at);
      const double slope = count > 0 ? double(*it) / count : 1e-30;
      const double beyond = ((p - box_.center()).cwiseAbs() - box_.sizes() / 2).maxCoeff();
      const auto value = static_cast<float>(std::max(function.value(p) / slope, beyond / voxel_));
      it.setValue(std::clamp(value, -kBackground, kBackground));
    }
    openvdb::tools::changeBackground(slopes_->tree(), kBackground);
    openvdb::tools::signedFloodFill(slopes_->tree());
    return slopes_;
  }

 private:
  Eigen::Vector3d place(const openvdb::Coord& at) const {
    return voxel_ * Eigen::Vector3d(at.x(), at.y(), at.z());
  }

  // The lowest and the highest of all voxels that the box comes into.
  std::pair<Eigen::Vector3i, Eigen::Vector3i> corners_of(const Eigen::AlignedBox3d& box) const {
    return {(box.min() / voxel_).array().floor().cast<int>(),
            (box.max() / voxel_).array().ceil().cast<int>()};
  }

  // Where a column along z, within a range, can have values up to the reach: first and last.
  std::pair<int, int> near_zero(const LinearPart& part,
                                const Eigen::Vector2i& column,
                                double reach,
                                const Eigen::Vector2i& range) const {
    const double value = part.value(place({column.x(), column.y(), 0}));
    const double rise = voxel_ * part.gradient.z();
    if (rise == 0 && std::abs(value) > reach) return {0, -1};
    if (rise == 0) return {range[0], range[1]};
    const auto [first, last] = std::minmax({(-reach - value) / rise, (reach - value) / rise});
    return {static_cast<int>(std::ceil(std::clamp<double>(first, range[0], range[1] + 1))),
            static_cast<int>(std::floor(std::clamp<double>(last, range[0] - 1, range[1])))};
  }

  void add(const openvdb::Coord& at, double slope) {
    constexpr uint64_t kMost = 100'000'000;  // 2 GB, at least three for each of the faces allowed
    const int count = counts_at_.getValue(at);
    if (count == 0 && ++size_ > kMost) {
      throw LimitError(
          "Poisson's surface would need more than 100000000 grid points; state a larger spacing");
    }
    slopes_at_.setValue(at, slopes_at_.getValue(at) + static_cast<float>(slope));
    counts_at_.setValue(at, count + 1);
  }

  void add_box() {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {box_.min()[axis], box_.max()[axis]}) {
        Eigen::AlignedBox3d face = box_;
        face.min()[axis] = side - voxel_ / 2;
        face.max()[axis] = side + voxel_ / 2;
        const auto [low, high] = corners_of(face);
        for (int i = low.x(); i <= high.x(); ++i) {
          for (int j = low.y(); j <= high.y(); ++j) {
            for (int k = low.z(); k <= high.z(); ++k) slopes_at_.setValueOn({i, j, k});
          }
        }
      }
    }
  }

  Eigen::AlignedBox3d box_;
  double voxel_;
  bool reaches_box_ = false;
  uint64_t size_ = 0;
  openvdb::FloatGrid::Ptr slopes_ = openvdb::FloatGrid::create(0);  // sums, of so many cells
  openvdb::Int32Grid::Ptr counts_ = openvdb::Int32Grid::create(0);
  openvdb::FloatGrid::Accessor slopes_at_ = slopes_->getAccessor();
  openvdb::Int32Grid::Accessor counts_at_ = counts_->getAccessor();
};

Eigen::AlignedBox3d box_around(const std::vector<Eigen::Vector3f>& points) {
  constexpr double kMargin = 0.1;  // of the diagonal
  Eigen::AlignedBox3d out;
  for (const auto& p : points) out.extend(p.cast<double>());
  const double margin = kMargin * out.diagonal().norm();
  out.min().array() -= margin;
  out.max().array() += margin;
  return out;
}

std::vector<LinearPart> crossed_parts(const PoissonFunction& function) {
  std::vector<LinearPart> out;
  for (const PoissonFunction::Cell& cell : function.crossed_cells()) {
    if (const LinearPart part(cell); part.is_sound()) out.push_back(part);
  }
  return out;
}

// With one decimal.
std::string rounded_up(double factor) {
  const auto tenths = static_cast<uint64_t>(std::ceil(std::min(10 * factor, 1e18)));
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10);
}

// Of the grid: what closes gaps may be many times larger than what was measured.
double grid_spacing(const std::vector<LinearPart>& parts,
                    const Eigen::AlignedBox3d& box,
                    double spacing,
                    bool is_stated) {
  double area = 0;
  bool reaches_box = false;
  for (const LinearPart& part : parts) {
    reaches_box = reaches_box || !box.contains(part.box);
    if (box.contains(part.box.center())) area += part.area;
  }
  const Eigen::Vector3d s = box.sizes();
  if (reaches_box) area += 2 * (s.x() * s.y() + s.y() * s.z() + s.z() * s.x());
  constexpr double kFacesPerSquare = 3;  // on average over all directions
  constexpr double kUsualFaces = 2e6;
  constexpr double kMostFaces = 2e7;
  constexpr double kMostCoarser = 3;  // of itself; then what was measured is lost in what was not
  const double faces = kFacesPerSquare * area / (spacing * spacing);
  const double coarser = std::sqrt(std::max(1.0, faces / kUsualFaces));
  if (!is_stated && coarser <= kMostCoarser) return spacing * coarser;
  if (is_stated && faces <= kMostFaces) return spacing;
  const std::string count = std::to_string(static_cast<uint64_t>(std::min(faces, 1e18)));
  if (!is_stated) {
    throw WithRemedy<LimitError>(
        Remedy::PoissonSpacing,
        "closing all gaps as finely as the points lie would take about " + count +
            " faces, most of them far from any point; remove what lies apart or state a spacing");
  }
  throw LimitError("Poisson's surface would have about " + count +
                   " faces, allowed are 20000000; state a spacing " +
                   rounded_up(std::sqrt(faces / kMostFaces)) + " times as large");
}

TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (auto& p : mesh.vertices) p = (factor * p.cast<double>()).cast<float>();
  return mesh;
}

TriangleMesh closed_surface(const openvdb::FloatGrid& distance, double voxel) {
  TriangleMesh mesh = scaled(zero_surface(distance), voxel);
  if (certify(mesh).passed()) return mesh;
  // More faces, but they never cut each other.
  mesh = scaled(zero_surface_by_tetrahedra(distance), voxel);
  if (is_closed_manifold(mesh)) return mesh;
  throw NumericalError("these points and normals enclose nothing");
}

}  // namespace

void PoissonOptions::validate() const {
  require(spacing >= 0 && std::isfinite(spacing), "PoissonOptions.spacing must be >= 0", spacing);
}

PoissonSurface poisson_surface(const TriangleMesh& cloud,
                               const PoissonOptions& options,
                               const Progress& progress) {
  options.validate();
  check_cloud(cloud);
  const double between = point_spacing(cloud.vertices);
  PoissonSurface out;
  out.spacing =
      options.spacing > 0 ? options.spacing : default_spacing(cloud.vertices.size(), between);
  const TriangleMesh points = thinned(cloud, out.spacing);
  const PoissonFunction function(points.vertices, points.normals, out.spacing);
  report(progress, 0.6);
  const std::vector<LinearPart> parts = crossed_parts(function);
  const Eigen::AlignedBox3d box = box_around(points.vertices);
  out.spacing = grid_spacing(parts, box, out.spacing, options.spacing > 0);
  PoissonBand band(box, out.spacing);
  for (const LinearPart& part : parts) band.add(part);
  out.mesh = closed_surface(*band.distances(function), out.spacing);
  report(progress, 0.9);
  out.evidence = take_evidence(out.mesh, StatedSurface(cloud), 2 * between);
  return out;
}

}  // namespace cgs
