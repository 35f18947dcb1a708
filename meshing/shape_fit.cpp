// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/shape_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include "libcgs/core/error.h"
#include "meshing/surface_measures.h"

namespace cgs {

namespace {

// A small piece of the patch, in units of the ball around its centre.
struct Sample {
  Eigen::Vector3d place;
  Eigen::Vector3d normal;
  double area;
  double sigma;  // NaN = no statement
};

struct Patch {
  std::vector<Sample> samples;
  size_t vertices = 0;
  double area = 0;
  std::array<double, 4> area_of_label = {};
  double stated_area = 0;
};

// Splits a face into n x n equal triangles and takes the middles of those within the ball.
void add_face(Patch& patch,
              const MeasurableMesh& mesh,
              uint32_t f,
              const std::array<Eigen::Vector3d, 3>& corner,
              std::vector<uint8_t>& used) {
  const Eigen::Vector3d u = corner[1] - corner[0];
  const Eigen::Vector3d v = corner[2] - corner[0];
  const Eigen::Vector3d twice = u.cross(v);
  if (twice.squaredNorm() == 0) return;
  constexpr double kFinest = 24;  // pieces per radius
  constexpr double kMost = 512;
  const double longest =
      std::sqrt(std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()}));
  const int n = static_cast<int>(std::clamp(std::ceil(longest * kFinest), 1.0, kMost));
  const double area = twice.norm() / 2 / n / n;
  const bool invented = mesh.states_provenance() && mesh.mesh.provenance[f] == Provenance::Inferred;
  const auto& face = mesh.mesh.faces[f];
  const auto add = [&](double s, double t) {
    const Eigen::Vector3d p = corner[0] + s * u + t * v;
    if (p.squaredNorm() > 1) return;
    double sigma = std::nan("");
    if (mesh.states_sigma() && !invented) {
      sigma = (1 - s - t) * double(mesh.mesh.sigma[face[0]]) +
              s * double(mesh.mesh.sigma[face[1]]) + t * double(mesh.mesh.sigma[face[2]]);
    }
    patch.samples.push_back({p, twice.normalized(), area, sigma});
    patch.area += area;
    if (std::isfinite(sigma)) patch.stated_area += area;
    if (mesh.states_provenance()) {
      patch.area_of_label.at(static_cast<size_t>(mesh.mesh.provenance[f])) += area;
    }
    for (const uint32_t w : face) used[w] = 1;
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      add((i + 1.0 / 3) / n, (j + 1.0 / 3) / n);
      if (i + j + 1 < n) add((i + 2.0 / 3) / n, (j + 2.0 / 3) / n);
    }
  }
}

Patch patch_within(const MeasurableMesh& mesh, const Eigen::Vector3d& center, double radius) {
  Patch out;
  std::vector<uint8_t> used(mesh.points.size(), 0);
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    std::array<Eigen::Vector3d, 3> corner;
    Eigen::AlignedBox3d box;
    for (size_t k = 0; k < 3; ++k) {
      corner.at(k) = (mesh.points[mesh.mesh.faces[f].at(k)] - center) / radius;
      box.extend(corner.at(k));
    }
    if (box.squaredExteriorDistance(Eigen::Vector3d::Zero()) <= 1)
      add_face(out, mesh, f, corner, used);
  }
  out.vertices = static_cast<size_t>(std::count(used.begin(), used.end(), uint8_t{1}));
  return out;
}

// Weighted distances to a shape with parameters about a first guess.
// Plane: two tilts and a shift. Sphere: centre and radius. Cylinder: two tilts of the axis, its
// shift in two directions, radius.
template <Shape kShape>
struct Distances {
  using Scalar = double;
  static constexpr int kParameters = kShape == Shape::Plane ? 3 : kShape == Shape::Sphere ? 4 : 5;

  const std::vector<Sample>& samples;
  Eigen::Matrix3d axes;   // columns; the last one is normal or axis of the first guess
  Eigen::Vector3d point;  // a point of the first guess
  int NumResiduals() const { return static_cast<int>(samples.size()); }

  template <typename T>
  T distance(const Sample& sample, const T* p) const {
    using std::sqrt;
    const Eigen::Matrix<T, 3, 1> q = (axes.transpose() * (sample.place - point)).template cast<T>();
    if constexpr (kShape == Shape::Sphere) {
      const Eigen::Matrix<T, 3, 1> d = q - Eigen::Matrix<T, 3, 1>(p[0], p[1], p[2]);
      return sqrt(d.squaredNorm() + T(1e-300)) - p[3];
    } else {
      const Eigen::Matrix<T, 3, 1> along =
          Eigen::Matrix<T, 3, 1>(p[0], p[1], T(1)) / sqrt(p[0] * p[0] + p[1] * p[1] + T(1));
      if constexpr (kShape == Shape::Plane) {
        return q.dot(along) - p[2];
      } else {
        const Eigen::Matrix<T, 3, 1> d = q - Eigen::Matrix<T, 3, 1>(p[2], p[3], T(0));
        return sqrt(d.cross(along).squaredNorm() + T(1e-300)) - p[4];
      }
    }
  }

  template <typename T>
  bool operator()(const T* parameters, T* residuals) const {
    for (size_t i = 0; i < samples.size(); ++i) {
      residuals[i] = distance(samples[i], parameters) * std::sqrt(samples[i].area);
    }
    return true;
  }
};

Eigen::Vector3d mean_place(const Patch& patch) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Sample& s : patch.samples) sum += s.area * s.place;
  return sum / patch.area;
}

// Eigenvectors of the scatter of places (or of normals), smallest last.
Eigen::Matrix3d scatter_axes(const Patch& patch, const Eigen::Vector3d& mean, bool of_normals) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Sample& s : patch.samples) {
    const Eigen::Vector3d d = of_normals ? s.normal : Eigen::Vector3d(s.place - mean);
    scatter += s.area * d * d.transpose();
  }
  const Eigen::Matrix3d v = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
  Eigen::Matrix3d out;
  out << v.col(2), v.col(1), v.col(0);
  return out;
}

// Centre and radius of |p - c|^2 = r^2 by linear least squares in the first `dims` coordinates.
Eigen::VectorXd algebraic_center(const std::vector<Sample>& samples,
                                 const Eigen::Matrix3d& axes,
                                 const Eigen::Vector3d& point,
                                 int dims) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(dims + 1, dims + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(dims + 1);
  for (const Sample& s : samples) {
    Eigen::VectorXd row(dims + 1);
    const Eigen::VectorXd q = (axes.transpose() * (s.place - point)).head(dims);
    row << 2 * q, 1;
    normal += s.area * row * row.transpose();
    right += s.area * q.squaredNorm() * row;
  }
  Eigen::VectorXd out = normal.ldlt().solve(right);
  out[dims] = std::sqrt(std::max(0.0, out[dims] + out.head(dims).squaredNorm()));
  return out;
}

template <Shape kShape>
struct Fitted {
  Eigen::Matrix<double, Distances<kShape>::kParameters, 1> parameters;
  Eigen::Matrix<double, Distances<kShape>::kParameters, Distances<kShape>::kParameters> covariance;
  double rms = 0;
  double largest = 0;
};

// Least squares from a first guess, and how well it determines the parameters.
template <Shape kShape>
Fitted<kShape> solve(const Patch& patch,
                     const Distances<kShape>& distances,
                     const Eigen::VectorXd& guess) {
  constexpr int kN = Distances<kShape>::kParameters;
  using Function = ceres::TinySolverAutoDiffFunction<Distances<kShape>, Eigen::Dynamic, kN>;
  Function function(distances);
  ceres::TinySolver<Function> solver;
  Fitted<kShape> out;
  out.parameters = guess;
  solver.options.max_num_iterations = 200;
  solver.options.gradient_tolerance = 1e-14;
  solver.options.parameter_tolerance = 1e-12;
  solver.options.function_tolerance = 1e-15;
  solver.Solve(function, &out.parameters);
  const auto rows = static_cast<Eigen::Index>(patch.samples.size());
  Eigen::VectorXd residuals(rows);
  Eigen::Matrix<double, Eigen::Dynamic, kN> jacobian(rows, kN);
  function(out.parameters.data(), residuals.data(), jacobian.data());
  const Eigen::Matrix<double, kN, kN> hessian = jacobian.transpose() * jacobian;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kN, kN>> eigen(hessian);
  constexpr double kSingular = 1e-9;
  if (!out.parameters.allFinite() ||
      !(eigen.eigenvalues()[0] > kSingular * eigen.eigenvalues()[kN - 1])) {
    throw NumericalError(
        "the surface within the ball does not determine this shape; take a larger "
        "--radius or another shape");
  }
  const Eigen::Matrix<double, kN, kN> inverse = hessian.inverse();
  out.rms = std::sqrt(residuals.squaredNorm() / patch.area);
  Eigen::VectorXd shifts = Eigen::VectorXd::Zero(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Sample& s = patch.samples[static_cast<size_t>(i)];
    const double root = std::sqrt(s.area);
    out.largest = std::max(out.largest, std::abs(residuals[i] / root));
    if (std::isfinite(s.sigma)) shifts[i] = s.sigma * root;
  }
  const auto points = static_cast<double>(std::max<size_t>(patch.vertices, kN + 1));
  out.covariance = inverse * (out.rms * out.rms * patch.area / (points - kN));
  const Eigen::Matrix<double, kN, 1> together = inverse * (jacobian.transpose() * shifts);
  out.covariance += together * together.transpose();
  return out;
}

ShapeFit common_part(const Patch& patch, Shape shape, double radius) {
  ShapeFit out;
  out.shape = shape;
  out.vertices = patch.vertices;
  out.area.dimension = 2;
  out.area.value = patch.area * radius * radius;
  for (size_t i = 0; i < 4; ++i) {
    out.area.by_provenance.at(i) = patch.area_of_label.at(i) * radius * radius;
  }
  out.area.stated = patch.stated_area / patch.area;
  return out;
}

void set_radius(ShapeFit& out, double value, double variance, const Patch& patch) {
  out.radius.value = value;
  out.radius.sigma = std::sqrt(variance);
  out.radius.stated = patch.stated_area / patch.area;
  for (size_t i = 0; i < 4; ++i) {
    out.radius.by_provenance.at(i) = value * patch.area_of_label.at(i) / patch.area;
  }
}

ShapeFit fit_plane(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Distances<Shape::Plane> distances{patch.samples, scatter_axes(patch, mean, false), mean};
  const auto fit = solve<Shape::Plane>(patch, distances, Eigen::Vector3d::Zero());
  const Eigen::Vector3d along =
      distances.axes * Eigen::Vector3d(fit.parameters[0], fit.parameters[1], 1).normalized();
  double facing = 0;
  for (const Sample& s : patch.samples) facing += s.area * s.normal.dot(along);
  out.point = mean + fit.parameters[2] * along;
  out.direction = facing < 0 ? Eigen::Vector3d(-along) : along;
  out.point_sigma = std::sqrt(fit.covariance(2, 2));
  out.direction_sigma = std::sqrt(fit.covariance(0, 0) + fit.covariance(1, 1));
  out.rms = fit.rms;
  out.largest = fit.largest;
  return out;
}

ShapeFit fit_sphere(const Patch& patch, ShapeFit out) {
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Distances<Shape::Sphere> distances{patch.samples, axes, zero};
  const auto fit =
      solve<Shape::Sphere>(patch, distances, algebraic_center(patch.samples, axes, zero, 3));
  out.point = fit.parameters.template head<3>();
  out.point_sigma = std::sqrt(fit.covariance.template topLeftCorner<3, 3>().trace());
  set_radius(out, fit.parameters[3], fit.covariance(3, 3), patch);
  out.rms = fit.rms;
  out.largest = fit.largest;
  return out;
}

ShapeFit fit_cylinder(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Eigen::Matrix3d axes = scatter_axes(patch, mean, true);  // normals avoid the axis
  const Distances<Shape::Cylinder> distances{patch.samples, axes, mean};
  const Eigen::VectorXd circle = algebraic_center(patch.samples, axes, mean, 2);
  Eigen::VectorXd guess(5);
  guess << 0, 0, circle;
  const auto fit = solve<Shape::Cylinder>(patch, distances, guess);
  out.direction = axes * Eigen::Vector3d(fit.parameters[0], fit.parameters[1], 1).normalized();
  const Eigen::Vector3d on_axis =
      mean + axes * Eigen::Vector3d(fit.parameters[2], fit.parameters[3], 0);
  out.point = on_axis + out.direction.dot(mean - on_axis) * out.direction;
  out.point_sigma = std::sqrt(fit.covariance(2, 2) + fit.covariance(3, 3));
  out.direction_sigma = std::sqrt(fit.covariance(0, 0) + fit.covariance(1, 1));
  set_radius(out, fit.parameters[4], fit.covariance(4, 4), patch);
  out.rms = fit.rms;
  out.largest = fit.largest;
  return out;
}

}  // namespace

ShapeFit fit_shape(const MeasurableMesh& mesh,
                   Shape shape,
                   const Eigen::Vector3d& center,
                   double radius) {
  require(radius > 0 && std::isfinite(radius), "the radius of a fit must be > 0", radius);
  Patch patch = patch_within(mesh, center, radius);
  for (Sample& s : patch.samples) s.sigma /= radius;
  constexpr size_t kFewest = 12;
  require(patch.samples.size() >= kFewest,
          "a fit needs more surface within its ball; the pieces of it",
          patch.samples.size());
  ShapeFit out = common_part(patch, shape, radius);
  out = shape == Shape::Plane    ? fit_plane(patch, out)
        : shape == Shape::Sphere ? fit_sphere(patch, out)
                                 : fit_cylinder(patch, out);
  out.point = center + radius * out.point;
  out.point_sigma *= radius;
  out.rms *= radius;
  out.largest *= radius;
  out.radius.value *= radius;
  out.radius.sigma *= radius;
  for (double& part : out.radius.by_provenance) part *= radius;
  return out;
}

}  // namespace cgs
