// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/poisson_function.h"

#include <algorithm>
#include <cmath>
#include <utility>

// CGAL's solver is Eigen's conjugate gradient.
#define CGAL_EIGEN3_ENABLED 1
#include <CGAL/Poisson_reconstruction_function.h>
#include <CGAL/property_map.h>

#include "libcgs/core/error.h"
#include "meshing/mesh/nudged_point.h"
#include "meshing/mesh/polygon_mesh.h"

namespace cgs {

namespace {

using polygon_mesh::Kernel;
using polygon_mesh::Point;
using Function = CGAL::Poisson_reconstruction_function<Kernel>;
using OrientedPoint = std::pair<Point, Kernel::Vector_3>;

std::vector<OrientedPoint> oriented_points(const std::vector<Eigen::Vector3f>& points,
                                           const std::vector<Eigen::Vector3f>& normals,
                                           double spacing) {
  const double tiny = 1e-4 * spacing;
  std::vector<OrientedPoint> out;
  out.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = nudged_point(points[i], i, tiny);
    const Eigen::Vector3d n = normals[i].cast<double>();
    out.emplace_back(Point(p.x(), p.y(), p.z()), Kernel::Vector_3(n.x(), n.y(), n.z()));
  }
  return out;
}

}  // namespace

struct PoissonFunction::Solution {
  explicit Solution(const std::vector<OrientedPoint>& points)
      : function(points.begin(),
                 points.end(),
                 CGAL::First_of_pair_property_map<OrientedPoint>(),
                 CGAL::Second_of_pair_property_map<OrientedPoint>()) {}

  Function function;
};

PoissonFunction::PoissonFunction(const std::vector<Eigen::Vector3f>& points,
                                 const std::vector<Eigen::Vector3f>& normals,
                                 double spacing) {
  const char* const failed = "Poisson's equation cannot be solved for these points and normals";
  CGAL::set_error_behaviour(CGAL::THROW_EXCEPTION);
  try {
    solution_ = std::make_unique<Solution>(oriented_points(points, normals, spacing));
    if (!solution_->function.compute_implicit_function()) throw NumericalError(failed);
  } catch (const CGAL::Failure_exception&) {
    throw NumericalError(failed);
  }
}

PoissonFunction::~PoissonFunction() = default;

std::vector<PoissonFunction::Cell> PoissonFunction::crossed_cells() const {
  std::vector<Cell> out;
  const auto& all = solution_->function.tr();
  for (auto c = all.finite_cells_begin(); c != all.finite_cells_end(); ++c) {
    Cell cell;
    for (int k = 0; k < 4; ++k) {
      const Point& p = c->vertex(k)->point();
      cell.corners.at(size_t(k)) = {p.x(), p.y(), p.z()};
      cell.values.at(size_t(k)) = c->vertex(k)->f();
    }
    const auto [low, high] = std::minmax_element(cell.values.begin(), cell.values.end());
    if (*low < 0 && *high >= 0) out.push_back(cell);
  }
  return out;
}

double PoissonFunction::value(const Eigen::Vector3d& place) const {
  const auto found = solution_->function.special_func(Point(place.x(), place.y(), place.z()));
  const bool beyond = boost::get<2>(found);
  return beyond ? std::abs(boost::get<0>(found)) : boost::get<0>(found);
}

}  // namespace cgs
