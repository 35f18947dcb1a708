// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/coherence/view_dependence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <tbb/parallel_for.h>

#include "libcgs/coherence/initialisation.h"
#include "libcgs/core/bilinear.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/pixel_matches.h"

namespace cgs {

namespace {

constexpr int kMeanRadius = 2;  // of the neighbourhood that G is fitted to [pixels]
constexpr int kNearest = 1;     // of what is left out of it to judge
constexpr int kPiece = 16;      // side of the pieces that are judged [pixels]
constexpr double kSlopeRidge = 0.3;
constexpr double kMostChange = 2;  // over a turn of 1, of what was seen
constexpr double kLeastDifference = 0.03;
constexpr double kWorth = 0.1;

// What another view shows at the pixels of one.
struct ViewColors {
  ColorImage difference;   // its colour less that of the pixel; NaN where it does not see the same
  Eigen::Vector3d center;  // of its camera
};

bool is_seen(const Eigen::Vector3f& difference) { return !std::isnan(difference.x()); }

// Of the mean difference over the neighbourhood of a pixel, without those up to `left_out` away.
struct MeanDifference {
  Eigen::Vector3f value = Eigen::Vector3f::Zero();
  int count = 0;
};

MeanDifference mean_around(const ColorImage& difference, int x, int y, int left_out) {
  MeanDifference out;
  for (int v = std::max(0, y - kMeanRadius); v <= std::min(difference.height - 1, y + kMeanRadius);
       ++v) {
    for (int u = std::max(0, x - kMeanRadius); u <= std::min(difference.width - 1, x + kMeanRadius);
         ++u) {
      if (std::max(std::abs(u - x), std::abs(v - y)) <= left_out) continue;
      if (!is_seen(difference(u, v))) continue;
      out.value += difference(u, v);
      ++out.count;
    }
  }
  if (out.count > 0) out.value /= static_cast<float>(out.count);
  return out;
}

// Squared differences of a piece, and what the neighbours leave of them.
struct PieceDifference {
  double all = 0;
  double left = 0;
  int count = 0;

  double rms(double squares) const { return count > 0 ? std::sqrt(squares / (3.0 * count)) : 0; }
  bool asks_for_directions() const {
    constexpr int kFewest = kPiece * kPiece / 8;
    return count >= kFewest && left <= all / 2 && rms(all - left) >= kLeastDifference;
  }
  void add(const PieceDifference& other) {
    all += other.all;
    left += other.left;
    count += other.count;
  }
};

class ViewDependenceFit {
 public:
  ViewDependenceFit(const Scene& scene, const std::vector<ViewPriors>& priors)
      : scene_(scene), priors_(priors) {
    for (const int i : scene.input) views_.push_back(&scene.views[static_cast<size_t>(i)]);
  }

  std::vector<ViewColors> seen_by_others(size_t n) const {
    const View& own = *views_[n];
    const std::vector<size_t> compared = neighbours(scene_, n, kMostCompared);
    std::vector<ViewColors> out(compared.size());
    tbb::parallel_for(size_t{0}, compared.size(), [&](size_t k) {
      const size_t j = compared[k];
      const View& other = *views_[j];
      const Eigen::Vector3f none =
          Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
      ViewColors& shown = out[k];
      shown = {{own.image.width, own.image.height, none}, other.camera.center()};
      for (const PixelMatch& match :
           pixel_matches(own.camera, priors_[n], other.camera, priors_[j])) {
        const auto i = static_cast<size_t>(match.pixel);
        shown.difference.data[i] = color_at(other.image, match.u, match.v) - own.image.data[i];
      }
    });
    return out;
  }

  // One entry per piece, row by row.
  Raster<PieceDifference> evidence(size_t n) const {
    const ColorImage& image = views_[n]->image;
    const std::vector<ViewColors> others = seen_by_others(n);
    const auto blocks = [](int pixels) { return (pixels + kPiece - 1) / kPiece; };
    Raster<PieceDifference> out(blocks(image.width), blocks(image.height), PieceDifference{});
    tbb::parallel_for(0, out.height, [&](int row) {
      for (int y = row * kPiece; y < std::min(image.height, (row + 1) * kPiece); ++y) {
        for (int x = 0; x < image.width; ++x) {
          for (const ViewColors& other : others) add(other.difference, x, y, out(x / kPiece, row));
        }
      }
    });
    return out;
  }

  // G of the Gaussian of a pixel, colours by directions.
  Eigen::Matrix3d slope(const std::vector<ViewColors>& others,
                        const Eigen::Vector3d& point,
                        const Eigen::Vector3d& direction,
                        int x,
                        int y) const {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();   // sum of e e^T, e = d_j - d_i
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();  // sum of e (c_j - c_i)^T
    Eigen::Vector3d most = Eigen::Vector3d::Zero();      // of |c_j - c_i|
    int count = 0;
    for (const ViewColors& other : others) {
      if (!is_seen(other.difference(x, y))) continue;
      const Eigen::Vector3d turn = (point - other.center).normalized() - direction;
      const Eigen::Vector3f change = mean_around(other.difference, x, y, -1).value;
      squares += turn * turn.transpose();
      products += turn * change.cast<double>().transpose();
      most = most.cwiseMax(change.cast<double>().cwiseAbs());
      ++count;
    }
    const double ridge = count > 0 ? kSlopeRidge * squares.trace() / count : 0;
    if (!(ridge > 0)) return Eigen::Matrix3d::Zero();
    squares.diagonal().array() += ridge;
    Eigen::Matrix3d out = squares.ldlt().solve(products).transpose();
    for (int c = 0; c < 3; ++c) {
      const double bound = std::min(double{kShC1}, kMostChange * most[c]);
      const double norm = out.row(c).norm();
      if (norm > bound) out.row(c) *= bound / norm;
    }
    return out;
  }

 private:
  static void add(const ColorImage& difference, int x, int y, PieceDifference& sum) {
    constexpr int kFewest = 7;  // of 16
    if (!is_seen(difference(x, y))) return;
    const MeanDifference mean = mean_around(difference, x, y, kNearest);
    if (mean.count < kFewest) return;
    sum.all += static_cast<double>(difference(x, y).squaredNorm());
    sum.left += static_cast<double>((difference(x, y) - mean.value).squaredNorm());
    ++sum.count;
  }

  const Scene& scene_;
  const std::vector<ViewPriors>& priors_;
  std::vector<const View*> views_;
};

// The coefficients of c + G (d - d_i).
void set_color(const Eigen::Vector3f& color,
               const Eigen::Matrix3d& slope,
               const Eigen::Vector3d& direction,
               Eigen::Vector3f* sh) {
  const Eigen::Vector3d constant = color.cast<double>() - slope * direction;
  sh[0] = ((constant.array() - 0.5) / double{kShC0}).cast<float>();
  const Eigen::Matrix3f linear = (slope / double{kShC1}).cast<float>();
  sh[1] = -linear.col(1);
  sh[2] = linear.col(2);
  sh[3] = -linear.col(0);
}

// Pieces of the views, and what all of them and those that ask for directions differ by.
struct Evidence {
  std::vector<Raster<PieceDifference>> views;
  PieceDifference all;
  PieceDifference asking;

  double explained() const { return all.all > 0 ? (asking.all - asking.left) / all.all : 0; }
};

Evidence gather_evidence(const ViewDependenceFit& fit, size_t views) {
  Evidence out;
  for (size_t n = 0; n < views; ++n) {
    out.views.push_back(fit.evidence(n));
    for (const PieceDifference& piece : out.views.back().data) {
      out.all.add(piece);
      if (piece.asks_for_directions()) out.asking.add(piece);
    }
  }
  return out;
}

// Gives all Gaussians four coefficients, and those of pieces that ask for it a slope. \return their
// share.
double add_slopes(const Scene& scene,
                  const std::vector<ViewPriors>& priors,
                  const ViewDependenceFit& fit,
                  const Evidence& evidence,
                  Gaussians& gaussians) {
  constexpr size_t kCount = 4;  // coefficients of degree 1
  std::vector<Eigen::Vector3f> sh(gaussians.size() * kCount, Eigen::Vector3f::Zero());
  size_t i = 0;
  size_t changed = 0;
  for (size_t n = 0; n < priors.size(); ++n) {
    const View& view = scene.views[static_cast<size_t>(scene.input[n])];
    // Once more: kept from the evidence, those of all views would take much memory at once.
    const std::vector<ViewColors> others = fit.seen_by_others(n);
    for (int y = 0; y < priors[n].depth.height; ++y) {
      for (int x = 0; x < priors[n].depth.width; ++x) {
        if (!draws(priors[n], priors[n].depth.index(x, y))) continue;
        sh[i * kCount] = gaussians.sh[i];
        if (evidence.views[n](x / kPiece, y / kPiece).asks_for_directions()) {
          const Eigen::Vector3d point = gaussians.position[i].cast<double>();
          const Eigen::Vector3d direction = (point - view.camera.center()).normalized();
          const Eigen::Matrix3d slope = fit.slope(others, point, direction, x, y);
          set_color(view.image(x, y), slope, direction, &sh[i * kCount]);
          if (!slope.isZero()) ++changed;
        }
        ++i;
      }
    }
  }
  gaussians.sh_degree = 1;
  gaussians.sh = std::move(sh);
  return static_cast<double>(changed) / static_cast<double>(gaussians.size());
}

}  // namespace

ViewDependence add_view_dependence(const Scene& scene,
                                   const std::vector<ViewPriors>& priors,
                                   Gaussians& gaussians) {
  require(
      gaussians.sh_degree == 0, "colours must not depend on directions yet", gaussians.sh_degree);
  const ViewDependenceFit fit(scene, priors);
  const Evidence evidence = gather_evidence(fit, priors.size());
  ViewDependence out;
  out.difference = evidence.all.rms(evidence.all.all);
  out.explained = evidence.explained();
  if (out.explained < kWorth) return out;
  out.share = add_slopes(scene, priors, fit, evidence, gaussians);
  return out;
}

}  // namespace cgs
