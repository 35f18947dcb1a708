// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether two trainings of one start that disagree tell where both are wrong, beside sigma.
//
// usage: disagreement MODEL [FIELD=VALUE ...] [/ FIELD=VALUE ...] [truth=DISPARITY.pgm]
//
// MODEL is a folder that `cgs train --set steps=0` wrote. Two models are trained from it, with the
// fields before and after the slash; without any, the standard setting and one with
// dropout=0.2. Truth is the scene's folder truth/ (a capture of cgs_make_capture), or an image of
// the disparity of the first input view in any unit, 0 = unknown, brought to the scale of the
// scene by the median.
//
// Prints Spearman's rank correlation with the true error of: sigma, the difference between the two
// models, and the sum of the ranks of both. First of depth at the input views (error and
// difference as |log ratio|, sigma as a share of depth), for pixels whose depth is measured and
// for others; then of colour at held-out views, where something was seen (mean absolute difference
// over channels; sigma drawn from there).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numeric>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "convert/model/model.h"
#include "convert/model/views.h"
#include "io/images/exr.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/train/trainer.h"

namespace {

using namespace cgs;

// Ranks from 0 on; equal values have the mean of theirs.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> out(values.size());
  for (size_t first = 0; first < order.size();) {
    size_t last = first;
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (size_t k = first; k < last; ++k) out[order[k]] = 0.5 * double(first + last - 1);
    first = last;
  }
  return out;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = double(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0;
  double aa = 0;
  double bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

struct Samples {
  std::vector<double> error, sigma, difference;

  void add(double e, double s, double d) {
    if (!std::isfinite(e) || !std::isfinite(s) || !std::isfinite(d)) return;
    error.push_back(e);
    sigma.push_back(s);
    difference.push_back(d);
  }
  void print(const char* name) const {
    if (error.size() < 100) {
      std::printf("%-28s too few\n", name);
      return;
    }
    const std::vector<double> e = ranks(error);
    const std::vector<double> s = ranks(sigma);
    const std::vector<double> d = ranks(difference);
    std::vector<double> both(s.size());
    for (size_t i = 0; i < s.size(); ++i) both[i] = s[i] + d[i];
    std::printf("%-28s %8zu %8.2f %8.2f %8.2f\n",
                name,
                e.size(),
                correlation(e, s),
                correlation(e, d),
                correlation(e, ranks(both)));
  }
};

// Exact depth of a view [internal units], from truth/ of the scene; empty without.
DepthMap true_depth(const Scene& scene, int index) {
  const View& view = scene.views[static_cast<size_t>(index)];
  const auto path =
      view.image_path.parent_path().parent_path() / "truth" / (view.name + "_depth.exr");
  if (!std::filesystem::exists(path)) return {};
  const ExrImage image = read_exr(path);
  const Camera& camera = view.camera;
  DepthMap depth(camera.width, camera.height, 0);
  const int step = image.width / camera.width;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto from =
          static_cast<size_t>(y * step + step / 2) * image.width + x * step + step / 2;
      depth(x, y) = image.channels[0].second[from] / static_cast<float>(scene.frame.scale);
    }
  }
  return depth;
}

DepthMap depth_of_disparity(const std::string& path, const ViewPriors& priors) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (image.empty()) throw BadInput(Defect::Open, path, "cannot be read");
  DepthMap depth(priors.depth.width, priors.depth.height, 0);
  require(image.cols == depth.width, "the truth must have the size of the view", image.cols);
  std::vector<float> scales;
  for (size_t i = 0; i < depth.data.size(); ++i) {
    const uint8_t disparity = image.data[i];
    if (disparity == 0) continue;
    depth.data[i] = 1.0f / static_cast<float>(disparity);
    if (priors.origin.data[i] != DepthOrigin::Measured) continue;
    scales.push_back(priors.depth.data[i] / depth.data[i]);
  }
  require(!scales.empty(), "pixels with depth and truth must exist", 0);
  const float scale = median(scales);
  for (float& z : depth.data) z *= scale;
  return depth;
}

void print_depth(const Model& model,
                 const CoherentGaussians& first,
                 const CoherentGaussians& second,
                 const std::string& disparity) {
  Samples measured;
  Samples others;
  for (size_t n = 0; n < model.priors.size(); ++n) {
    const ViewPriors& priors = model.priors[n];
    DepthMap truth = true_depth(model.scene, model.scene.input[n]);
    if (!disparity.empty() && n == 0) truth = depth_of_disparity(disparity, priors);
    for (size_t i = 0; i < truth.data.size(); ++i) {
      const auto z = double(first.depth(n).data[i]);
      if (!(truth.data[i] > 0) || !(z > 0)) continue;
      Samples& to = priors.origin.data[i] == DepthOrigin::Measured ? measured : others;
      to.add(std::abs(std::log(z / double(truth.data[i]))),
             double(priors.sigma.data[i]) / double(priors.depth.data[i]),
             std::abs(std::log(z / double(second.depth(n).data[i]))));
    }
  }
  measured.print("depth, measured");
  others.print("depth, not measured");
}

// The set in the colour of what sigma / depth is at the pixel of each Gaussian, times a hundred.
Gaussians in_sigmas(const CoherentGaussians& model, const std::vector<ViewPriors>& priors) {
  Gaussians out = model.gaussians();
  out.sh_degree = 0;
  out.sh.assign(out.size(), Eigen::Vector3f::Zero());
  for (size_t n = 0; n < priors.size(); ++n) {
    const CoherentGaussians::Range range = model.range(n);
    for (size_t g = range.first; g < range.last; ++g) {
      const auto pixel = static_cast<size_t>(model.pixel(n, g - range.first));
      const float sigma = priors[n].sigma.data[pixel] / priors[n].depth.data[pixel];
      if (std::isfinite(sigma)) out.sh[g].setConstant((100 * sigma - 0.5f) / kShC0);
    }
  }
  return out;
}

double difference(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return double((a - b).cwiseAbs().mean());
}

void print_color(Model& model, const CoherentGaussians& first, const CoherentGaussians& second) {
  Samples samples;
  const std::vector<SupportView> inputs = support_views(model);
  const Gaussians sigmas = in_sigmas(first, model.priors);
  for (const int index : model.scene.held_out) {
    load_images(model.scene, {index});
    const View& view = model.scene.views[static_cast<size_t>(index)];
    RenderBuffers own = rasterize(first.gaussians(), view.camera);
    annotate_support(own, view.camera, inputs);
    const RenderBuffers other = rasterize(second.gaussians(), view.camera);
    const RenderBuffers drawn_sigmas = rasterize(sigmas, view.camera);
    for (size_t i = 0; i < view.image.data.size(); ++i) {
      const bool is_valid = view.valid.empty() || view.valid.data[i] != 0;
      if (!is_valid || is_hole(own.hole.data[i])) continue;
      samples.add(difference(own.color.data[i], view.image.data[i]),
                  double(drawn_sigmas.color.data[i].x()),
                  difference(own.color.data[i], other.color.data[i]));
    }
  }
  samples.print("colour, held out");
}

void run(int argc, char** argv) {
  Model model = read_model(argv[1]);
  std::array<TrainingOptions, 2> options;
  bool is_second = false;
  bool is_set = false;
  std::string truth;
  for (int i = 2; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = std::min(argument.find('='), argument.size());
    const std::string name = argument.substr(0, equals);
    const std::string value = argument.substr(std::min(equals + 1, argument.size()));
    if (argument == "/") {
      is_second = true;
    } else if (name == "truth") {
      truth = value;
    } else {
      set_training_field(options[is_second ? 1 : 0], name, value);
      is_set = true;
    }
  }
  if (!is_set) options[1].dropout = 0.2;
  load_images(model.scene, model.scene.input);
  Trainer first(model.scene, model.priors, options[0]);
  Trainer second(model.scene, model.priors, options[1]);
  for (Trainer* trainer : {&first, &second}) {
    while (!trainer->done()) trainer->step();
  }
  std::printf(
      "%-28s %8s %8s %8s %8s\n", "rank correlation of error", "pixels", "sigma", "differ", "both");
  print_depth(model, first.model(), second.model(), truth);
  print_color(model, first.model(), second.model());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "usage: disagreement MODEL [FIELD=VALUE ...] [/ FIELD=VALUE ...] "
                 "[truth=DISPARITY.pgm]\n");
    return 2;
  }
  try {
    run(argc, argv);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "disagreement: %s\n", error.what());
    return 1;
  }
}
