// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/commands/info_photographs.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "convert/text/html.h"
#include "convert/text/terminal.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/photo_quality.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/priors/reduced_view.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// The input views of a scene alone, with pictures so small that a sweep of them takes a second.
Scene small_inputs(const Scene& scene) {
  constexpr int kSide = 256;  // [pixels], about
  Scene out = scene;
  out.cache.reset();
  out.held_out.clear();
  tbb::parallel_for(size_t{0}, scene.input.size(), [&](size_t k) {
    std::vector<std::string> ignored;  // of odd pixels: training tells
    View view = loaded_view(scene, scene.input[k], true, ignored);
    view.given_depth = {};  // of another size, and what photographs measure is asked
    const int side = std::max(view.camera.width, view.camera.height);
    out.views[static_cast<size_t>(scene.input[k])] =
        reduced_view(view, std::max(1, (side + kSide / 2) / kSide));
  });
  return out;
}

}  // namespace

Json photographs_to_json(Scene& scene) {
  std::vector<int> used = scene.input;
  used.insert(used.end(), scene.held_out.begin(), scene.held_out.end());
  std::sort(used.begin(), used.end());
  std::vector<PhotoQuality> quality(used.size());
  std::vector<std::vector<std::string>> ignored(used.size());  // of odd pixels: training tells
  tbb::parallel_for(size_t{0}, used.size(), [&](size_t k) {
    quality[k] = photo_quality(loaded_view(scene, used[k], true, ignored[k]).image);
  });
  const std::vector<PhotoFlaws> flaws = photo_flaws(quality);
  Json out = Json::array();
  for (size_t k = 0; k < used.size(); ++k) {
    const std::string& name = scene.views[static_cast<size_t>(used[k])].name;
    out.push_back({{"name", name},
                   {"blur", quality[k].blur},
                   {"stops", flaws[k].stops},
                   {"burnt", quality[k].burnt},
                   {"black", quality[k].black}});
    const std::string photograph = "photograph " + printable(name) + " is ";
    if (flaws[k].is_blurred) {
      scene.warnings.push_back(
          photograph + "blurred beside the others (" + number(quality[k].blur, "%.2f") +
          " of its contrast stays when it is blurred once more): leave it out, "
          "or take it again with a steadier hand");
    }
    if (flaws[k].is_off_exposure) {
      scene.warnings.push_back(photograph + number(std::abs(flaws[k].stops), "%.1f") + " stops " +
                               (flaws[k].stops > 0 ? "brighter" : "darker") +
                               " than the others: lock the exposure of the camera");
    }
    if (flaws[k].is_burnt) {
      scene.warnings.push_back(photograph + "burnt out on " + percent(quality[k].burnt) +
                               " of its pixels, which show no texture to measure");
    }
  }
  return out;
}

Json coarse_depth_to_json(const Scene& scene) {
  if (scene.input.size() < 2) return nullptr;
  std::vector<PriorsCoverage> shares(scene.input.size());  // where nothing is measured, of nothing
  try {
    Terminal quiet(true);
    const Progress until_interrupted = quiet.begin("a coarse depth");
    shares = estimate_priors(small_inputs(scene), {}, until_interrupted).report.coverage;
  } catch (const NumericalError&) {
  }
  Json out = Json::array();
  for (size_t k = 0; k < shares.size(); ++k) {
    const bool is_told = shares.size() > 2;
    out.push_back({{"view", scene.views[static_cast<size_t>(scene.input[k])].name},
                   {"measured", shares[k].measured},
                   {"moving", is_told ? Json(shares[k].transient) : Json()}});
  }
  return out;
}

void print_photographs(const Json& photographs, const Json& coarse_depth) {
  if (photographs.empty()) return;
  std::printf(
      "\nphotographs:             blur  exposure     burnt     black  measured    moving\n");
  for (const Json& row : photographs) {
    Json depth;
    for (const Json& of : coarse_depth) {
      if (of["view"] == row["name"]) depth = of;
    }
    const auto share = [&](const char* key) {
      return depth.is_null() || depth[key].is_null() ? "-" : percent(depth[key].get<double>());
    };
    std::printf("  %-22s %4.2f %+9.2f %9s %9s %9s %9s\n",
                one_line(row["name"].get<std::string>()).c_str(),
                row["blur"].get<double>(),
                row["stops"].get<double>(),
                percent(row["burnt"].get<double>()).c_str(),
                percent(row["black"].get<double>()).c_str(),
                share("measured").c_str(),
                share("moving").c_str());
  }
}

}  // namespace cgs
