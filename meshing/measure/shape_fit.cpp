// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/shape_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/measure/surface_measures.h"

namespace cgs {

namespace {

// A small piece of the patch, or a corner of it with its share, in units of the ball around its
// centre.
struct Sample {
  Eigen::Vector3d place;
  Eigen::Vector3d normal;  // zero for a corner
  double area;
  double sigma;  // NaN = no statement
};

struct Patch {
  std::vector<Sample> samples;
  std::vector<Sample> corners;  // of the faces with samples, each place once
  double area = 0;
  std::array<double, kProvenanceCount> area_of_label = {};
  double stated_area = 0;
};

// A part of a face: its corners [radii from the middle of the ball], and their weights in the face.
struct FacePart {
  std::array<Eigen::Vector3d, 3> corner;
  std::array<Eigen::Vector3d, 3> weights;

  bool meets_ball() const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& c : corner) box.extend(c);
    return box.squaredExteriorDistance(Eigen::Vector3d::Zero()) <= 1;
  }
  double side(size_t k) const { return (corner.at((k + 1) % 3) - corner.at(k)).norm(); }
  double longest() const { return std::max({side(0), side(1), side(2)}); }
  // Across the longest side, so that the parts of a long thin face are no thinner than it.
  std::array<FacePart, 2> halves() const {
    size_t k = 0;
    while (side(k) < longest()) ++k;
    const size_t next = (k + 1) % 3;
    std::array<FacePart, 2> out = {*this, *this};
    out[0].corner.at(next) = out[1].corner.at(k) = (corner.at(k) + corner.at(next)) / 2;
    out[0].weights.at(next) = out[1].weights.at(k) = (weights.at(k) + weights.at(next)) / 2;
    return out;
  }
};

// What vertices have of the area within the ball.
struct CornerShares {
  std::vector<double> area;     // of faces around, by how near to the vertex it lies
  std::vector<double> evident;  // without that of invented faces
};

// Where samples of a patch go.
struct Collected {
  const MeasurableMesh& mesh;
  Patch& patch;
  CornerShares& shares;
};

// Splits a piece of face f into n x n equal triangles and takes the middles of those within the
// ball.
void add_samples(const Collected& to, uint32_t f, const FacePart& piece) {
  const MeasurableMesh& mesh = to.mesh;
  Patch& patch = to.patch;
  CornerShares& shares = to.shares;
  constexpr double kFinest = 24;  // pieces per radius
  const Eigen::Vector3d u = piece.corner[1] - piece.corner[0];
  const Eigen::Vector3d v = piece.corner[2] - piece.corner[0];
  const Eigen::Vector3d twice = u.cross(v);
  if (twice.squaredNorm() == 0) return;
  const int n = static_cast<int>(std::max(std::ceil(piece.longest() * kFinest), 1.0));
  const double area = twice.norm() / 2 / n / n;
  const bool invented = mesh.states_provenance() && !has_evidence(mesh.mesh.provenance[f]);
  const bool states_sigma = !mesh.mesh.sigma.empty();
  const auto& face = mesh.mesh.faces[f];
  const auto add = [&](double s, double t) {
    const Eigen::Vector3d p = piece.corner[0] + s * u + t * v;
    if (p.squaredNorm() > 1) return;
    const Eigen::Vector3d weights =
        (1 - s - t) * piece.weights[0] + s * piece.weights[1] + t * piece.weights[2];
    for (size_t k = 0; k < 3; ++k) {
      const double share = area * weights[static_cast<Eigen::Index>(k)];
      shares.area[face.at(k)] += share;
      if (!invented) shares.evident[face.at(k)] += share;
    }
    double sigma = std::nan("");
    if (states_sigma && !invented) {
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

// Of a large face only what is near the ball. \param depth  how often the face was halved
void add_piece(const Collected& to, uint32_t f, const FacePart& piece, int depth) {
  constexpr double kLongest = 16;  // [radii]
  constexpr int kDeepest = 128;    // for balls so small that nothing is within reach of double
  if (!piece.meets_ball() || depth > kDeepest) return;
  if (piece.longest() <= kLongest) {
    add_samples(to, f, piece);
    return;
  }
  for (const FacePart& half : piece.halves()) add_piece(to, f, half, depth + 1);
}

// Vertices in one place, as in files without shared vertices, are one corner: they err together.
std::vector<Sample> corners(const MeasurableMesh& mesh,
                            const CornerShares& shares,
                            const Eigen::Vector3d& center,
                            double radius) {
  std::vector<Sample> out;
  std::map<std::array<double, 3>, size_t> corner_at;
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    if (shares.area[v] == 0) continue;
    const Eigen::Vector3d& p = mesh.points[v];
    const auto [known, is_new] = corner_at.try_emplace({p.x(), p.y(), p.z()}, out.size());
    if (is_new) {
      out.push_back({(p - center) / radius, Eigen::Vector3d::Zero(), 0, std::nan("")});
    }
    Sample& corner = out[known->second];
    corner.area += shares.area[v];
    const double sigma = mesh.mesh.sigma.empty() ? std::nan("") : double(mesh.mesh.sigma[v]);
    if (!std::isfinite(sigma) || shares.evident[v] == 0) continue;
    if (std::isnan(corner.sigma)) corner.sigma = 0;
    corner.sigma += sigma / radius * shares.evident[v];
  }
  for (Sample& corner : out) corner.sigma /= corner.area;
  return out;
}

Patch patch_within(const MeasurableMesh& mesh, const Eigen::Vector3d& center, double radius) {
  Patch out;
  CornerShares shares{std::vector<double>(mesh.points.size(), 0),
                      std::vector<double>(mesh.points.size(), 0)};
  for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) {
    FacePart whole;
    for (size_t k = 0; k < 3; ++k) {
      whole.corner.at(k) = (mesh.points[mesh.mesh.faces[f].at(k)] - center) / radius;
      whole.weights.at(k) = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(k));
    }
    add_piece({mesh, out, shares}, f, whole, 0);
  }
  for (Sample& s : out.samples) s.sigma /= radius;
  out.corners = corners(mesh, shares, center, radius);
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
  Eigen::MatrixXd scatter;   // sum of w^2 J J^T
  double weight = 0;         // sum of w
  double squares = 0;        // sum of w r^2
  double largest = 0;
};

Normal normal_equations(Shape shape,
                        const std::vector<Sample>& samples,
                        const Local& local,
                        const Eigen::VectorXd& parameters) {
  const Eigen::Index n = parameters.size();
  Normal out{Eigen::MatrixXd::Zero(n, n),
             Eigen::VectorXd::Zero(n),
             Eigen::VectorXd::Zero(n),
             Eigen::MatrixXd::Zero(n, n)};
  Eigen::VectorXd row(n);
  for (const Sample& s : samples) {
    const Eigen::Vector3d q = local.axes.transpose() * (s.place - local.point);
    const double r = distance(shape, q, parameters, row);
    out.hessian += s.area * row * row.transpose();
    out.gradient += s.area * r * row;
    if (std::isfinite(s.sigma)) out.shift += s.area * s.sigma * row;
    out.scatter += s.area * s.area * row * row.transpose();
    out.weight += s.area;
    out.squares += s.area * r * r;
    out.largest = std::max(out.largest, std::abs(r));
  }
  return out;
}

struct Fitted {
  Eigen::VectorXd parameters;
  Normal at;  // the parameters
};

// Tilts of an axis are taken at the reach of places along it: long facets end far from the ball.
bool is_determined(Shape shape, const Normal& at) {
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(at.gradient.size());
  if (shape == Shape::Cylinder) {
    const double reach = std::sqrt(at.hessian.topLeftCorner(2, 2).trace() / at.weight);
    scale.head(2) /= std::max(1.0, reach);
  }
  const Eigen::MatrixXd scaled = scale.asDiagonal() * at.hessian * scale.asDiagonal();
  if (!scaled.allFinite()) return false;
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kSingular = 1e-9;
  return values[0] > kSingular * values[values.size() - 1];
}

// Levenberg and Marquardt from a first guess.
Fitted solve(Shape shape,
             const std::vector<Sample>& samples,
             const Local& local,
             const Eigen::VectorXd& guess) {
  Fitted out{guess, normal_equations(shape, samples, local, guess)};
  double damping = 1e-3;
  constexpr int kMostSteps = 200;
  for (int i = 0; i < kMostSteps && damping < 1e12; ++i) {
    Eigen::MatrixXd damped = out.at.hessian;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = damped.ldlt().solve(-out.at.gradient);
    const Eigen::VectorXd next = out.parameters + step;
    const Normal there = normal_equations(shape, samples, local, next);
    if (!(there.squares <= out.at.squares)) {
      damping *= 10;
      continue;
    }
    out.parameters = next;
    out.at = there;
    damping /= 10;
    if (step.norm() <= 1e-13 * (1 + next.norm())) break;
  }
  if (samples.size() <= static_cast<size_t>(parameter_count(shape)) ||
      !out.parameters.allFinite() || !is_determined(shape, out.at)) {
    throw NumericalError(
        "the surface within the ball does not determine this shape; take a larger radius or "
        "another shape");
  }
  return out;
}

// Covariances of the parameters.
struct Errors {
  Eigen::MatrixXd scatter;  // by residuals, as if every vertex erred on its own
  Eigen::MatrixXd common;   // by the stated sigma, as if all erred the same way

  double variance(Eigen::Index i) const { return scatter(i, i) + common(i, i); }
};

Eigen::MatrixXd inverse_hessian(const Normal& at) {
  const Eigen::Index n = at.gradient.size();
  return at.hessian.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
}

Eigen::MatrixXd common_errors(const Normal& at, const Eigen::MatrixXd& inverse) {
  const Eigen::VectorXd together = inverse * at.shift;
  return together * together.transpose();
}

// Of a fit to samples, which err no more on their own than the vertices do.
Errors errors_of_samples(const Normal& at, size_t vertices) {
  const auto n = static_cast<double>(at.gradient.size());
  const Eigen::MatrixXd inverse = inverse_hessian(at);
  const double points = std::max(static_cast<double>(vertices), n + 1);
  return {inverse * (at.squares / (points - n)), common_errors(at, inverse)};
}

// Of a fit to corners of any weights. Residuals are smaller than the errors by what the fit follows
// of each, so that the sum of w r^2 is expected to be the variance times this freedom.
Errors errors_of_corners(const Normal& at) {
  const Eigen::MatrixXd inverse = inverse_hessian(at);
  constexpr double kLeast = 1e-9;  // of all weight, which rounding may leave of none
  const double freedom = std::max(at.weight - (inverse * at.scatter).trace(), kLeast * at.weight);
  const double variance = at.squares / freedom;
  return {inverse * at.scatter * inverse * variance, common_errors(at, inverse)};
}

ShapeFit common_part(const Patch& patch, Shape shape, double radius) {
  ShapeFit out;
  out.shape = shape;
  out.vertices = patch.corners.size();
  out.area.dimension = 2;
  out.area.value = patch.area * radius * radius;
  for (size_t i = 0; i < kProvenanceCount; ++i) {
    out.area.by_provenance.at(i) = patch.area_of_label.at(i) * radius * radius;
  }
  out.area.stated = patch.stated_area / patch.area;
  return out;
}

void set_radius(ShapeFit& out, double value, const Errors& errors, const Patch& patch) {
  const Eigen::Index last = errors.scatter.rows() - 1;
  out.radius.value = value;
  out.radius_scatter = std::sqrt(errors.scatter(last, last));
  out.radius.stated = patch.stated_area / patch.area;
  if (out.radius.stated > 0) out.radius.sigma = std::sqrt(errors.variance(last));
  for (size_t i = 0; i < kProvenanceCount; ++i) {
    out.radius.by_provenance.at(i) = value * patch.area_of_label.at(i) / patch.area;
  }
}

// What the surface, between its vertices as well, leaves to a shape.
void set_residuals(ShapeFit& out, const Patch& patch, const Local& local, const Fitted& fit) {
  const Normal all = normal_equations(out.shape, patch.samples, local, fit.parameters);
  out.rms = std::sqrt(all.squares / all.weight);
  out.largest = all.largest;
}

ShapeFit fit_plane(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Local local{scatter_axes(patch, mean, false), mean};
  const Fitted fit = solve(Shape::Plane, patch.samples, local, Eigen::VectorXd::Zero(3));
  const Errors errors = errors_of_samples(fit.at, patch.corners.size());
  const Eigen::Vector3d along =
      local.axes * Eigen::Vector3d(fit.parameters[0], fit.parameters[1], 1).normalized();
  double facing = 0;
  for (const Sample& s : patch.samples) facing += s.area * s.normal.dot(along);
  out.point = mean + fit.parameters[2] * along;
  out.direction = facing < 0 ? Eigen::Vector3d(-along) : along;
  out.point_sigma = std::sqrt(errors.variance(2));
  out.direction_sigma = std::sqrt(errors.variance(0) + errors.variance(1));
  set_residuals(out, patch, local, fit);
  return out;
}

// Round shapes are fitted to the corners: facets cut off from them what lies between.
ShapeFit fit_sphere(const Patch& patch, ShapeFit out) {
  const Local local;
  const Fitted fit =
      solve(Shape::Sphere, patch.corners, local, algebraic_center(patch.corners, local, 3));
  const Errors errors = errors_of_corners(fit.at);
  out.point = fit.parameters.head(3);
  out.point_sigma = std::sqrt(errors.variance(0) + errors.variance(1) + errors.variance(2));
  set_radius(out, fit.parameters[3], errors, patch);
  set_residuals(out, patch, local, fit);
  return out;
}

ShapeFit fit_cylinder(const Patch& patch, ShapeFit out) {
  const Eigen::Vector3d mean = mean_place(patch);
  const Eigen::Matrix3d axes = scatter_axes(patch, mean, true);  // normals avoid the axis
  const Local local{axes, mean};
  Eigen::VectorXd guess(5);
  guess << 0, 0, algebraic_center(patch.corners, local, 2);
  const Fitted fit = solve(Shape::Cylinder, patch.corners, local, guess);
  const Errors errors = errors_of_corners(fit.at);
  out.direction = axes * Eigen::Vector3d(fit.parameters[0], fit.parameters[1], 1).normalized();
  const Eigen::Vector3d on_axis =
      mean + axes * Eigen::Vector3d(fit.parameters[2], fit.parameters[3], 0);
  out.point = on_axis + out.direction.dot(mean - on_axis) * out.direction;
  out.point_sigma = std::sqrt(errors.variance(2) + errors.variance(3));
  out.direction_sigma = std::sqrt(errors.variance(0) + errors.variance(1));
  set_radius(out, fit.parameters[4], errors, patch);
  set_residuals(out, patch, local, fit);
  return out;
}

}  // namespace

ShapeFit fit_shape(const MeasurableMesh& mesh,
                   Shape shape,
                   const Eigen::Vector3d& center,
                   double radius) {
  require(radius > 0 && std::isfinite(radius), "the radius of a fit must be > 0", radius);
  const Patch patch = patch_within(mesh, center, radius);
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
  out.radius_scatter *= radius;
  for (double& part : out.radius.by_provenance) part *= radius;
  return out;
}

}  // namespace cgs
