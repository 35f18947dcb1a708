// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/sh_rotation.h"

#include <cmath>
#include <cstdlib>

namespace cgs {

namespace {

/// The matrix of one degree from those of degree 1 and of the degree before, in the notation of the
/// paper: rows m and columns n from -degree to degree, P, U, V, W and their factors u, v, w.
class NextDegree {
 public:
  NextDegree(const Eigen::MatrixXd& first, const Eigen::MatrixXd& before, int degree)
      : first_(first), before_(before), l_(degree) {}

  Eigen::MatrixXd matrix() const {
    Eigen::MatrixXd out(2 * l_ + 1, 2 * l_ + 1);
    for (int m = -l_; m <= l_; ++m) {
      for (int n = -l_; n <= l_; ++n) out(m + l_, n + l_) = entry(m, n);
    }
    return out;
  }

 private:
  double entry(int m, int n) const {
    const int size = std::abs(m);
    const double divisor = std::abs(n) == l_ ? 2 * l_ * (2 * l_ - 1) : (l_ + n) * (l_ - n);
    const double u = std::sqrt((l_ + m) * (l_ - m) / divisor);
    const double both = (l_ + size - 1) * (l_ + size) / divisor;
    const double v = m == 0 ? -0.5 * std::sqrt(2 * both) : 0.5 * std::sqrt(both);
    const double w = m == 0 ? 0 : -0.5 * std::sqrt((l_ - size - 1) * (l_ - size) / divisor);
    double out = 0;  // a factor of 0 comes with indices that do not exist
    if (u != 0) out += u * p(0, m, n);
    if (v != 0) out += v * big_v(m, n);
    if (w != 0) out += w * big_w(m, n);
    return out;
  }

  double p(int i, int a, int b) const {
    const auto f = [&](int column) { return first_(i + 1, column + 1); };
    const auto g = [&](int column) { return before_(a + l_ - 1, column + l_ - 1); };
    if (b == -l_) return f(1) * g(-l_ + 1) + f(-1) * g(l_ - 1);
    if (b == l_) return f(1) * g(l_ - 1) - f(-1) * g(-l_ + 1);
    return f(0) * g(b);
  }

  double big_v(int m, int n) const {
    if (m == 0) return p(1, 1, n) + p(-1, -1, n);
    if (m == 1) return std::sqrt(2.0) * p(1, 0, n);
    if (m == -1) return std::sqrt(2.0) * p(-1, 0, n);
    return m > 0 ? p(1, m - 1, n) - p(-1, -m + 1, n) : p(1, m + 1, n) + p(-1, -m - 1, n);
  }

  double big_w(int m, int n) const {
    return m > 0 ? p(1, m + 1, n) + p(-1, -m - 1, n) : p(1, m - 1, n) - p(-1, -m + 1, n);
  }

  const Eigen::MatrixXd& first_;
  const Eigen::MatrixXd& before_;
  int l_;
};

}  // namespace

ShRotation::ShRotation(const Eigen::Matrix3d& rotation) {
  constexpr std::array<int, 3> kAxes = {1, 2, 0};  // degree 1 is y, z, x
  degrees_[0] = Eigen::MatrixXd::Identity(1, 1);
  degrees_[1].resize(3, 3);
  for (size_t m = 0; m < 3; ++m) {
    for (size_t n = 0; n < 3; ++n) {
      degrees_[1](static_cast<int>(m), static_cast<int>(n)) = rotation(kAxes.at(m), kAxes.at(n));
    }
  }
  for (int l = 2; l <= 3; ++l) {
    const auto i = static_cast<size_t>(l);
    degrees_.at(i) = NextDegree(degrees_[1], degrees_.at(i - 1), l).matrix();
  }
  // The paper's functions of odd order have the other sign than those of 3DGS.
  for (int l = 1; l <= 3; ++l) {
    Eigen::MatrixXd& matrix = degrees_.at(static_cast<size_t>(l));
    for (int m = 0; m <= 2 * l; ++m) {
      for (int n = (m + 1) % 2; n <= 2 * l; n += 2) matrix(m, n) *= -1;
    }
  }
}

void ShRotation::apply(std::span<Eigen::Vector3f> coefficients) const {
  size_t begin = 1;
  for (size_t l = 1; begin < coefficients.size(); ++l) {
    const size_t count = 2 * l + 1;
    Eigen::Matrix<double, 7, 3> before = Eigen::Matrix<double, 7, 3>::Zero();
    for (size_t k = 0; k < count; ++k) {
      before.row(static_cast<int>(k)) = coefficients[begin + k].cast<double>().transpose();
    }
    for (size_t k = 0; k < count; ++k) {
      const auto row = degrees_.at(l).row(static_cast<int>(k));
      coefficients[begin + k] =
          (row * before.topRows(static_cast<int>(count))).transpose().cast<float>();
    }
    begin += count;
  }
}

}  // namespace cgs
