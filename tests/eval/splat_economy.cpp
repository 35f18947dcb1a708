// SPDX-License-Identifier: GPL-3.0-or-later
// What the splats for browsers save, and what that costs.
//
// usage: splat_economy MODEL OUTPUT [VIEW,VIEW]
//
// MODEL is a folder that `cgs train` or `cgs run` wrote. Writes all of its splats and those for
// browsers to OUTPUT, reads both .spz back, and prints of both: splats, bytes, PSNR and SSIM of the
// views held out (or of those named). Then, along the spiral of `cgs render`, the part of the
// pixels that all splats cover and the fewer leave open, and how alike the pictures are. Last, what
// was tried.
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/evaluation.h"
#include "convert/model/model.h"
#include "convert/run/web_splats.h"
#include "io/bytes/atomic_file.h"
#include "io/images/png.h"
#include "io/scenes/view_names.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_reader.h"
#include "io/splats/spz.h"
#include "libcgs/reconstruct/camera_path.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

namespace {

using Json = nlohmann::ordered_json;

struct Files {
  size_t splats = 0;
  size_t spz = 0;
  size_t glb = 0;
  cgs::ViewFigures shown;  ///< As the SPZ reads back.
};

size_t bytes_of(const std::filesystem::path& file) {
  return static_cast<size_t>(std::filesystem::file_size(file));
}

// The model has other splats from then on.
Files read_back(cgs::Model& model,
                const std::filesystem::path& folder,
                const std::vector<int>& views) {
  Files out;
  const cgs::Frame frame = model.scene.frame;
  model.gaussians = cgs::read_splats(folder / "splats.spz", frame).gaussians;
  out.splats = model.gaussians.size();
  out.spz = bytes_of(folder / "splats.spz");
  out.glb = bytes_of(folder / "splats.glb");
  out.shown = cgs::evaluate_views(model, views, {}, cgs::HoleFill::None).mean;
  return out;
}

void print(const char* name, const Files& files) {
  std::printf("%s: %zu splats, spz %zu, glb %zu bytes, PSNR %.3f, SSIM %.4f\n",
              name,
              files.splats,
              files.spz,
              files.glb,
              files.shown.psnr.value(),
              files.shown.ssim.value());
}

// Writes one picture of the path, of both.
void print_along_spiral(const cgs::Gaussians& all,
                        const cgs::Model& fewer,
                        const std::filesystem::path& output) {
  constexpr float kCovered = 0.95f;  // alpha
  constexpr float kOpen = 0.8f;
  constexpr int kFrames = 12;
  size_t covered = 0;
  size_t open = 0;
  double sum = 0;
  int frame = 0;
  for (const cgs::Camera& camera : cgs::camera_path(fewer, "spiral", kFrames)) {
    const cgs::RenderBuffers a = cgs::rasterize(all, camera);
    const cgs::RenderBuffers b = cgs::rasterize(fewer.gaussians, camera);
    for (size_t i = 0; i < a.alpha.data.size(); ++i) {
      sum += (a.color.data[i] - b.color.data[i]).cast<double>().squaredNorm() /
             double(3 * a.alpha.data.size());
      if (a.alpha.data[i] < kCovered) continue;
      ++covered;
      open += b.alpha.data[i] < kOpen ? 1 : 0;
    }
    if (++frame != kFrames / 4) continue;
    cgs::write_png(output / "all.png", cgs::picture(a));
    cgs::write_png(output / "web.png", cgs::picture(b));
  }
  std::printf("spiral: %.4f %% of what is covered is left open; pictures agree to %.2f dB\n",
              100 * double(open) / double(covered),
              -10 * std::log10(sum / kFrames));
}

void run(const std::filesystem::path& folder,
         const std::filesystem::path& output,
         const std::string& names) {
  cgs::Model model = cgs::read_model(folder);
  model.scene.frame.up = -Eigen::Vector3d::UnitY();  // the axes by which SPZ is read back
  const std::vector<int> views =
      names.empty() ? model.scene.held_out : cgs::select_views(model.scene, names);
  cgs::make_output_folder(output / "all");
  cgs::write_spz(output / "all/splats.spz", model.gaussians, model.scene.frame);
  cgs::write_splat_glb(output / "all/splats.glb", model.gaussians, model.scene.frame, {});
  const std::clock_t begin = std::clock();
  const Json web = cgs::web_splats_to_json(cgs::write_web_splats(output / "web", model));
  const double seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
  const cgs::Gaussians all = std::exchange(model.gaussians, {});
  print("all", read_back(model, output / "all", views));
  print("web", read_back(model, output / "web", views));
  print_along_spiral(all, model, output);
  std::printf("%.1f core-seconds, evaluation included; %s\n", seconds, web.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: splat_economy MODEL OUTPUT [VIEW,VIEW]\n");
    return 2;
  }
  try {
    run(argv[1], argv[2], argc == 4 ? argv[3] : "");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "splat_economy: %s\n", error.what());
    return 1;
  }
}
