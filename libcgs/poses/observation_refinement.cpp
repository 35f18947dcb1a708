// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/observation_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace cgs {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kRadius = 7;               // of a patch [working pixels]
constexpr double kWindow = 4;            // standard deviation of its weights [working pixels]
constexpr int kShifts = 5;               // steps of the place alone
constexpr int kSteps = 25;               // at most, with them
constexpr double kSettled = 0.003;       // [working pixels]
constexpr double kFarthest = 1.5;        // that a feature may be off [working pixels]
constexpr double kLeastExplained = 0.8;  // of the variance of the patch
constexpr double kLargestStretch = 1.6;  // of the warp, beyond what the poses say

/// A picture at a place, between its pixels.
struct Sample {
  double level = 0;                   // 0 ... 255
  Vector2d slope = Vector2d::Zero();  // [1 / pixel]
};

// Weights of four neighbours for the fraction f beyond the second, and their derivatives
// (Catmull-Rom).
void cubic_weights(double f, std::array<double, 4>& weight, std::array<double, 4>& slope) {
  weight = {0.5 * f * (f * (2 - f) - 1),
            0.5 * (f * f * (3 * f - 5) + 2),
            0.5 * f * (f * (4 - 3 * f) + 1),
            0.5 * f * f * (f - 1)};
  slope = {0.5 * (f * (4 - 3 * f) - 1),
           0.5 * f * (9 * f - 10),
           0.5 * (f * (8 - 9 * f) + 1),
           0.5 * f * (3 * f - 2)};
}

// \return false if the place lies too near to the border
bool sample(const Raster<uint8_t>& picture, const Vector2d& at, Sample& out) {
  const double x = at.x() - 0.5;
  const double y = at.y() - 0.5;
  if (!(x >= 1 && y >= 1 && x < picture.width - 3 && y < picture.height - 3)) return false;
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  std::array<double, 4> wx, sx, wy, sy;
  cubic_weights(x - x0, wx, sx);
  cubic_weights(y - y0, wy, sy);
  out = {};
  for (int j = 0; j < 4; ++j) {
    const uint8_t* row = &picture.data[picture.index(x0 - 1, y0 - 1 + j)];
    double level = 0;
    double slope = 0;
    for (int i = 0; i < 4; ++i) {
      level += wx[static_cast<size_t>(i)] * row[i];
      slope += sx[static_cast<size_t>(i)] * row[i];
    }
    out.level += wy[static_cast<size_t>(j)] * level;
    out.slope += Vector2d(wy[static_cast<size_t>(j)] * slope, sy[static_cast<size_t>(j)] * level);
  }
  return true;
}

/// Between the plane in which a photograph's observations lie and the pixels of its picture.
struct PicturePlane {
  Vector2d scale;   // pixels of the picture per working pixel
  Vector2d centre;  // [pixels of the picture]

  explicit PicturePlane(const UnposedPhoto& photo)
      : scale(photo.features.pixel * photo.features.picture.width / photo.width,
              photo.features.pixel * photo.features.picture.height / photo.height),
        centre(0.5 * photo.features.picture.width, 0.5 * photo.features.picture.height) {}
  Vector2d in_picture(const Vector2d& at) const { return centre + scale.cwiseProduct(at); }
};

/// Levels around the observation that stays.
struct Patch {
  static constexpr size_t kSide = 2 * kRadius + 1;
  std::array<double, kSide * kSide> level;
  std::array<double, kSide * kSide> weight;  // sum 1
  double variance = 0;
};

template <typename Visit>
void for_each_offset(Visit visit) {
  size_t k = 0;
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x) visit(k++, Vector2d(x, y));
  }
}

std::optional<Patch> patch_at(const UnposedPhoto& photo, const Vector2d& at) {
  const PicturePlane plane(photo);
  Patch out;
  bool is_inside = true;
  double sum = 0;
  for_each_offset([&](size_t k, const Vector2d& d) {
    Sample s;
    is_inside = is_inside && sample(photo.features.picture, plane.in_picture(at + d), s);
    out.level[k] = s.level;
    out.weight[k] = std::exp(-0.5 * d.squaredNorm() / (kWindow * kWindow));
    sum += out.weight[k];
  });
  if (!is_inside) return std::nullopt;
  double mean = 0;
  for (size_t k = 0; k < out.level.size(); ++k) {
    out.weight[k] /= sum;
    mean += out.weight[k] * out.level[k];
  }
  for (size_t k = 0; k < out.level.size(); ++k) {
    out.variance += out.weight[k] * (out.level[k] - mean) * (out.level[k] - mean);
  }
  return out;
}

/// Where a patch lies in another photograph, and how bright it is there.
struct Fit {
  Vector2d at = Vector2d::Zero();
  Matrix2d warp = Matrix2d::Identity();
  double gain = 1;
  double offset = 0;
};

using Normal = Eigen::Matrix<double, 8, 8>;
using Step = Eigen::Matrix<double, 8, 1>;

// Least squares of gain * picture + offset against the patch, linearised.
struct Equations {
  Normal A = Normal::Zero();
  Step b = Step::Zero();
  double error = 0;  // mean square
};

std::optional<Equations> equations(const Patch& patch,
                                   const UnposedPhoto& photo,
                                   const PicturePlane& plane,
                                   const Fit& fit) {
  Equations out;
  bool is_inside = true;
  for_each_offset([&](size_t k, const Vector2d& d) {
    Sample s;
    is_inside =
        is_inside && sample(photo.features.picture, plane.in_picture(fit.at + fit.warp * d), s);
    if (!is_inside) return;
    const double residual = fit.gain * s.level + fit.offset - patch.level[k];
    const Vector2d g = fit.gain * s.slope.cwiseProduct(plane.scale);
    Step row;
    row << g.x(), g.y(), s.level, 1, g.x() * d.x(), g.x() * d.y(), g.y() * d.x(), g.y() * d.y();
    out.A.noalias() += patch.weight[k] * row * row.transpose();
    out.b.noalias() += patch.weight[k] * residual * row;
    out.error += patch.weight[k] * residual * residual;
  });
  if (!is_inside) return std::nullopt;
  return out;
}

// Brightness and contrast that suit before anything has moved.
bool match_levels(const Patch& patch,
                  const UnposedPhoto& photo,
                  const PicturePlane& plane,
                  Fit& fit) {
  fit.gain = 1;
  fit.offset = 0;
  const std::optional<Equations> e = equations(patch, photo, plane, fit);
  if (!e) return false;
  const Eigen::Vector2d x = e->A.block<2, 2>(2, 2).ldlt().solve(e->b.segment<2>(2));
  fit.gain -= x[0];
  fit.offset -= x[1];
  return std::isfinite(fit.gain) && fit.gain > 0.1 && fit.gain < 10;
}

bool is_like(const Matrix2d& warp, const Matrix2d& expected) {
  const Matrix2d change = warp * expected.inverse();
  const Vector2d stretch = Eigen::JacobiSVD<Matrix2d>(change).singularValues();
  return stretch.allFinite() && stretch[0] < kLargestStretch && stretch[1] > 1 / kLargestStretch &&
         change.determinant() > 0;
}

// Standard deviation of the place, along the direction in which it is known worst.
double place_sigma(const Equations& e) {
  // The weights of a patch sum up to 1; it has about as many pixels as its window is large.
  constexpr double kPixels = 4 * M_PI * kWindow * kWindow;
  const Normal covariance = e.A.ldlt().solve(Normal::Identity()) * e.error / (kPixels - 8);
  const Eigen::SelfAdjointEigenSolver<Matrix2d> eigen(covariance.topLeftCorner<2, 2>());
  return std::sqrt(eigen.eigenvalues()[1]);
}

/// What is known of an observation.
struct Refined {
  Vector2d at = Vector2d::Zero();
  double sigma = 0;  // [working pixels]
};

// \param start  where the feature lies, and the warp that the poses say
std::optional<Refined> fitted(const Patch& patch, const UnposedPhoto& photo, const Fit& start) {
  const PicturePlane plane(photo);
  Fit fit = start;
  if (!match_levels(patch, photo, plane, fit)) return std::nullopt;
  bool is_settled = false;
  std::optional<Equations> e;
  for (int step = 0; step < kSteps && !is_settled; ++step) {
    e = equations(patch, photo, plane, fit);
    if (!e) return std::nullopt;
    const int unknowns = step < kShifts ? 4 : 8;
    Step x = Step::Zero();
    x.head(unknowns) = e->A.topLeftCorner(unknowns, unknowns).ldlt().solve(e->b.head(unknowns));
    if (!x.allFinite()) return std::nullopt;
    fit.at -= x.head<2>();
    fit.gain -= x[2];
    fit.offset -= x[3];
    fit.warp -= (Matrix2d() << x[4], x[5], x[6], x[7]).finished();
    if (!((fit.at - start.at).norm() < kFarthest) || !is_like(fit.warp, start.warp)) {
      return std::nullopt;
    }
    is_settled = step >= kShifts && x.head<2>().norm() < kSettled;
  }
  if (!is_settled || !(e->error < (1 - kLeastExplained) * patch.variance)) return std::nullopt;
  const double sigma = place_sigma(*e);
  if (!(sigma < kFeatureSigma)) return std::nullopt;
  return Refined{fit.at, std::max(sigma, kRefinedSigma)};
}

// How a small surface at the point, facing both cameras, is warped between two photographs.
std::optional<Matrix2d> expected_warp(const Reconstruction& scene,
                                      const Vector3d& point,
                                      const Observation& from,
                                      const Observation& to) {
  const PhotoPose& from_pose = *scene.pose(from.photo);
  const PhotoPose& to_pose = *scene.pose(to.photo);
  const Lens from_lens = scene.lens(from.photo);
  const Lens to_lens = scene.lens(to.photo);
  const Vector3d centre = from_pose.center();
  const Vector3d normal = (centre - point).normalized() + (to_pose.center() - point).normalized();
  const auto transferred = [&](const Vector2d& d) -> Vector2d {
    const Vector3d ray =
        from_pose.rotation.conjugate() * direction_at(from_lens, from.at + d).homogeneous();
    const Vector3d p = to_pose * (centre + normal.dot(point - centre) / normal.dot(ray) * ray);
    return through_lens<double>(to_lens.focal, to_lens.k1, to_lens.centre, p.hnormalized());
  };
  constexpr double kStep = 2;  // [working pixels]
  Matrix2d warp;
  for (int i = 0; i < 2; ++i) {
    const Vector2d d = kStep * Vector2d::Unit(i);
    warp.col(i) = (transferred(d) - transferred(-d)) / (2 * kStep);
  }
  if (!warp.allFinite() ||
      !is_like(warp, Matrix2d::Identity() * std::sqrt(std::abs(warp.determinant())))) {
    return std::nullopt;
  }
  return warp;
}

bool can_take_part(const std::vector<UnposedPhoto>& photos,
                   const Reconstruction& scene,
                   const Observation& s) {
  return s.is_used && scene.pose(s.photo) &&
         !photos[static_cast<size_t>(s.photo)].features.picture.empty();
}

// The observation from the middle of the others: the largest sum of cosines to their rays.
Observation* most_central(const Reconstruction& scene,
                          const std::vector<Observation*>& observations,
                          const Vector3d& point) {
  Observation* best = nullptr;
  double most = -2;
  for (Observation* s : observations) {
    const Vector3d ray = (scene.pose(s->photo)->center() - point).normalized();
    double sum = 0;
    for (const Observation* other : observations) {
      sum += ray.dot((scene.pose(other->photo)->center() - point).normalized());
    }
    if (best != nullptr && !(sum > most)) continue;
    best = s;
    most = sum;
  }
  return best;
}

void refine(const std::vector<UnposedPhoto>& photos, const Reconstruction& scene, Track& track) {
  std::vector<Observation*> observations;
  for (Observation& s : track.seen) {
    if (can_take_part(photos, scene, s)) observations.push_back(&s);
  }
  if (observations.size() < 2) return;
  Observation* const fixed = most_central(scene, observations, track.position);
  const auto patch = patch_at(photos[static_cast<size_t>(fixed->photo)], fixed->at);
  if (!patch) return;
  for (Observation* s : observations) {
    if (s == fixed) continue;
    const auto warp = expected_warp(scene, track.position, *fixed, *s);
    if (!warp) continue;
    const auto refined = fitted(*patch, photos[static_cast<size_t>(s->photo)], {s->at, *warp});
    if (!refined) continue;
    s->at = refined->at;
    s->sigma = refined->sigma;
    fixed->sigma = kRefinedSigma;  // what it shows is what is looked for
  }
}

}  // namespace

void refine_observations(const std::vector<UnposedPhoto>& photos,
                         Reconstruction& scene,
                         const Progress& progress) {
  SharedProgress shared(progress, scene.tracks.size());
  tbb::parallel_for(size_t{0}, scene.tracks.size(), [&](size_t k) {
    if (scene.tracks[k].is_known) refine(photos, scene, scene.tracks[k]);
    shared.advance();
  });
}

}  // namespace cgs
