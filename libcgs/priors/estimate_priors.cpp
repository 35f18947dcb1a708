// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/estimate_priors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libcgs/core/error.h"
#include "libcgs/priors/background.h"
#include "libcgs/priors/continued_planes.h"
#include "libcgs/priors/guessed_depth.h"
#include "libcgs/priors/measured_planes.h"
#include "libcgs/priors/neighbours.h"
#include "libcgs/priors/sky.h"
#include "libcgs/priors/transients.h"

namespace cgs {

namespace {

// Pixels of an origin that no mask leaves out: of what is marked in regions, these may hold some.
double usable(const Raster<DepthOrigin>& origin, DepthOrigin which, const View& view) {
  size_t out = 0;
  for (size_t i = 0; i < origin.data.size(); ++i) {
    out += view.is_usable(i) && origin.data[i] == which ? 1 : 0;
  }
  return static_cast<double>(out);
}

// Before and after some of it was marked as estimated.
PriorsCoverage coverage(const Raster<DepthOrigin>& before,
                        const Raster<DepthOrigin>& after,
                        const View& view) {
  const auto count = [](const auto& values, auto which) {
    return static_cast<double>(std::count(values.begin(), values.end(), which));
  };
  const auto& origin = before.data;
  const auto all = static_cast<double>(origin.size());
  const double valid = view.valid.empty() ? all : all - count(view.valid.data, uint8_t{0});
  if (!(valid > 0)) return {};
  PriorsCoverage out;
  out.measured = count(origin, DepthOrigin::Measured) / valid;
  out.completed = count(origin, DepthOrigin::Completed) / valid;
  out.guessed = count(origin, DepthOrigin::Guessed) / valid;
  out.sky = count(origin, DepthOrigin::Sky) / valid;
  out.transient = usable(before, DepthOrigin::Transient, view) / valid;
  out.background = usable(before, DepthOrigin::Background, view) / valid;
  out.estimated =
      static_cast<double>(std::count_if(after.data.begin(), after.data.end(), is_estimated)) /
      valid;
  out.left_open = std::max(0.0, 1 - out.measured - out.completed - out.guessed - out.no_surface());
  return out;
}

}  // namespace

bool is_measured(const PriorsCoverage& share) {
  return share.measured + share.guessed >= share.least_measured;
}

void PriorsOptions::validate() const {
  sweep.validate();
  alignment.validate();
  completion.validate();
  adjoining.validate();
  layers.validate();
}

namespace {

class Estimator {
 public:
  Estimator(const Scene& scene, const PriorsOptions& options) : scene_(scene), options_(options) {}

  EstimatedPriors run(const Progress& progress) {
    constexpr double kSweepShare = 0.95;  // of the time
    constexpr double kCompletedShare = 0.98;
    out_.views = plane_sweep(scene_, options_.sweep, part_of(progress, 0, kSweepShare));
    out_.report.alignment = align_depths(scene_, out_.views, options_.alignment);
    const GivenDepth given = fit_given_depth(scene_, out_.views);
    out_.report.given = {
        given.kind, given.metres_per_unit, given.metres_sigma, given.found, given.remarks};
    if (given.kind == DepthKind::Metric) {
      for (size_t i = 0; i < out_.views.size(); ++i) {
        merge_sensor_depth(given.views[i], view(i), out_.views[i]);
      }
    }
    const std::vector<MaskMap> sky = find_sky(scene_, out_.views);
    for (size_t i = 0; i < sky.size(); ++i) enter_sky(sky[i], out_.views[i]);
    const std::vector<MaskMap> transients = find_transients(scene_, out_.views);
    for (size_t i = 0; i < transients.size(); ++i) enter_transients(transients[i], out_.views[i]);
    mark_background(scene_, out_.views);
    const std::vector<DepthGuess> guesses = guesses_of(given);
    const auto count = static_cast<double>(out_.views.size());
    for (size_t i = 0; i < out_.views.size(); ++i) {
      const Progress completing = part_of(progress, kSweepShare, kCompletedShare);
      complete(i, out_.views[i], part_of(completing, double(i) / count, double(i + 1) / count));
      enter_guess(guesses[i], out_.views[i]);
    }
    set_backdrop(out_.views);
    tell_evidence(part_of(progress, kCompletedShare, 1));
    const std::vector<UnmeasuredShares> why = unmeasured_shares(scene_, out_.views);
    for (size_t i = 0; i < why.size(); ++i) out_.report.coverage[i].unmeasured = why[i];
    forget_unmeasured();
    report(progress, 1);
    return std::move(out_);
  }

 private:
  // Only when all views are completed: those before another are its witnesses as they were
  // measured.
  void tell_evidence(const Progress& progress) {
    std::vector<Raster<DepthOrigin>> filled;
    for (size_t i = 0; i < out_.views.size(); ++i) {
      limit_completion(out_.views[i]);
      filled.push_back(out_.views[i].origin);
      mark_estimated(out_.views[i], view(i), options_.adjoining);
    }
    // A network knows more of what is seen than that there may be a wall.
    const bool is_guessed = std::any_of(filled.begin(), filled.end(), [](const auto& origin) {
      return std::count(origin.data.begin(), origin.data.end(), DepthOrigin::Guessed) > 0;
    });
    if (!is_guessed) {
      continue_planes(scene_,
                      measured_planes(scene_, out_.views),
                      options_.completion.sigma_per_pixel,
                      out_.views,
                      progress);
    }
    for (size_t i = 0; i < out_.views.size(); ++i) {
      ViewPriors& priors = out_.views[i];
      for (size_t k = 0; k < filled[i].data.size(); ++k) {
        const bool is_continued = filled[i].data[k] == DepthOrigin::Unknown &&
                                  priors.origin.data[k] == DepthOrigin::Continued;
        if (is_continued) filled[i].data[k] = DepthOrigin::Completed;
      }
      out_.report.coverage.push_back(coverage(filled[i], priors.origin, view(i)));
      priors.layer = depth_layers(priors.depth, options_.layers);
    }
  }

  // A view of which nothing was measured says nothing of the scene: filled in, it would be a
  // surface that nobody saw.
  void forget_unmeasured() {
    std::vector<PriorsCoverage>& shares = out_.report.coverage;
    for (size_t i = 0; i < shares.size(); ++i) {
      if (!is_measured(shares[i])) shares[i].least_measured = least_measured(scene_, out_.views, i);
    }
    const bool has_pixels = std::any_of(shares.begin(), shares.end(), [](const auto& share) {
      return share.measured + share.completed + share.guessed + share.no_surface() +
                 share.left_open >
             0;
    });
    if (!has_pixels) throw InvalidInput("the masks leave nothing of any input view");
    if (std::none_of(shares.begin(), shares.end(), is_measured)) {
      throw NumericalError(
          "no depth can be measured: hardly a point of one input view was found in another. They "
          "must overlap and show texture, and their cameras must be right");
    }
    std::vector<uint8_t> are_forgotten;
    for (const PriorsCoverage& share : shares) are_forgotten.push_back(is_measured(share) ? 0 : 1);
    forget_views(scene_, are_forgotten, out_.views);
  }

  const View& view(size_t i) const { return scene_.views[static_cast<size_t>(scene_.input[i])]; }

  // Of a view, which may be a copy of it that knows less; others are as they are now.
  void complete(size_t i, ViewPriors& priors, const Progress& progress) const {
    DepthCompletionOptions completion = options_.completion;
    if (!(completion.fallback_depth > 0)) {
      const DepthRange range = depth_range(scene_, scene_.input[i]);
      completion.fallback_depth = 2 / (1 / range.near + 1 / range.far);
    }
    std::vector<CompletionWitness> witnesses;
    for (const size_t j : neighbours(scene_, i, kMostCompared)) {
      witnesses.push_back({&view(j).camera, &out_.views[j]});
    }
    complete_depth(priors, view(i), completion, witnesses, progress);
  }

  std::vector<DepthGuess> guesses_of(const GivenDepth& given) const {
    std::vector<DepthGuess> out(out_.views.size());
    const bool are_guesses =
        given.kind == DepthKind::Relative || given.kind == DepthKind::Disparity;
    if (!are_guesses) return out;
    for (size_t i = 0; i < out.size(); ++i) {
      if (given.views[i].depth.empty()) continue;
      out[i] = guess_depth(given.views[i], view(i), out_.views[i]);
    }
    remove_contradictions(scene_, given.views, out_.views, out);
    return out;
  }

  const Scene& scene_;
  const PriorsOptions& options_;
  EstimatedPriors out_;
};

}  // namespace

EstimatedPriors estimate_priors(const Scene& scene,
                                const PriorsOptions& options,
                                const Progress& progress) {
  options.validate();
  return Estimator(scene, options).run(progress);
}

}  // namespace cgs
