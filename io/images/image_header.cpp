// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/image_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include <zlib.h>

#include "io/images/heif.h"
#include "io/images/image_chunks.h"
#include "io/images/tiff_directory.h"

namespace cgs {

namespace {

using std::string_view_literals::operator""sv;

constexpr std::string_view kPngMagic = "\x89PNG\r\n\x1a\n"sv;
constexpr std::string_view kFormats = "PNG, JPEG, TIFF, WebP, HEIC and AVIF are read";

uint32_t big_endian(std::string_view bytes) {
  uint32_t value = 0;
  for (const char c : bytes) value = value << 8 | static_cast<uint8_t>(c);
  return value;
}

uint64_t little_endian(std::string_view bytes) {
  uint64_t value = 0;
  for (size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

ImageHeader checked(ImageFormat format,
                    uint64_t width,
                    uint64_t height,
                    const std::filesystem::path& path,
                    const ReadLimits& limits) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height);
  if (width == 0 || height == 0) throw BadInput(Defect::Value, path, "image size " + size);
  uint64_t pixels = 0;
  constexpr uint64_t kMaxSide = (uint64_t{1} << 31) - 1;
  if (width > kMaxSide || height > kMaxSide || __builtin_mul_overflow(width, height, &pixels) ||
      pixels > limits.max_pixels) {
    throw LimitError(printable(path) + ": image size " + size + ", allowed are " +
                     std::to_string(limits.max_pixels) + " pixels");
  }
  return {format, static_cast<int>(width), static_cast<int>(height)};
}

// --- JPEG -----------------------------------------------------------------------------------

struct JpegFrame {
  uint32_t width = 0;
  uint32_t height = 0;
  int components = 0;
};

JpegFrame parse_jpeg_frame(std::string_view segment, int marker, const ByteReader& file) {
  if (segment.size() < 6) file.fail(Defect::Syntax, "JPEG frame header too short");
  const auto precision = static_cast<uint8_t>(segment[0]);
  const JpegFrame frame{big_endian(segment.substr(3, 2)),
                        big_endian(segment.substr(1, 2)),
                        static_cast<uint8_t>(segment[5])};
  constexpr std::array<int, 5> kRead = {0xC0, 0xC1, 0xC2, 0xC9, 0xCA};
  if (std::find(kRead.begin(), kRead.end(), marker) == kRead.end()) {
    file.fail(Defect::Unsupported, "JPEG that is neither baseline nor progressive (lossless?)");
  }
  if (precision != 8) {
    file.fail(Defect::Unsupported, "JPEG of " + std::to_string(precision) + " bits, 8 are read");
  }
  if (frame.components != 1 && frame.components != 3 && frame.components != 4) {
    file.fail(Defect::Unsupported,
              "JPEG of " + std::to_string(frame.components) +
                  " colour components; grey, RGB and CMYK are read");
  }
  if (frame.height == 0 && frame.width > 0) {
    file.fail(Defect::Unsupported, "JPEG that states its height behind its data (DNL)");
  }
  return frame;
}

// From the first frame header (T.81 B.1.1).
JpegFrame find_jpeg_frame(ByteReader& file) {
  std::optional<JpegFrame> frame;
  visit_jpeg_segments(file, [&](int marker, std::string_view segment) {
    const bool is_frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame) frame = parse_jpeg_frame(segment, marker, file);
    return !is_frame;
  });
  if (!frame) file.fail(Defect::Syntax, "JPEG without a frame header before its data");
  return *frame;
}

// --- TIFF -----------------------------------------------------------------------------------

constexpr uint64_t kTiffWidth = 256;
constexpr uint64_t kTiffHeight = 257;
constexpr uint64_t kTiffStripOffsets = 273;
constexpr uint64_t kTiffOrientation = 274;
constexpr uint64_t kTiffStripBytes = 279;
constexpr uint64_t kTiffTileOffsets = 324;
constexpr uint64_t kTiffTileBytes = 325;

void check_tiff_is_whole(std::string_view bytes, const std::filesystem::path& path) {
  const TiffDirectory directory(bytes, path);
  std::vector<uint64_t> offsets = directory.values(kTiffStripOffsets);
  std::vector<uint64_t> lengths = directory.values(kTiffStripBytes);
  if (offsets.empty()) {
    offsets = directory.values(kTiffTileOffsets);
    lengths = directory.values(kTiffTileBytes);
  }
  if (offsets.empty() || offsets.size() != lengths.size()) {
    directory.fail(Defect::Syntax, "strips or tiles are not declared consistently");
  }
  for (size_t i = 0; i < offsets.size(); ++i) {
    if (offsets[i] > bytes.size() || lengths[i] > bytes.size() - offsets[i]) {
      directory.fail(Defect::Truncated,
                     "part " + std::to_string(i) + " of the pixels is past the end of the file");
    }
  }
}

// --- WebP -----------------------------------------------------------------------------------

ImageHeader parse_webp(ByteReader& file, const ReadLimits& limits) {
  file.take(12, "WebP header");
  const std::string_view kind = file.take(4, "WebP chunk");
  file.take(4, "WebP chunk length");
  uint64_t width = 0;
  uint64_t height = 0;
  if (kind == "VP8X") {
    file.take(4, "WebP flags");
    width = 1 + little_endian(file.take(3, "WebP width"));
    height = 1 + little_endian(file.take(3, "WebP height"));
  } else if (kind == "VP8L") {
    file.take(1, "WebP signature");
    const auto bits = file.get<uint32_t>("WebP size");
    width = 1 + (bits & 0x3FFF);
    height = 1 + (bits >> 14 & 0x3FFF);
  } else if (kind == "VP8 ") {
    file.take(6, "WebP frame tag");
    width = file.get<uint16_t>("WebP width") & 0x3FFF;
    height = file.get<uint16_t>("WebP height") & 0x3FFF;
  } else {
    file.fail(Defect::Syntax, "unknown WebP chunk");
  }
  return checked(ImageFormat::WebP, width, height, file.path(), limits);
}

void check_webp_is_whole(std::string_view bytes, const std::filesystem::path& path) {
  const uint64_t declared = 8 + little_endian(bytes.substr(4, 4));
  if (declared > bytes.size()) {
    throw BadInput(Defect::Truncated,
                   path,
                   "WebP declares " + std::to_string(declared) + " bytes, the file has " +
                       std::to_string(bytes.size()));
  }
}

// --- PNG ------------------------------------------------------------------------------------

ImageHeader parse_png(ByteReader& file, const ReadLimits& limits) {
  file.take(kPngMagic.size(), "PNG magic");
  file.take(4, "PNG chunk length");
  if (file.take(4, "PNG chunk") != "IHDR") file.fail(Defect::Syntax, "expected the chunk IHDR");
  const uint32_t width = big_endian(file.take(4, "PNG width"));
  const uint32_t height = big_endian(file.take(4, "PNG height"));
  return checked(ImageFormat::Png, width, height, file.path(), limits);
}

void check_png_is_whole(std::string_view bytes, const std::filesystem::path& path) {
  constexpr uint32_t kMaxAncillary = 8U << 20;
  ByteReader file(bytes, path);
  file.take(kPngMagic.size(), "PNG magic");
  while (true) {
    const uint32_t length = big_endian(file.take(4, "PNG chunk length"));
    const std::string_view name = bytes.substr(file.offset(), 4);
    const bool is_ancillary = !name.empty() && (name[0] & 0x20) != 0;
    if (is_ancillary && length > kMaxAncillary) {
      throw LimitError(printable(path) + ": PNG chunk of " + std::to_string(length) +
                       " bytes beside the pixels, allowed are " + std::to_string(kMaxAncillary));
    }
    const std::string_view body = file.take(size_t{length} + 4, "PNG chunk");
    const uint32_t stored = big_endian(file.take(4, "PNG checksum"));
    const auto sum = crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
    if (sum != stored) file.fail(Defect::Truncated, "PNG chunk with a wrong checksum");
    if (name == "IEND") return;
  }
}

[[noreturn]] void refuse_other_content(std::string_view bytes, const std::filesystem::path& path) {
  const auto at = [&](size_t offset, std::string_view magic) {
    return bytes.size() > offset && bytes.substr(offset, magic.size()) == magic;
  };
  const std::string formats = std::string("; ") + std::string(kFormats);
  refuse_foreign_content(path, bytes, "an image");
  if (at(4, "ftypcrx ")) {
    throw BadInput(
        Defect::Unsupported, path, "raw camera file; develop it, " + std::string(kFormats));
  }
  if (at(4, "ftyp")) throw BadInput(Defect::Unsupported, path, "a video" + formats);
  if (at(0, "GIF8")) throw BadInput(Defect::Unsupported, path, "GIF image" + formats);
  if (at(0, "BM")) throw BadInput(Defect::Unsupported, path, "BMP image" + formats);
  if (at(0, "\x76\x2f\x31\x01")) {
    throw BadInput(Defect::Unsupported, path, "OpenEXR image" + formats);
  }
  if (at(0, "ply")) throw BadInput(Defect::Magic, path, "expected an image, found PLY");
  throw BadInput(Defect::Magic, path, "not an image" + formats);
}

}  // namespace

ImageHeader parse_image_header(std::string_view bytes,
                               const std::filesystem::path& path,
                               const ReadLimits& limits) {
  ByteReader file(bytes, path);
  if (bytes.starts_with(kPngMagic)) return parse_png(file, limits);
  if (bytes.starts_with("\xff\xd8")) {
    const JpegFrame frame = find_jpeg_frame(file);
    ImageHeader header = checked(ImageFormat::Jpeg, frame.width, frame.height, path, limits);
    header.inks = frame.components == 4 ? 4 : 0;
    return header;
  }
  if (bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP")) {
    return parse_webp(file, limits);
  }
  if (is_heif(bytes)) {
    const ImageSize size = heif_size(bytes, path);
    return checked(ImageFormat::Heif, uint32_t(size.width), uint32_t(size.height), path, limits);
  }
  const bool is_tiff = bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv) ||
                       bytes.starts_with("II+\0"sv) || bytes.starts_with("MM\0+"sv);
  if (!is_tiff) refuse_other_content(bytes, path);
  if (bytes.substr(0, 10).ends_with("CR")) {
    throw BadInput(
        Defect::Unsupported, path, "raw camera file; develop it, " + std::string(kFormats));
  }
  const TiffDirectory directory(bytes, path);
  ImageHeader header = checked(ImageFormat::Tiff,
                               directory.value(kTiffWidth).value_or(0),
                               directory.value(kTiffHeight).value_or(0),
                               path,
                               limits);
  if (const auto place = directory.place_of_short(kTiffOrientation)) {
    const uint64_t stated = directory.number(*place, 2);
    if (stated >= 1 && stated <= 8) header.orientation = static_cast<int>(stated);
  }
  return header;
}

std::string upright_tiff(std::string_view bytes, const std::filesystem::path& path) {
  const TiffDirectory directory(bytes, path);
  std::string out(bytes);
  if (const auto place = directory.place_of_short(kTiffOrientation)) {
    (void)directory.number(*place, 2);  // refuses what lies past the end
    out[*place] = char(directory.is_big_endian() ? 0 : 1);
    out[*place + 1] = char(directory.is_big_endian() ? 1 : 0);
  }
  return out;
}

void check_image_is_whole(std::string_view bytes,
                          const ImageHeader& header,
                          const std::filesystem::path& path) {
  if (header.format == ImageFormat::Png) check_png_is_whole(bytes, path);
  if (header.format == ImageFormat::Tiff) check_tiff_is_whole(bytes, path);
  if (header.format == ImageFormat::WebP) check_webp_is_whole(bytes, path);
}

}  // namespace cgs
