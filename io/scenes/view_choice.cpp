// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_choice.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>

#include "io/scenes/view_names.h"
#include "io/scenes/view_sizes.h"
#include "libcgs/core/error.h"
#include "libcgs/core/input_views.h"
#include "libcgs/core/remedy.h"
#include "libcgs/core/split_mix.h"

namespace cgs {

namespace {

constexpr int kInputs = 3;  // of many views, at least; of LLFF's protocol

// As many as kMostPixels allow.
// \param divisors  of the sizes that the cameras have
size_t input_count(const Scene& scene,
                   const std::vector<int>& usable,
                   const std::vector<int>& divisors) {
  double pixels = 0;
  for (const int i : usable) {
    const auto view = static_cast<size_t>(i);
    const Camera& camera = scene.views[view].camera;
    pixels += double(camera.width / divisors[view]) * (camera.height / divisors[view]);
  }
  const auto count = static_cast<double>(usable.size());
  const auto affordable = static_cast<size_t>(count * SceneOptions::kMostPixels / pixels);
  return std::clamp(affordable, size_t{kInputs}, most_inputs(usable.size()));
}

std::vector<int> llff_protocol(const std::vector<int>& usable) {
  std::vector<int> pool;
  for (size_t i = 0; i < usable.size(); ++i) {
    if (i % SceneOptions::kHeldOutEvery != 0) pool.push_back(usable[i]);
  }
  std::vector<int> out;
  for (int i = 0; i < kInputs; ++i) {
    const double at = static_cast<double>(pool.size() - 1) * i / (kInputs - 1);
    out.push_back(pool[static_cast<size_t>(std::nearbyint(at))]);  // ties to even
  }
  return out;
}

// Whether of many photographs those are chosen that show the most. LLFF's scenes have a protocol
// that others publish figures for.
bool chooses_by_worth(const Scene& scene, const SceneOptions& options) {
  return options.views.empty() && !options.all_views && scene.kind != SceneKind::Llff &&
         views_with_files(scene).size() > SceneOptions::kTakesAll;
}

// Adds views, each as far as there is one from those that are there, until there are so many: what
// they show again is measured better.
void fill_up(const Scene& scene,
             const std::vector<int>& usable,
             size_t count,
             std::vector<int>& in) {
  const auto center = [&](int view) -> Eigen::Vector3d {
    return scene.views[static_cast<size_t>(view)].camera.center();
  };
  std::vector<double> off(usable.size(), std::numeric_limits<double>::infinity());
  const auto come_near = [&](int view) {
    for (size_t i = 0; i < usable.size(); ++i) {
      off[i] = std::min(off[i], (center(usable[i]) - center(view)).norm());
    }
  };
  for (const int view : in) come_near(view);
  while (in.size() < count) {
    size_t farthest = 0;
    for (size_t i = 1; i < off.size(); ++i) {
      // Of as far ones not always the first: what is left over lies all over, too.
      if (off[i] > off[farthest] ||
          (off[i] == off[farthest] && random_number(i) > random_number(farthest))) {
        farthest = i;
      }
    }
    if (!(off[farthest] > 0)) break;
    in.push_back(usable[farthest]);
    come_near(in.back());
  }
  std::sort(in.begin(), in.end());
}

std::vector<int> some_views(const Scene& scene, const std::vector<int>& usable) {
  std::vector<int> out;
  if (scene.kind != SceneKind::Llff) {
    const std::vector<int> as_they_are(scene.views.size(), 1);
    const size_t count = input_count(scene, usable, as_they_are);
    out = choose_input_views(scene, usable, count);
    if (!out.empty()) fill_up(scene, usable, count, out);
  }
  return out.empty() ? llff_protocol(usable) : out;
}

std::vector<int> named_views(const Scene& scene, const std::string& list) {
  std::vector<int> out = select_views(scene, list);
  for (const int i : out) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (!view.image_path.empty()) continue;
    throw WithRemedy<InvalidInput>(Remedy::ChosenViews,
                                   "view \"" + printable(view.name) + "\" has no image file");
  }
  if (out.size() < 2) {
    throw WithRemedy<InvalidInput>(
        Remedy::ChosenViews, "one view is named; two or more are needed, from different places");
  }
  return out;
}

// Each is drawn, evaluated and shown: hundreds would take more than the reconstruction.
std::vector<int> some_others(const std::vector<int>& usable, const std::vector<int>& input) {
  constexpr size_t kMostHeldOut = 24;
  std::vector<int> others;
  std::set_difference(
      usable.begin(), usable.end(), input.begin(), input.end(), std::back_inserter(others));
  const size_t count = std::min(others.size(), kMostHeldOut);
  std::vector<int> out;
  for (size_t i = 0; i < count; ++i) {
    out.push_back(others[count == 1 ? 0 : i * (others.size() - 1) / (count - 1)]);
  }
  return out;
}

// Which of many photographs are used, and why no more; empty where all but those held out are.
std::string choice_words(const Scene& scene, size_t usable) {
  if (scene.input.size() >= most_inputs(usable)) return {};
  const std::string count = std::to_string(scene.input.size()) + " of " + std::to_string(usable);
  if (scene.kind == SceneKind::Llff) {
    return count + " photographs are used: those of the protocol that papers follow";
  }
  return count +
         " photographs are used: those that show the most together, as many as take some five "
         "minutes; the others tell how good it is";
}

}  // namespace

std::vector<int> views_with_files(const Scene& scene) {
  std::vector<int> out;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (!scene.views[i].image_path.empty()) out.push_back(static_cast<int>(i));
  }
  return out;
}

std::vector<int> choose_divisors(Scene& scene, const SceneOptions& options) {
  const std::vector<int> largest = divisors_to(scene, SceneOptions::kLongestSide);
  std::vector<int> out = largest;
  if (chooses_by_worth(scene, options)) {
    const std::vector<int> usable = views_with_files(scene);
    const size_t wanted = options.wanted_views(usable.size());
    const auto longest_side = [&](const std::vector<int>& divisors) {
      int longest = 0;
      for (const int i : usable) {
        const Camera& camera = scene.views[static_cast<size_t>(i)].camera;
        longest = std::max(longest, std::max(camera.width, camera.height) / divisors[size_t(i)]);
      }
      return longest;
    };
    for (int longest = SceneOptions::kLongestSide; longest >= SceneOptions::kShortestChosen;
         --longest) {
      const std::vector<int> divisors = divisors_to(scene, longest);
      if (longest_side(divisors) < SceneOptions::kShortestChosen) break;
      out = divisors;
      if (input_count(scene, usable, divisors) >= wanted) break;
    }
  }
  const std::string text = divisors_text(scene, out);
  const bool is_for_more = out != largest;
  if (!text.empty()) {
    scene.notes.push_back(text + (is_for_more ? "; fewer of them would then be used" : ""));
  }
  return out;
}

void choose_views(Scene& scene, const SceneOptions& options) {
  const std::vector<int> usable = views_with_files(scene);
  if (!options.views.empty()) {
    scene.input = named_views(scene, options.views);
  } else {
    const bool takes_all = options.all_views || usable.size() <= SceneOptions::kTakesAll;
    scene.input = takes_all ? usable : some_views(scene, usable);
    const std::string words = choice_words(scene, usable.size());
    if (!words.empty()) scene.notes.push_back(words);
  }
  if (scene.input.size() < 2) throw BadInput(Defect::Empty, scene.folder, "need at least 2 views");
  scene.held_out = some_others(usable, scene.input);
}

}  // namespace cgs
