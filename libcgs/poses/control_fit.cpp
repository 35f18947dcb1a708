// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/control_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <string>

#include <Eigen/Dense>
#include <ceres/ceres.h>

#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

constexpr size_t kFewest = 3;
constexpr double kChiSquared = 16.27;  // 99.9 % of a chi-squared of three coordinates lie below
using Places = std::vector<size_t>;    // of pairs
using Parameters = Eigen::Matrix<double, 7, 1>;  // log of scale, rotation vector, shift
using Information = Eigen::Matrix<double, 7, 7>;

/// Weighted least squares over some pairs.
struct Fit {
  Similarity similarity;
  Information covariance = Information::Zero();  // as the sigmas say, of Parameters
  double chi_squared = 0;
  int freedom = 0;  // equations above unknowns

  double scatter() const { return freedom > 0 ? std::sqrt(chi_squared / freedom) : 0; }
};

// Of the difference between a measured point, moved, and the known one.
Eigen::Matrix3d covariance_of(const ControlPair& pair, const Similarity& s) {
  constexpr double kRounding = 1e-15;  // of the distance from zero: what coordinates hold
  const double floor = kRounding * (1 + pair.known.norm());
  const double variance = pair.known_sigma * pair.known_sigma + floor * floor;
  return s.scale * s.scale * s.rotation * pair.covariance * s.rotation.transpose() +
         variance * Eigen::Matrix3d::Identity();
}

double squared_sigmas(const Eigen::Vector3d& off, const Eigen::Matrix3d& covariance) {
  return off.dot(covariance.ldlt().solve(off));
}

double squared_sigmas(const ControlPair& pair, const Similarity& s) {
  return squared_sigmas(s(pair.measured) - pair.known, covariance_of(pair, s));
}

Eigen::Vector3d mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p - points.front();
  return points.front() + sum / double(points.size());
}

/// Length and width of a set of points: standard deviations along and across its longest axis.
std::array<double, 2> extents(const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d centre = mean(points);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - centre) * (p - centre).transpose();
  const Eigen::Vector3d values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues();
  const double count = double(points.size());
  return {std::sqrt(std::max(0.0, values[2]) / count), std::sqrt(std::max(0.0, values[1]) / count)};
}

constexpr double kLeastWidth = 0.02;  // of the length: narrower is a line

bool is_line(const std::vector<Eigen::Vector3d>& points) {
  const auto [length, width] = extents(points);
  return !(width > kLeastWidth * length);
}

/// Both sides of some pairs.
struct Sides {
  std::vector<Eigen::Vector3d> measured;
  std::vector<Eigen::Vector3d> known;
};

Sides sides_of(const std::vector<ControlPair>& pairs, const Places& places) {
  Sides out;
  for (const size_t i : places) {
    out.measured.push_back(pairs[i].measured);
    out.known.push_back(pairs[i].known);
  }
  return out;
}

Similarity closed_form(const Sides& sides) {
  Similarity out;
  out.from = mean(sides.measured);
  out.to = mean(sides.known);
  Eigen::Matrix3Xd from(3, sides.measured.size());
  Eigen::Matrix3Xd to(3, sides.known.size());
  for (size_t i = 0; i < sides.known.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = sides.measured[i] - out.from;
    to.col(static_cast<Eigen::Index>(i)) = sides.known[i] - out.to;
  }
  const Eigen::Matrix4d moved = Eigen::umeyama(from, to);
  const Eigen::Matrix3d linear = moved.topLeftCorner<3, 3>();
  out.scale = std::cbrt(linear.determinant());
  out.rotation = linear / out.scale;
  return out;
}

/// The whitened difference of a pair as a function of a change of the similarity.
struct Difference {
  Eigen::Vector3d moved;  // scale * rotation * (measured - from)
  Eigen::Vector3d off;    // to - known
  Eigen::Matrix3d whitening;

  template <typename T>
  bool operator()(const T* change, T* residual) const {
    using std::exp;
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Vector turn(change[1], change[2], change[3]);
    const Vector p = moved.cast<T>();
    // The rotation vector is small: the start is right to the noise of the points. Two terms, whose
    // derivative is exact where the iteration ends.
    const Vector turned = p + turn.cross(p) + T(0.5) * turn.cross(turn.cross(p));
    const Vector shift(change[4], change[5], change[6]);
    Eigen::Map<Vector> out(residual);
    out = whitening.cast<T>() * (exp(change[0]) * turned + shift + off.cast<T>());
    return true;
  }
};

Eigen::Matrix3d whitening_of(const Eigen::Matrix3d& covariance) {
  const Eigen::LLT<Eigen::Matrix3d> factor(covariance);
  return factor.matrixL().solve(Eigen::Matrix3d::Identity());
}

void change(Similarity& s, const Parameters& by) {
  const Eigen::Vector3d turn = by.segment<3>(1);
  if (turn.norm() > 0) {
    s.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * s.rotation;
  }
  s.rotation = Eigen::Quaterniond(s.rotation).normalized().toRotationMatrix();
  s.scale *= std::exp(by[0]);
  s.to += by.tail<3>();
}

// One solution with weights from the similarity before it.
Parameters best_change(const std::vector<ControlPair>& pairs,
                       const Places& places,
                       const Similarity& s) {
  Parameters out = Parameters::Zero();
  ceres::Problem problem;
  for (const size_t i : places) {
    const ControlPair& pair = pairs[i];
    auto* difference = new Difference{s.scale * (s.rotation * (pair.measured - s.from)),
                                      s.to - pair.known,
                                      whitening_of(covariance_of(pair, s))};
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Difference, 3, 7>(difference), nullptr, out.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;  // sums in one order: same bits every time
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable() || !out.allFinite()) {
    throw NumericalError("no similarity fits the control points");
  }
  return out;
}

Eigen::Matrix<double, 3, 7> jacobian(const ControlPair& pair, const Similarity& s) {
  const Eigen::Vector3d p = s.scale * (s.rotation * (pair.measured - s.from));
  Eigen::Matrix<double, 3, 7> J;
  J << p.x(), 0, p.z(), -p.y(), 1, 0, 0,  //
      p.y(), -p.z(), 0, p.x(), 0, 1, 0,   //
      p.z(), p.y(), -p.x(), 0, 0, 0, 1;
  return J;
}

Fit fit(const std::vector<ControlPair>& pairs, const Places& places) {
  Fit out;
  out.similarity = closed_form(sides_of(pairs, places));
  constexpr int kRounds = 6;  // the weights turn with the rotation, which hardly changes
  for (int round = 0; round < kRounds; ++round) {
    change(out.similarity, best_change(pairs, places, out.similarity));
  }
  Information information = Information::Zero();
  for (const size_t i : places) {
    const Eigen::Matrix<double, 3, 7> J = jacobian(pairs[i], out.similarity);
    const Eigen::Matrix3d covariance = covariance_of(pairs[i], out.similarity);
    information += J.transpose() * covariance.ldlt().solve(J);
    out.chi_squared += squared_sigmas(pairs[i], out.similarity);
  }
  // Scaled to ones on the diagonal first: rotations and shifts have other units.
  const Parameters scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Information even = scale.asDiagonal() * information * scale.asDiagonal();
  const Information inverse = even.ldlt().solve(Information::Identity());
  out.covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
  out.freedom = 3 * static_cast<int>(places.size()) - 7;
  return out;
}

// As a point that had no say in the fit misses it.
double squared_sigmas_outside(const ControlPair& pair, const Fit& by, double scatter) {
  const Eigen::Matrix<double, 3, 7> J = jacobian(pair, by.similarity);
  const Eigen::Matrix3d of_fit = scatter * scatter * J * by.covariance * J.transpose();
  return squared_sigmas(by.similarity(pair.measured) - pair.known,
                        covariance_of(pair, by.similarity) + of_fit);
}

std::array<size_t, 3> numbered_triple(uint64_t number, size_t count) {
  std::array<size_t, 3> out{};
  uint64_t state = number;
  for (size_t k = 0; k < 3; ++k) {
    do {
      state = random_number(state);
      out.at(k) = state % count;
    } while (std::find(out.begin(), out.begin() + k, out.at(k)) != out.begin() + k);
  }
  return out;
}

// All triples of a few points, many of many.
std::vector<std::array<size_t, 3>> triples(size_t count) {
  constexpr size_t kMost = 3000;
  std::vector<std::array<size_t, 3>> out;
  if (count * (count - 1) * (count - 2) / 6 > kMost) {
    for (size_t i = 0; i < kMost; ++i) out.push_back(numbered_triple(i, count));
    return out;
  }
  for (size_t a = 0; a < count; ++a) {
    for (size_t b = a + 1; b < count; ++b) {
      for (size_t c = b + 1; c < count; ++c) out.push_back({a, b, c});
    }
  }
  return out;
}

/// The points that agree best with the similarity of three of them.
Places core_of(const std::vector<ControlPair>& pairs, const Places& candidates) {
  const size_t count = candidates.size();
  const size_t trusted = count - (count - 2) / 2;  // of five: one may be wrong; of six, two
  double least = std::numeric_limits<double>::infinity();
  Places best;
  for (const auto& triple : triples(count)) {
    const Places three = {candidates[triple[0]], candidates[triple[1]], candidates[triple[2]]};
    const Sides sides = sides_of(pairs, three);
    if (is_line(sides.known) || is_line(sides.measured)) continue;
    const Similarity s = closed_form(sides);
    std::vector<std::pair<double, size_t>> off;
    for (const size_t i : candidates) off.emplace_back(squared_sigmas(pairs[i], s), i);
    std::sort(off.begin(), off.end());
    double sum = 0;
    for (size_t k = 0; k < trusted; ++k) sum += off[k].first;
    if (!(sum < least)) continue;
    least = sum;
    best = three;  // they stay, so that the core is no line
    for (size_t k = 0; k < trusted; ++k) best.push_back(off[k].second);
    std::sort(best.begin(), best.end());
    best.erase(std::unique(best.begin(), best.end()), best.end());
  }
  return best;
}

// The points that a fit of some leaves no doubt about, those included.
Places agreeing(const std::vector<ControlPair>& pairs,
                const Places& candidates,
                const Places& trusted) {
  const Fit by = fit(pairs, trusted);
  const double scatter = std::max(1.0, by.scatter() * (1 + 5.0 / by.freedom));
  Places out;
  for (const size_t i : candidates) {
    const bool is_trusted = std::binary_search(trusted.begin(), trusted.end(), i);
    const double off = is_trusted ? 0 : squared_sigmas_outside(pairs[i], by, 1);
    if (off <= kChiSquared * scatter * scatter) out.push_back(i);
  }
  return out;
}

Places without(Places places, size_t k) {
  places.erase(places.begin() + static_cast<std::ptrdiff_t>(k));
  return places;
}

// The three of four points that agree, where leaving out no other point makes three agree as well:
// a similarity meets three points of level ground whatever their heights, and then nobody can tell
// which of the four is wrong. Empty if so.
Places only_agreeing_three(const std::vector<ControlPair>& pairs, const Places& four) {
  constexpr double kOfTwo =
      13.8;  // 99.9 % of a chi-squared of two, as three points leave, lie below
  std::vector<std::pair<double, size_t>> left;  // chi-squared, place of the point left out
  for (size_t k = 0; k < four.size(); ++k) {
    const Places three = without(four, k);
    const Sides sides = sides_of(pairs, three);
    if (is_line(sides.known) || is_line(sides.measured)) continue;
    left.emplace_back(fit(pairs, three).chi_squared, k);
  }
  std::sort(left.begin(), left.end());
  if (left.empty()) return {};
  const double noise = std::max(1.0, left.front().first / 2);  // sigmas may be too small for all
  if (left.size() > 1 && left[1].first <= kOfTwo * noise) return {};
  return without(four, left.front().second);
}

/// The candidates without outliers.
Places inliers(const std::vector<ControlPair>& pairs, const Places& candidates) {
  if (candidates.size() <= kFewest) return candidates;
  Places out =
      candidates.size() == 4 ? only_agreeing_three(pairs, candidates) : core_of(pairs, candidates);
  if (out.empty()) return candidates;
  for (size_t before = 0; before < out.size();) {
    before = out.size();
    out = agreeing(pairs, candidates, out);
  }
  return out;
}

void require_plane(const std::vector<Eigen::Vector3d>& points, const std::string& where) {
  const auto [length, width] = extents(points);
  if (!(length > 0)) throw NumericalError("all control points lie in one place " + where);
  if (is_line(points)) {
    throw NumericalError("all control points lie on one line " + where +
                         ", about which the scene could turn; add one beside it");
  }
}

Places candidates_of(const std::vector<ControlPair>& pairs) {
  Places out;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].is_check) out.push_back(i);
  }
  if (out.size() == 2) {
    throw WithRemedy<NumericalError>(
        Remedy::KnownDistance,
        "2 control points can be used, at least 3 are needed that lie on no line; two points tell "
        "only the scale, as a known distance does");
  }
  if (out.size() < kFewest) {
    throw NumericalError(std::to_string(out.size()) +
                         " control points can be used, at least 3 are needed that lie on no line");
  }
  return out;
}

double largest_rotation_sigma(const Fit& by) {
  const Eigen::Matrix3d covariance = by.covariance.block<3, 3>(1, 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
}

ControlFit control_fit(const std::vector<ControlPair>& pairs, const Places& used) {
  const Sides sides = sides_of(pairs, used);
  require_plane(sides.known, "of the control frame");
  require_plane(sides.measured, "in the photographs");
  const Fit by = fit(pairs, used);
  ControlFit out;
  out.control_from_scene = by.similarity;
  out.scatter = by.scatter();
  const double widened = std::max(1.0, out.scatter);
  out.scale_sigma = widened * by.similarity.scale * std::sqrt(by.covariance(0, 0));
  out.rotation_sigma = widened * largest_rotation_sigma(by);
  for (size_t i = 0; i < pairs.size(); ++i) {
    ControlResidual residual;
    residual.off = by.similarity(pairs[i].measured) - pairs[i].known;
    residual.is_used = std::binary_search(used.begin(), used.end(), i);
    const double squared = residual.is_used ? squared_sigmas(pairs[i], by.similarity)
                                            : squared_sigmas_outside(pairs[i], by, widened);
    residual.sigmas = std::sqrt(squared / 3);
    residual.is_met = squared <= kChiSquared * (residual.is_used ? widened * widened : 1);
    out.residuals.push_back(residual);
  }
  return out;
}

// Whether the points fit mirrored, and as they are only badly or by leaving out more of them: a
// mirrored table of a facade fits as it is once the points off the wall are left out. Points that
// all lie in a plane fit mirrored as well; nothing can be told of them here.
bool fit_mirrored(std::vector<ControlPair> pairs, const Places& candidates, const ControlFit& as) {
  constexpr double kBad = 3;   // times what the sigmas say
  constexpr double kGood = 2;  // what few points may scatter by chance
  for (ControlPair& pair : pairs) pair.known.z() = -pair.known.z();
  const Places used = inliers(pairs, candidates);
  const double scatter = fit(pairs, used).scatter();
  const auto used_as_they_are = std::count_if(
      as.residuals.begin(), as.residuals.end(), [](const auto& r) { return r.is_used; });
  const bool keeps_more = static_cast<std::ptrdiff_t>(used.size()) > used_as_they_are;
  return (as.scatter > kBad && scatter < as.scatter / kBad) ||
         (keeps_more && scatter < kGood * std::max(1.0, as.scatter));
}

}  // namespace

ControlFit fit_control(const std::vector<ControlPair>& pairs) {
  const Places candidates = candidates_of(pairs);
  const Sides sides = sides_of(pairs, candidates);
  require_plane(sides.known, "of the control frame");
  require_plane(sides.measured, "in the photographs");
  ControlFit out = control_fit(pairs, inliers(pairs, candidates));
  if (fit_mirrored(pairs, candidates, out)) {
    throw NumericalError(
        "the control points fit only mirrored; x, y, z must be a right-handed system such as "
        "east, north, up, so that x and y may have to change places");
  }
  constexpr double kWorstRotation = 0.1;  // [rad]
  const double by_picks = out.rotation_sigma / std::max(1.0, out.scatter);
  if (!(out.rotation_sigma <= kWorstRotation) && by_picks <= kWorstRotation) {
    std::array<char, 32> times{};
    std::snprintf(times.data(), times.size(), "%.1f", out.scatter);
    throw NumericalError(std::string("the control points contradict each other: they scatter ") +
                         times.data() +
                         " times as much as their sigmas and picks say, which leaves the rotation "
                         "of the scene open; check coordinates and picks, or add points to tell "
                         "which is wrong");
  }
  if (!(out.rotation_sigma <= kWorstRotation)) {
    throw NumericalError(
        "the control points leave the rotation of the scene open by more than 6 degrees; add "
        "points farther apart, or farther from a line");
  }
  return out;
}

}  // namespace cgs
