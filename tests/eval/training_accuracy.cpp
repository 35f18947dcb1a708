// SPDX-License-Identifier: GPL-3.0-or-later
// What training settings bring on held-out views.
//
// usage: training_accuracy MODEL [preset=NAME] [every=STEPS] [limit=COUNT | views=NAME,NAME]
//                          [prune=GAP] [given=BUMPS] [FIELD=VALUE ...]
//
// MODEL is a folder that `cgs train --set steps=0` wrote. Fields are those of TrainingOptions; a
// preset sets all, so that fields come after it. prune takes away Gaussians before what is drawn,
// see kept_by_mode(), from what is evaluated. given makes given depth of the truth (below), as a
// network errs: see Corruption, with bumps of that height and one square turned inside out.
// Photographs are matched in exposure to the model where its input views were, as by cgs evaluate.
// Prints one line per evaluation: PSNR and SSIM over all pixels, over the pixels that were seen
// before training (a fixed set, so that lines can be compared), and over those seen now. Times are
// core-seconds of the steps: what is left to compare on a busy machine.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>

#include "convert/model/evaluation.h"
#include "convert/model/model.h"
#include "io/images/exr.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/train/image_metrics.h"
#include "libcgs/train/trainer.h"
#include "tests/support/corrupted_depth.h"
#include "tests/support/mode_pruning.h"

namespace {

using cgs::MaskMap;

struct HeldOut {
  cgs::View view;
  bool is_exposed_otherwise = false;
  MaskMap seen_at_start;
};

// Pixels of the photograph: undistorting leaves borders that show nothing.
MaskMap valid_pixels(const cgs::View& view) {
  return view.valid.empty() ? MaskMap(view.image.width, view.image.height, 1) : view.valid;
}

MaskMap seen_pixels(const cgs::RenderBuffers& buffers, MaskMap valid) {
  for (size_t i = 0; i < valid.data.size(); ++i) {
    if (cgs::is_hole(buffers.hole.data[i])) valid.data[i] = 0;
  }
  return valid;
}

// Exact depth of the input views [internal units], where the scene has a folder truth/.
std::vector<cgs::DepthMap> true_depths(const cgs::Scene& scene) {
  std::vector<cgs::DepthMap> out;
  for (const int i : scene.input) {
    const cgs::View& view = scene.views[static_cast<size_t>(i)];
    const auto path =
        view.image_path.parent_path().parent_path() / "truth" / (view.name + "_depth.exr");
    if (!std::filesystem::exists(path)) return {};
    const cgs::ExrImage image = cgs::read_exr(path);
    if (image.width != view.camera.width) return {};  // a reduced size
    cgs::DepthMap depth(image.width, image.height, 0);
    for (size_t k = 0; k < depth.data.size(); ++k) {
      depth.data[k] = image.channels[0].second[k] / static_cast<float>(scene.frame.scale);
    }
    out.push_back(std::move(depth));
  }
  return out;
}

// Mean |log depth ratio| and the share within 1 % over all pixels whose truth is known.
void print_depth_error(const cgs::Trainer& trainer, const std::vector<cgs::DepthMap>& truth) {
  double sum = 0;
  double within = 0;
  double count = 0;
  for (size_t n = 0; n < truth.size(); ++n) {
    const cgs::DepthMap& depth = trainer.model().depth(n);
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (!(truth[n].data[i] > 0) || !(depth.data[i] > 0)) continue;
      const double error = std::abs(std::log(double(depth.data[i]) / double(truth[n].data[i])));
      sum += std::min(error, 0.1);
      within += error < 0.01 ? 1 : 0;
      ++count;
    }
  }
  if (count > 0)
    std::printf(" | depth %.3f%% off, %.1f%% good", 100 * sum / count, 100 * within / count);
}

struct Means {
  double psnr = 0, ssim = 0, psnr_fixed = 0, ssim_fixed = 0, psnr_seen = 0, holes = 0;
};

cgs::ColorImage exposed_alike(const HeldOut& held_out,
                              const cgs::ColorImage& shown,
                              const MaskMap& seen) {
  cgs::View view = held_out.view;
  if (held_out.is_exposed_otherwise) {
    view.exposure = cgs::matching_gain(view.image, shown, seen);
    cgs::apply_exposure(view);
  }
  return view.image;
}

Means evaluate(const cgs::Gaussians& gaussians,
               const std::vector<cgs::SupportView>& inputs,
               std::vector<HeldOut>& held_out) {
  Means m;
  for (HeldOut& h : held_out) {
    cgs::RenderBuffers buffers = cgs::rasterize(gaussians, h.view.camera);
    cgs::annotate_support(buffers, h.view.camera, inputs);
    const MaskMap valid = valid_pixels(h.view);
    const MaskMap seen = seen_pixels(buffers, valid);
    if (h.seen_at_start.empty()) h.seen_at_start = seen;
    const cgs::ColorImage shown = cgs::picture(buffers);
    const cgs::ColorImage photograph = exposed_alike(h, shown, seen);
    m.psnr += cgs::psnr(shown, photograph, &valid);
    m.ssim += cgs::ssim(shown, photograph, &valid);
    m.psnr_fixed += cgs::psnr(shown, photograph, &h.seen_at_start);
    m.ssim_fixed += cgs::ssim(shown, photograph, &h.seen_at_start);
    m.psnr_seen += cgs::psnr(shown, photograph, &seen);
    const auto count = [](const MaskMap& mask) {
      return double(std::count(mask.data.begin(), mask.data.end(), 1));
    };
    m.holes += 1 - count(seen) / count(valid);
  }
  const auto n = double(held_out.size());
  return {m.psnr / n, m.ssim / n, m.psnr_fixed / n, m.ssim_fixed / n, m.psnr_seen / n, m.holes / n};
}

void give_corrupted_depth(const std::vector<cgs::DepthMap>& truth,
                          double bumps,
                          cgs::Scene& scene) {
  cgs::require(!truth.empty(), "given depth is made from the truth of the scene", truth.size());
  for (size_t n = 0; n < truth.size(); ++n) {
    const cgs::test::Corruption how{
        .bumps = bumps, .inverted_x = truth[n].width / 2, .inverted_y = truth[n].height / 2};
    scene.views[static_cast<size_t>(scene.input[n])].given_depth =
        cgs::test::corrupted_depth(truth[n], static_cast<unsigned>(n), how);
  }
}

cgs::Gaussians pruned(cgs::Gaussians gaussians, const cgs::Scene& scene, double gap) {
  if (!(gap > 0)) return gaussians;
  std::vector<cgs::Camera> cameras;
  for (const int i : scene.input) cameras.push_back(scene.views[static_cast<size_t>(i)].camera);
  const std::vector<uint8_t> keep = cgs::test::kept_by_mode(gaussians, cameras, gap);
  for (size_t g = 0; g < keep.size(); ++g) {
    if (keep[g] == 0) gaussians.opacity[g] = 0;
  }
  return gaussians;
}

void run(int argc, char** argv) {
  cgs::Model model = cgs::read_model(argv[1]);
  cgs::TrainingOptions options;
  int every = 100;
  size_t limit = 6;
  std::string views;
  double prune = 0;
  double bumps = -1;
  for (int i = 2; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = std::min(argument.find('='), argument.size() - 1);
    const std::string name = argument.substr(0, equals);
    const std::string value = argument.substr(equals + 1);
    if (name == "every") {
      every = std::atoi(value.c_str());
    } else if (name == "limit") {
      limit = static_cast<size_t>(std::atoi(value.c_str()));
    } else if (name == "preset") {
      options = cgs::training_preset(value);
    } else if (name == "views") {
      views = value;
    } else if (name == "prune") {
      prune = std::atof(value.c_str());
    } else if (name == "given") {
      bumps = std::atof(value.c_str());
    } else {
      cgs::set_training_field(options, name, value);
    }
  }
  cgs::load_images(model.scene, model.scene.input);
  std::vector<HeldOut> held_out;
  const std::vector<int> indices =
      views.empty() ? model.scene.held_out : cgs::select_views(model.scene, views);
  const size_t stride = std::max<size_t>(1, indices.size() / std::max<size_t>(limit, 1));
  for (size_t k = stride / 2; k < indices.size(); k += stride) {
    cgs::load_images(model.scene, {indices[k]});
    held_out.push_back({model.scene.views[static_cast<size_t>(indices[k])],
                        cgs::is_exposed_otherwise(model, indices[k]),
                        {}});
  }
  const std::vector<cgs::SupportView> inputs = cgs::support_views(model);
  const std::vector<cgs::DepthMap> truth = true_depths(model.scene);
  if (bumps >= 0) give_corrupted_depth(truth, bumps, model.scene);
  cgs::Trainer trainer(model.scene, model.priors, options);
  std::printf(
      "%5s %7s | %6s %5s | %6s %5s | %6s %5s |  l1      ssim    tv      flow    prior   bend\n",
      "step",
      "core_s",
      "all",
      "ssim",
      "fixed",
      "ssim",
      "seen",
      "holes");
  double seconds = 0;
  cgs::StepReport last;
  while (true) {
    if (trainer.steps_done() % every == 0 || trainer.done()) {
      const Means m =
          evaluate(pruned(trainer.model().gaussians(), model.scene, prune), inputs, held_out);
      std::printf(
          "%5d %7.1f | %6.2f %.3f | %6.2f %.3f | %6.2f %4.1f%% | %.5f %.5f %.5f %.5f %.5f %.5f",
          trainer.steps_done(),
          seconds,
          m.psnr,
          m.ssim,
          m.psnr_fixed,
          m.ssim_fixed,
          m.psnr_seen,
          100 * m.holes,
          last.l1,
          last.ssim,
          last.tv,
          last.flow,
          last.prior,
          last.bending);
      print_depth_error(trainer, truth);
      std::printf("\n");
      std::fflush(stdout);
    }
    if (trainer.done()) break;
    const std::clock_t start = std::clock();
    last = trainer.step();
    seconds += double(std::clock() - start) / CLOCKS_PER_SEC;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "usage: training_accuracy MODEL [preset=NAME] [every=STEPS] [limit=COUNT | "
                 "views=NAME,NAME] [prune=GAP] [given=BUMPS] [FIELD=VALUE ...]\n");
    return 2;
  }
  try {
    run(argc, argv);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "training_accuracy: %s\n", error.what());
    return 1;
  }
}
