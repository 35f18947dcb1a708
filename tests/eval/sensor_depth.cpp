// SPDX-License-Identifier: GPL-3.0-or-later
// How far the depth of a run is from that of a depth camera which the run did not see, by the
// number of input views that see the surface.
//
// usage: sensor_depth RUN_FOLDER SCENE_WITH_DEPTH
//   The run is of the same photographs and cameras without their depth, e.g. of a folder with links
//   to all other files.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "convert/model/model.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/order_statistics.h"
#include "tests/support/exr_channel.h"

namespace {

using namespace cgs;

/// Relative errors of depth by the number of views; key -1 for all but holes.
using Errors = std::map<int, std::vector<double>>;

/// \param measured  at the size of the photograph, of which the picture is a fraction
void compare(const std::filesystem::path& path, const DepthMap& measured, Errors& errors) {
  const ExrImage image = read_exr(path);
  const std::vector<float>& depth = test::channel(image, "Z", path);
  const std::vector<float>& support = test::channel(image, "support.Y", path);
  const int step = measured.width / image.width;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t i = size_t(y) * size_t(image.width) + size_t(x);
      const int u = x * step + step / 2;
      const int v = y * step + step / 2;
      if (!measured.contains(u, v) || !(measured(u, v) > 0) || !(depth[i] > 0)) continue;
      const double off = std::abs(double(depth[i]) / double(measured(u, v)) - 1);
      const int views = static_cast<int>(support[i]);
      errors[views].push_back(off);
      if (views > 0) errors[-1].push_back(off);
    }
  }
}

void print(int views, std::vector<double>& off) {
  std::printf(views < 0 ? "all but holes" : "%d views      ", views);
  std::printf("  %9zu pixels, median %.2f %%", off.size(), 100 * median(off));
  for (const double limit : {0.01, 0.02, 0.05}) {
    const auto within = std::count_if(off.begin(), off.end(), [&](double e) { return e < limit; });
    std::printf(", within %g %%: %.1f %%", 100 * limit, 100 * double(within) / double(off.size()));
  }
  std::printf("\n");
}

void run(const std::filesystem::path& folder, const std::filesystem::path& with_depth) {
  const Model model = read_model(folder);
  SceneOptions options;
  options.downscale = 1;
  options.allow_external = true;
  Scene scene = read_scene(with_depth, options);
  Errors inputs;
  Errors held_out;
  for (size_t i = 0; i < model.scene.views.size(); ++i) {
    const std::string& name = model.scene.views[i].name;
    const std::filesystem::path picture = folder / "views" / (name + ".exr");
    if (!std::filesystem::exists(picture)) continue;
    std::vector<std::string> warnings;
    const View view = loaded_view(scene, find_view(scene, name, "--views"), true, warnings);
    const auto& chosen = model.scene.input;
    const bool is_input = std::find(chosen.begin(), chosen.end(), int(i)) != chosen.end();
    compare(picture, view.given_depth, is_input ? inputs : held_out);
  }
  std::printf("input views\n");
  for (auto& [views, off] : inputs) print(views, off);
  std::printf("held-out views\n");
  for (auto& [views, off] : held_out) print(views, off);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: sensor_depth RUN_FOLDER SCENE_WITH_DEPTH\n");
    return 2;
  }
  try {
    run(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sensor_depth: %s\n", error.what());
    return 1;
  }
}
