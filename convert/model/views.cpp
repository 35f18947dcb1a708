// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/camera_path_file.h"
#include "convert/model/pictures.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/images/png.h"
#include "io/images/view_exr.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/transients.h"
#include "libcgs/priors/water.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

// Of the pixels that may be looked at; all may if there is no mask.
std::optional<HoleShares> hole_shares(const Model& model,
                                      const RenderBuffers& buffers,
                                      const MaskMap& valid) {
  if (!knows_holes(model)) return std::nullopt;
  const std::vector<Hole>& holes = buffers.hole.data;
  std::array<size_t, kHoleKinds> counts{};
  size_t looked_at = 0;
  for (size_t i = 0; i < holes.size(); ++i) {
    if (!valid.empty() && valid.data[i] == 0) continue;
    ++counts.at(static_cast<size_t>(holes[i]));
    ++looked_at;
  }
  const auto share = [&](Hole kind) {
    const size_t count = counts.at(static_cast<size_t>(kind));
    return looked_at > 0 ? static_cast<double>(count) / static_cast<double>(looked_at) : 0;
  };
  HoleShares out{share(Hole::Transparent),
                 share(Hole::Occluded),
                 share(Hole::Outside),
                 share(Hole::Estimated),
                 share(Hole::Sky)};
  if (looked_at < holes.size()) {
    out.masked = 1 - static_cast<double>(looked_at) / static_cast<double>(holes.size());
  }
  return out;
}

Json shares_to_json(const RenderedPicture& picture) {
  const std::optional<HoleShares>& shares = picture.holes;
  if (!shares) return {{"hole_fraction", nullptr}};
  Json out = {{"hole_fraction", shares->hole()},
              {"transparent_fraction", shares->transparent},
              {"occluded_fraction", shares->occluded},
              {"outside_fraction", shares->outside},
              {"estimated_fraction", shares->estimated},
              {"sky_fraction", shares->sky}};
  if (shares->masked > 0) out["masked_fraction"] = shares->masked;
  if (picture.painted) out["synthetic_fraction"] = *picture.painted;
  return out;
}

// Of all pixels; nothing where nobody painted.
std::optional<double> painted_share(const PaintedPicture& shown) {
  const auto& painted = shown.painted.data;
  if (painted.empty()) return std::nullopt;
  return double(std::count(painted.begin(), painted.end(), 1)) / double(painted.size());
}

ViewRasters view_rasters(const RenderBuffers& buffers, const Camera& camera) {
  ViewRasters rasters;
  rasters.color = buffers.color;
  rasters.alpha = buffers.alpha;
  rasters.depth = buffers.median_depth;
  for (size_t i = 0; i < rasters.depth.data.size(); ++i) {
    if (buffers.hole.data[i] == Hole::Sky) rasters.depth.data[i] = std::nanf("");
  }
  rasters.normal = normals_from_depth(rasters.depth, camera);
  rasters.depth_variance = buffers.depth_variance;
  rasters.support = buffers.support;
  rasters.hole = buffers.hole;
  return rasters;
}

// What is known of the depth of a view; nothing where it is no input.
const ViewPriors* priors_of(const Model& model, int view) {
  const std::vector<int>& input = model.scene.input;
  const auto k = static_cast<size_t>(std::find(input.begin(), input.end(), view) - input.begin());
  return k < model.priors.size() ? &model.priors[k] : nullptr;
}

// 1 where an input view shows what the others contradict; empty where it shows none, and for other
// views.
MaskMap transient_pixels(const Model& model, int view) {
  const ViewPriors* const priors = priors_of(model, view);
  return priors != nullptr ? transient_mask(*priors) : MaskMap();
}

// The photograph of an input view without the water; empty where there is none, for other views,
// and where the photograph is gone.
ColorImage restored_photograph(const Model& model, int view) {
  const ViewPriors* const priors = priors_of(model, view);
  const std::filesystem::path& photograph = model.scene.views[static_cast<size_t>(view)].image_path;
  if (!model.scene.water || priors == nullptr || !is_present(photograph)) return {};
  std::vector<std::string> told_before;
  View loaded = loaded_view(model.scene, view, /*with_image=*/true, told_before);
  take_out_water(*priors, *model.scene.water, loaded);
  return loaded.image;
}

RenderedPicture write_view(const Model& model,
                           const std::vector<SupportView>& inputs,
                           const ModelPictures& pictures,
                           int index,
                           const std::filesystem::path& folder) {
  const View& view = model.scene.views[static_cast<size_t>(index)];
  const RenderBuffers buffers = render_camera(model, inputs, view.camera);
  ViewRasters rasters = view_rasters(buffers, view.camera);
  rasters.valid = valid_pixels(model.scene, index);  // what is masked was seen, and is not wanted
  write_view_exr(folder / (view.name + ".exr"), rasters, view.camera, model.scene.frame);
  const auto png = [&](const char* what) { return folder / (view.name + "." + what + ".png"); };
  const PaintedPicture shown = pictures.painted(buffers, view.camera);
  write_png(png("color"), shown.color);
  write_png(png("depth"), depth_picture(rasters.depth));
  write_png(png("normal"), normal_picture(rasters.normal, view.camera.cam_from_world()));
  if (knows_holes(model)) {
    write_png(png("hole"), intersection(hole_mask(buffers), rasters.valid));
  } else {
    std::filesystem::remove(png("hole"));  // of another model
  }
  const MaskMap transient = transient_pixels(model, index);
  if (transient.empty()) {
    std::filesystem::remove(png("transient"));
  } else {
    write_png(png("transient"), transient);
  }
  const ColorImage restored = restored_photograph(model, index);
  if (restored.empty()) {
    std::filesystem::remove(png("restored"));
  } else {
    write_png(png("restored"), restored);
  }
  return {view.name,
          role_of(model.scene, index),
          hole_shares(model, buffers, rasters.valid),
          painted_share(shown)};
}

std::string frame_name(size_t k) {
  std::string number = std::to_string(k);
  number.insert(0, number.size() < 4 ? 4 - number.size() : 0, '0');
  return "frame_" + number;
}

std::vector<std::string> pictures_of_frame(size_t k) {
  return {frame_name(k) + ".png", frame_name(k) + ".hole.png", frame_name(k) + ".painted.png"};
}

// Whether cameras are those of an earlier path: views of models have photographs, pictures of holes
// and of other programs have other names.
bool are_of_path(const Scene& scene) {
  if (!scene.input.empty() || !scene.held_out.empty()) return false;
  for (size_t k = 0; k < scene.views.size(); ++k) {
    if (scene.views[k].name != frame_name(k) || !scene.views[k].image_path.empty()) return false;
  }
  return true;
}

// Number of pictures of an earlier path.
// \throws InvalidInput if what lies there is of something else
size_t earlier_frames(const std::filesystem::path& folder) {
  const std::filesystem::path cameras = folder / "cameras.json";
  if (!is_present(cameras)) {
    if (!is_present(folder / pictures_of_frame(0).front())) return 0;
    throw InvalidInput(printable(folder) + " holds frame_0000.png but not the cameras.json that " +
                       "would go with it: choose another folder, or remove the frames");
  }
  try {
    const Scene earlier = read_cameras_json(cameras);
    if (are_of_path(earlier)) return earlier.views.size();
  } catch (const Error&) {
    // of another program, as told below
  }
  throw InvalidInput(printable(cameras) +
                     " is not of frames along a path, and their cameras would replace it; choose "
                     "another folder");
}

// Those of a longer path must not follow the new ones.
void remove_frames(const std::filesystem::path& folder, size_t earlier) {
  for (size_t k = 0; k < earlier; ++k) {
    for (const std::string& name : pictures_of_frame(k)) std::filesystem::remove(folder / name);
  }
}

// Small enough for a sheet of them to fit a screen.
ColorImage thumbnail(ColorImage picture) {
  constexpr int kWidest = 320;
  if (picture.width <= kWidest) return picture;
  MaskMap all;
  const int height = std::max(1, picture.height * kWidest / picture.width);
  area_downscale(picture, all, kWidest, height);
  return picture;
}

// Holes in magenta, in violet where something was painted.
ColorImage with_tints(const PaintedPicture& shown, MaskMap holes) {
  for (size_t i = 0; i < shown.painted.data.size(); ++i) {
    if (shown.painted.data[i] != 0) holes.data[i] = 0;
  }
  ColorImage out = tinted(shown.color, holes);
  return shown.painted.empty() ? out : tinted(std::move(out), shown.painted, kPaintedTint);
}

}  // namespace

std::string role_of(const Scene& scene, int view) {
  return scene.input.empty() ? std::string() : view_role(scene, view);
}

Json role_to_json(const std::string& role) { return role.empty() ? Json() : Json(role); }

std::string view_role(const Scene& scene, int view) {
  const auto is_in = [&](const std::vector<int>& views) {
    return std::find(views.begin(), views.end(), view) != views.end();
  };
  return is_in(scene.input) ? "input" : is_in(scene.held_out) ? "held out" : "not used";
}

std::vector<int> views_with_photograph(const Scene& scene) {
  std::vector<int> views = scene.input;
  views.insert(views.end(), scene.held_out.begin(), scene.held_out.end());
  std::sort(views.begin(), views.end());
  return views;
}

std::string unknown_holes_warning(const Model& model) {
  if (knows_holes(model)) return {};
  return "the model does not say what input views saw, so holes are not known: no mask of them is "
         "written, and their figures are left out";
}

std::vector<RenderedPicture> write_views(const Model& model,
                                         const std::vector<int>& views,
                                         const std::filesystem::path& folder,
                                         const Progress& progress,
                                         const PictureOptions& shown) {
  make_output_folder(folder);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, shown);
  std::vector<RenderedPicture> out;
  for (size_t k = 0; k < views.size(); ++k) {
    report(progress, static_cast<double>(k) / static_cast<double>(views.size()));
    out.push_back(write_view(model, inputs, pictures, views[k], folder));
  }
  report(progress, 1);
  return out;
}

void refuse_to_replace_path(const std::filesystem::path& folder,
                            const std::filesystem::path& wanted) {
  std::error_code ignored;
  if (std::filesystem::equivalent(wanted, folder / "cameras.json", ignored)) {
    throw InvalidInput(printable(wanted) +
                       " would be replaced by the cameras of the frames; choose another folder");
  }
  (void)earlier_frames(folder);
}

std::vector<RenderedPicture> write_path(const Model& model,
                                        const std::vector<Camera>& path,
                                        const std::filesystem::path& folder,
                                        const Progress& progress,
                                        const PictureOptions& shown) {
  make_output_folder(folder);
  const size_t earlier = earlier_frames(folder);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, shown);
  remove_frames(folder, earlier);
  write_cameras_json(folder / "cameras.json", scene_of_cameras(model, path, frame_name));
  constexpr size_t kOnSheet = 12;
  const auto place_on_sheet = [&](size_t k) { return k * kOnSheet / path.size(); };
  std::vector<ColorImage> sheet;
  std::vector<RenderedPicture> out;
  for (size_t k = 0; k < path.size(); ++k) {
    report(progress, static_cast<double>(k) / static_cast<double>(path.size()));
    const RenderBuffers buffers = render_camera(model, inputs, path[k]);
    const PaintedPicture made = pictures.painted(buffers, path[k]);
    MaskMap holes(path[k].width, path[k].height, 0);
    const std::vector<std::string> names = pictures_of_frame(k);
    write_png(folder / names[0], made.color);
    if (knows_holes(model)) {
      holes = hole_mask(buffers);
      write_png(folder / names[1], holes);
    }
    if (!made.painted.empty()) write_png(folder / names[2], made.painted);
    if (k == 0 || path.size() <= kOnSheet || place_on_sheet(k) != place_on_sheet(k - 1)) {
      sheet.push_back(thumbnail(with_tints(made, holes)));
    }
    out.push_back({frame_name(k), "", hole_shares(model, buffers, {}), painted_share(made)});
  }
  constexpr int kColumns = 4;
  write_png(folder / "contact.png", contact_sheet(sheet, kColumns));
  report(progress, 1);
  return out;
}

Json views_to_json(const std::vector<RenderedPicture>& views) {
  Json out = Json::array();
  for (const RenderedPicture& view : views) {
    out.push_back({{"name", view.name}, {"role", role_to_json(view.role)}});
    out.back().update(shares_to_json(view));
  }
  return out;
}

Json frames_to_json(const std::vector<RenderedPicture>& frames) {
  Json out = Json::array();
  for (const RenderedPicture& frame : frames) {
    out.push_back({{"name", frame.name}});
    out.back().update(shares_to_json(frame));
  }
  return out;
}

}  // namespace cgs
