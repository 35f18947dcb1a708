// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace cgs {

/// The function that falls from outside to inside of a surface of which oriented points are known,
/// 0 on it and linear within each of many tetrahedra.
///
/// Points are nudged before, see nudged_point().
/// Source: Kazhdan et al. 2006, "Poisson surface reconstruction", on tetrahedra as in CGAL.
class PoissonFunction {
 public:
  /// A tetrahedron [internal units] and the function at its corners.
  struct Cell {
    std::array<Eigen::Vector3d, 4> corners;
    std::array<double, 4> values;
  };

  /// \param normals  unit length, outward
  /// \param spacing  of the points, about [internal units]; they are nudged by 0.0001 of it
  /// \throws NumericalError if it cannot be solved for
  PoissonFunction(const std::vector<Eigen::Vector3f>& points,
                  const std::vector<Eigen::Vector3f>& normals,
                  double spacing);
  ~PoissonFunction();
  PoissonFunction(const PoissonFunction&) = delete;
  PoissonFunction& operator=(const PoissonFunction&) = delete;

  /// Those in which the function changes its sign.
  std::vector<Cell> crossed_cells() const;
  /// < 0 inside; beyond all tetrahedra it is outside. Not from several threads at once.
  double value(const Eigen::Vector3d& place) const;

 private:
  struct Solution;
  std::unique_ptr<Solution> solution_;
};

}  // namespace cgs
