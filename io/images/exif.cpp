// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exif.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include <libexif/exif-data.h>

#include "io/bytes/byte_reader.h"
#include "io/images/exif_part.h"
#include "io/images/image_header.h"

namespace cgs {

namespace {

using Exif = std::unique_ptr<ExifData, decltype(&exif_data_unref)>;

// The first value of a tag as a number; 0 if it is absent or of another type.
double number(ExifData* exif, ExifIfd part, ExifTag tag) {
  const ExifEntry* const entry = exif_content_get_entry(exif->ifd[part], tag);
  if (entry == nullptr || entry->data == nullptr || entry->components < 1) return 0;
  const ExifByteOrder order = exif_data_get_byte_order(exif);
  if (entry->size < exif_format_get_size(entry->format)) return 0;
  switch (entry->format) {
    case EXIF_FORMAT_SHORT:
      return exif_get_short(entry->data, order);
    case EXIF_FORMAT_LONG:
      return exif_get_long(entry->data, order);
    case EXIF_FORMAT_RATIONAL: {
      const ExifRational value = exif_get_rational(entry->data, order);
      return value.denominator > 0 ? double(value.numerator) / double(value.denominator) : 0;
    }
    default:
      return 0;
  }
}

std::string text(ExifData* exif, ExifTag tag) {
  std::array<char, 128> value = {};
  ExifEntry* const entry = exif_content_get_entry(exif->ifd[EXIF_IFD_0], tag);
  if (entry == nullptr) return "";
  exif_entry_get_value(entry, value.data(), value.size());
  return one_line(value.data());
}

// Pixels per millimetre of the sensor; 0 if not said.
double pixels_per_millimetre(ExifData* exif, const ImageSize& size) {
  const double resolution = number(exif, EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  constexpr double kInch = 2;
  constexpr double kCentimetre = 3;
  const double unit = number(exif, EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT);
  const double millimetres = unit == kInch ? 25.4 : unit == kCentimetre ? 10 : 0;
  // Stated for the picture as it was taken; programs that shrink it leave the tag.
  double width = number(exif, EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION);
  double height = number(exif, EXIF_IFD_EXIF, EXIF_TAG_PIXEL_Y_DIMENSION);
  // HEIC states the size before it is turned upright.
  if ((width > height) != (size.width > size.height)) std::swap(width, height);
  const bool is_same_shape =
      std::abs(width * size.height - height * size.width) <= 2 * std::max(size.width, size.height);
  if (!(resolution > 0 && millimetres > 0 && width > 0 && is_same_shape)) return 0;
  return resolution / millimetres * size.width / width;
}

// Focal length in pixels from that on 35 mm film, for pictures from sensors of 3:2 and 4:3.
LensHint from_film(double millimetres, const ImageSize& size) {
  const double longer = std::max(size.width, size.height);
  const double shorter = std::min(size.width, size.height);
  constexpr double kRounded = 0.3;  // [mm], of a value rounded to whole millimetres
  const double rounding = kRounded / millimetres;
  constexpr double kHonest = 0.02;  // lenses are named roughly
  constexpr double kCut = 0.04;     // not knowing the sensor's shape
  constexpr double kSame = 0.02;
  const double shape = longer / shorter;
  const double diagonal = std::hypot(36.0, 24.0);
  if (std::abs(shape / 1.5 - 1) < kSame || std::abs(shape * 3 / 4 - 1) < kSame) {
    const double focal = millimetres / diagonal * std::hypot(longer, shorter);
    return {"", focal, std::hypot(rounding, kHonest)};
  }
  // Wider pictures keep the sensor's longer side, others the shorter one: the mean of what it is
  // on a sensor of 3:2 and on one of 4:3 with the same diagonal.
  const double focal = shape > 1.5
                           ? longer * millimetres * 0.5 * (1 / 36.0 + 1 / (0.8 * diagonal))
                           : shorter * millimetres * 0.5 * (1 / 24.0 + 1 / (0.6 * diagonal));
  return {"", focal, std::hypot(rounding, kCut)};
}

constexpr std::string_view kJpegMagic = "\xff\xd8";

// The Exif part of an image; null for what is none or has none.
Exif read_exif(const std::filesystem::path& path) {
  // A JPEG segment has at most 64 KiB, and Exif is to be among the first.
  constexpr uint64_t kEnough = uint64_t{256} << 10;
  std::string bytes = read_file_start(path, kEnough);
  if (!bytes.starts_with(kJpegMagic)) bytes = read_file(path);
  bytes = exif_part(bytes, path);
  if (bytes.empty()) return {nullptr, &exif_data_unref};
  return {exif_data_new_from_data(reinterpret_cast<const unsigned char*>(bytes.data()),
                                  static_cast<unsigned>(bytes.size())),
          &exif_data_unref};
}

}  // namespace

LensHint lens_hint(const std::filesystem::path& path, const ImageSize& size) {
  const Exif exif = read_exif(path);
  if (!exif) return {};
  LensHint hint;
  const double plane = pixels_per_millimetre(exif.get(), size);
  const double focal = number(exif.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH);
  const double film = number(exif.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
  if (film > 0) hint = from_film(film, size);
  // Some programs that develop or shrink photographs leave a resolution of the focal plane that is
  // wrong by half and more; the length as on film they leave as it was.
  constexpr double kContradicts = 0.1;
  const bool is_plane_right =
      hint.focal == 0 || std::abs(std::log(plane * focal / hint.focal)) <= kContradicts;
  if (plane > 0 && focal > 0 && is_plane_right) {
    constexpr double kMarked = 0.03;  // lenses focused near are longer than marked
    hint = {"", plane * focal, kMarked};
  }
  constexpr double kShortest = 0.2;  // [larger sides]
  constexpr double kLongest = 50;
  const double side = std::max(size.width, size.height);
  if (!(hint.focal >= kShortest * side && hint.focal <= kLongest * side)) hint = {};
  const double zoom = number(exif.get(), EXIF_IFD_EXIF, EXIF_TAG_DIGITAL_ZOOM_RATIO);
  if (zoom > 1) {
    hint = {};
    hint.zoom = zoom;
  }
  hint.marked = focal;
  hint.camera = text(exif.get(), EXIF_TAG_MAKE) + " " + text(exif.get(), EXIF_TAG_MODEL);
  return hint;
}

int exif_orientation(const std::filesystem::path& path) {
  constexpr int kUpright = 1;
  constexpr int kLast = 8;
  const std::string start = read_file_start(path, 16);
  if (start.starts_with("II") || start.starts_with("MM")) {
    return parse_image_header(read_file(path), path).orientation;  // TIFF has a tag of its own
  }
  if (!start.starts_with(kJpegMagic)) return kUpright;
  const Exif exif = read_exif(path);
  if (!exif) return kUpright;
  const double value = number(exif.get(), EXIF_IFD_0, EXIF_TAG_ORIENTATION);
  return value >= kUpright && value <= kLast ? static_cast<int>(value) : kUpright;
}

}  // namespace cgs
