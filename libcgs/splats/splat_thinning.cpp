// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/splats/splat_thinning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "libcgs/core/order_statistics.h"
#include "libcgs/core/thinned.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/splats/splat_merging.h"
#include "libcgs/splats/splat_refit.h"

namespace cgs {

namespace {

constexpr std::array<float, 4> kLadder = {0.001f, 0.003f, 0.006f, 0.012f};

std::vector<Camera> input_cameras(const Scene& scene) {
  std::vector<Camera> out;
  for (const int i : scene.input) out.push_back(scene.views[static_cast<size_t>(i)].camera);
  return out;
}

// On the line from one camera to another at `place`: 0 and 1 are these, less and more lies beside.
Camera on_the_way(const Camera& from, const Camera& to, double place) {
  Camera out = from;
  const Eigen::Matrix3d start = from.world_from_cam.linear();
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(start.transpose() * to.world_from_cam.linear()));
  out.world_from_cam.linear() =
      start * Eigen::AngleAxisd(place * turn.angle(), turn.axis()).toRotationMatrix();
  out.world_from_cam.translation() = (1 - place) * from.center() + place * to.center();
  return out;
}

// The input cameras, and those at the given places between neighbours in their order.
std::vector<Camera> with_cameras_between(const std::vector<Camera>& inputs,
                                         const std::vector<double>& places) {
  constexpr size_t kMostPairs = 4;
  constexpr double kWidest = 0.5;  // cosine between views: farther apart, the way may lead through
                                   // what they look at
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i + 1 < inputs.size(); ++i) pairs.emplace_back(i, i + 1);
  if (inputs.size() > 2) pairs.emplace_back(inputs.size() - 1, 0);
  const auto forward = [&](size_t i) { return inputs[i].world_from_cam.linear().col(2); };
  pairs.erase(std::remove_if(
                  pairs.begin(),
                  pairs.end(),
                  [&](const auto& p) { return forward(p.first).dot(forward(p.second)) < kWidest; }),
              pairs.end());
  std::vector<Camera> out = inputs;
  const size_t count = std::min(pairs.size(), kMostPairs);
  for (size_t k = 0; k < count; ++k) {
    const auto& [a, b] = pairs[k * pairs.size() / count];
    for (const double place : places) out.push_back(on_the_way(inputs[a], inputs[b], place));
  }
  return out;
}

// Mean squared error of a photograph where splats show something; empty if that is hardly anywhere:
// edges alone, cut off by the frame, tell of nothing else. `own` are the splats of the photograph,
// one per pixel of what it shows.
std::optional<double> error_of(const Gaussians& g, const View& view, size_t own) {
  constexpr float kShown = 0.5f;        // alpha
  constexpr double kLeastShare = 0.05;  // of what has splats of its own
  const RenderBuffers buffers = rasterize(g, view.camera);
  const ColorImage shown = picture(buffers);
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < shown.data.size(); ++i) {
    if (!view.is_usable(i)) continue;
    if (buffers.alpha.data[i] < kShown) continue;
    sum += (shown.data[i] - view.image.data[i]).cast<double>().squaredNorm();
    ++count;
  }
  if (count == 0 || double(count) < kLeastShare * double(own)) return std::nullopt;
  return sum / (3 * double(count));
}

// Every picture takes all splats, so that with all views the work would grow with their square.
constexpr size_t kMostJudges = 12;

// PSNR of the input photographs against the splats of the others [dB].
std::optional<double> psnr_of_unseen(const Gaussians& gaussians,
                                     const Scene& scene,
                                     std::span<const size_t> counts) {
  constexpr double kLeastError = 1e-6;  // so that there is a logarithm
  std::vector<size_t> first(counts.size(), 0);
  std::vector<size_t> views(counts.size());
  std::exclusive_scan(counts.begin(), counts.end(), first.begin(), size_t{0});
  std::iota(views.begin(), views.end(), size_t{0});
  Gaussians others = gaussians;
  double sum = 0;
  size_t count = 0;
  for (const size_t n : thinned(views, kMostJudges)) {
    // What is transparent is not drawn.
    std::fill_n(others.opacity.begin() + static_cast<std::ptrdiff_t>(first[n]), counts[n], 0.0f);
    const auto error =
        error_of(others, scene.views[static_cast<size_t>(scene.input[n])], counts[n]);
    std::copy_n(gaussians.opacity.begin() + static_cast<std::ptrdiff_t>(first[n]),
                counts[n],
                others.opacity.begin() + static_cast<std::ptrdiff_t>(first[n]));
    if (!error) continue;
    sum -= 10 * std::log10(std::max(*error, kLeastError));
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / double(count);
}

// Photographs may tell that the model is better than eight bits a channel can show. Nobody sees
// then what differs by less than their step (root mean square), so this is allowed.
double least_error_to_judge_by() {
  constexpr double kStep = 1.0 / 255;
  return kStep * kStep / (std::pow(10, 0.1 * kMostThinningLoss) - 1);
}

/// What all settings share.
struct Trials {
  WeighedSplats weighed;
  /// Of all splats: from the input views, from cameras to fit to, from cameras to judge by.
  std::vector<PictureToMatch> full;
  size_t inputs = 0;
  size_t fitted = 0;  ///< Those before the ones to judge by.
  double unseen = 0;  ///< Mean squared error.
  float pixel = 0;    ///< Of ThinnedSplats.
};

// Few splats need more passes than pictures, and these take little of the time: what fits them to
// the pictures halves what is lost, so that half as many do.
constexpr size_t kPasses = 144;
constexpr size_t kFirstPasses = 24;  // tell which setting it will be
constexpr double kMostHelp = 3;      // by which the others divide what is lost, as measured at most

/// Fewer splats, and by how many passes they were fitted.
struct Fitted {
  Gaussians splats;
  std::vector<float> pixel;
  size_t passes = 0;

  void fit(const Trials& t, size_t to_passes, const Progress& progress) {
    const auto wanted = std::span(t.full).first(t.fitted);
    const size_t more = std::max(to_passes, wanted.size()) - passes;
    refit_splats(splats, pixel, wanted, more, progress);
    passes += more;
  }
};

// Mean over the pictures [dB].
double loss_of(const Trials& t, const Gaussians& g) {
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < t.full.size(); ++k) {
    if (k >= t.inputs && k < t.fitted) continue;
    const std::vector<PictureToMatch> shown = pictures_to_match(g, std::span(&t.full[k].camera, 1));
    sum += 10 * std::log10(1 + mean_square_difference(shown.front(), t.full[k]) / t.unseen);
    ++count;
  }
  return sum / double(count);
}

// Of those that a camera sees; 0 if there are none.
float pixel_of_nearest(const WeighedSplats& s) {
  std::vector<float> pixels;
  for (size_t i = 0; i < s.pixel.size(); ++i) {
    if (!s.ray[i].isZero(0)) pixels.push_back(s.pixel[i]);
  }
  return pixels.empty() ? 0 : quantile(pixels, 0.01);
}

Trials prepare(const Gaussians& gaussians, const Scene& scene, double unseen_psnr) {
  const std::vector<Camera> all = input_cameras(scene);
  const std::vector<Camera> inputs = thinned(all, kMostJudges);
  std::vector<Camera> cameras = with_cameras_between(inputs, {0.5, -0.3, 1.3});
  // By all input views: what none of them showed would be left out.
  std::vector<Camera> weighing = all;
  weighing.insert(
      weighing.end(), cameras.begin() + static_cast<std::ptrdiff_t>(inputs.size()), cameras.end());
  Trials out;
  out.weighed = weigh_splats(gaussians, weighing);
  out.pixel = pixel_of_nearest(out.weighed);
  out.inputs = inputs.size();
  out.fitted = cameras.size();
  const std::vector<Camera> judged = with_cameras_between(inputs, {0.25, -0.2});
  cameras.insert(
      cameras.end(), judged.begin() + static_cast<std::ptrdiff_t>(inputs.size()), judged.end());
  out.full = pictures_to_match(gaussians, cameras);
  out.unseen = std::max(std::pow(10, -0.1 * unseen_psnr), least_error_to_judge_by());
  return out;
}

/// A setting of the ladder, and what became of it.
struct Tried {
  Fitted fitted;
  double loss = 0;
};

// Fits for a first look, and on where that may help a setting that loses too much.
Tried tried(const Trials& t, const WeighedSplats& merged, const Progress& progress) {
  Tried out{{merged.splats, merged.pixel, 0}, 0};
  out.fitted.fit(t, kFirstPasses, part_of(progress, 0, 0.3));
  out.loss = loss_of(t, out.fitted.splats);
  if (out.loss <= kMostThinningLoss || out.loss > kMostHelp * kMostThinningLoss) return out;
  out.fitted.fit(t, kPasses, part_of(progress, 0.3, 1));
  out.loss = loss_of(t, out.fitted.splats);
  return out;
}

// The strongest setting of the ladder that loses little enough, if one does, by bisection. Stronger
// merges go on from weaker ones, so that the cheapest come first.
void choose(ThinnedSplats& out, const Trials& trials, const Progress& progress) {
  size_t low = 0;  // settings below lose little enough, those from `high` on too much
  size_t high = kLadder.size();
  WeighedSplats weaker;
  Tried chosen;
  while (low < high) {
    const size_t middle = (low + high) / 2;
    const double done = 0.3 * double(out.tried.size());
    WeighedSplats merged =
        merge_splats(low > 0 ? weaker : trials.weighed, {.most_cost = kLadder.at(middle)});
    Tried one = tried(trials, merged, part_of(progress, done, done + 0.3));
    out.tried.push_back({kLadder.at(middle), one.fitted.splats.size(), one.loss});
    if (one.loss <= kMostThinningLoss) {
      out.most_cost = kLadder.at(middle);
      chosen = std::move(one);
      weaker = std::move(merged);
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (!out.most_cost) return;
  if (chosen.fitted.passes < kPasses) {
    chosen.fitted.fit(trials, kPasses, part_of(progress, 0.9, 1));
    chosen.loss = loss_of(trials, chosen.fitted.splats);
  }
  for (ThinningTrial& trial : out.tried) {
    if (trial.most_cost == *out.most_cost) trial.loss = chosen.loss;
  }
  out.splats = std::move(chosen.fitted.splats);
  out.pixel = trials.pixel;
}

}  // namespace

ThinnedSplats thin_splats(const Gaussians& gaussians,
                          const Scene& scene,
                          std::span<const size_t> counts,
                          const Progress& progress) {
  ThinnedSplats out;
  report(progress, 0);
  const size_t of_views = std::accumulate(counts.begin(), counts.end(), size_t{0});
  const size_t most = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
  const bool is_own = of_views <= gaussians.size() && gaussians.size() - of_views <= most;
  if (is_own && counts.size() == scene.input.size()) {
    out.unseen_psnr = psnr_of_unseen(gaussians, scene, counts);
  }
  if (out.unseen_psnr) {
    choose(out, prepare(gaussians, scene, *out.unseen_psnr), part_of(progress, 0.2, 1));
  }
  if (!out.most_cost) out.splats = gaussians;
  report(progress, 1);
  return out;
}

}  // namespace cgs
