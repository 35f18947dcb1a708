// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/shape_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

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
  std::array<double, kProvenanceCount> area_of_label = {};
  double stated_area = 0;
};

// A part of a face: its corners [radii from the middle of the ball], and their weights in the face.
struct Piece {
  std::array<Eigen::Vector3d, 3> corner;
  std::array<Eigen::Vector3d, 3> weights;

  bool meets_ball() const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& c : corner) box.extend(c);
    return box.squaredExteriorDistance(Eigen::Vector3d::Zero()) <= 1;
  }
  double longest() const {
    return std::sqrt(std::max({(corner[1] - corner[0]).squaredNorm(),
                               (corner[2] - corner[1]).squaredNorm(),
                               (corner[0] - corner[2]).squaredNorm()}));
  }
  std::array<Piece, 4> quarters() const {
    const auto half = [&](const auto& of, size_t i, size_t j) {
      return Eigen::Vector3d((of.at(i) + of.at(j)) / 2);
    };
    const auto part = [&](size_t k) {
      const size_t next = (k + 1) % 3;
      const size_t last = (k + 2) % 3;
      return Piece{{corner.at(k), half(corner, k, next), half(corner, k, last)},
                   {weights.at(k), half(weights, k, next), half(weights, k, last)}};
    };
    const Piece middle{{half(corner, 0, 1), half(corner, 1, 2), half(corner, 2, 0)},
                       {half(weights, 0, 1), half(weights, 1, 2), half(weights, 2, 0)}};
    return {part(0), part(1), part(2), middle};
  }
};

// Splits a piece of face f into n x n equal triangles and takes the middles of those within the
// ball.
void add_samples(Patch& patch, const MeasurableMesh& mesh, uint32_t f, const Piece& piece) {
  constexpr double kFinest = 24;  // pieces per radius
  const Eigen::Vector3d u = piece.corner[1] - piece.corner[0];
  const Eigen::Vector3d v = piece.corner[2] - piece.corner[0];
  const Eigen::Vector3d twice = u.cross(v);
  if (twice.squaredNorm() == 0) return;
  const int n = static_cast<int>(std::max(std::ceil(piece.longest() * kFinest), 1.0));
  const double area = twice.norm() / 2 / n / n;
  const bool invented = mesh.states_provenance() && mesh.mesh.provenance[f] == Provenance::Inferred;
  const auto& face = mesh.mesh.faces[f];
  const auto add = [&](double s, double t) {
    const Eigen::Vector3d p = piece.corner[0] + s * u + t * v;
    if (p.squaredNorm() > 1) return;
    double sigma = std::nan("");
    if (mesh.states_sigma() && !invented) {
      const Eigen::Vector3d weights =
          (1 - s - t) * piece.weights[0] + s * piece.weights[1] + t * piece.weights[2];
      sigma = weights[0] * double(mesh.mesh.sigma[face[0]]) +
              weights[1] * double(mesh.mesh.sigma[face[1]]) +
              weights[2] * double(mesh.mesh.sigma[face[2]]);
    }
    patch.samples.push_back({p, twice.normalized(), area, sigma});
    patch.area += area;
    if (std::isfinite(sigma)) patch.stated_area += area;
    if (mesh.states_provenance()) {
      patch.area_of_label.at(static_cast<size_t>(mesh.mesh.provenance[f])) += area;
    }
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      add((i + 1.0 / 3) / n, (j + 1.0 / 3) / n);
      if (i + j + 1 < n) add((i + 2.0 / 3) / n, (j + 2.0 / 3) / n);
    }
  }
}

// Of a large face only what is near the ball. \param depth  how often the face was quartered
void add_piece(
    Patch& patch, const MeasurableMesh& mesh, uint32_t f, const Piece& piece, int depth) {
  constexpr double kLongest = 16;  // [radii]
  constexpr int kDeepest = 64;     // for balls so small that nothing is within reach of double
  if (!piece.meets_ball() || depth > kDeepest) return;
  if (piece.longest() <= kLongest) {
    add_samples(patch, mesh, f, piece);
    return;
  }
  for (const Piece& quarter : piece.quarters()) add_piece(patch, mesh, f, quarter, depth + 1);
}

Patch patch_within(const MeasurableMesh& mesh, const Eigen::Vector3d& center, double radius) {
  Patch out;
  std::vector<uint8_t> used(mesh.points.size(), 0);
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    Piece whole;
    for (size_t k = 0; k < 3; ++k) {
      whole.corner.at(k) = (mesh.points[mesh.mesh.faces[f].at(k)] - center) / radius;
      whole.weights.at(k) = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(k));
    }
    const size_t before = out.samples.size();
    add_piece(out, mesh, f, whole, 0);
    if (out.samples.size() == before) continue;
    for (const uint32_t v : mesh.mesh.faces[f]) used[v] = 1;
  }
  out.vertices = static_cast<size_t>(std::count(used.begin(), used.end(), uint8_t{1}));
  return out;
}

// Where a shape is looked for: axes (columns; the last one is normal or axis of the first guess)
// and a point of the first guess.
struct Local {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
};

int parameter_count(Shape shape) {
  return shape == Shape::Plane ? 3 : shape == Shape::Sphere ? 4 : 5;
}

// Distance to a shape and its derivatives by the parameters. Plane: two tilts and a shift. Sphere:
// centre and radius. Cylinder: two tilts of the axis, its shift in two directions, radius.
double distance(Shape shape,
                const Eigen::Vector3d& q,
                const Eigen::VectorXd& p,
                Eigen::VectorXd& row) {
  constexpr double kTiny = 1e-150;  // no division by nothing on a centre or an axis
  if (shape == Shape::Sphere) {
    const Eigen::Vector3d d = q - p.head<3>();
    row.head<3>() = -d / (d.norm() + kTiny);
    row[3] = -1;
    return d.norm() - p[3];
  }
  const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + 1);
  const Eigen::Vector3d along = Eigen::Vector3d(p[0], p[1], 1) / length;
  if (shape == Shape::Plane) {
    const double height = q.dot(along);
    row[0] = (q[0] - height * along[0]) / length;
    row[1] = (q[1] - height * along[1]) / length;
    row[2] = -1;
    return height - p[2];
  }
  const Eigen::Vector3d d = q - Eigen::Vector3d(p[2], p[3], 0);
  const double height = d.dot(along);
  const Eigen::Vector3d across = d - height * along;
  const double radius = across.norm();
  const Eigen::Vector3d out = across / (radius + kTiny);
  row[0] = -height * out[0] / length;
  row[1] = -height * out[1] / length;
  row[2] = -out[0];
  row[3] = -out[1];
  row[4] = -1;
  return radius - p[4];
}

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
Eigen::VectorXd algebraic_center(const std::vector<Sample>& samples, const Local& local, int dims) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(dims + 1, dims + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(dims + 1);
  for (const Sample& s : samples) {
    Eigen::VectorXd row(dims + 1);
    const Eigen::VectorXd q = (local.axes.transpose() * (s.place - local.point)).head(dims);
    row << 2 * q, 1;
    normal += s.area * row * row.transpose();
    right += s.area * q.squaredNorm() * row;
  }
  Eigen::VectorXd out = normal.ldlt().solve(right);
  out[dims] = std::sqrt(std::max(0.0, out[dims] + out.head(dims).squaredNorm()));
  return out;
}

// The sums of least squares at a set of parameters.
struct Normal {
  Eigen::MatrixXd hessian;   // sum of w J J^T
  Eigen::VectorXd gradient;  // sum of w J r
  Eigen::VectorXd shift;     // sum of w J sigma: every stated sigma at once
  double squares = 0;        // sum of w r^2
  double largest = 0;
};

Normal normal_equations(Shape shape,
                        const Patch& patch,
                        const Local& local,
                        const Eigen::VectorXd& parameters) {
  const Eigen::Index n = parameters.size();
  Normal out{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  Eigen::VectorXd row(n);
  for (const Sample& s : patch.samples) {
    const Eigen::Vector3d q = local.axes.transpose() * (s.place - local.point);
    const double r = distance(shape, q, parameters, row);
    out.hessian += s.area * row * row.transpose();
    out.gradient += s.area * r * row;
    if (std::isfinite(s.sigma)) out.shift += s.area * s.sigma * row;
    out.squares += s.area * r * r;
    out.largest = std::max(out.largest, std::abs(r));
  }
  return out;
}

struct Fitted {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;
  double rms = 0;
  double largest = 0;
};

// Levenberg and Marquardt from a first guess, and how well the patch determines the parameters.
Fitted solve(Shape shape, const Patch& patch, const Local& local, const Eigen::VectorXd& guess) {
  const int n = parameter_count(shape);
  Fitted out{guess, {}};
  Normal at = normal_equations(shape, patch, local, guess);
  double damping = 1e-3;
  constexpr int kMostSteps = 200;
  for (int i = 0; i < kMostSteps && damping < 1e12; ++i) {
    Eigen::MatrixXd damped = at.hessian;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = damped.ldlt().solve(-at.gradient);
    const Eigen::VectorXd next = out.parameters + step;
    const Normal there = normal_equations(shape, patch, local, next);
    if (!(there.squares <= at.squares)) {
      damping *= 10;
      continue;
    }
    out.parameters = next;
    at = there;
    damping /= 10;
    if (step.norm() <= 1e-13 * (1 + next.norm())) break;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(at.hessian);
  constexpr double kSingular = 1e-9;
  if (!out.parameters.allFinite() ||
      !(eigen.eigenvalues()[0] > kSingular * eigen.eigenvalues()[n - 1])) {
    throw NumericalError(
        "the surface within the ball does not determine this shape; take a larger --radius or "
        "another shape");
  }
  out.rms = std::sqrt(at.squares / patch.area);
  out.largest = at.largest;
  const auto points = static_cast<double>(std::max(patch.vertices, static_cast<size_t>(n + 1)));
  const Eigen::MatrixXd inverse = at.hessian.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd together = inverse * at.shift;
  out.covariance = inverse * (at.squares / (points - n)) + together * together.transpose();
  return out;
}

ShapeFit common_part(const Patch& patch, Shape shape, double radius) {
  ShapeFit out;
  out.shape = shape;
  out.vertices = patch.vertices;
  out.area.dimension = 2;
  out.area.value = patch.area * radius * radius;
  for (size_t i = 0; i < kProvenanceCount; ++i) {
    out.area.by_provenance.at(i) = patch.area_of_label.at(i) * radius * radius;
  }
  out.area.stated = patch.stated_area / patch.area;
  return out;
}

void set_radius(ShapeFit& out, double value, double variance, const Patch& patch) {
  out.radius.value = value;
  out.radius.sigma = std::sqrt(variance);
  out.radius.stated = patch.stated_area / patch.area;
  for (size_t i = 0; i < kProvenanceCount; ++i) {
    out.radius.by_provenance.at(i) = value * patch.area_of_label.at(i) / patch.area;
  }
}

ShapeFit fit_plane(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Local local{scatter_axes(patch, mean, false), mean};
  const Fitted fit = solve(Shape::Plane, patch, local, Eigen::VectorXd::Zero(3));
  const Eigen::Vector3d along =
      local.axes * Eigen::Vector3d(fit.parameters[0], fit.parameters[1], 1).normalized();
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
  const Local local;
  const Fitted fit = solve(Shape::Sphere, patch, local, algebraic_center(patch.samples, local, 3));
  out.point = fit.parameters.head(3);
  out.point_sigma = std::sqrt(fit.covariance.topLeftCorner(3, 3).trace());
  set_radius(out, fit.parameters[3], fit.covariance(3, 3), patch);
  out.rms = fit.rms;
  out.largest = fit.largest;
  return out;
}

ShapeFit fit_cylinder(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Eigen::Matrix3d axes = scatter_axes(patch, mean, true);  // normals avoid the axis
  const Local local{axes, mean};
  Eigen::VectorXd guess(5);
  guess << 0, 0, algebraic_center(patch.samples, local, 2);
  const Fitted fit = solve(Shape::Cylinder, patch, local, guess);
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
