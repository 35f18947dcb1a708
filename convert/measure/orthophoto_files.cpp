// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/orthophoto_files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>

#include <nlohmann/json.hpp>

#include "convert/measure/measured_file.h"
#include "convert/model/memory_plan.h"
#include "convert/text/frame_json.h"
#include "convert/text/length.h"
#include "convert/text/report_json.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/bytes/mesh_arrays.h"
#include "io/images/png.h"
#include "io/images/tiff.h"
#include "libcgs/core/error.h"
#include "libcgs/core/provenance.h"
#include "meshing/pictures/orthophoto.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr double kMostPixels = 1e8;
constexpr double kLongestSide = 30'000;  // [pixels]
// At most while the picture of the labels is encoded: heights as seen (8) and as written (4),
// labels (1), what is shown (1), the encoded colours (4), and the colours of the labels (12), as
// bytes (4) and encoded (4); and a tenth more.
constexpr double kBytesOfPixel = 42;

/// A picture's place in the world.
struct Placed {
  PictureGrid grid;
  double pixel_size = 0;                             ///< [unit]
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< Of the top left pixel [unit].
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< World point of (0, 0) at height 0 [unit].
  double height_base = 0;                            ///< Height of internal (0, 0, 0) [unit].
};

PictureAxes axes_of(const OrthophotoRequest& request, const MeasurableMesh& mesh) {
  if (!request.plane.empty()) {
    std::array<Eigen::Vector3d, 3> p;
    for (size_t k = 0; k < 3; ++k) {
      p.at(k) = mesh.internal_from_file(parse_point(request.plane.at(k)));
    }
    return picture_axes(p[0], p[1], p[2]);
  }
  static const std::map<std::string, PictureSide> kSides = {{"top", PictureSide::Top},
                                                            {"front", PictureSide::Front},
                                                            {"back", PictureSide::Back},
                                                            {"left", PictureSide::Left},
                                                            {"right", PictureSide::Right}};
  const auto side = kSides.find(request.side);
  require(side != kSides.end(), "--side must be top, front, back, left or right", request.side);
  if (!request.up.empty()) return picture_axes(side->second, up_direction(request.up));
  // As programs for maps and CAD have it, where nobody says.
  const Eigen::Vector3d z_up = Eigen::Vector3d::UnitZ();
  return picture_axes(side->second, mesh.frame.knows_up() ? mesh.frame.up : z_up);
}

// What the faces use of an axis [internal units].
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double length() const { return high - low; }
};

Range range_along(const MeasurableMesh& mesh, const Eigen::Vector3d& axis) {
  Range out;
  for (const auto& f : mesh.mesh.faces) {
    for (const uint32_t v : f) {
      out.low = std::min(out.low, axis.dot(mesh.points[v]));
      out.high = std::max(out.high, axis.dot(mesh.points[v]));
    }
  }
  return out;
}

// 1, 2 or 5 times a power of ten that splits a length into 1000 to 2500 parts.
double round_part(double length) {
  constexpr double kParts = 2500;
  const double exact = length / kParts;
  const double ten = std::pow(10, std::floor(std::log10(exact)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * ten >= exact) return step * ten;
  }
  return 10 * ten;
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  constexpr int kDigits = 15;  // all that a double keeps of a decimal number
  return {text.data(),
          std::to_chars(
              text.data(), text.data() + text.size(), value, std::chars_format::general, kDigits)
              .ptr};
}

void check_size(double width, double height, const std::string& pixel_size) {
  if (width * height <= kMostPixels && std::max(width, height) <= kLongestSide) return;
  throw LimitError("--pixel-size " + pixel_size + " makes a picture of " + number_text(width) +
                   " x " + number_text(height) +
                   " pixels; at most 30000 on a side and 100 million "
                   "in all are written");
}

void check_memory(const PictureGrid& grid, size_t budget) {
  const double needed = kBytesOfPixel * grid.width * grid.height;
  if (needed <= static_cast<double>(budget)) return;
  throw LimitError("a picture of " + std::to_string(grid.width) + " x " +
                   std::to_string(grid.height) + " pixels needs about " +
                   format_file_size(static_cast<size_t>(needed)) + " of memory and " +
                   format_file_size(budget) + " may be used; a larger --pixel-size makes it fit");
}

Placed place(const OrthophotoRequest& request,
             const MeasurableMesh& mesh,
             const PictureAxes& axes,
             const FigureUnit& unit) {
  // World coordinates of internal (0, 0, 0) along the axes, or those from the plane's first point.
  const double per_world = unit.length / mesh.frame.scale;
  Eigen::Vector3d origin = mesh.frame.world_from_internal(Eigen::Vector3d::Zero()) * per_world;
  Placed out;
  if (!request.plane.empty()) {
    const Eigen::Vector3d first = mesh.internal_from_file(parse_point(request.plane[0]));
    origin = -unit.length * first;
    out.origin = mesh.frame.world_from_internal(first) * per_world;
  }
  const Range across = range_along(mesh, axes.right);
  const Range along = range_along(mesh, axes.up);
  const double longest = std::max(across.length(), along.length());
  require(longest > 0, "an orthophoto needs a surface with extent, its size", longest);
  out.pixel_size = request.pixel_size.empty()
                       ? round_part(longest * unit.length)
                       : parse_length(request.pixel_size, mesh.frame, "--pixel-size") * unit.length;
  const double px = out.pixel_size;
  const double left = std::floor((axes.right.dot(origin) + across.low * unit.length) / px);
  const double right = std::ceil((axes.right.dot(origin) + across.high * unit.length) / px);
  const double bottom = std::floor((axes.up.dot(origin) + along.low * unit.length) / px);
  const double top = std::ceil((axes.up.dot(origin) + along.high * unit.length) / px);
  const double width = std::max(1.0, right - left);
  const double height = std::max(1.0, top - bottom);
  check_size(width, height, request.pixel_size);
  out.corner = {left * px, top * px};
  out.height_base = axes.toward.dot(origin);
  out.grid = {axes,
              {(out.corner.x() - axes.right.dot(origin)) / unit.length,
               (out.corner.y() - axes.up.dot(origin)) / unit.length},
              px / unit.length,
              static_cast<int>(width),
              static_cast<int>(height)};
  return out;
}

// World files place the middle of the first pixel; rows run down.
std::string world_file(const Placed& placed) {
  const double px = placed.pixel_size;
  std::string out;
  for (const double value :
       {px, 0.0, 0.0, -px, placed.corner.x() + 0.5 * px, placed.corner.y() - 0.5 * px}) {
    out += number_text(value) + "\n";
  }
  return out;
}

Eigen::Vector3f label_color(int8_t label) {
  const bool is_stated = label >= 0 && static_cast<size_t>(label) < kProvenanceCount;
  return is_stated ? provenance_color(static_cast<Provenance>(label))
                   : Eigen::Vector3f::Constant(0.5f);
}

ColorImage label_picture(const Orthophoto& photo) {
  ColorImage out(photo.label.width, photo.label.height, Eigen::Vector3f::Ones());
  std::transform(photo.label.data.begin(), photo.label.data.end(), out.data.begin(), label_color);
  return out;
}

// 1 where the mesh is shown.
MaskMap shown_pixels(const Orthophoto& photo) {
  const Raster<double>& height = photo.height;
  MaskMap out(height.width, height.height, 0);
  std::transform(height.data.begin(), height.data.end(), out.data.begin(), [](double h) {
    return uint8_t(std::isnan(h) ? 0 : 1);
  });
  return out;
}

struct Heights {
  Raster<float> values;  // [unit], from zero
  double zero = 0;
  double lowest = 0;
  double highest = 0;
};

Heights heights_of(const Orthophoto& photo, const Placed& placed, const FigureUnit& unit) {
  Heights out;
  Range range;
  for (const double h : photo.height.data) {
    if (std::isnan(h)) continue;
    range.low = std::min(range.low, h);
    range.high = std::max(range.high, h);
  }
  out.lowest = placed.height_base + range.low * unit.length;
  out.highest = placed.height_base + range.high * unit.length;
  // Where floats of this size are coarser than a sixteenth of a pixel, heights count from below.
  const double largest = std::max(std::abs(out.lowest), std::abs(out.highest));
  if (largest * double(std::numeric_limits<float>::epsilon()) > placed.pixel_size / 16) {
    out.zero = std::floor(out.lowest / placed.pixel_size) * placed.pixel_size;
  }
  out.values = Raster<float>(photo.height.width, photo.height.height, 0);
  std::transform(
      photo.height.data.begin(), photo.height.data.end(), out.values.data.begin(), [&](double h) {
        return static_cast<float>((placed.height_base - out.zero) + h * unit.length);
      });
  return out;
}

// Pictures first, then their world files in the same order.
constexpr std::array<const char*, 7> kEndings = {
    ".png", ".provenance.png", ".tif", ".pgw", ".provenance.pgw", ".tfw", ".orthophoto.json"};

Json shares_json(const Orthophoto& photo, size_t covered, bool states_provenance) {
  std::array<size_t, kProvenanceCount> counts = {};
  for (const int8_t label : photo.label.data) {
    if (label >= 0) ++counts.at(static_cast<size_t>(label));
  }
  Json out = Json::object();
  for (const Provenance label : kProvenanceOrder) {
    Json& share = out[provenance_key(label)];
    if (!states_provenance) continue;
    share = static_cast<double>(counts.at(static_cast<size_t>(label))) /
            static_cast<double>(std::max<size_t>(1, covered));
  }
  return out;
}

Json provenance_colors_json() {
  Json out = Json::object();
  for (const Provenance label : kProvenanceOrder) {
    out[provenance_key(label)] = traits(label).color;
  }
  return out;
}

// For whoever opens the pictures later and has nothing else; they may lie elsewhere then.
std::string description_of(Json report, const std::vector<std::filesystem::path>& files) {
  report["files"] = Json::array();
  for (const auto& file : files) report["files"].push_back(file.filename().string());
  report["provenance_colors"] = provenance_colors_json();
  return json_text(versioned(report)) + "\n";
}

// All files appear together, once all could be encoded and written, so that no picture is left
// alone or beside the numbers of an earlier one. What takes long, or may run out of memory, comes
// before the first file is there. The photo's colours are gone afterwards.
void write_files(const std::vector<std::filesystem::path>& files,
                 Orthophoto& photo,
                 const MaskMap& shown,
                 const Raster<float>& heights,
                 const std::vector<std::string>& texts) {
  std::vector<std::string> contents = {encode_png(photo.color, shown)};
  photo.color = ColorImage();  // the largest part of a photo
  contents.push_back(encode_png(label_picture(photo), shown));
  contents.push_back(encode_tiff(heights));
  contents.insert(contents.end(), texts.begin(), texts.end());
  if (files[0].has_parent_path()) make_output_folder(files[0].parent_path());
  std::deque<AtomicFile> written;  // not moved while it grows
  for (size_t k = files.size(); k-- > 0;) written.emplace_back(files[k]).write(contents[k]);
  for (AtomicFile& file : written) file.commit();  // the numbers first, by which pictures are read
}

}  // namespace

std::vector<std::filesystem::path> orthophoto_files(const std::filesystem::path& prefix) {
  std::vector<std::filesystem::path> out;
  out.reserve(kEndings.size());
  for (const char* ending : kEndings) out.emplace_back(prefix.string() + ending);
  return out;
}

Json write_orthophoto(const OrthophotoRequest& request,
                      const MeasurableMesh& mesh,
                      const FigureUnit& unit,
                      size_t memory_limit) {
  require(request.prefix.has_filename(),
          "--orthophoto must name files in a folder, as plans/facade",
          request.prefix.string());
  const PictureAxes axes = axes_of(request, mesh);
  const Placed placed = place(request, mesh, axes, unit);
  check_memory(placed.grid, memory_budget(memory_limit));
  Orthophoto photo = orthophoto(mesh, placed.grid);
  const MaskMap shown = shown_pixels(photo);
  const auto covered =
      static_cast<size_t>(std::count(shown.data.begin(), shown.data.end(), uint8_t{1}));
  require(
      covered > 0, "--pixel-size is so large that no pixel's middle shows the mesh, covered", 0);
  const Heights heights = heights_of(photo, placed, unit);
  const std::vector<std::filesystem::path> files = orthophoto_files(request.prefix);
  Json out = {{"files", Json::array()},
              {"unit", unit.name},
              {"scale",
               {{"source", scale_source_name(mesh.frame.scale_source)},
                {"relative_sigma", unit.relative_sigma > 0 ? Json(unit.relative_sigma) : Json()}}},
              {"pixel_size", placed.pixel_size},
              {"width", placed.grid.width},
              {"height", placed.grid.height},
              {"axes",
               {{"right", vector_to_json(axes.right)},
                {"up", vector_to_json(axes.up)},
                {"toward", vector_to_json(axes.toward)}}},
              {"origin", vector_to_json(placed.origin)},
              {"corner", {placed.corner.x(), placed.corner.y()}},
              {"height_zero", heights.zero},
              {"lowest", heights.lowest},
              {"highest", heights.highest},
              {"covered", static_cast<double>(covered) / static_cast<double>(shown.data.size())}};
  out.update(shares_json(photo, covered, mesh.states_provenance()));
  for (const auto& file : files) out["files"].push_back(file.string());
  const std::string world = world_file(placed);
  write_files(
      files, photo, shown, heights.values, {world, world, world, description_of(out, files)});
  return out;
}

}  // namespace cgs
