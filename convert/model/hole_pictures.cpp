// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/hole_pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/camera_path_file.h"
#include "convert/model/pictures.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "io/bytes/sha256.h"
#include "io/images/exr.h"
#include "io/images/image.h"
#include "io/images/png.h"
#include "io/scenes/cameras_json.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/mask_operations.h"
#include "libcgs/reconstruct/hole_views.h"
#include "libcgs/reconstruct/surroundings_painter.h"
#include "libcgs/render/hidden_depth.h"
#include "libcgs/render/picture.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kReadMe =
    "Paint over the white pixels of NAME_mask.png in NAME.png, by hand or with any program that\n"
    "fills in pictures, and save each picture under its name in this folder (PNG; JPEG at its "
    "best\n"
    "quality does, too). Black pixels of the mask must stay as they are: they are what "
    "photographs\n"
    "show, and a picture in which they changed is refused. NAME_depth.exr is for programs that "
    "take\n"
    "depth: Z of what is drawn, hidden.Z of where painted pixels will lie. Pictures that you "
    "leave\n"
    "as they are do not count. Then: cgs fill MODEL THIS_FOLDER -o FILLED_MODEL, and look at\n"
    "FILLED_MODEL with cgs render. All that you paint is tagged as synthetic and measured by "
    "nobody.\n";

ExrImage depth_exr(const RenderBuffers& buffers, const MaskMap& holes, const Frame& frame) {
  const DepthMap hidden = hidden_depth(buffers, holes);
  ExrImage out;
  out.width = holes.width;
  out.height = holes.height;
  std::vector<float> drawn(holes.data.size(), 0);
  std::vector<float> behind(holes.data.size(), 0);
  const auto unit = static_cast<float>(frame.scale);
  for (size_t i = 0; i < drawn.size(); ++i) {
    const float z = buffers.median_depth.data[i];
    if (holes.data[i] == 0 && std::isfinite(z)) drawn[i] = unit * z;
    if (std::isfinite(hidden.data[i])) behind[i] = unit * hidden.data[i];
  }
  out.channels = {{"Z", std::move(drawn)}, {"hidden.Z", std::move(behind)}};
  out.text["cgs:units"] = frame.unit_name();
  return out;
}

// The picture that somebody made of a view; nothing if there is none.
std::optional<std::filesystem::path> picture_of(const std::filesystem::path& folder,
                                                const std::string& name) {
  std::optional<std::filesystem::path> out;
  for (const std::string& entry : sorted_entries(folder)) {
    const std::filesystem::path path = folder / entry;
    const std::string ending = lower_extension(path);
    const bool is_picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
    if (!is_picture || path.stem() != name) continue;
    if (out) {
      throw BadInput(Defect::Ref,
                     path,
                     "is a second picture of " + printable(name) + ", beside " +
                         printable(out->filename()) + "; keep one");
    }
    out = path;
  }
  return out;
}

// Largest difference of a channel, of 255.
int difference(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const auto byte = [](float value) { return std::lround(255 * std::clamp(value, 0.0f, 1.0f)); };
  long out = 0;
  for (int c = 0; c < 3; ++c) out = std::max(out, std::labs(byte(a[c]) - byte(b[c])));
  return static_cast<int>(out);
}

/// How much of what is seen a picture may change, by its format.
struct Tolerance {
  int difference = 1;  ///< Of 255.
  double share = 0;    ///< Of the pixels that are compared, may differ by more.
  int margin = 0;      ///< Pixels around holes that are not compared.
};

std::string percent_of(double share) {
  std::string text = std::to_string(100 * share);
  return text.substr(0, text.find('.') + 3) + " %";
}

void check_seen(const std::filesystem::path& path,
                const ColorImage& painted,
                const ColorImage& shown,
                const MaskMap& holes) {
  const Tolerance may = lower_extension(path) == ".png" ? Tolerance{} : Tolerance{16, 0.01, 16};
  const MaskMap left_out = may.margin > 0 ? dilated(holes, may.margin) : holes;
  size_t changed = 0;
  size_t compared = 0;
  for (size_t i = 0; i < shown.data.size(); ++i) {
    if (left_out.data[i] != 0) continue;
    ++compared;
    changed += difference(painted.data[i], shown.data[i]) > may.difference ? 1 : 0;
  }
  const double share = compared > 0 ? double(changed) / double(compared) : 0;
  if (share <= may.share) return;
  throw BadInput(
      Defect::Mismatch,
      path,
      percent_of(share) + " of the pixels outside of the mask (" + std::to_string(changed) +
          ") differ from what the model shows by more than " + std::to_string(may.difference) +
          "/255; allowed: " + (may.share > 0 ? percent_of(may.share) : std::string("none")));
}

/// A view of the folder as the model shows it, and its holes.
struct ShownView {
  ColorImage plain;   ///< Holes are black.
  ColorImage filled;  ///< Colours around in holes.
  MaskMap holes;
};

ShownView shown_view(const Model& model,
                     const std::vector<SupportView>& inputs,
                     const Camera& camera) {
  const RenderBuffers buffers = render_camera(model, inputs, camera);
  return {picture(buffers), filled_picture(buffers), hole_mask(buffers)};
}

// Whether somebody painted in holes at all.
bool is_changed(const ColorImage& painted, const ShownView& shown) {
  int least = std::numeric_limits<int>::max();
  for (const ColorImage* const before : {&shown.plain, &shown.filled}) {
    int largest = 0;
    for (size_t i = 0; i < painted.data.size(); ++i) {
      if (shown.holes.data[i] == 0) continue;
      largest = std::max(largest, difference(painted.data[i], before->data[i]));
    }
    least = std::min(least, largest);
  }
  return least > 1;
}

// Nothing if it was not painted.
std::optional<PaintedView> painted_view(const Model& model,
                                        const std::vector<SupportView>& inputs,
                                        const std::filesystem::path& path,
                                        const Camera& camera) {
  const std::string bytes = read_file(path);
  ColorImage picture = decode_image(bytes, path);
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (picture.width != camera.width || picture.height != camera.height) {
    throw BadInput(Defect::Mismatch,
                   path,
                   "is " + size(picture.width, picture.height) + ", its camera " +
                       size(camera.width, camera.height));
  }
  const ShownView shown = shown_view(model, inputs, camera);
  check_seen(path, picture, shown.plain, shown.holes);
  if (!is_changed(picture, shown)) return std::nullopt;
  return PaintedView{camera, std::move(picture), {path.filename().string(), sha256(bytes)}, {}};
}

HoleViews views_with_holes(const Model& model, const Progress& progress) {
  HoleViews out = hole_views(model, {}, progress);
  if (out.cameras.empty()) {
    throw NumericalError("no hole is seen by any of " + std::to_string(out.candidates) +
                         " cameras around the input views");
  }
  return out;
}

std::string hole_name(size_t k) { return "hole_" + std::to_string(k + 1); }

}  // namespace

HolePictures write_hole_pictures(const Model& model,
                                 const std::filesystem::path& folder,
                                 HoleFill fill,
                                 const Progress& progress) {
  const std::filesystem::path cameras = folder / "cameras.json";
  if (is_present(cameras)) {
    throw InvalidInput(printable(folder) +
                       " has a cameras.json: pictures there may be painted; choose another folder");
  }
  const HoleViews chosen = views_with_holes(model, part_of(progress, 0, 0.8));
  make_output_folder(folder);
  const std::vector<SupportView> inputs = support_views(model);
  const ModelPictures pictures(model, {.fill = fill});
  const Scene scene = scene_of_cameras(model, chosen.cameras, hole_name);
  // Called cameras.json when all is there: pictures beside that may be painted.
  const std::filesystem::path unfinished = folder / "cameras.unfinished.json";
  write_cameras_json(unfinished, scene);
  HolePictures out{{}, chosen.candidates, chosen.covered};
  // Cameras as they are read again, so that what is painted is compared with the same bits.
  for (const View& view : camera_views_from(unfinished, model)) {
    report(progress, 0.8 + 0.2 * double(out.pictures.size()) / double(scene.views.size()));
    const RenderBuffers buffers = render_camera(model, inputs, view.camera);
    const MaskMap holes = hole_mask(buffers);
    write_png(folder / (view.name + ".png"), pictures.of(buffers, view.camera));
    write_png(folder / (view.name + "_mask.png"), holes);
    write_exr(folder / (view.name + "_depth.exr"), depth_exr(buffers, holes, scene.frame));
    const auto count = std::count(holes.data.begin(), holes.data.end(), 1);
    out.pictures.push_back({view.name, double(count) / double(holes.data.size())});
  }
  write_file(folder / "README.txt", kReadMe);
  std::filesystem::rename(unfinished, cameras);
  report(progress, 1);
  return out;
}

Json hole_pictures_to_json(const HolePictures& made) {
  Json views = Json::array();
  for (const HolePicture& picture : made.pictures) {
    views.push_back({{"name", picture.name}, {"hole_fraction", picture.holes}});
  }
  return {{"candidates", made.candidates}, {"covered_fraction", made.covered}, {"views", views}};
}

PaintedPictures read_painted_pictures(const Model& model,
                                      const std::filesystem::path& folder,
                                      const Progress& progress) {
  const std::vector<View> views = camera_views_from(folder / "cameras.json", model);
  const std::vector<SupportView> inputs = support_views(model);
  PaintedPictures out;
  for (size_t k = 0; k < views.size(); ++k) {
    report(progress, double(k) / double(views.size()));
    const auto path = picture_of(folder, views[k].name);
    std::optional<PaintedView> painted;
    if (path) painted = painted_view(model, inputs, *path, views[k].camera);
    if (painted) {
      out.views.push_back(std::move(*painted));
      out.names.push_back(views[k].name);
    } else {
      out.unpainted.push_back(views[k].name);
    }
  }
  if (out.views.empty()) {
    throw BadInput(Defect::Empty,
                   folder,
                   "none of its " + std::to_string(views.size()) +
                       " pictures is painted in the white of its mask");
  }
  report(progress, 1);
  return out;
}

std::vector<Camera> surroundings_views(const Model& model, const Progress& progress) {
  return hole_views(model, holes_left_open, progress).cameras;
}

PaintedHoles paint_surroundings(const Model& model, const Progress& progress) {
  const std::vector<Camera> cameras = surroundings_views(model, part_of(progress, 0, 0.3));
  return paint_surroundings(model, cameras, part_of(progress, 0.3, 1));
}

PaintedHoles paint_surroundings(const Model& model,
                                const std::vector<Camera>& cameras,
                                const Progress& progress) {
  PaintedHoles out;
  const auto paint = [&](size_t k, const ViewToPaint& view) {
    PaintedSurroundings painted = painted_surroundings(view);
    const std::string file = std::string(kSurroundingsFolder) + "/" + hole_name(k) + ".png";
    std::string png = encode_png(painted.picture);
    out.painted.names.push_back(hole_name(k));
    out.painted.views.push_back({cameras[k],
                                 std::move(painted.picture),
                                 {file, sha256(png)},
                                 std::move(painted.left_open)});
    out.pictures[file] = std::move(png);
    return out.painted.views.back();
  };
  out.fill = lift_painted(model, cameras, paint, progress);
  if (out.fill.gaussians.size() == 0) {
    throw NumericalError(
        "nothing can be painted: holes are small, looked at by a photograph, in "
        "the sky, or too far from what photographs show");
  }
  return out;
}

}  // namespace cgs
