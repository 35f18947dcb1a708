// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exif_part.h"

#include <cstdint>
#include <vector>

#include "io/bytes/byte_reader.h"
#include "io/bytes/compression.h"
#include "io/images/heif.h"
#include "io/images/image_chunks.h"
#include "io/images/tiff_directory.h"

namespace cgs {

namespace {

using std::string_view_literals::operator""sv;

constexpr std::string_view kExif = "Exif\0\0"sv;
constexpr uint64_t kLargestSegment = 65'000;  // what a segment of JPEG holds

std::string with_header(std::string_view tiff) {
  if (tiff.starts_with(kExif)) tiff.remove_prefix(kExif.size());
  return std::string(kExif) + std::string(tiff.substr(0, kLargestSegment));
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// What a text chunk holds after its keyword where that names a raw profile, as ImageMagick and
// Exiv2 write Exif: a line break, a name, the number of bytes, and these in hexadecimal, in lines.
std::string of_raw_profile(std::string_view text) {
  for (int line = 0; line < 3; ++line) {
    const size_t end = text.find('\n');
    if (end == std::string_view::npos) return "";
    text.remove_prefix(end + 1);
  }
  std::string out;
  int high = -1;
  for (const char c : text) {
    const int digit = hex_digit(c);
    if (digit < 0) continue;
    if (high >= 0) out += static_cast<char>(16 * high + digit);
    high = high >= 0 ? -1 : digit;
  }
  return out.starts_with(kExif) ? with_header(out) : "";
}

std::string of_text_chunk(std::string_view name,
                          std::string_view body,
                          const std::filesystem::path& path) {
  // ImageMagick calls so what else stands there, too, as XMP.
  for (const std::string_view keyword :
       {"Raw profile type exif\0"sv, "Raw profile type APP1\0"sv}) {
    if (!body.starts_with(keyword)) continue;
    body.remove_prefix(keyword.size());
    if (name == "tEXt") return of_raw_profile(body);
    if (!body.empty()) body.remove_prefix(1);  // the method: deflate
    constexpr size_t kLongest = 3 * kLargestSegment;
    return of_raw_profile(
        inflate(body, DeflateWrapping::Zlib, SizeRange{0, kLongest}, path, "PNG raw profile"));
  }
  return "";
}

// The first segment with Exif, wherever it stands among others.
std::string part_of_jpeg(std::string_view bytes, const std::filesystem::path& path) {
  constexpr int kApp1 = 0xe1;
  std::string out;
  ByteReader file(bytes, path);
  visit_jpeg_segments(file, [&](int marker, std::string_view body) {
    if (marker == kApp1 && body.starts_with(kExif)) out = body;
    return out.empty();
  });
  return out;
}

std::string part_of_png(std::string_view bytes, const std::filesystem::path& path) {
  std::string out;
  visit_png_chunks(bytes, path, [&](std::string_view name, std::string_view body) {
    if (name == "eXIf") out = with_header(body);
    if (name == "tEXt" || name == "zTXt") out = of_text_chunk(name, body, path);
    return out.empty();
  });
  return out;
}

std::string part_of_webp(std::string_view bytes, const std::filesystem::path& path) {
  std::string out;
  visit_webp_chunks(bytes, path, [&](std::string_view name, std::string_view body) {
    if (name == "EXIF") out = with_header(body);
    return out.empty();
  });
  return out;
}

// A TIFF file of one directory and that of its Exif part, in the byte order of another file.
class SmallTiff {
 public:
  explicit SmallTiff(bool is_big_endian) : is_big_endian_(is_big_endian) {}

  std::string bytes(const std::vector<std::pair<uint16_t, TiffField>>& main,
                    const std::vector<std::pair<uint16_t, TiffField>>& exif) {
    const size_t exif_start = 8 + size_of(main.size() + 1);
    values_start_ = exif_start + size_of(exif.size());
    std::string pointer;
    append(pointer, exif_start, 4);
    std::vector<std::pair<uint16_t, TiffField>> first = main;
    first.push_back({kExifDirectory, {kLong, 1, pointer}});
    std::string out = is_big_endian_ ? "MM" : "II";
    append(out, 42, 2);
    append(out, 8, 4);
    out += directory(first) + directory(exif);
    return out + values_;
  }

  static constexpr uint16_t kExifDirectory = 0x8769;

 private:
  static constexpr uint16_t kLong = 4;
  static size_t size_of(size_t entries) { return 2 + 12 * entries + 4; }

  void append(std::string& out, uint64_t value, int width) const {
    for (int i = 0; i < width; ++i) {
      const int place = is_big_endian_ ? width - 1 - i : i;
      out += static_cast<char>(value >> (8 * place));
    }
  }

  std::string directory(const std::vector<std::pair<uint16_t, TiffField>>& fields) {
    std::string out;
    append(out, fields.size(), 2);
    for (const auto& [tag, field] : fields) {
      append(out, tag, 2);
      append(out, field.type, 2);
      append(out, field.count, 4);
      if (field.bytes.size() <= 4) {
        out += std::string(field.bytes) + std::string(4 - field.bytes.size(), '\0');
      } else {
        append(out, values_start_ + values_.size(), 4);
        values_ += field.bytes;
      }
    }
    append(out, 0, 4);  // no further directory
    return out;
  }

  bool is_big_endian_;
  size_t values_start_ = 0;
  std::string values_;
};

std::vector<std::pair<uint16_t, TiffField>> fields_of(const TiffDirectory& directory,
                                                      std::initializer_list<uint16_t> tags) {
  constexpr size_t kLongestField = 1024;
  std::vector<std::pair<uint16_t, TiffField>> out;
  for (const uint16_t tag : tags) {
    const auto field = directory.field(tag);
    const bool fits = field && field->type <= 12 && field->bytes.size() <= kLongestField;
    if (fits) out.emplace_back(tag, *field);
  }
  return out;
}

// The directories may lie anywhere in the file, far beyond what an Exif part may hold.
std::string part_of_tiff(std::string_view bytes, const std::filesystem::path& path) {
  constexpr uint16_t kMaker = 0x010f;
  constexpr uint16_t kModel = 0x0110;
  const TiffDirectory first(bytes, path);
  const auto exif = first.directory(SmallTiff::kExifDirectory);
  if (!exif) return "";
  // Focal length, size as taken, resolution of the focal plane and its unit, zoom, length on film.
  const auto lens =
      fields_of(*exif, {0x920a, 0xa002, 0xa003, 0xa20e, 0xa20f, 0xa210, 0xa404, 0xa405});
  return with_header(
      SmallTiff(first.is_big_endian()).bytes(fields_of(first, {kMaker, kModel}), lens));
}

}  // namespace

std::string exif_part(std::string_view bytes, const std::filesystem::path& path) {
  try {
    if (bytes.starts_with("\xff\xd8")) return part_of_jpeg(bytes, path);
    if (bytes.starts_with("\x89PNG")) return part_of_png(bytes, path);
    if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP")) {
      return part_of_webp(bytes, path);
    }
    if (bytes.starts_with("II") || bytes.starts_with("MM")) return part_of_tiff(bytes, path);
    if (is_heif(bytes)) return heif_exif(bytes, path);
  } catch (const BadInput&) {
    return "";  // of the picture as a whole its decoder tells
  }
  return "";
}

}  // namespace cgs
