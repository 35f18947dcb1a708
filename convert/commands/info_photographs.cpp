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

// So small that a sweep takes a second.
View for_sweep(View view) {
  constexpr int kSide = 256;  // [pixels], about
  view.given_depth = {};      // of another size, and what photographs measure is asked
  return reduced_view(view, reduction_to(kSide, std::max(view.camera.width, view.camera.height)));
}

}  // namespace

Json photographs_to_json(Scene& scene, Scene& small) {
  std::vector<int> used = scene.input;
  used.insert(used.end(), scene.held_out.begin(), scene.held_out.end());
  std::sort(used.begin(), used.end());
  std::vector<PhotoQuality> quality(used.size());
  std::vector<std::vector<std::string>> ignored(used.size());  // of odd pixels: training tells
  small = scene;
  tbb::parallel_for(size_t{0}, used.size(), [&](size_t k) {
    View view = loaded_view(scene, used[k], true, ignored[k]);
    quality[k] = photo_quality(view.image);
    const bool is_input = std::count(scene.input.begin(), scene.input.end(), used[k]) > 0;
    if (is_input) small.views[static_cast<size_t>(used[k])] = for_sweep(std::move(view));
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

Json coarse_depth_to_json(const Scene& small) {
  if (small.input.size() < 2) return nullptr;
  std::vector<PriorsCoverage> shares(small.input.size());  // where nothing is measured, of nothing
  try {
    Terminal quiet(true);
    shares = estimate_priors(small, {}, quiet.begin("a coarse depth")).report.coverage;
  } catch (const NumericalError&) {
  }
  Json out = Json::array();
  for (size_t k = 0; k < shares.size(); ++k) {
    const bool is_told = shares.size() > 2;
    out.push_back({{"view", small.views[static_cast<size_t>(small.input[k])].name},
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
