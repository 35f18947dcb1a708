// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/evidence_words.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace cgs {

namespace {

// "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& words) {
  std::string out;
  for (size_t i = 0; i < words.size(); ++i) {
    if (i > 0) out += i + 1 < words.size() ? ", " : " and ";
    out += words[i];
  }
  return out;
}

// Where the depth of the input views is from: what most rests on first.
std::string depth_words(const PriorsReport& priors) {
  PriorsCoverage sum;
  for (const PriorsCoverage& view : priors.coverage) {
    if (!is_measured(view)) continue;  // its depth stays unknown
    sum.measured += view.measured;
    sum.guessed += view.guessed;
    sum.completed += view.completed;
  }
  const bool has_sensor = priors.given.kind == DepthKind::Metric;
  std::vector<std::pair<double, std::string>> sources = {
      {sum.measured,
       has_sensor ? "measured by a multi-view plane sweep and a depth sensor"
                  : "measured by a multi-view plane sweep"},
      {sum.guessed, "guessed from one photograph and fitted to what is measured"},
      {sum.completed, "filled in from neighbours"}};
  std::stable_sort(sources.begin(), sources.end(), [](const auto& a, const auto& b) {
    return a.first > b.first;
  });
  const double all = sum.measured + sum.guessed + sum.completed;
  std::vector<std::string> words;
  for (const auto& [share, text] : sources) {
    if (!(share > 0)) continue;
    std::array<char, 32> percent{};
    std::snprintf(percent.data(), percent.size(), "%.0f %% ", 100 * share / all);
    words.push_back(share < all ? percent.data() + text : text);
  }
  return words.empty() ? "unknown" : listed(words);
}

// What a training of so many steps may have changed.
std::vector<std::string> optimised(const TrainingOptions& options, size_t steps) {
  const bool has_networks = options.coherence.decoder == ResidualDecoder::Conv;
  // Shapes are free from the first step on that begins at or after this part of the schedule.
  const bool frees_shapes = options.free_from * options.steps <= double(steps) - 1;
  std::vector<std::string> out;
  if ((has_networks ? options.conv_depth_rate : options.depth_rate) > 0) out.emplace_back("depth");
  if ((has_networks ? options.conv_opacity_rate : options.opacity_rate) > 0) {
    out.emplace_back("opacity");
  }
  if (options.shape_rate > 0 && frees_shapes) out.emplace_back("shape");
  if (options.color_rate > 0) out.emplace_back("colour");
  return out;
}

// "43 % "; tenths where it is little.
std::string percent_text(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), share < 0.095 ? "%.1f %% " : "%.0f %% ", 100 * share);
  return text.data();
}

std::string words_on(const PriorsCoverage& share) {
  constexpr double kMentioned = 0.0005;
  const std::array<std::pair<double, const char*>, 5> parts = {
      {{share.sky, "is sky"},
       {share.background, "is background of an object that stands alone"},
       {share.estimated,
        "shows surface that nothing measured and is estimated from its surroundings"},
       {share.transient,
        "shows what the other photographs do not (people, cars, leaves) and is left out"},
       {share.left_open, "shows surface of which nothing is known and stays open"}}};
  std::vector<std::string> words = {percent_text(share.with_evidence()) + "is measured"};
  for (const auto& [part, text] : parts) {
    if (part >= kMentioned) words.push_back(percent_text(part) + text);
  }
  return listed(words);
}

std::string free_words(const TrainedModel& trained) {
  const DensityReport& density = *trained.density;
  const std::string start = density.is_from_splats
                                ? std::to_string(density.begun_with) + " given splats"
                                : std::to_string(density.begun_with) + " points " +
                                      "measured by a multi-view plane sweep";
  return "classical 3D Gaussian splatting: begun from " + start +
         ", free to move apart, so that nothing vouches for where they are; optimised against the "
         "photographs in " +
         std::to_string(trained.steps.size()) + " steps of one view";
}

}  // namespace

std::string description_of(const TrainedModel& trained, const TrainingOptions& options) {
  if (trained.density) return free_words(trained);
  const std::string start =
      "one Gaussian per pixel at a depth that is " + depth_words(trained.priors) + "; ";
  const std::string pane = trained.pane.view.empty() ? "" : "before them a pane; ";
  const std::vector<std::string> changed = optimised(options, trained.steps.size());
  if (trained.steps.empty() || changed.empty()) {
    return "aligned initialisation: " + start + pane + "not optimised against the photographs";
  }
  return "coherent Gaussians: " + start + pane + listed(changed) +
         " optimised against the photographs in " + std::to_string(trained.steps.size()) + " steps";
}

std::vector<std::string> coverage_words(const PriorsReport& priors, const Scene& scene) {
  std::vector<std::string> out;
  for (size_t i = 0; i < priors.coverage.size(); ++i) {
    const std::string& name = scene.views[static_cast<size_t>(scene.input[i])].name;
    out.push_back("of photograph " + name + ", " + words_on(priors.coverage[i]));
  }
  return out;
}

}  // namespace cgs
