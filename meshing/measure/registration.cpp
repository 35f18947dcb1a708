// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/registration.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/remedy.h"
#include "meshing/mesh/measured_value.h"

namespace cgs {

namespace {

constexpr size_t kFewestPoints = 100;
constexpr double kReach = 4.6851;  // widths of Tukey's weights: 95 % efficient for normal errors

// What was invented of a surface says nothing of where it lies, unless all of it was.
bool leaves_out_unseen(const MeasurableMesh& mesh) {
  const auto& labels = mesh.mesh.provenance;
  return mesh.states_provenance() && std::any_of(labels.begin(), labels.end(), was_seen);
}

// A point after the motion so far, and the plane it is drawn to.
struct Pair {
  Eigen::Vector3d place;
  Eigen::Vector3d normal;
  double distance = 0;  // along the normal, from the plane to the place
  bool counts = true;
};

std::vector<Pair> pairs(const std::vector<Eigen::Vector3d>& points,
                        const Registration& motion,
                        const MeasurableMesh& mesh,
                        const NearestSurface& surface) {
  std::vector<Pair> out(points.size());
  const bool only_seen = leaves_out_unseen(mesh);
  tbb::parallel_for(size_t(0), points.size(), [&](size_t i) {
    out[i].place = motion.apply(points[i]);
    const SurfacePoint nearest = surface.nearest(out[i].place);
    const SurfaceEvidence evidence = evidence_at(mesh, nearest);
    out[i].normal = evidence.normal;
    // A rim would draw what lies beyond it, where the surface goes on and nobody recorded it.
    out[i].counts = (!only_seen || was_seen(evidence.provenance)) && !surface.is_on_rim(nearest);
    // Where an edge is nearest (a ridge, a corner) the way to it is the better direction.
    const Eigen::Vector3d offset = out[i].place - nearest.position;
    if (nearest.weights.minCoeff() == 0 && offset.norm() > 1e-12)
      out[i].normal = offset.normalized();
    out[i].distance = offset.dot(out[i].normal);
  });
  out.erase(std::remove_if(out.begin(), out.end(), [](const Pair& p) { return !p.counts; }),
            out.end());
  if (out.size() < kFewestPoints) {
    throw WithRemedy<NumericalError>(
        Remedy::NoRegistration,
        "the surfaces hardly meet where both were seen; lay them onto each other first, and "
        "compare them as they lie");
  }
  return out;
}

// Standard deviation of the middle of the distances, however wild the rest.
double robust_width(const std::vector<Pair>& all) {
  std::vector<double> distances;
  distances.reserve(all.size());
  for (const Pair& p : all) distances.push_back(std::abs(p.distance));
  constexpr double kNormal = 1.4826;  // median to standard deviation of a normal distribution
  return std::max(kNormal * median(distances), 1e-12);
}

double tukey_weight(double distance, double width) {
  const double u = distance / (kReach * width);
  return std::abs(u) >= 1 ? 0 : (1 - u * u) * (1 - u * u);
}

struct Used {
  double rms = 0;
  double share = 0;
};

Used used(const std::vector<Pair>& all, double width, size_t points) {
  Used out;
  double squares = 0;
  size_t count = 0;
  for (const Pair& p : all) {
    if (tukey_weight(p.distance, width) == 0) continue;
    squares += p.distance * p.distance;
    ++count;
  }
  out.rms = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
  out.share = static_cast<double>(count) / static_cast<double>(points);
  return out;
}

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

// The small rotation, translation and growth about `center` that bring the pairs together.
Vector7 step(const std::vector<Pair>& all,
             double width,
             const Eigen::Vector3d& center,
             double radius,
             bool with_scale) {
  Matrix7 normal = Matrix7::Zero();
  Vector7 right = Vector7::Zero();
  for (const Pair& p : all) {  // in order, so that the sums have the same bits for any threads
    const double weight = tukey_weight(p.distance, width);
    if (weight == 0) continue;
    const Eigen::Vector3d q = (p.place - center) / radius;
    const Eigen::Vector3d turning = q.cross(p.normal);
    Vector7 row;
    for (int k = 0; k < 3; ++k) {
      row[k] = turning[k];
      row[k + 3] = p.normal[k];
    }
    row[6] = with_scale ? q.dot(p.normal) : 0;
    normal += weight * row * row.transpose();
    right -= weight * p.distance / radius * row;
  }
  const int unknowns = with_scale ? 7 : 6;
  const Eigen::MatrixXd part = normal.topLeftCorner(unknowns, unknowns);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(part);
  constexpr double kSliding = 1e-8;
  if (!(eigen.eigenvalues()[0] > kSliding * eigen.eigenvalues()[unknowns - 1])) {
    throw WithRemedy<NumericalError>(
        Remedy::NoRegistration,
        "the surfaces do not hold each other in every direction: a plane, a ball or a tube slides, "
        "and so do surfaces that hardly meet, being of other units or elsewhere; lay them onto "
        "each other first, and compare them as they lie");
  }
  Vector7 out = Vector7::Zero();
  out.head(unknowns) = part.ldlt().solve(right.head(unknowns));
  out.segment<3>(3) *= radius;
  return out;
}

void move(Registration& motion, const Vector7& by, const Eigen::Vector3d& center) {
  const Eigen::Vector3d turn = by.head<3>();
  const double angle = turn.norm();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  if (angle > 0) rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  const double growth = 1 + by[6];
  motion.translation =
      growth * (rotation * (motion.translation - center)) + center + by.segment<3>(3);
  motion.rotation = Eigen::Quaterniond(rotation * motion.rotation).normalized().toRotationMatrix();
  motion.scale *= growth;
}

}  // namespace

Registration register_points(const std::vector<Eigen::Vector3d>& points,
                             const MeasurableMesh& mesh,
                             const NearestSurface& surface,
                             bool with_scale) {
  require(
      points.size() >= kFewestPoints, "a registration needs points, their number", points.size());
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) box.extend(p);
  const double radius = box.diagonal().norm() / 2;
  Registration out;
  constexpr int kMostIterations = 100;
  constexpr double kStill = 1e-9;  // of the radius
  for (; out.iterations < kMostIterations; ++out.iterations) {
    const auto all = pairs(points, out, mesh, surface);
    const double width = robust_width(all);
    const Used now = used(all, width, points.size());
    if (out.iterations == 0) out.rms_before = now.rms;
    const Eigen::Vector3d center = out.apply(box.center());
    const Vector7 by = step(all, width, center, radius, with_scale);
    if (!by.allFinite()) throw NumericalError("the registration found no finite motion");
    move(out, by, center);
    const double largest =
        std::max({by.head<3>().norm(), by.segment<3>(3).norm() / radius, std::abs(by[6])});
    out.converged = largest < kStill;
    if (out.converged) break;
  }
  const auto all = pairs(points, out, mesh, surface);
  const Used end = used(all, robust_width(all), points.size());
  out.rms_after = end.rms;
  out.share = end.share;
  return out;
}

}  // namespace cgs
