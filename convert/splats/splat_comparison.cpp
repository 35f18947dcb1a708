// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/pictures.h"
#include "libcgs/core/error.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/render/virtual_cameras.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

/// Squared differences of colours, for a PSNR.
struct Squares {
  double sum = 0;
  size_t pixels = 0;

  void add(const Eigen::Vector3f& x, const Eigen::Vector3f& y) {
    sum += (x - y).cast<double>().squaredNorm();
    ++pixels;
  }
  void add(const Squares& other) {
    sum += other.sum;
    pixels += other.pixels;
  }
  std::optional<double> psnr() const {
    if (pixels == 0) return std::nullopt;
    if (sum == 0) return std::numeric_limits<double>::infinity();
    return -10 * std::log10(sum / (3 * double(pixels)));
  }
};

/// One of the two sets from a camera.
struct Drawn {
  RenderBuffers buffers;
  ColorImage picture;
  MaskMap unseen;  // 1 = yes
};

Drawn draw(const Gaussians& gaussians, const Camera& camera) {
  Drawn out{rasterize(gaussians, camera), {}, {}};
  out.picture = picture(out.buffers);
  constexpr float kHalf = 0.5f;
  out.unseen = MaskMap(camera.width, camera.height, 0);
  for (size_t i = 0; i < out.unseen.data.size(); ++i) {
    out.unseen.data[i] = out.buffers.alpha.data[i] >= kHalf ? 0 : 1;
  }
  return out;
}

double share(const MaskMap& mask) {
  return double(std::count(mask.data.begin(), mask.data.end(), uint8_t{1})) /
         double(mask.data.size());
}

double alone(const Drawn& shown, const Drawn& other) {
  size_t count = 0;
  for (size_t i = 0; i < shown.unseen.data.size(); ++i) {
    if (shown.unseen.data[i] == 0 && other.unseen.data[i] != 0) ++count;
  }
  return double(count) / double(shown.unseen.data.size());
}

ShownSplats shown_splats(const Drawn& drawn, const Drawn& other, const ComparedView& view) {
  ShownSplats out{share(drawn.unseen), alone(drawn, other), {}, {}};
  if (view.photograph.empty()) return out;
  Squares everywhere;
  Squares shared;
  for (size_t i = 0; i < drawn.picture.data.size(); ++i) {
    if (!view.valid.empty() && view.valid.data[i] == 0) continue;
    everywhere.add(drawn.picture.data[i], view.photograph.data[i]);
    if (drawn.unseen.data[i] != 0 || other.unseen.data[i] != 0) continue;
    shared.add(drawn.picture.data[i], view.photograph.data[i]);
  }
  out.psnr = everywhere.psnr();
  out.psnr_shared = shared.psnr();
  return out;
}

// On black: at the rim of what is shown, a little more alpha is a little more colour.
Squares difference(const Drawn& a, const Drawn& b) {
  Squares out;
  for (size_t i = 0; i < a.unseen.data.size(); ++i) {
    if (a.unseen.data[i] != 0 && b.unseen.data[i] != 0) continue;
    out.add(a.buffers.color.data[i].cwiseMin(1.0f), b.buffers.color.data[i].cwiseMin(1.0f));
  }
  return out;
}

ColorImage difference_picture(const Drawn& a, const Drawn& b) {
  constexpr float kLouder = 4;
  ColorImage out(a.picture.width, a.picture.height, Eigen::Vector3f::Zero());
  MaskMap unseen = a.unseen;
  for (size_t i = 0; i < out.data.size(); ++i) {
    unseen.data[i] = a.unseen.data[i] | b.unseen.data[i];
    const float mean = (a.picture.data[i] - b.picture.data[i]).cwiseAbs().mean();
    out.data[i].setConstant(std::min(1.0f, kLouder * mean));
  }
  return tinted(out, unseen);
}

ColorImage side_by_side(const Drawn& a, const Drawn& b, const ComparedView& view) {
  std::vector<ColorImage> pictures;
  if (!view.photograph.empty()) pictures.push_back(view.photograph);
  pictures.push_back(tinted(a.picture, a.unseen));
  pictures.push_back(tinted(b.picture, b.unseen));
  pictures.push_back(difference_picture(a, b));
  return contact_sheet(pictures, static_cast<int>(pictures.size()));
}

// Over all views: shares by pixels, the rest by views.
ShownSplats mean_of(const std::vector<ComparedPictures>& views,
                    const std::vector<double>& pixels,
                    ShownSplats ComparedPictures::*which) {
  ShownSplats out;
  double all = 0;
  for (const double count : pixels) all += count;
  for (size_t k = 0; k < views.size(); ++k) {
    const ShownSplats& of = views[k].*which;
    out.unseen += of.unseen * pixels[k] / all;
    out.alone += of.alone * pixels[k] / all;
  }
  for (const auto figure : {&ShownSplats::psnr, &ShownSplats::psnr_shared}) {
    double sum = 0;
    double count = 0;
    for (const ComparedPictures& view : views) {
      if (!(view.*which.*figure)) continue;
      sum += *(view.*which.*figure);
      ++count;
    }
    if (count > 0) out.*figure = sum / count;
  }
  return out;
}

void require_fitting(const ComparedView& view) {
  const auto fits = [&](const auto& raster) {
    return raster.empty() ||
           (raster.width == view.camera.width && raster.height == view.camera.height);
  };
  require(fits(view.photograph) && fits(view.valid),
          "a photograph to compare with must be of the size of its camera",
          view.name);
}

Json psnr_to_json(const std::optional<double>& psnr) {
  if (!psnr) return nullptr;
  return std::isinf(*psnr) ? Json("same") : Json(*psnr);
}

Json shown_to_json(const ShownSplats& shown) {
  return {{"unseen", shown.unseen},
          {"alone", shown.alone},
          {"psnr", psnr_to_json(shown.psnr)},
          {"psnr_shared", psnr_to_json(shown.psnr_shared)}};
}

}  // namespace

std::vector<ComparedView> views_around(const Gaussians& a,
                                       const Gaussians& b,
                                       const Progress& progress) {
  VirtualCameraOptions options;
  options.views = 8;
  VirtualCameras around = virtual_cameras(a, options, part_of(progress, 0, 0.5));
  VirtualCameras around_b = virtual_cameras(b, options, part_of(progress, 0.5, 1));
  if (around_b.radius > around.radius) around = std::move(around_b);
  std::vector<ComparedView> out;
  for (const Camera& camera : around.cameras) {
    out.push_back({"around_" + std::to_string(out.size() + 1), camera, {}, {}});
  }
  return out;
}

SplatComparison compare_splats(
    const Gaussians& a,
    const Gaussians& b,
    std::vector<ComparedView> views,
    const std::function<void(ComparedView&)>& load,
    const std::function<void(const std::string& name, const ColorImage&)>& show,
    const Progress& progress) {
  require(!views.empty(), "compare_splats: number of views must be > 0", views.size());
  SplatComparison out;
  Squares all;
  std::vector<double> pixels;
  for (size_t k = 0; k < views.size(); ++k) {
    report(progress, double(k) / double(views.size()));
    ComparedView view = std::move(views[k]);  // photographs go one by one
    if (load) load(view);
    require_fitting(view);
    const Drawn of_a = draw(a, view.camera);
    const Drawn of_b = draw(b, view.camera);
    const Squares between = difference(of_a, of_b);
    out.views.push_back({view.name,
                         shown_splats(of_a, of_b, view),
                         shown_splats(of_b, of_a, view),
                         between.psnr()});
    all.add(between);
    pixels.push_back(double(of_a.unseen.data.size()));
    if (show) show(view.name, side_by_side(of_a, of_b, view));
  }
  out.all = {"",
             mean_of(out.views, pixels, &ComparedPictures::a),
             mean_of(out.views, pixels, &ComparedPictures::b),
             all.psnr()};
  return out;
}

std::vector<std::string> lacking_words(const ComparedPictures& all) {
  constexpr double kLittle = 0.01;
  std::vector<std::string> out;
  for (const auto& [name, other, alone] :
       {std::tuple("A", "B", all.b.alone), std::tuple("B", "A", all.a.alone)}) {
    if (alone < kLittle) continue;
    std::array<char, 120> text{};
    std::snprintf(text.data(),
                  text.size(),
                  "%s shows nothing at %.1f %% of the pixels, where %s shows splats",
                  name,
                  100 * alone,
                  other);
    out.emplace_back(text.data());
  }
  return out;
}

Json splat_comparison_to_json(const SplatComparison& comparison) {
  Json views = Json::array();
  for (const ComparedPictures& view : comparison.views) {
    views.push_back({{"name", view.name},
                     {"psnr", psnr_to_json(view.psnr)},
                     {"a", shown_to_json(view.a)},
                     {"b", shown_to_json(view.b)}});
  }
  return {{"psnr", psnr_to_json(comparison.all.psnr)},
          {"a", shown_to_json(comparison.all.a)},
          {"b", shown_to_json(comparison.all.b)},
          {"views", views}};
}

}  // namespace cgs
