// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/photo_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Cholesky>
#include <tbb/parallel_for.h>

#include "libcgs/core/disjoint_sets.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/shared_places.h"

namespace cgs {

namespace {

// Unknowns of a photograph: log gamma, log gain of three channels, two terms of the vignette, what
// lies off the diagonal of the matrix row by row.
constexpr int kUnknowns = 12;
constexpr int kGainAt = 1;
constexpr int kVignetteAt = 4;
constexpr int kMatrixAt = 6;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Row = Eigen::Matrix<double, 1, kUnknowns>;

struct Term {
  const char* name;
  int first;
  int count;
};
constexpr std::array<Term, 5> kTerms = {{{"gain", kGainAt, 3},
                                         {"gamma", 0, 1},
                                         {"vignette", kVignetteAt, 1},
                                         {"vignette of two terms", kVignetteAt + 1, 1},
                                         {"matrix", kMatrixAt, 6}}};

struct ResponsePair {
  size_t a, b;
  std::vector<SharedPlace> samples;
};

/// What a pair adds to the normal equations, of the unknowns of both.
struct PairSums {
  Eigen::Matrix<double, 2 * kUnknowns, 2 * kUnknowns> normal =
      Eigen::Matrix<double, 2 * kUnknowns, 2 * kUnknowns>::Zero();
  Eigen::Matrix<double, 2 * kUnknowns, 1> right = Eigen::Matrix<double, 2 * kUnknowns, 1>::Zero();
};

struct Logs {
  int count = 3;  // channels; 1 = luminance
  std::array<double, 3> value = {};
  std::array<Row, 3> slope = {};
};

// Logarithms of corrected light, and their derivatives.
Logs corrected_logs(const ShownPlace& shown, const Unknowns& u) {
  constexpr double kDarkest = 1e-7;
  const double gamma = std::exp(u[0]);
  const Eigen::Vector3d logs = shown.light.array().max(kDarkest).log();
  const Eigen::Vector3d power = (gamma * logs).array().exp();
  Logs out;
  for (int c = 0; c < 3; ++c) {
    const int d = (c + 1) % 3;
    const int e = (c + 2) % 3;
    // Off the diagonal, row c holds columns in their order.
    const int first = kMatrixAt + 2 * c;
    const int at_d = first + (d < e ? 0 : 1);
    const int at_e = first + (d < e ? 1 : 0);
    const double mixed =
        power[c] + u[at_d] * (power[d] - power[c]) + u[at_e] * (power[e] - power[c]);
    const double sum = std::max(mixed, kDarkest);
    const size_t i = static_cast<size_t>(c);
    out.value.at(i) = std::log(sum) + u[kGainAt + c] + u[kVignetteAt] * shown.r2 +
                      u[kVignetteAt + 1] * shown.r2 * shown.r2;
    Row& slope = out.slope.at(i);
    slope.setZero();
    const double own = 1 - u[at_d] - u[at_e];
    slope[0] =
        gamma / sum *
        (own * power[c] * logs[c] + u[at_d] * power[d] * logs[d] + u[at_e] * power[e] * logs[e]);
    slope[kGainAt + c] = 1;
    slope[kVignetteAt] = shown.r2;
    slope[kVignetteAt + 1] = shown.r2 * shown.r2;
    slope[at_d] = (power[d] - power[c]) / sum;
    slope[at_e] = (power[e] - power[c]) / sum;
  }
  return out;
}

Logs luminance_of(const Logs& logs) {
  Logs out;
  out.count = 1;
  double sum = 0;
  Row slope = Row::Zero();
  for (size_t c = 0; c < 3; ++c) {
    const double part =
        double{luminance_weights()[static_cast<Eigen::Index>(c)]} * std::exp(logs.value.at(c));
    sum += part;
    slope += part * logs.slope.at(c);
  }
  out.value[0] = std::log(sum);
  out.slope[0] = slope / sum;
  return out;
}

/// Fits unknowns of photographs to what pairs of them show.
class ResponseFit {
 public:
  ResponseFit(const Scene& scene, const std::vector<ViewPriors>& priors) : scene_(scene) {
    std::vector<ColorImage> light;
    for (size_t i = 0; i < priors.size(); ++i) {
      light.push_back(smooth_light(view(i)));
      is_grey_.push_back(view(i).response.is_grey);
    }
    shared_.assign(priors.size(), 0);
    for (size_t a = 0; a < priors.size(); ++a) {
      for (const size_t b : neighbours(scene, a, kMostCompared)) add_pair(a, b, priors, light);
    }
    unknowns_.assign(priors.size(), Unknowns::Zero());
    choose_reference();
    leave_out_unconnected();
  }

  PhotoResponses run() {
    PhotoResponses out;
    out.reference = reference_;
    for (const ResponsePair& pair : pairs_) out.samples += pair.samples.size();
    set_cap();
    out.residual = mean_residual(unknowns_);
    for (const Term& term : kTerms) {
      const bool needs_first = term.first == kVignetteAt + 1 && !out.terms.back().is_used;
      out.terms.push_back(needs_first ? not_tried(term) : tried(term, out.samples));
    }
    // Once more with what is fitted best: what a photograph shows otherwise counts least then.
    if (out.is_richer()) {
      set_cap();
      minimise(used_, mean_residual(unknowns_));
    }
    for (size_t v = 0; v < unknowns_.size(); ++v) {
      out.response.push_back(response_of(v));
      out.gain.push_back(unknowns_[v].segment<3>(kGainAt).array().exp().matrix().cast<float>());
    }
    return out;
  }

 private:
  const View& view(size_t i) const { return scene_.views[static_cast<size_t>(scene_.input[i])]; }

  void add_pair(size_t a,
                size_t b,
                const std::vector<ViewPriors>& priors,
                const std::vector<ColorImage>& light) {
    constexpr size_t kFewestPlaces = 50;
    ResponsePair pair{
        a, b, shared_places({view(a), priors[a], light[a]}, {view(b), priors[b], light[b]})};
    if (pair.samples.size() < kFewestPlaces) return;
    shared_[a] += pair.samples.size();
    shared_[b] += pair.samples.size();
    pairs_.push_back(std::move(pair));
  }

  void choose_reference() {
    const auto rank = [&](size_t v) { return std::pair(!is_grey_[v], shared_[v]); };
    for (size_t v = 1; v < shared_.size(); ++v) {
      if (rank(v) > rank(reference_)) reference_ = v;
    }
  }

  // Nothing tells how those that share nothing with the reference compare with it.
  void leave_out_unconnected() {
    DisjointSets groups(shared_.size());
    for (const ResponsePair& pair : pairs_) {
      groups.join(static_cast<uint32_t>(pair.a), static_cast<uint32_t>(pair.b));
    }
    const auto is_apart = [&](size_t v) {
      return groups.root(static_cast<uint32_t>(v)) !=
             groups.root(static_cast<uint32_t>(reference_));
    };
    std::erase_if(pairs_, [&](const ResponsePair& pair) { return is_apart(pair.a); });
    for (size_t v = 0; v < shared_.size(); ++v) {
      if (is_apart(v)) shared_[v] = 0;
    }
  }

  bool is_free(size_t v, int unknown) const {
    const bool is_matrix = unknown >= kMatrixAt;
    const bool is_vignette = !is_matrix && unknown >= kVignetteAt;
    if (shared_[v] == 0 || (v == reference_ && !is_vignette)) return false;
    // Of a grey view the first gain stands for all.
    return !is_grey_[v] || (!is_matrix && unknown != kGainAt + 1 && unknown != kGainAt + 2);
  }

  // What stands without it is left of the differences.
  ResponseTerm not_tried(const Term& term) const {
    ResponseTerm out{term.name};
    out.residual = mean_residual(unknowns_);
    return out;
  }

  ResponseTerm tried(const Term& term, size_t places) {
    const std::vector<Unknowns> before = unknowns_;
    ResponseTerm out = not_tried(term);
    std::array<bool, kUnknowns> used = used_;
    for (int k = term.first; k < term.first + term.count; ++k) {
      used.at(static_cast<size_t>(k)) = true;
      for (size_t v = 0; v < unknowns_.size(); ++v) out.parameters += is_free(v, k) ? 1 : 0;
    }
    if (places == 0 || out.parameters == 0) return out;
    set_cap();
    const double without = mean_residual(unknowns_);
    out.residual = minimise(used, without);
    const auto n = static_cast<double>(places);
    out.saved_bits = n * std::log2(without / out.residual) - 0.5 * out.parameters * std::log2(n);
    constexpr double kLeastFall = 0.01;  // what shines or is matched wrongly is fitted by less
    out.is_used = out.saved_bits > 0 && out.residual < (1 - kLeastFall) * without;
    if (out.is_used) {
      used_ = used;
    } else {
      unknowns_ = before;
    }
    return out;
  }

  // Differences count up to four times their median: what only one photograph shows, such as a
  // scratch or a passer-by, pulls no response.
  void set_cap() {
    constexpr double kMedians = 4;
    constexpr double kLeastCap = 0.02;
    std::vector<double> all;
    for (const ResponsePair& pair : pairs_) {
      for (const SharedPlace& sample : pair.samples) {
        residuals(pair, sample, unknowns_, [&](double r, double, const Row&, const Row&) {
          all.push_back(std::abs(r));
        });
      }
    }
    cap_ = all.empty() ? kLeastCap : std::max(kLeastCap, kMedians * median(all));
  }

  // The residuals of a sample, each with its derivatives by the unknowns of both views.
  template <typename Use>
  void residuals(const ResponsePair& pair,
                 const SharedPlace& sample,
                 const std::vector<Unknowns>& unknowns,
                 const Use& use) const {
    Logs a = corrected_logs(sample.a, unknowns[pair.a]);
    Logs b = corrected_logs(sample.b, unknowns[pair.b]);
    if (is_grey_[pair.a] || is_grey_[pair.b]) {
      a = luminance_of(a);
      b = luminance_of(b);
    }
    // Noise of the photographs grows with gamma; not to count it would favour a small one.
    const double squared_a = std::exp(2 * unknowns[pair.a][0]);
    const double squared_b = std::exp(2 * unknowns[pair.b][0]);
    const double spread = std::sqrt(0.5 * (squared_a + squared_b));
    // A step of 1 % of linear light is one of 0.45 % of its code, for all but the darkest.
    constexpr double kCoded = 1 / 2.2;
    const double scale = kCoded * sample.coded / spread;
    for (size_t c = 0; c < static_cast<size_t>(a.count); ++c) {
      const double r = scale * (a.value.at(c) - b.value.at(c));
      Row by_a = scale * a.slope.at(c);
      Row by_b = -scale * b.slope.at(c);
      by_a[0] -= r * 0.5 * squared_a / (spread * spread);
      by_b[0] -= r * 0.5 * squared_b / (spread * spread);
      use(r, 1.0 / a.count, by_a, by_b);
    }
  }

  double mean_residual(const std::vector<Unknowns>& unknowns) const {
    std::vector<double> sums(pairs_.size(), 0);
    tbb::parallel_for(size_t(0), pairs_.size(), [&](size_t i) {
      for (const SharedPlace& sample : pairs_[i].samples) {
        residuals(pairs_[i], sample, unknowns, [&](double r, double share, const Row&, const Row&) {
          sums[i] += share * std::min(std::abs(r), cap_);
        });
      }
    });
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < pairs_.size(); ++i) {
      sum += sums[i];
      count += pairs_[i].samples.size();
    }
    constexpr double kExact = 1e-6;  // planted without noise
    return count > 0 ? std::max(sum / static_cast<double>(count), kExact) : 0;
  }

  // Least absolute differences by reweighted Gauss-Newton steps that are shortened until they help.
  double minimise(const std::array<bool, kUnknowns>& used, double value) {
    constexpr int kMostSteps = 40;
    constexpr double kSettled = 1e-5;
    for (int k = 0; k < kMostSteps; ++k) {
      const Eigen::VectorXd way = newton_step(used, value);
      double share = 1;
      double lower = value;
      std::vector<Unknowns> there;
      for (; share > 0.01 && !(lower < value); share *= 0.5) {
        there = unknowns_;
        for (size_t v = 0; v < there.size(); ++v) {
          there[v] += share * way.segment<kUnknowns>(static_cast<Eigen::Index>(v) * kUnknowns);
          tie(v, there[v]);
        }
        lower = mean_residual(there);
      }
      if (!(lower < value)) break;
      const bool is_settled = lower > (1 - kSettled) * value;
      unknowns_ = std::move(there);
      value = lower;
      if (is_settled) break;
    }
    return value;
  }

  void tie(size_t v, Unknowns& unknowns) const {
    if (is_grey_[v]) unknowns[kGainAt + 1] = unknowns[kGainAt + 2] = unknowns[kGainAt];
  }

  Eigen::VectorXd newton_step(const std::array<bool, kUnknowns>& used, double mean) const {
    const auto size = static_cast<Eigen::Index>(unknowns_.size()) * kUnknowns;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    std::vector<PairSums> sums(pairs_.size());
    tbb::parallel_for(
        size_t(0), pairs_.size(), [&](size_t i) { sums[i] = sums_of(pairs_[i], mean); });
    for (size_t i = 0; i < pairs_.size(); ++i) enter(sums[i], pairs_[i], normal, right);
    // What nothing tells stays near where nothing is done.
    constexpr double kWide = 0.5;
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto v = static_cast<size_t>(i / kUnknowns);
      const auto k = static_cast<int>(i % kUnknowns);
      if (used.at(static_cast<size_t>(k)) && is_free(v, k)) {
        normal(i, i) += 1 / (kWide * kWide);
        right[i] -= unknowns_[v][k] / (kWide * kWide);
        continue;
      }
      normal.row(i).setZero();
      normal.col(i).setZero();
      normal(i, i) = 1;
      right[i] = 0;
    }
    return normal.ldlt().solve(right);
  }

  PairSums sums_of(const ResponsePair& pair, double mean) const {
    PairSums out;
    const double least = 0.1 * mean;  // the kink of the absolute value is rounded there
    for (const SharedPlace& sample : pair.samples) {
      residuals(
          pair, sample, unknowns_, [&](double r, double share, const Row& by_a, const Row& by_b) {
            if (std::abs(r) >= cap_) return;
            Eigen::Matrix<double, 1, 2 * kUnknowns> row;
            row << folded(pair.a, by_a), folded(pair.b, by_b);
            const double weight = share / (mean * std::max(std::abs(r), least));
            out.normal.noalias() += weight * row.transpose() * row;
            out.right.noalias() -= weight * r * row.transpose();
          });
    }
    return out;
  }

  static void enter(const PairSums& sums,
                    const ResponsePair& pair,
                    Eigen::MatrixXd& normal,
                    Eigen::VectorXd& right) {
    const auto a = static_cast<Eigen::Index>(pair.a) * kUnknowns;
    const auto b = static_cast<Eigen::Index>(pair.b) * kUnknowns;
    right.segment<kUnknowns>(a) += sums.right.head<kUnknowns>();
    right.segment<kUnknowns>(b) += sums.right.tail<kUnknowns>();
    normal.block<kUnknowns, kUnknowns>(a, a) += sums.normal.topLeftCorner<kUnknowns, kUnknowns>();
    normal.block<kUnknowns, kUnknowns>(a, b) += sums.normal.topRightCorner<kUnknowns, kUnknowns>();
    normal.block<kUnknowns, kUnknowns>(b, a) +=
        sums.normal.bottomLeftCorner<kUnknowns, kUnknowns>();
    normal.block<kUnknowns, kUnknowns>(b, b) +=
        sums.normal.bottomRightCorner<kUnknowns, kUnknowns>();
  }

  // Of a grey view, where the first gain stands for all.
  Row folded(size_t v, const Row& slope) const {
    Row out = slope;
    if (is_grey_[v]) out[kGainAt] += slope[kGainAt + 1] + slope[kGainAt + 2];
    return out;
  }

  PhotoResponse response_of(size_t v) const {
    const Unknowns& u = unknowns_[v];
    PhotoResponse out;
    out.is_grey = is_grey_[v];
    out.gamma = std::exp(u[0]);
    out.vignette = u.segment<2>(kVignetteAt);
    int at = kMatrixAt;
    for (int c = 0; c < 3; ++c) {
      for (int d = 0; d < 3; ++d) {
        if (d == c) continue;
        out.matrix(c, d) = u[at];
        out.matrix(c, c) -= u[at++];
      }
    }
    return out;
  }

  const Scene& scene_;
  std::vector<uint8_t> is_grey_;
  std::vector<ResponsePair> pairs_;
  std::vector<size_t> shared_;
  std::vector<Unknowns> unknowns_;
  std::array<bool, kUnknowns> used_ = {};
  size_t reference_ = 0;
  double cap_ = 0;  // of a difference
};

}  // namespace

bool PhotoResponses::is_richer() const {
  return std::any_of(terms.begin(), terms.end(), [](const ResponseTerm& term) {
    return term.is_used && term.name != kTerms.front().name;
  });
}

PhotoResponses fit_photo_responses(const Scene& scene, const std::vector<ViewPriors>& priors) {
  require(priors.size() == scene.input.size(),
          "fit_photo_responses: number of priors must be that of the input views",
          priors.size());
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    require(!view.image.empty(), "fit_photo_responses: the image must be loaded", view.name);
  }
  return ResponseFit(scene, priors).run();
}

}  // namespace cgs
