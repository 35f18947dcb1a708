// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/scene/photo_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/content_hash.h"
#include "io/bytes/json_file.h"
#include "io/images/image.h"
#include "io/scenes/colmap_writer.h"
#include "io/scenes/masks.h"
#include "io/scenes/orientation.h"
#include "io/scenes/photographs.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/poses/solve_poses.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// Beyond, hours; and tools that solve for thousands exist.
constexpr size_t kMostPhotographs = 200;

std::vector<PhotoFile> checked_photographs(const SceneRoot& root,
                                           const std::vector<std::string>& wanted) {
  std::vector<PhotoFile> photographs = list_photographs(root);
  if (photographs.size() > kMostPhotographs && wanted.size() >= 2) {
    std::erase_if(photographs, [&](const PhotoFile& photograph) {
      const std::string name = photograph.path.filename().string();
      return std::find(wanted.begin(), wanted.end(), name) == wanted.end();
    });
  }
  if (photographs.size() < 2) {
    std::string hints;
    for (const std::string& line : unread_files(root.folder)) hints += "; " + line;
    throw BadInput(Defect::Empty, root.folder, "need at least 2 photographs" + hints);
  }
  if (photographs.size() > kMostPhotographs) {
    throw LimitError(printable(root.folder) + ": " + std::to_string(photographs.size()) +
                     " photographs without cameras; poses are solved for at most " +
                     std::to_string(kMostPhotographs) +
                     ": name those to use with --views, or solve with COLMAP");
  }
  return photographs;
}

std::string inputs_text(MaskIndex& masks,
                        const std::vector<PhotoFile>& photographs,
                        const PhotoPoseOptions& how) {
  Json hashes = Json::object();
  for (const PhotoFile& photograph : photographs) {
    const std::string name = photograph.path.filename().string();
    hashes[name] = file_hash(photograph.path);
    const std::filesystem::path mask = masks.mask_of(photograph.path);
    if (!mask.empty()) hashes[name + ", mask"] = file_hash(mask);
  }
  Json out = {{"program", program_version()}, {"focal", how.focal}, {"photographs", hashes}};
  if (how.each_lens) out["each_lens"] = true;
  if (how.may_have_border) out["may_have_border"] = true;
  return json_text(out, -1);
}

// Of the files that write_photo_poses() writes: cameras that somebody moved are not solved ones.
Json hashes_of_model(const std::filesystem::path& folder) {
  Json out = Json::object();
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    out[name] = file_hash(folder / "sparse/0" / name);
  }
  return out;
}

/// Which photographs are to be reconstructed from.
struct Wanted {
  std::vector<std::string> names;  ///< Empty = any.
  size_t count = 0;                ///< How many are enough.

  /// How many of the placed ones count.
  size_t among(const std::vector<std::string>& placed) const {
    if (names.empty()) return std::min(placed.size(), count);
    return static_cast<size_t>(std::count_if(names.begin(), names.end(), [&](const auto& name) {
      return std::find(placed.begin(), placed.end(), name) != placed.end();
    }));
  }
};

Wanted wanted_of(const std::vector<std::string>& names, size_t photographs, bool all_views) {
  SceneOptions options;
  options.all_views = all_views;
  return {names, names.empty() ? options.wanted_views(photographs) : names.size()};
}

std::vector<std::string> placed_names(const ColmapModel& model) {
  std::vector<std::string> out;
  for (const ColmapImage& image : model.images) out.push_back(image.name);
  return out;
}

std::optional<PhotoPoses> stored_poses(const std::filesystem::path& folder,
                                       const std::string& inputs) {
  if (folder.empty() || !is_present(folder / "poses.json")) return std::nullopt;
  try {
    const nlohmann::json document = read_json(folder / "poses.json");
    const JsonValue record(document, folder / "poses.json");
    if (record.at("inputs").text() != inputs) return std::nullopt;
    if (Json(document.value("files", nlohmann::json())) != hashes_of_model(folder)) {
      return std::nullopt;
    }
    PhotoPoses out;
    out.inputs = inputs;
    out.is_stored = true;
    const JsonValue warnings = record.at("warnings");
    for (size_t i = 0; i < warnings.size(); ++i) out.warnings.push_back(warnings.at(i).text());
    if (const auto notes = record.find("notes")) {  // earlier versions had none
      for (size_t i = 0; i < notes->size(); ++i) out.notes.push_back(notes->at(i).text());
    }
    out.focal_sigma = record.at("focal_sigma").number();
    const auto aside = record.find("from_aside");  // earlier versions always tried
    out.tried_from_aside = !aside || aside->boolean();
    const std::filesystem::path model = folder / "sparse/0";
    out.model.cameras = read_colmap_cameras_text(model / "cameras.txt");
    out.model.images = read_colmap_images_text(model / "images.txt");
    out.model.points = read_colmap_points_text(model / "points3D.txt");
    return out;
  } catch (const BadInput&) {
    return std::nullopt;  // damaged: solve again
  }
}

// Quarter turns, clockwise, that make upright what lies in the file. Mirrored ones are counted as
// none: their lenses are their own, by lens_of().
int quarter_turns(int orientation) {
  switch (orientation) {
    case 3:
      return 2;
    case 6:
      return 1;
    case 8:
      return 3;
    default:
      return 0;
  }
}

// Photographs of one camera, size and stated focal length, also where that is no number of pixels,
// share a lens, upright or lying: as their sensor lay they are alike.
int lens_of(const PhotoFile& photograph, std::vector<const PhotoFile*>& lenses) {
  const auto key = [](const PhotoFile& p) {
    const bool is_mirrored = p.orientation != 1 && quarter_turns(p.orientation) == 0;
    const ImageSize stored = turned(p.size, p.orientation);
    return std::tuple(stored.width,
                      stored.height,
                      is_mirrored ? p.orientation : 1,
                      p.hint.camera,
                      p.hint.focal,
                      p.hint.marked,
                      p.hint.zoom);
  };
  const auto same = std::find_if(lenses.begin(), lenses.end(), [&](const PhotoFile* other) {
    return key(*other) == key(photograph);
  });
  const auto index = static_cast<int>(same - lenses.begin());
  if (same == lenses.end()) lenses.push_back(&photograph);
  return index;
}

using Colors = std::vector<std::array<int, 3>>;  // of features, 0 ... 255

UnposedPhoto unposed_photo(MaskIndex& masks,
                           const PhotoFile& photograph,
                           const PhotoPoseOptions& how,
                           bool from_aside,
                           const Progress& progress,
                           Colors& colors) {
  View view;
  view.image_path = photograph.path;
  view.mask_path = masks.mask_of(photograph.path);
  view.orientation = photograph.orientation;
  view.may_have_border = how.may_have_border;
  MaskMap usable;
  const ColorImage image = read_photograph(view, usable);
  UnposedPhoto out;
  out.name = photograph.path.filename().string();
  out.width = image.width;
  out.height = image.height;
  out.features = from_aside ? detect_tilted_features(image, usable, {}, progress)
                            : detect_features(image, usable);
  out.focal = photograph.hint.focal;
  out.focal_sigma = photograph.hint.sigma;
  out.turns = quarter_turns(photograph.orientation);
  for (const Eigen::Vector2d& p : out.features.points) {
    const int x = std::clamp(static_cast<int>(p.x()), 0, image.width - 1);
    const int y = std::clamp(static_cast<int>(p.y()), 0, image.height - 1);
    const Eigen::Vector3f color = 255 * image(x, y);
    colors.push_back({static_cast<int>(std::lround(color.x())),
                      static_cast<int>(std::lround(color.y())),
                      static_cast<int>(std::lround(color.z()))});
  }
  return out;
}

// Pairs of placed photographs that are next to no way apart: a burst, or two copies of one.
std::vector<std::pair<size_t, size_t>> photos_from_one_place(const PoseSolution& solution) {
  constexpr double kNoWay = 1e-3;  // of the way to the farthest
  std::vector<std::pair<size_t, size_t>> out;
  for (size_t a = 0; a < solution.photos.size(); ++a) {
    for (size_t b = a + 1; b < solution.photos.size(); ++b) {
      if (!solution.photos[a].is_placed || !solution.photos[b].is_placed) continue;
      const Eigen::Vector3d way =
          solution.photos[b].camera.center() - solution.photos[a].camera.center();
      if (way.norm() < kNoWay) out.emplace_back(a, b);
    }
  }
  return out;
}

std::string focal_text(const UnposedPhoto& photo, const SolvedPhoto& solved) {
  if (solved.is_assumed) {
    return "neither the Exif of " + printable(photo.name) +
           " nor what the photographs show tells the focal length: " +
           std::to_string(std::lround(solved.camera.fx)) +
           " pixels are assumed, as is typical of cameras, uncertain by " +
           percent(solved.focal_sigma) +
           ": depth may be stretched by as much; --focal states it, in pixels, if one camera "
           "took all photographs";
  }
  return "focal length of " + printable(photo.name) +
         " solved for: " + std::to_string(std::lround(solved.camera.fx)) +
         " pixels, uncertain by " + percent(solved.focal_sigma) +
         (photo.focal > 0 ? " (Exif says " + std::to_string(std::lround(photo.focal)) +
                                (solved.is_refuted ? ", which the photographs contradict: they may "
                                                     "have been cut or zoomed)"
                                                   : ")")
                          : " (its Exif does not say)");
}

void add_remarks(const std::vector<UnposedPhoto>& photos,
                 const PoseSolution& solution,
                 PhotoPoses& out) {
  std::set<int> told;  // lenses
  for (size_t i = 0; i < photos.size(); ++i) {
    const SolvedPhoto& solved = solution.photos[i];
    const UnposedPhoto& photo = photos[i];
    if (!solved.is_placed) {
      out.warnings.push_back("photograph " + printable(photo.name) +
                             " was left out: too little of what it shows is in the others");
    } else if (solved.focal_sigma > 0 && told.insert(photo.lens).second) {
      constexpr double kSure = 0.05;  // lengths along the view err by about as much
      const bool is_doubtful = solved.is_refuted || solved.is_assumed || solved.focal_sigma > kSure;
      (is_doubtful ? out.warnings : out.notes).push_back(focal_text(photo, solved));
    }
  }
  for (const auto& [a, b] : photos_from_one_place(solution)) {
    out.warnings.push_back("photographs " + printable(photos[a].name) + " and " +
                           printable(photos[b].name) +
                           " were taken from one place: together they tell nothing of depth");
  }
}

// COLMAP's cameras, numbered from 1: one per lens and way that photographs are turned.
std::vector<uint32_t> camera_ids(const std::vector<UnposedPhoto>& photos) {
  std::map<std::pair<int, int>, uint32_t> ids;
  std::vector<uint32_t> out;
  for (const UnposedPhoto& photo : photos) {
    const auto next = static_cast<uint32_t>(ids.size() + 1);
    out.push_back(ids.emplace(std::pair(photo.lens, photo.turns), next).first->second);
  }
  return out;
}

ColmapModel colmap_model(const std::vector<UnposedPhoto>& photos,
                         const std::vector<Colors>& colors,
                         const PoseSolution& solution) {
  ColmapModel model;
  const std::vector<uint32_t> camera_of = camera_ids(photos);
  for (size_t i = 0; i < photos.size(); ++i) {
    const SolvedPhoto& solved = solution.photos[i];
    if (!solved.is_placed) continue;
    model.cameras[camera_of[i]] = {solved.camera, {solved.k1, 0, 0, 0, 0}, {}};
    ColmapImage image;
    image.id = static_cast<uint32_t>(i + 1);
    image.camera_id = camera_of[i];
    image.name = photos[i].name;
    const Eigen::Quaterniond& q = solved.rotation;
    image.rotation = {q.w(), q.x(), q.y(), q.z()};
    image.translation = solved.translation;
    image.points = photos[i].features.points;
    image.keypoints = image.points.size();
    model.images.push_back(std::move(image));
  }
  std::vector<ColmapImage*> image_of(photos.size(), nullptr);
  for (ColmapImage& image : model.images) image_of[image.id - 1] = &image;
  for (const SolvedPoint& point : solution.points) {
    ColmapPoint out{point.position, {}, {}, point.error};
    const SolvedObservation& first = point.track.front();
    out.color = colors[static_cast<size_t>(first.photo)][static_cast<size_t>(first.feature)];
    for (const SolvedObservation& s : point.track) {
      out.track.emplace_back(static_cast<uint32_t>(s.photo + 1), static_cast<uint32_t>(s.feature));
      image_of[static_cast<size_t>(s.photo)]->points[static_cast<size_t>(s.feature)] = s.at;
    }
    model.points.push_back(std::move(out));
  }
  return model;
}

/// Photographs and what was found of their cameras.
struct Attempt {
  std::vector<UnposedPhoto> photos;
  std::vector<Colors> colors;
  PoseSolution solution;

  std::vector<std::string> placed() const {
    std::vector<std::string> out;
    for (size_t i = 0; i < photos.size(); ++i) {
      if (solution.photos[i].is_placed) out.push_back(photos[i].name);
    }
    return out;
  }
};

std::string attempt_text(const Attempt& attempt) {
  char rms[32];
  std::snprintf(rms, sizeof rms, "%.2f", attempt.solution.rms);
  return std::to_string(attempt.placed().size()) + " of " + std::to_string(attempt.photos.size()) +
         " placed, " + std::to_string(attempt.solution.points.size()) + " points, " + rms +
         " pixels rms";
}

Attempt attempted(MaskIndex& masks,
                  const std::vector<PhotoFile>& photographs,
                  const PhotoPoseOptions& how,
                  bool from_aside,
                  const Progress& progress) {
  Attempt out;
  out.colors.resize(photographs.size());
  std::vector<const PhotoFile*> lenses;
  constexpr double kShare = 0.4;  // of the time, for finding features
  for (size_t i = 0; i < photographs.size(); ++i) {
    const double count = double(photographs.size());
    const Progress part =
        part_of(progress, kShare * double(i) / count, kShare * double(i + 1) / count);
    report(part, 0);
    UnposedPhoto photo = unposed_photo(masks, photographs[i], how, from_aside, part, out.colors[i]);
    photo.lens = how.each_lens ? static_cast<int>(i) : lens_of(photographs[i], lenses);
    if (how.focal > 0) {
      photo.focal = how.focal;
      photo.focal_sigma = 0;
    }
    out.photos.push_back(std::move(photo));
  }
  out.solution = solve_poses(out.photos, part_of(progress, kShare, 1));
  return out;
}

// Once more with features as seen from aside where too few that are to be reconstructed from have
// found a place: it takes several times as long, and moves those that have theirs.
// \return what is best, and whether both were tried
std::pair<Attempt, bool> solved_photos(MaskIndex& masks,
                                       const std::vector<PhotoFile>& photographs,
                                       const Wanted& wanted,
                                       const PhotoPoseOptions& how,
                                       Terminal& terminal) {
  const auto used = [&](const Attempt& attempt) { return wanted.among(attempt.placed()); };
  std::optional<Attempt> first;
  std::exception_ptr failure;
  const Progress progress = terminal.begin("cameras of photographs");
  try {
    first = attempted(masks, photographs, how, false, progress);
  } catch (const NumericalError&) {
    failure = std::current_exception();
  }
  terminal.end(first ? attempt_text(*first) : "not found");
  if (first && used(*first) >= wanted.count) return {std::move(*first), false};
  const Progress again = terminal.begin("cameras again, as if seen from aside");
  try {
    Attempt second = attempted(masks, photographs, how, true, again);
    terminal.end(attempt_text(second));
    if (!first || used(second) > used(*first)) return {std::move(second), true};
  } catch (const NumericalError&) {
    terminal.end("not found");
  }
  if (failure) std::rethrow_exception(failure);
  return {std::move(*first), true};
}

// A focal length in pixels is that of one size of photographs, and no lens is 28 pixels long.
void check_focal(double focal, const std::vector<PhotoFile>& photographs) {
  const auto side = [](const PhotoFile& file) {
    return std::max(file.size.width, file.size.height);
  };
  for (const PhotoFile& photograph : photographs) {
    if (side(photograph) == side(photographs.front())) continue;
    throw InvalidInput("--focal is in pixels of photographs of one size; " +
                       printable(photographs.front().path.filename()) + " is " +
                       std::to_string(side(photographs.front())) + " pixels long, " +
                       printable(photograph.path.filename()) + " " +
                       std::to_string(side(photograph)) +
                       ": bring them to one size, or leave it out");
  }
  constexpr double kShortest = 0.2;  // [larger sides]; as photographs' own are taken
  constexpr double kLongest = 50;
  const double larger = side(photographs.front());
  if (focal >= kShortest * larger && focal <= kLongest * larger) return;
  throw InvalidInput(
      "--focal is in pixels, not millimetres, and of photographs of " +
      std::to_string(side(photographs.front())) + " pixels allowed from " +
      std::to_string(std::lround(kShortest * larger)) + " to " +
      std::to_string(std::lround(kLongest * larger)) +
      " (a lens of f mm as on film: f / 36 of the larger side of photographs of 3:2, f / 34.6 "
      "of those of 4:3), got " +
      std::to_string(focal));
}

}  // namespace

PhotoPoses photo_poses(const SceneRoot& root,
                       const std::vector<std::string>& names,
                       const PhotoPoseOptions& how,
                       const std::filesystem::path& stored,
                       Terminal& terminal) {
  const std::vector<PhotoFile> photographs = checked_photographs(root, names);
  const Wanted wanted = wanted_of(names, photographs.size(), how.all_views);
  if (how.focal > 0) check_focal(how.focal, photographs);
  MaskIndex masks(root);
  const std::string inputs = inputs_text(masks, photographs, how);
  if (auto poses = stored_poses(stored, inputs)) {
    if (poses->tried_from_aside || wanted.among(placed_names(poses->model)) >= wanted.count) {
      return *poses;
    }
  }
  const auto [attempt, tried_from_aside] = solved_photos(masks, photographs, wanted, how, terminal);
  PhotoPoses out;
  out.tried_from_aside = tried_from_aside;
  out.model = colmap_model(attempt.photos, attempt.colors, attempt.solution);
  out.inputs = inputs;
  add_remarks(attempt.photos, attempt.solution, out);
  for (const SolvedPhoto& solved : attempt.solution.photos) {
    if (solved.is_placed) out.focal_sigma = std::max(out.focal_sigma, solved.focal_sigma);
  }
  return out;
}

void write_photo_poses(const std::filesystem::path& folder, const PhotoPoses& poses) {
  write_colmap_text(folder / "sparse/0", poses.model);
  const Json record = {{"inputs", poses.inputs},
                       {"warnings", poses.warnings},
                       {"notes", poses.notes},
                       {"focal_sigma", poses.focal_sigma},
                       {"from_aside", poses.tried_from_aside},
                       {"files", hashes_of_model(folder)}};
  write_file(folder / "poses.json", json_text(record) + "\n");  // last: it says the model is whole
}

void forget_photo_poses(const std::filesystem::path& folder) {
  if (!is_present(folder / "poses.json")) return;  // not ours
  for (const char* name : {"poses.json",
                           "sparse/0/cameras.txt",
                           "sparse/0/images.txt",
                           "sparse/0/points3D.txt",
                           "sparse/0",
                           "sparse",
                           ""}) {
    std::error_code ignored;  // a folder that holds more stays
    std::filesystem::remove(folder / name, ignored);
  }
}

}  // namespace cgs
