// SPDX-License-Identifier: GPL-3.0-or-later
//
// How accurate the plane sweep is on stereo pairs with known disparity (Middlebury 2014 at quarter
// size and 2006 at third size), as scenes of two views.
//
//   stereo_accuracy FOLDER [PAIR]   FOLDER holds middlebury2014Q/ and middlebury2006T/; PAIR is one
//                                   of them, such as Piano; a pair is a folder as it comes from
//                                   vision.middlebury.edu/stereo/data
//
// Prints per pair, over pixels that both photographs show: the share that a depth was measured
// for, the share of those whose disparity is wrong by more than 0.5, 1 and 2 pixels, the same
// after completion (every pixel counts), the shares of measured depths within 1, 2, 3 and 5 of
// their sigmas (of a normal distribution: 68.3, 95.4, 99.7 and 100 %), and the time. The truth of
// the 2006 pairs comes in steps of a third of a pixel.
//
// Then what given depth brings where nothing was measured: the true disparity, brought to another
// scale and offset; the same with waves of 4 % and blurred edges, as networks err; and with bumps
// of 20 %, inverted blocks and outliers.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "libcgs/core/error.h"
#include "libcgs/priors/depth_completion.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/priors/plane_sweep.h"

namespace {

using namespace cgs;

struct Pair {
  Scene scene;
  Raster<float> disparity;  // of the left view; infinite = unknown
  MaskMap counted;          // known and not occluded
  double focal_baseline = 0;
  double offset = 0;  // disparity = focal_baseline / depth - offset
};

cv::Mat read(const std::filesystem::path& path, int flags) {
  cv::Mat image = cv::imread(path.string(), flags);
  if (image.empty()) throw BadInput(Defect::Open, path, "cannot be read");
  return image;
}

ColorImage color_image(const std::filesystem::path& path) {
  const cv::Mat bgr = read(path, cv::IMREAD_COLOR);
  ColorImage image(bgr.cols, bgr.rows, Eigen::Vector3f::Zero());
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      image(x, y) = Eigen::Vector3f(p[2], p[1], p[0]) / 255.0f;
    }
  }
  return image;
}

// Little-endian PFM, rows from below. OpenCV's reader divides by the scale in the header, which in
// these files is not meant.
Raster<float> read_pfm(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string tag;
  int width = 0;
  int height = 0;
  double scale = 0;
  file >> tag >> width >> height >> scale;
  if (tag != "Pf" || width <= 0 || height <= 0 || !(scale < 0)) {
    throw BadInput(Defect::Syntax, path, "not a little-endian grey PFM");
  }
  file.get();
  Raster<float> out(width, height, 0.0f);
  for (int y = height - 1; y >= 0; --y) {
    file.read(reinterpret_cast<char*>(&out(0, y)), std::streamsize(sizeof(float)) * width);
  }
  if (!file) throw BadInput(Defect::Truncated, path, "rows are missing");
  return out;
}

// Left camera at the origin, right one a unit to its right.
Scene stereo_scene(const std::filesystem::path& folder,
                   const char* left,
                   const char* right,
                   const Eigen::Vector3d& fxy) {
  Scene scene;
  scene.folder = folder;
  for (const int i : {0, 1}) {
    View view;
    view.name = i == 0 ? left : right;
    view.image = color_image(folder / view.name);
    view.camera = {.width = view.image.width,
                   .height = view.image.height,
                   .fx = fxy.x(),
                   .fy = fxy.x(),
                   .cx = fxy.y() + (i == 1 ? fxy.z() : 0),
                   .cy = 0.5 * view.image.height};
    view.camera.world_from_cam.translation().x() = i;
    scene.views.push_back(std::move(view));
    scene.input.push_back(i);
  }
  return scene;
}

// The depth range is what a user of the benchmark is told: the largest disparity.
void set_range(Pair& pair, double smallest, double largest) {
  for (View& view : pair.scene.views) {
    view.near = pair.focal_baseline / (largest + pair.offset);
    view.far = pair.focal_baseline / (smallest + pair.offset);
  }
}

Pair read_2014(const std::filesystem::path& folder) {
  std::ifstream file(folder / "calib.txt");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto number = [&](const char* pattern) {
    std::smatch match;
    if (!std::regex_search(text, match, std::regex(pattern))) {
      throw BadInput(Defect::Syntax, folder / "calib.txt", pattern);
    }
    return std::stod(match[1]);
  };
  Pair pair;
  const double focal = number(R"(cam0=\[\s*([\d.]+))");
  const double cx = number(R"(cam0=\[\s*[\d.]+\s+0\s+([\d.]+))");
  pair.offset = number(R"(doffs=\s*([\d.]+))");
  pair.focal_baseline = focal;
  pair.scene = stereo_scene(folder, "im0.png", "im1.png", {focal, cx, pair.offset});
  set_range(pair, number(R"(vmin=\s*([\d.]+))"), number(R"(ndisp=\s*([\d.]+))"));
  pair.disparity = read_pfm(folder / "disp0GT.pfm");
  const cv::Mat mask = read(folder / "mask0nocc.png", cv::IMREAD_GRAYSCALE);
  pair.counted = MaskMap(pair.disparity.width, pair.disparity.height, 0);
  for (int y = 0; y < pair.disparity.height; ++y) {
    for (int x = 0; x < pair.disparity.width; ++x) {
      pair.counted(x, y) = mask.at<uint8_t>(y, x) == 255 && std::isfinite(pair.disparity(x, y));
    }
  }
  return pair;
}

Pair read_2006(const std::filesystem::path& folder) {
  Pair pair;
  pair.focal_baseline = 1240;  // third of 3740 pixels; any positive number gives the same result
  const cv::Mat left = read(folder / "disp1.png", cv::IMREAD_GRAYSCALE);
  const cv::Mat right = read(folder / "disp5.png", cv::IMREAD_GRAYSCALE);
  pair.scene = stereo_scene(folder, "view1.png", "view5.png", {1240, 0.5 * left.cols, 0});
  pair.disparity = Raster<float>(left.cols, left.rows, 0.0f);
  pair.counted = MaskMap(left.cols, left.rows, 0);
  for (int y = 0; y < left.rows; ++y) {
    for (int x = 0; x < left.cols; ++x) {
      const double d = left.at<uint8_t>(y, x) / 3.0;  // the scale of third-size maps
      pair.disparity(x, y) = static_cast<float>(d);
      const int other = static_cast<int>(std::lround(x - d));
      if (d <= 0 || other < 0) continue;
      pair.counted(x, y) = std::abs(right.at<uint8_t>(y, other) / 3.0 - d) <= 1;
    }
  }
  set_range(pair, 10, 85);
  return pair;
}

struct BadPixels {
  double known = 0;
  double half = 0;
  double one = 0;
  double two = 0;
};

BadPixels bad_pixels(const Pair& pair, const ViewPriors& priors) {
  BadPixels bad;
  double counted = 0;
  for (size_t i = 0; i < pair.counted.data.size(); ++i) {
    if (pair.counted.data[i] == 0) continue;
    counted += 1;
    const double depth = double(priors.depth.data[i]) * pair.scene.frame.scale;
    if (std::isnan(depth)) continue;
    const double error =
        std::abs(pair.focal_baseline / depth - pair.offset - double(pair.disparity.data[i]));
    bad.known += 1;
    bad.half += error > 0.5;
    bad.one += error > 1;
    bad.two += error > 2;
  }
  for (double* sum : {&bad.half, &bad.one, &bad.two}) *sum *= 100 / bad.known;
  bad.known *= 100 / counted;
  return bad;
}

// Shares [%] of the measured depths that lie within 1, 2, 3 and 5 of their sigmas.
std::array<double, 4> shares_within_sigma(const Pair& pair, const ViewPriors& priors) {
  constexpr std::array<double, 4> kLimits = {1, 2, 3, 5};
  std::array<double, 4> shares = {};
  double known = 0;
  for (size_t i = 0; i < pair.counted.data.size(); ++i) {
    const auto depth = double(priors.depth.data[i]);
    if (pair.counted.data[i] == 0 || std::isnan(depth)) continue;
    const double truth = pair.focal_baseline / (double(pair.disparity.data[i]) + pair.offset);
    const double error = std::abs(depth - truth / pair.scene.frame.scale);
    known += 1;
    for (size_t k = 0; k < kLimits.size(); ++k) {
      shares[k] += error < kLimits[k] * double(priors.sigma.data[i]);
    }
  }
  for (double& share : shares) share *= 100 / known;
  return shares;
}

void evaluate(Pair pair) {
  to_canonical(pair.scene);
  const auto start = std::chrono::steady_clock::now();
  std::vector<ViewPriors> priors = plane_sweep(pair.scene, {});
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  const BadPixels measured = bad_pixels(pair, priors[0]);
  const std::array<double, 4> within = shares_within_sigma(pair, priors[0]);
  complete_depth(priors[0], pair.scene.views[0], {});
  const BadPixels all = bad_pixels(pair, priors[0]);
  std::printf(
      "%-14s %8.1f | %6.2f %6.2f %6.2f | %6.2f %6.2f %6.2f | %5.1f %5.1f %5.1f %5.1f | %6.2f\n",
      pair.scene.folder.filename().c_str(),
      measured.known,
      measured.half,
      measured.one,
      measured.two,
      all.half,
      all.one,
      all.two,
      within[0],
      within[1],
      within[2],
      within[3],
      time.count());
}

// Inverse depth of another scale and offset; 0 where the truth is not known.
DepthMap disturbed(const Pair& pair, int how) {
  DepthMap out(pair.disparity.width, pair.disparity.height, 0.0f);
  const float typical = 0.5f * float(pair.focal_baseline / pair.scene.views[0].near - pair.offset);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const float d = pair.disparity(x, y);
      if (std::isfinite(d) && d > 0) out(x, y) = d;
    }
  }
  if (how == 1) {
    cv::Mat image(out.height, out.width, CV_32FC1, out.data.data());
    const cv::Mat known = image > 0;
    cv::Mat blurred;
    cv::GaussianBlur(image, blurred, {}, 3);
    blurred.copyTo(image, known);
  }
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      float& d = out(x, y);
      if (!(d > 0)) continue;
      const float wave = std::sin(0.02f * float(x)) * std::cos(0.025f * float(y));
      if (how == 1) d *= 1 + 0.04f * wave;
      if (how == 2) {
        const bool is_inverted = x % 180 > 140 && y % 160 > 120;
        const bool is_wild = (x * 7919 + y * 104729) % 23 == 0;
        d *= 1 + 0.2f * std::pow(wave, 9.0f);
        d = is_wild ? typical * 0.1f * float((x * y) % 29) : is_inverted ? 2.5f * typical - d : d;
      }
      d = std::max(0.0f, 3.7f * d + 20);
    }
  }
  return out;
}

// Error of the disparity where the photographs alone measured nothing and the truth is known.
BadPixels where_not_measured(const Pair& pair, const ViewPriors& alone, const ViewPriors& priors) {
  Pair others = pair;
  for (size_t i = 0; i < others.counted.data.size(); ++i) {
    const bool is_known = std::isfinite(pair.disparity.data[i]) && pair.disparity.data[i] > 0;
    others.counted.data[i] = is_known && alone.origin.data[i] != DepthOrigin::Measured ? 1 : 0;
  }
  return bad_pixels(others, priors);
}

void evaluate_given(Pair pair) {
  to_canonical(pair.scene);
  const ViewPriors alone = estimate_priors(pair.scene, {}).views[0];
  const BadPixels before = where_not_measured(pair, alone, alone);
  std::printf(
      "%-14s | %6.1f %6.1f |", pair.scene.folder.filename().c_str(), before.one, before.two);
  for (const int how : {0, 1, 2}) {
    pair.scene.views[0].given_depth = disturbed(pair, how);
    const EstimatedPriors with = estimate_priors(pair.scene, {});
    const BadPixels after = where_not_measured(pair, alone, with.views[0]);
    size_t changed = 0;
    for (size_t i = 0; i < alone.depth.data.size(); ++i) {
      const bool was_measured = alone.origin.data[i] == DepthOrigin::Measured;
      changed += was_measured && alone.depth.data[i] != with.views[0].depth.data[i] ? 1 : 0;
    }
    std::printf(" %6.1f %6.1f %5.1f %zu |",
                after.one,
                after.two,
                100 * with.report.coverage[0].guessed,
                changed);
  }
  std::printf("\n");
}

Pair read_pair(const std::filesystem::path& root, const std::string& name) {
  const std::filesystem::path newer = root / "middlebury2014Q" / name;
  return is_directory(newer) ? read_2014(newer) : read_2006(root / "middlebury2006T" / name);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: stereo_accuracy FOLDER [PAIR]\n");
    return 2;
  }
  try {
    const std::filesystem::path root = argv[1];
    std::vector<std::string> names = {
        "Motorcycle", "Piano", "Playroom", "Aloe", "Cloth3", "Lampshade2"};
    if (argc == 3) names = {argv[2]};
    std::printf(
        "pair            measured |  bad0.5  bad1  bad2 |  completed: the same |     within 1, 2, "
        "3, 5 sigma |   time\n");
    std::printf(
        "                  [%%]    |       [%%]            |       [%%]            |           "
        "[%%]           |   [s]\n");
    for (const std::string& name : names) evaluate(read_pair(root, name));
    std::printf(
        "\npixels that were not measured, bad1 and bad2 [%%]; share guessed [%%]; measured pixels "
        "that changed\n");
    std::printf(
        "pair           |         alone |  other scale and offset |    waves, blurred edges | "
        "bumps, "
        "inverted, outliers |\n");
    for (const std::string& name : names) evaluate_given(read_pair(root, name));
  } catch (const Error& error) {
    std::fprintf(stderr, "stereo_accuracy: %s\n", error.what());
    return error.exit_code();
  }
  return 0;
}
