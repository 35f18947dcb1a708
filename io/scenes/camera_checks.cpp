// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/camera_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <Eigen/SVD>
#include <unsupported/Eigen/Polynomials>

namespace cgs {

namespace {

std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

// Next to a large root the solver leaves rounding of those at 0.
bool is_root(const Eigen::VectorXd& polynomial, double t) {
  constexpr double kSmall = 1e-6;
  const double value = Eigen::poly_eval(polynomial, t);
  return std::abs(value) <= kSmall * Eigen::poly_eval(polynomial.cwiseAbs(), t);
}

double radial_factor(const std::array<double, 5>& distortion, double r) {
  const double r2 = r * r;
  return 1 + r2 * (distortion[0] + r2 * (distortion[1] + r2 * distortion[4]));
}

}  // namespace

Eigen::Isometry3d checked_pose(const Eigen::Matrix3d& rotation,
                               const Eigen::Vector3d& translation,
                               const Refuse& refuse) {
  if (!rotation.allFinite() || !translation.allFinite()) {
    refuse(Defect::Value, "the pose contains a value that is not finite");
  }
  constexpr double kFarthest = 1e12;  // [scene units]: beyond, squares of distances lose the scene
  if (!(translation.cwiseAbs().maxCoeff() <= kFarthest)) {
    refuse(Defect::Value, "the camera is further away than " + text(kFarthest));
  }
  constexpr double kTolerance = 1e-3;
  constexpr double kExactEnough = 1e-12;
  const double residual =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(residual <= kTolerance)) {
    refuse(Defect::Value,
           "the rotation is not orthonormal (residual " + text(residual) + ", allowed " +
               text(kTolerance) + ")");
  }
  if (!(rotation.determinant() > 0)) {
    refuse(Defect::Value, "the rotation is a reflection (determinant -1)");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation;
  if (residual > kExactEnough) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  }
  pose.translation() = translation;
  return pose;
}

void check_intrinsics(const Camera& camera, const Refuse& refuse, const ReadLimits& limits) {
  if (camera.width <= 0 || camera.height <= 0) {
    refuse(Defect::Value,
           "image size " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
               " must be positive");
  }
  const uint64_t pixels =
      static_cast<uint64_t>(camera.width) * static_cast<uint64_t>(camera.height);
  if (pixels > limits.max_pixels) {
    refuse(Defect::Value,
           "a camera of " + std::to_string(pixels) + " pixels, allowed are " +
               std::to_string(limits.max_pixels));
  }
  constexpr double kMaxFocal = 1e6;  // image widths: a view of less than 0.00006 degrees
  for (const auto& [value, name] : {std::pair(camera.fx, "fx"), std::pair(camera.fy, "fy")}) {
    if (!(value > 0 && value < kMaxFocal * camera.width)) {
      refuse(Defect::Value, std::string(name) + " = " + text(value) + " must be > 0 and finite");
    }
  }
  constexpr double kFarOut = 10;  // image sizes
  if (!(std::abs(camera.cx) <= kFarOut * camera.width)) {
    refuse(Defect::Value, "cx = " + text(camera.cx) + " lies far outside the image");
  }
  if (!(std::abs(camera.cy) <= kFarOut * camera.height)) {
    refuse(Defect::Value, "cy = " + text(camera.cy) + " lies far outside the image");
  }
}

void set_intrinsics(Camera& camera, const Eigen::Matrix3d& K, const Refuse& refuse) {
  const bool has_skew = std::abs(K(0, 1)) > 1e-9 * std::abs(K(0, 0));
  if (has_skew || K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1) {
    refuse(Defect::Unsupported, "K must be fx 0 cx / 0 fy cy / 0 0 1");
  }
  camera.fx = K(0, 0);
  camera.fy = K(1, 1);
  camera.cx = K(0, 2);
  camera.cy = K(1, 2);
  check_intrinsics(camera, refuse);
}

void check_coefficient(double value, const Refuse& refuse) {
  constexpr double kLargest = 1e50;  // far above any lens; its powers are finite
  if (std::abs(value) <= kLargest) return;
  refuse(Defect::Value,
         "a distortion coefficient is " + text(value) + ", allowed is up to " + text(kLargest));
}

double fold_radius(const std::array<double, 5>& distortion) {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  return fold_radius(std::array<double, 4>{k1, k2, k3, 0});
}

double fold_radius(const std::array<double, 4>& radial) {
  // The derivative, as a polynomial in t = 1 / r^2: its highest coefficient is 1 however small the
  // coefficients of the lens are.
  Eigen::VectorXd polynomial(5);
  polynomial << 9 * radial[3], 7 * radial[2], 5 * radial[1], 3 * radial[0], 1;
  Eigen::Index zeros = 0;
  while (polynomial[zeros] == 0) ++zeros;
  if (zeros == 4) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd significant = polynomial.tail(5 - zeros);
  const Eigen::PolynomialSolver<double, Eigen::Dynamic> solver(significant);
  double largest = 0;
  for (const std::complex<double>& root : solver.roots()) {
    const double t = root.real();
    const bool is_real = std::abs(root.imag()) <= 1e-9 * std::abs(t);
    if (is_real && t > largest && is_root(significant, t)) largest = t;
  }
  return 1 / std::sqrt(largest);
}

void check_distortion(const Camera& camera,
                      const std::array<double, 5>& distortion,
                      const Refuse& refuse) {
  for (const double value : distortion) check_coefficient(value, refuse);
  const double fold = fold_radius(distortion);
  if (!std::isfinite(fold)) return;
  const double circle = std::min(std::min(camera.cx, camera.width - camera.cx) / camera.fx,
                                 std::min(camera.cy, camera.height - camera.cy) / camera.fy);
  const double reach = fold * radial_factor(distortion, fold);
  if (reach < circle) {
    refuse(Defect::Value,
           "the lens distortion cannot be undone beyond radius " + text(reach * camera.fx) +
               " pixels, which is inside the image");
  }
}

}  // namespace cgs
