// SPDX-License-Identifier: GPL-3.0-or-later
// What a second layer brings where photographs show a pane.
//
// usage: pane_accuracy OUTPUT [ROW...]
//
// Writes to OUTPUT scenes of a wall, without a pane and through panes of opacity 0.4 that show
// nothing, half of the contrast of the wall, and all of it (rows "no pane", "even",
// "half contrast", "full contrast"): three photographs to reconstruct from and three held out.
// Prints of each, trained with one layer and with as many as it asks for, the share of the pixels
// of the middle photograph before the pane whose depth is of the wall within 1 %, PSNR held out
// without holes, and what was found.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/model/evaluation.h"
#include "convert/model/model_training.h"
#include "io/bytes/atomic_file.h"
#include "io/images/png.h"
#include "io/scenes/scene_reader.h"
#include "tests/support/pane_scene.h"

namespace {

using Json = nlohmann::ordered_json;

constexpr double kCell = 0.04;  // three pixels on the wall
constexpr float kOpacity = 0.4f;
constexpr const char* kInput = "1,3,5";

std::vector<cgs::Camera> cameras() {
  const double places[][2] = {
      {-0.45, 0.05}, {-0.3, -0.1}, {-0.1, 0.12}, {0.05, 0}, {0.2, -0.08}, {0.4, 0.1}};
  std::vector<cgs::Camera> out;
  for (const auto& [x, y] : places) {
    out.push_back(cgs::test::looking_at({x, y, 0}, {0.3 * x, 0.2 * y, 6}, 480, 360, 450));
  }
  return out;
}

// As transforms.json has it: axes of OpenGL.
Json frame_of(const cgs::View& view) {
  Eigen::Matrix4d pose = view.camera.world_from_cam.matrix();
  pose.block<3, 2>(0, 1) *= -1;
  Json rows = Json::array();
  for (int i = 0; i < 4; ++i) rows.push_back({pose(i, 0), pose(i, 1), pose(i, 2), pose(i, 3)});
  return {{"file_path", view.name + ".png"}, {"transform_matrix", rows}};
}

void write_scene(const std::filesystem::path& folder, const cgs::Scene& scene) {
  std::filesystem::create_directories(folder);
  const cgs::Camera& camera = scene.views[0].camera;
  Json json = {{"fl_x", camera.fx},
               {"fl_y", camera.fy},
               {"cx", camera.cx},
               {"cy", camera.cy},
               {"w", camera.width},
               {"h", camera.height},
               {"frames", Json::array()}};
  for (const cgs::View& view : scene.views) {
    cgs::write_png(folder / (view.name + ".png"), view.image);
    json["frames"].push_back(frame_of(view));
  }
  cgs::write_file(folder / "transforms.json", json.dump(1));
}

double share_behind(const cgs::TrainedModel& trained, const cgs::test::PaneScene& planted) {
  constexpr size_t kMiddle = 1;  // of the input views
  const cgs::Scene& scene = trained.model.scene;
  const cgs::Camera& camera = planted.scene.views[3].camera;
  const cgs::DepthMap wall = cgs::test::true_depth(planted.wall, camera);
  const cgs::DepthMap both = cgs::test::true_depth(planted.both, camera);
  double right = 0;
  double all = 0;
  for (size_t i = 0; i < wall.data.size(); ++i) {
    if (!(both.data[i] < wall.data[i] - 1)) continue;
    const double z = double(trained.model.priors[kMiddle].depth.data[i]) * scene.frame.scale;
    all += 1;
    right += std::abs(z / double(wall.data[i]) - 1) < 0.01 ? 1 : 0;
  }
  return right / all;
}

void measure(const std::filesystem::path& folder,
             const char* name,
             const cgs::test::PaneScene& planted,
             int layers) {
  cgs::ModelRequest request;
  request.training.coherence.layers_per_ray = layers;
  cgs::SceneOptions options;
  options.views = kInput;
  cgs::TrainedModel trained = cgs::train_model(cgs::read_scene(folder, options), request, {});
  const cgs::ViewFigures shown =
      cgs::evaluate_views(trained.model, trained.model.scene.held_out, {}).mean;
  const cgs::PaneReport& pane = trained.pane;
  std::printf("%-14s %d layer(s): depth behind %5.1f %%, held out %.2f dB, ",
              name,
              layers,
              100 * share_behind(trained, planted),
              shown.psnr_seen.value());
  if (pane.view.empty()) {
    std::puts("no pane");
  } else {
    std::printf("pane before %.1f %%, opacity %.3f, foretells %.1f dB better\n",
                100 * pane.share,
                pane.opacity,
                pane.gain);
  }
  std::fflush(stdout);
}

void run(const std::filesystem::path& output, const std::vector<std::string>& named) {
  using cgs::test::kFullContrast;
  const struct {
    const char* name;
    double contrast;
    bool is_bare;
  } rows[] = {{"no pane", kFullContrast, true},
              {"even", 0, false},
              {"half contrast", 0.5 * kFullContrast, false},
              {"full contrast", kFullContrast, false}};
  for (const auto& row : rows) {
    if (!named.empty() && std::find(named.begin(), named.end(), row.name) == named.end()) continue;
    const cgs::test::PaneScene planted =
        cgs::test::pane_scene(cameras(), kCell, kOpacity, row.contrast);
    write_scene(output / row.name, row.is_bare ? planted.bare : planted.scene);
    for (const int layers : {1, 2}) measure(output / row.name, row.name, planted, layers);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: pane_accuracy OUTPUT [ROW...]\n", stderr);
    return 2;
  }
  try {
    run(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pane_accuracy: %s\n", error.what());
    return 1;
  }
  return 0;
}
