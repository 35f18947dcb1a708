// SPDX-License-Identifier: GPL-3.0-or-later
// What the splats for browsers save, and what that costs on photographs held out.
//
// usage: splat_economy MODEL OUTPUT
//
// MODEL is a folder that `cgs train` or `cgs run` wrote. Writes all of its splats to OUTPUT/all and
// those for browsers to OUTPUT/web, and prints, of both: splats, bytes, PSNR and SSIM of the views
// held out, and of pictures from cameras beside the path how many pixels that the model covers
// show through.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model.h"
#include "convert/views.h"
#include "convert/web_splats.h"
#include "io/atomic_file.h"
#include "io/gaussian_ply.h"
#include "io/json_file.h"
#include "io/spz.h"

namespace {

using Json = nlohmann::ordered_json;

double core_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: splat_economy MODEL OUTPUT\n");
    return 2;
  }
  try {
    cgs::Model model = cgs::read_model(argv[1]);
    const std::filesystem::path output = argv[2];
    cgs::make_output_folder(output);
    const auto spz = cgs::write_spz(output / "all.spz", model.gaussians, model.scene.frame);
    const Json all = cgs::evaluate_views(model, model.scene.held_out, {})["mean"];
    const double begin = core_seconds();
    const Json web = cgs::write_web_splats(output, model);
    const double seconds = core_seconds() - begin;
    const Json& thinning = web["thinning"];
    std::printf("%zu -> %zu splats (%.1f %%), spz %zu -> %zu bytes (%.1f %%), glb %zu; ",
                thinning["of"].get<size_t>(),
                thinning["kept"].get<size_t>(),
                100 * thinning["kept"].get<double>() / thinning["of"].get<double>(),
                spz.bytes,
                web["splats.spz"]["bytes"].get<size_t>(),
                100 * web["splats.spz"]["bytes"].get<double>() / double(spz.bytes),
                web["splats.glb"]["bytes"].get<size_t>());
    std::printf("PSNR %.3f -> %.3f, SSIM %.4f -> %.4f; %.1f core-seconds\n%s\n",
                all["psnr"].get<double>(),
                thinning["held_out"]["psnr"].get<double>(),
                all["ssim"].get<double>(),
                thinning["held_out"]["ssim"].get<double>(),
                seconds,
                thinning.dump().c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "splat_economy: %s\n", error.what());
    return 1;
  }
}
