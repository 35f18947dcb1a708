// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/pictures.h"
#include "convert/text/frame_json.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/images/png.h"
#include "io/images/view_exr.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/resample.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "libcgs/priors/transients.h"
#include "libcgs/priors/water.h"
#include "libcgs/train/flip.h"
#include "libcgs/train/image_metrics.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

// What a view was to the model; empty where no view is an input, as of splats of other programs.
std::string role_of(const Scene& scene, int index) {
  return scene.input.empty() ? std::string() : view_role(scene, index);
}

// Without the depth that input views saw, every pixel would look like a hole.
bool knows_holes(const Model& model) { return !model.priors.empty(); }

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

Json role_to_json(const std::string& role) { return role.empty() ? Json() : Json(role); }

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

MaskMap intersection(const MaskMap& a, const MaskMap& b) {
  if (b.empty()) return a;
  MaskMap out = a;
  for (size_t i = 0; i < out.data.size(); ++i) out.data[i] = a.data[i] & b.data[i];
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

// 1 where an input view shows what the others contradict; empty where it shows none, and for other
// views.
MaskMap transient_pixels(const Model& model, int view) {
  const std::vector<int>& input = model.scene.input;
  const auto k = static_cast<size_t>(std::find(input.begin(), input.end(), view) - input.begin());
  return k < model.priors.size() ? transient_mask(model.priors[k]) : MaskMap();
}

// The photograph of an input view without the water; empty where there is none, for other views,
// and where the photograph is gone.
ColorImage restored_photograph(const Model& model, int view) {
  const std::vector<int>& input = model.scene.input;
  const auto k = static_cast<size_t>(std::find(input.begin(), input.end(), view) - input.begin());
  const std::filesystem::path& photograph = model.scene.views[static_cast<size_t>(view)].image_path;
  if (!model.scene.water || k >= model.priors.size() || !is_present(photograph)) return {};
  std::vector<std::string> told_before;
  View loaded = loaded_view(model.scene, view, /*with_image=*/true, told_before);
  take_out_water(model.priors[k], *model.scene.water, loaded);
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
  return {frame_name(k) + ".png", frame_name(k) + ".hole.png"};
}

// Pictures of an earlier path: those of a longer one must not follow the new ones.
// \throws InvalidInput if pictures lie there whose cameras.json does not
void remove_frames(const std::filesystem::path& folder) {
  size_t earlier = 0;
  try {
    if (is_present(folder / "cameras.json")) {
      earlier = read_cameras_json(folder / "cameras.json").views.size();
    }
  } catch (const Error&) {
    earlier = 0;  // of another program
  }
  if (earlier == 0 && is_present(folder / pictures_of_frame(0).front())) {
    throw InvalidInput(printable(folder) + " holds frame_0000.png but not the cameras.json that " +
                       "would go with it: choose another folder, or remove the frames");
  }
  for (size_t k = 0; k < earlier; ++k) {
    for (const std::string& name : pictures_of_frame(k)) std::filesystem::remove(folder / name);
  }
}

// Where the frames were taken from, in the frame of the model.
Scene scene_of_path(const Model& model, const std::vector<Camera>& path) {
  Scene out;
  out.kind = model.scene.kind;
  out.folder = model.scene.folder;
  out.frame = model.scene.frame;
  for (size_t k = 0; k < path.size(); ++k) {
    View view;
    view.name = frame_name(k);
    view.camera = path[k];
    out.views.push_back(view);
  }
  return out;
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

// Holes in magenta, in violet where somebody painted.
ColorImage with_tints(const PaintedPicture& shown, MaskMap holes) {
  for (size_t i = 0; i < shown.painted.data.size(); ++i) {
    if (shown.painted.data[i] != 0) holes.data[i] = 0;
  }
  ColorImage out = tinted(shown.color, holes);
  return shown.painted.empty() ? out : tinted(std::move(out), shown.painted, kPaintedTint);
}

// With black where nothing may be compared: windows beside it reach there.
ColorImage blackened(ColorImage image, const MaskMap& valid) {
  for (size_t i = 0; i < valid.data.size(); ++i) {
    if (valid.data[i] == 0) image.data[i] = Eigen::Vector3f::Zero();
  }
  return image;
}

double share_of(const MaskMap& part, const MaskMap& whole) {
  const auto count = [](const MaskMap& pixels) {
    return static_cast<double>(std::count(pixels.data.begin(), pixels.data.end(), 1));
  };
  return count(part) / count(whole);
}

EvaluatedView evaluate_view(const Model& model,
                            const std::vector<SupportView>& inputs,
                            const ModelPictures& pictures,
                            int index) {
  View view = model.scene.views[static_cast<size_t>(index)];
  const RenderBuffers buffers = render_camera(model, inputs, view.camera);
  const ColorImage shown = blackened(pictures.of(buffers, view.camera), view.valid);
  MaskMap seen = hole_mask(buffers);
  for (uint8_t& value : seen.data) value = 1 - value;
  const MaskMap everywhere(seen.width, seen.height, 1);
  const MaskMap all = intersection(everywhere, view.valid);
  const MaskMap use = intersection(seen, view.valid);
  EvaluatedView out;
  out.name = view.name;
  if (!model.scene.input.empty()) out.role = view_role(model.scene, index);
  if (is_exposed_otherwise(model, index)) {
    view.exposure = matching_gain(view.image, shown, use);
    apply_exposure(view);
    out.exposure = view.exposure;
  }
  const ColorImage photograph = blackened(view.image, view.valid);
  // The coarse scales of MS-SSIM mix what is masked with the rest, and count it as equal; the rim
  // that a lens leaves does not matter.
  constexpr double kNearlyWhole = 0.95;
  const auto has_any = [](const MaskMap& pixels) {
    return std::find(pixels.data.begin(), pixels.data.end(), 1) != pixels.data.end();
  };
  if (has_any(all)) {
    out.figures.psnr = psnr(shown, photograph, &all);
    out.figures.ssim = ssim(shown, photograph, &all);
    out.figures.flip = flip(shown, photograph, &all);
  }
  if (share_of(all, everywhere) >= kNearlyWhole) out.figures.ms_ssim = ms_ssim(shown, photograph);
  if (!knows_holes(model)) return out;
  if (has_any(use)) {
    out.figures.psnr_seen = psnr(shown, photograph, &use);
    out.figures.ssim_seen = ssim(shown, photograph, &use);
  }
  if (has_any(all)) out.figures.hole_fraction = 1 - share_of(use, all);
  return out;
}

// By their names in reports.
constexpr std::array<std::pair<const char*, std::optional<double> ViewFigures::*>, 7> kFigures = {
    {{"psnr", &ViewFigures::psnr},
     {"ssim", &ViewFigures::ssim},
     {"psnr_seen", &ViewFigures::psnr_seen},
     {"ssim_seen", &ViewFigures::ssim_seen},
     {"hole_fraction", &ViewFigures::hole_fraction},
     {"ms_ssim", &ViewFigures::ms_ssim},
     {"flip", &ViewFigures::flip}}};

ViewFigures mean_figures(const std::vector<const EvaluatedView*>& views) {
  ViewFigures mean;
  for (const auto& [name, figure] : kFigures) {
    double sum = 0;
    size_t count = 0;
    for (const EvaluatedView* view : views) {
      if (!(view->figures.*figure)) continue;
      sum += *(view->figures.*figure);
      ++count;
    }
    if (count > 0) mean.*figure = sum / static_cast<double>(count);
  }
  return mean;
}

// Of those views that say how well the model predicts, if there are any: it was trained on inputs.
ViewFigures mean_of(const std::vector<EvaluatedView>& views, std::vector<std::string>& warnings) {
  const auto is_input = [](const EvaluatedView& view) { return view.role == "input"; };
  const bool are_all_inputs = std::all_of(views.begin(), views.end(), is_input);
  if (are_all_inputs) {
    warnings.emplace_back(
        "only input views are evaluated: the model was trained on them, so that the figures say "
        "how well it fits, not how well it predicts");
  }
  std::vector<const EvaluatedView*> counted;
  for (const EvaluatedView& view : views) {
    if (!is_input(view) || are_all_inputs) counted.push_back(&view);
  }
  return mean_figures(counted);
}

std::optional<ViewFigures> mean_of_every_eighth(const std::vector<EvaluatedView>& views,
                                                const Scene& scene) {
  if (scene.kind != SceneKind::Llff) return std::nullopt;
  std::vector<const EvaluatedView*> counted;
  for (size_t i = 0; i < scene.views.size(); i += 8) {
    const auto found = std::find_if(views.begin(), views.end(), [&](const EvaluatedView& view) {
      return view.name == scene.views[i].name && view.role != "input";
    });
    if (found == views.end()) return std::nullopt;
    counted.push_back(&*found);
  }
  return mean_figures(counted);
}

// Those that have a photograph. \throws BadInput if none has
std::vector<int> with_photograph(Scene& scene, const std::vector<int>& views) {
  std::vector<int> out;
  for (const int i : views) {
    const View& view = scene.views[static_cast<size_t>(i)];
    if (view.image_path.empty()) {
      scene.warnings.push_back("view " + printable(view.name) +
                               " has no photograph and is not evaluated");
    } else {
      out.push_back(i);
    }
  }
  if (out.empty() && !is_folder(scene.folder)) {
    throw BadInput(Defect::Open,
                   scene.folder,
                   "the folder of the photographs is gone; --scene says where they are");
  }
  if (out.empty()) {
    throw BadInput(Defect::Empty, scene.folder, "no view to evaluate has a photograph");
  }
  return out;
}

}  // namespace

// The exposure of the model is that of its input views. Where these had to be matched, the other
// photographs of the scene were exposed by whatever they show.
bool is_exposed_otherwise(const Model& model, int view) {
  const Scene& scene = model.scene;
  const std::string role = view_role(scene, view);
  return role != "input" && std::any_of(scene.input.begin(), scene.input.end(), [&](int i) {
           const View& input = scene.views[static_cast<size_t>(i)];
           PhotoResponse response = input.response;
           response.is_grey = false;  // without colours, but exposed as the others
           return input.exposure != Eigen::Vector3f::Ones() || response != PhotoResponse{};
         });
}

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

std::vector<RenderedPicture> write_path(const Model& model,
                                        const std::vector<Camera>& path,
                                        const std::filesystem::path& folder,
                                        const Progress& progress,
                                        const PictureOptions& shown) {
  make_output_folder(folder);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, shown);
  remove_frames(folder);
  write_cameras_json(folder / "cameras.json", scene_of_path(model, path));
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

Json figures_to_json(const ViewFigures& figures) {
  Json out;
  for (const auto& [name, figure] : kFigures) {
    out[name] = figures.*figure ? Json(*(figures.*figure)) : Json();
  }
  return out;
}

Json evaluation_to_json(const Evaluation& evaluation) {
  Json rows = Json::array();
  for (const EvaluatedView& view : evaluation.views) {
    Json row = {{"name", view.name}, {"role", role_to_json(view.role)}};
    row.update(figures_to_json(view.figures));
    row["exposure"] = view.exposure ? vector_to_json(view.exposure->cast<double>()) : Json();
    rows.push_back(row);
  }
  const auto& eighth = evaluation.every_eighth;
  Json out = {{"mean", figures_to_json(evaluation.mean)},
              {"every_eighth", eighth ? figures_to_json(*eighth) : Json()},
              {"views", rows}};
  if (evaluation.through_water) out["through_water"] = true;
  return out;
}

Evaluation evaluate_views(Model& model,
                          const std::vector<int>& views,
                          const Progress& progress,
                          HoleFill fill) {
  std::vector<std::string>& warnings = model.scene.warnings;
  if (const std::string text = unknown_holes_warning(model); !text.empty()) {
    warnings.push_back(text);
  }
  const std::vector<int> shown = with_photograph(model.scene, views);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, {fill, /*through_water=*/true});
  Evaluation out;
  out.through_water = model.scene.water.has_value();
  for (size_t k = 0; k < shown.size(); ++k) {
    report(progress, static_cast<double>(k) / static_cast<double>(shown.size()));
    load_images(model.scene, {shown[k]});
    out.views.push_back(evaluate_view(model, inputs, pictures, shown[k]));
    model.scene.views[static_cast<size_t>(shown[k])].image = {};  // one photograph at a time
  }
  out.mean = mean_of(out.views, warnings);
  out.every_eighth = mean_of_every_eighth(out.views, model.scene);
  report(progress, 1);
  return out;
}

}  // namespace cgs
