// SPDX-License-Identifier: GPL-3.0-or-later
// What a viewer of web/asset.glb sees from the cameras of a run, against the photographs: as they
// are, and with the exposure of the picture, one factor on linear light per channel, matched. Of
// input views also where the view's own photograph is shown, which tells of resampling, offsets and
// JPEG alone, and where another one is, which tells of the surface, too.
//
// usage: texture_accuracy RUN_FOLDER [ASSET.glb [PICTURE_FOLDER]]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>

#include "convert/model/model.h"
#include "io/bytes/atomic_file.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/srgb.h"
#include "libcgs/train/image_metrics.h"
#include "tests/support/glb_file.h"
#include "tests/support/temp_dir.h"

namespace {

using namespace cgs;

bool is_seen(const std::string& material) {
  return material.rfind("observed", 0) == 0 || material.rfind("single view", 0) == 0;
}

/// Red, green and blue for the first, second and third image; grey where there is none.
ColorImage parts_picture(const test::GlbPicture& picture, const test::Glb& glb) {
  ColorImage out(picture.part.width, picture.part.height, Eigen::Vector3f::Zero());
  for (size_t p = 0; p < out.data.size(); ++p) {
    const int part = picture.part.data[p];
    if (part < 0) continue;
    const int image = glb.parts[static_cast<size_t>(part)].image;
    out.data[p].setConstant(0.3f);
    if (image >= 0) out.data[p][image % 3] = 1;
  }
  return out;
}

/// The picture at the exposure of the photograph: median ratio over the pixels in use.
ColorImage exposure_matched(ColorImage picture, const ColorImage& photograph, const MaskMap& use) {
  for (int c = 0; c < 3; ++c) {
    std::vector<float> ratios;
    for (size_t p = 0; p < use.data.size(); ++p) {
      const float a = picture.data[p][c];
      const float b = photograph.data[p][c];
      if (use.data[p] == 0 || std::min(a, b) < 0.04f || std::max(a, b) > 0.98f) continue;
      ratios.push_back(linear_from_srgb(b) / linear_from_srgb(a));
    }
    if (ratios.empty()) continue;
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    for (Eigen::Vector3f& color : picture.data) {
      color[c] = std::min(1.0f, srgb_from_linear(*middle * linear_from_srgb(color[c])));
    }
  }
  return picture;
}

/// Of a part of a file, the name of the photograph that it shows; empty = none.
std::string photograph_of(const test::Glb& glb, const test::GlbPart& part) {
  if (part.image < 0) return {};
  return glb.json["images"][static_cast<size_t>(part.image)]["name"];
}

/// \return NaN where no pixel counts
double psnr_on(const MaskMap& use, const ColorImage& picture, const ColorImage& photograph) {
  const bool any =
      std::any_of(use.data.begin(), use.data.end(), [](uint8_t used) { return used != 0; });
  return any ? psnr(picture, photograph, &use) : std::nan("");
}

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return sum / count; }
};

void measure(const std::filesystem::path& run,
             const std::filesystem::path& asset,
             const std::filesystem::path& pictures) {
  Model model = read_model(run / "model");
  Scene& scene = model.scene;
  std::vector<int> views = scene.input;
  views.insert(views.end(), scene.held_out.begin(), scene.held_out.end());
  const test::Glb glb = test::parse_glb(test::read_bytes(asset));
  std::array<Mean, 4> means;
  if (!pictures.empty()) make_output_folder(pictures);
  for (size_t k = 0; k < views.size(); ++k) {
    const int i = views[k];
    load_images(scene, {i});
    View& view = scene.views[static_cast<size_t>(i)];
    Camera camera = view.camera;
    camera.world_from_cam = world_from_internal(scene.frame, camera.world_from_cam);
    const test::GlbPicture picture = test::render_glb(glb, camera);
    MaskMap seen(camera.width, camera.height, 0);
    MaskMap textured = seen;
    MaskMap own = seen;
    MaskMap other = seen;
    double n = 0;
    double n_textured = 0;
    for (size_t p = 0; p < seen.data.size(); ++p) {
      const int part = picture.part.data[p];
      if (part < 0 || (!view.valid.empty() && view.valid.data[p] == 0)) continue;
      seen.data[p] = is_seen(glb.parts[static_cast<size_t>(part)].material) ? 1 : 0;
      textured.data[p] = glb.parts[static_cast<size_t>(part)].image >= 0 ? 1 : 0;
      const std::string shown = photograph_of(glb, glb.parts[static_cast<size_t>(part)]);
      own.data[p] = shown == view.name ? 1 : 0;
      other.data[p] = !shown.empty() && shown != view.name ? 1 : 0;
      n += seen.data[p];
      n_textured += textured.data[p];
    }
    const bool is_input = k < scene.input.size();
    const double value = psnr(picture.color, view.image, &seen);
    const double matched =
        psnr(exposure_matched(picture.color, view.image, seen), view.image, &seen);
    means.at(is_input ? 0 : 2).add(value);
    means.at(is_input ? 1 : 3).add(matched);
    std::printf(
        "%s %s  PSNR on seen surface %.2f dB, matched %.2f dB (%.1f %% of pixels), SSIM %.4f; "
        "textured %.1f %%",
        view.name.c_str(),
        is_input ? "input   " : "held out",
        value,
        matched,
        100 * n / double(seen.data.size()),
        ssim(picture.color, view.image, &seen),
        100 * n_textured / double(seen.data.size()));
    if (n_textured > 0) std::printf(", PSNR %.2f dB", psnr(picture.color, view.image, &textured));
    if (is_input && n_textured > 0) {
      std::printf(" (own photograph %.2f dB, others %.2f dB)",
                  psnr_on(own, picture.color, view.image),
                  psnr_on(other, picture.color, view.image));
    }
    std::printf("\n");
    if (!pictures.empty()) {
      write_png(pictures / (view.name + ".png"), picture.color);
      write_png(pictures / (view.name + ".parts.png"), parts_picture(picture, glb));
    }
    view.image = {};
  }
  std::printf("mean input %.2f dB, matched %.2f dB", means[0].value(), means[1].value());
  if (means[2].count > 0) {
    std::printf("; held out %.2f dB, matched %.2f dB", means[2].value(), means[3].value());
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: texture_accuracy RUN_FOLDER [ASSET.glb [PICTURE_FOLDER]]\n");
    return 2;
  }
  try {
    const std::filesystem::path run = argv[1];
    measure(run, argc > 2 ? argv[2] : run / "web/asset.glb", argc > 3 ? argv[3] : "");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "texture_accuracy: %s\n", error.what());
    return 1;
  }
}
