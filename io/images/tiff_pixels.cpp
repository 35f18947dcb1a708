// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff_pixels.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <string>

#include <half.h>
#include <tiffio.h>

#include "io/bytes/byte_reader.h"
#include "io/bytes/lack_of_memory.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

// A file in memory as libtiff reads it, and what it complained of first.
struct TiffMemory {
  std::string_view bytes;
  uint64_t at = 0;
  std::string complaint;
};

tmsize_t read_memory(thandle_t handle, void* out, tmsize_t size) {
  auto* memory = static_cast<TiffMemory*>(handle);
  const uint64_t rest = memory->at < memory->bytes.size() ? memory->bytes.size() - memory->at : 0;
  const uint64_t count = std::min<uint64_t>(rest, size > 0 ? uint64_t(size) : 0);
  if (count > 0) std::memcpy(out, memory->bytes.data() + memory->at, count);
  memory->at += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t refuse_to_write(thandle_t, void*, tmsize_t) { return 0; }

toff_t seek_memory(thandle_t handle, toff_t offset, int whence) {
  auto* memory = static_cast<TiffMemory*>(handle);
  const uint64_t from = whence == SEEK_SET   ? 0
                        : whence == SEEK_CUR ? memory->at
                                             : memory->bytes.size();
  memory->at = from + offset;
  return memory->at;
}

int close_memory(thandle_t) { return 0; }
toff_t size_of_memory(thandle_t handle) { return static_cast<TiffMemory*>(handle)->bytes.size(); }

int map_memory(thandle_t handle, void** base, toff_t* size) {
  auto* memory = static_cast<TiffMemory*>(handle);
  *base = const_cast<char*>(memory->bytes.data());  // NOLINT: libtiff does not write to it
  *size = memory->bytes.size();
  return 1;
}
void unmap_memory(thandle_t, void*, toff_t) {}

int keep_complaint(TIFF*, void* user, const char*, const char* format, va_list arguments) {
  auto* memory = static_cast<TiffMemory*>(user);
  if (!memory->complaint.empty()) return 1;
  std::array<char, 300> text = {};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  memory->complaint = one_line(text.data());
  return 1;
}
int ignore_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

template <typename T>
T field_or(TIFF* file, uint32_t tag, T fallback) {
  T value = fallback;
  return TIFFGetFieldDefaulted(file, tag, &value) == 1 ? value : fallback;
}

// Samples of a row that are not whole bytes: from the highest bit on.
void unpack_bits(const uint8_t* row, int bits, size_t count, float* out, size_t stride) {
  uint64_t window = 0;
  int held = 0;
  const uint64_t mask = (uint64_t{1} << bits) - 1;
  for (size_t i = 0; i < count; ++i) {
    while (held < bits) {
      window = window << 8 | *row++;
      held += 8;
    }
    held -= bits;
    out[i * stride] = static_cast<float>(window >> held & mask);
  }
}

template <typename T>
void unpack_as(const uint8_t* row, size_t count, float* out, size_t stride) {
  for (size_t i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, row + i * sizeof value, sizeof value);
    out[i * stride] = static_cast<float>(value);
  }
}

void unpack_half(const uint8_t* row, size_t count, float* out, size_t stride) {
  for (size_t i = 0; i < count; ++i) {
    uint16_t bits = 0;
    std::memcpy(&bits, row + 2 * i, sizeof bits);
    half value;
    value.setBits(bits);
    out[i * stride] = static_cast<float>(value);
  }
}

// One sign bit, seven bits of exponent with bias 63, sixteen of mantissa.
void unpack_float24(const uint8_t* row, size_t count, float* out, size_t stride) {
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* p = row + 3 * i;
    const uint32_t bits = uint32_t{p[0]} | uint32_t{p[1]} << 8 | uint32_t{p[2]} << 16;
    const int exponent = static_cast<int>(bits >> 16 & 0x7F);
    const auto mantissa = static_cast<float>(bits & 0xFFFF) / 65536.0f;
    float value =
        exponent == 0 ? std::ldexp(mantissa, -62) : std::ldexp(1 + mantissa, exponent - 63);
    if (exponent == 0x7F) value = mantissa == 0 ? INFINITY : NAN;
    out[i * stride] = (bits >> 23 & 1) != 0 ? -value : value;
  }
}

void unpack(const TiffForm& form, const uint8_t* row, size_t count, float* out, size_t stride) {
  if (form.is_float) {
    if (form.bits == 16) unpack_half(row, count, out, stride);
    if (form.bits == 24) unpack_float24(row, count, out, stride);
    if (form.bits == 32) unpack_as<float>(row, count, out, stride);
    if (form.bits == 64) unpack_as<double>(row, count, out, stride);
  } else if (form.bits == 8) {
    unpack_as<uint8_t>(row, count, out, stride);
  } else if (form.bits == 16) {
    unpack_as<uint16_t>(row, count, out, stride);
  } else if (form.bits == 32) {
    unpack_as<uint32_t>(row, count, out, stride);
  } else {
    unpack_bits(row, form.bits, count, out, stride);
  }
}

}  // namespace

double TiffForm::full() const {
  return is_float ? 1 : static_cast<double>((uint64_t{1} << bits) - 1);
}

int TiffForm::color_channels() const {
  return kind == Kind::Rgb || kind == Kind::Lab ? 3 : kind == Kind::Inks ? 4 : 1;
}

// The open file, and what is told of its layout.
struct TiffPixels::Handle {
  struct Close {
    void operator()(TIFF* file) const { TIFFClose(file); }
  };

  // Strips or tiles, of which each holds one or all channels of its pixels.
  struct Blocks {
    bool are_tiles = false;
    uint32_t width = 0;
    uint32_t height = 0;
    int planes = 1;
    uint64_t row_bytes = 0;
  };

  Handle(std::string_view bytes, const ImageHeader& size, const std::filesystem::path& place)
      : memory{bytes, 0, {}}, header(size), path(place) {}

  [[noreturn]] void refuse(Defect defect, const std::string& reason) const {
    throw_if_memory_ran_out();
    throw BadInput(
        defect, path, memory.complaint.empty() ? reason : reason + " (" + memory.complaint + ")");
  }

  void open();
  bool read_kind(TiffForm& form);
  void read_samples_of(TiffForm& form) const;
  void read_palette(TiffForm& form) const;
  Blocks blocks(const TiffForm& form) const;
  void read_block(const Blocks& blocks,
                  uint32_t x,
                  uint32_t y,
                  uint32_t rows,
                  std::vector<std::unique_ptr<uint8_t[]>>& planes) const;

  TiffMemory memory;
  ImageHeader header;
  std::filesystem::path path;
  std::unique_ptr<TIFF, Close> file;
};

void TiffPixels::Handle::open() {
  constexpr tmsize_t kTables = tmsize_t{256} << 20;
  const auto pixels = tmsize_t(header.width) * tmsize_t(header.height);
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(
      TIFFOpenOptionsAlloc(), &TIFFOpenOptionsFree);
  if (!options) throw std::bad_alloc();
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kTables + 32 * pixels);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_complaint, &memory);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
  errno = 0;
  file.reset(TIFFClientOpenExt("image",
                               "r",
                               &memory,
                               read_memory,
                               refuse_to_write,
                               seek_memory,
                               close_memory,
                               size_of_memory,
                               map_memory,
                               unmap_memory,
                               options.get()));
  if (!file) refuse(Defect::Syntax, "the image decoder refused the content");
}

// \return false for colours that are not read here
bool TiffPixels::Handle::read_kind(TiffForm& form) {
  uint16_t photometric = 0;
  if (TIFFGetField(file.get(), TIFFTAG_PHOTOMETRIC, &photometric) != 1) return false;
  switch (photometric) {
    case PHOTOMETRIC_MINISWHITE:
      form.kind = TiffForm::Kind::White;
      return true;
    case PHOTOMETRIC_MINISBLACK:
      form.kind = TiffForm::Kind::Grey;
      return true;
    case PHOTOMETRIC_RGB:
      form.kind = TiffForm::Kind::Rgb;
      return true;
    case PHOTOMETRIC_PALETTE:
      form.kind = TiffForm::Kind::Palette;
      return true;
    case PHOTOMETRIC_SEPARATED:
      form.kind = TiffForm::Kind::Inks;
      return field_or<uint16_t>(file.get(), TIFFTAG_INKSET, INKSET_CMYK) == INKSET_CMYK;
    case PHOTOMETRIC_CIELAB: {
      form.kind = TiffForm::Kind::Lab;
      const auto bits = field_or<uint16_t>(file.get(), TIFFTAG_BITSPERSAMPLE, 1);
      return bits == 8 || bits == 16;
    }
    case PHOTOMETRIC_YCBCR:
      form.kind = TiffForm::Kind::Rgb;  // as libjpeg makes it
      return field_or<uint16_t>(file.get(), TIFFTAG_COMPRESSION, 0) == COMPRESSION_JPEG &&
             TIFFSetField(file.get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB) == 1;
    default:
      return false;
  }
}

void TiffPixels::Handle::read_samples_of(TiffForm& form) const {
  constexpr int kMostChannels = 64;
  form.channels = field_or<uint16_t>(file.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
  form.bits = field_or<uint16_t>(file.get(), TIFFTAG_BITSPERSAMPLE, 1);
  const auto format = field_or<uint16_t>(file.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  form.is_float = format == SAMPLEFORMAT_IEEEFP;
  if (form.channels < form.color_channels() || form.channels > kMostChannels) {
    refuse(Defect::Syntax, "TIFF of " + std::to_string(form.channels) + " samples per pixel");
  }
  if (format == SAMPLEFORMAT_INT || (form.is_float && form.kind == TiffForm::Kind::Lab)) {
    refuse(Defect::Unsupported,
           form.is_float ? "floats of CIELab are not read"
                         : "signed whole-number samples are not read");
  }
  const bool is_known =
      form.is_float ? form.bits == 16 || form.bits == 24 || form.bits == 32 || form.bits == 64
                    : format != SAMPLEFORMAT_COMPLEXINT && form.bits >= 1 && form.bits <= 32;
  if (!is_known || format == SAMPLEFORMAT_COMPLEXIEEEFP) {
    refuse(Defect::Unsupported, "TIFF samples of this kind are not read");
  }
  uint16_t count = 0;
  const uint16_t* kinds = nullptr;
  const bool is_told = TIFFGetField(file.get(), TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1;
  for (int i = 0; i < count && form.alpha < 0; ++i) {
    if (kinds[i] == EXTRASAMPLE_UNSPECIFIED) continue;
    form.alpha = form.color_channels() + i;
    form.is_premultiplied = kinds[i] == EXTRASAMPLE_ASSOCALPHA;
  }
  // What older programs write without a word is opacity.
  if (!is_told && form.channels == form.color_channels() + 1) form.alpha = form.channels - 1;
}

void TiffPixels::Handle::read_palette(TiffForm& form) const {
  constexpr int kMostBits = 16;
  std::array<const uint16_t*, 3> columns = {};
  if (form.bits > kMostBits || form.is_float ||
      TIFFGetField(file.get(), TIFFTAG_COLORMAP, &columns[0], &columns[1], &columns[2]) != 1) {
    refuse(Defect::Syntax, "TIFF without the colours of its palette");
  }
  const size_t count = size_t{1} << form.bits;
  uint16_t largest = 0;
  for (const uint16_t* column : columns)
    largest = std::max(largest, *std::max_element(column, column + count));
  const float full = largest < 256 ? 255 : 65535;  // some old programs wrote bytes
  form.palette.resize(count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t c = 0; c < 3; ++c) form.palette[i][c] = float(columns[c][i]) / full;
  }
}

TiffPixels::Handle::Blocks TiffPixels::Handle::blocks(const TiffForm& form) const {
  Blocks out;
  TIFF* const tiff = file.get();
  out.are_tiles = TIFFIsTiled(tiff) != 0;
  if (field_or<uint16_t>(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) ==
      PLANARCONFIG_SEPARATE) {
    out.planes = form.channels;
  }
  if (out.are_tiles) {
    out.width = field_or<uint32_t>(tiff, TIFFTAG_TILEWIDTH, 0);
    out.height = field_or<uint32_t>(tiff, TIFFTAG_TILELENGTH, 0);
    out.row_bytes = TIFFTileRowSize64(tiff);
  } else {
    out.width = uint32_t(header.width);
    out.height = std::min(field_or<uint32_t>(tiff, TIFFTAG_ROWSPERSTRIP, UINT32_MAX),
                          uint32_t(header.height));
    out.row_bytes = TIFFScanlineSize64(tiff);
  }
  const uint64_t samples = uint64_t{out.width} * uint64_t(out.planes == 1 ? form.channels : 1);
  const bool is_sound = out.width > 0 && out.height > 0 &&
                        samples <= UINT64_MAX / uint64_t(form.bits) &&
                        out.row_bytes >= (samples * uint64_t(form.bits) + 7) / 8;
  if (!is_sound) refuse(Defect::Syntax, "the strips or tiles of the TIFF are of no size");
  constexpr uint64_t kAnyway = uint64_t{64} << 20;
  const uint64_t most =
      kAnyway + 16 * uint64_t(form.channels) * uint64_t(header.width) * uint64_t(header.height);
  if (out.row_bytes > most / out.height / uint64_t(out.planes)) {
    throw LimitError(printable(path) + ": tiles of " + std::to_string(out.width) + " x " +
                     std::to_string(out.height) + " pixels are far larger than the picture");
  }
  return out;
}

void TiffPixels::Handle::read_block(const Blocks& blocks,
                                    uint32_t x,
                                    uint32_t y,
                                    uint32_t rows,
                                    std::vector<std::unique_ptr<uint8_t[]>>& planes) const {
  for (size_t p = 0; p < planes.size(); ++p) {
    const auto plane = static_cast<uint16_t>(p);
    auto& bytes = planes[p];
    const auto wanted = static_cast<tmsize_t>(blocks.row_bytes * rows);
    const tmsize_t got =
        blocks.are_tiles
            ? TIFFReadEncodedTile(
                  file.get(), TIFFComputeTile(file.get(), x, y, 0, plane), bytes.get(), wanted)
            : TIFFReadEncodedStrip(
                  file.get(), TIFFComputeStrip(file.get(), y, plane), bytes.get(), wanted);
    if (got < wanted) refuse(Defect::Truncated, "the pixels are cut or damaged");
  }
}

TiffPixels::TiffPixels(std::string_view bytes,
                       const ImageHeader& header,
                       const std::filesystem::path& path)
    : handle_(std::make_unique<Handle>(bytes, header, path)) {
  handle_->open();
  const auto width = field_or<uint32_t>(handle_->file.get(), TIFFTAG_IMAGEWIDTH, 0);
  const auto height = field_or<uint32_t>(handle_->file.get(), TIFFTAG_IMAGELENGTH, 0);
  if (width != uint32_t(header.width) || height != uint32_t(header.height)) {
    handle_->refuse(Defect::Syntax, "the decoded image is not what its header announces");
  }
  is_read_ = handle_->read_kind(form_);
  if (!is_read_) return;
  handle_->read_samples_of(form_);
  if (form_.kind == TiffForm::Kind::Palette) handle_->read_palette(form_);
}

TiffPixels::~TiffPixels() = default;

void TiffPixels::read(const TakeRow& take) const {
  const Handle::Blocks blocks = handle_->blocks(form_);
  const auto width = uint32_t(handle_->header.width);
  const auto height = uint32_t(handle_->header.height);
  // Unwritten memory is only address space, until a file turns out to hold what it promises.
  std::vector<std::unique_ptr<uint8_t[]>> planes(size_t(blocks.planes));
  for (auto& plane : planes) {
    plane = std::make_unique_for_overwrite<uint8_t[]>(blocks.row_bytes * blocks.height);
  }
  std::vector<float> samples(size_t{std::min(blocks.width, width)} * size_t(form_.channels));
  errno = 0;
  for (uint32_t y = 0; y < height; y += blocks.height) {
    const uint32_t rows = std::min(blocks.height, height - y);
    for (uint32_t x = 0; x < width; x += blocks.width) {
      handle_->read_block(blocks, x, y, blocks.are_tiles ? blocks.height : rows, planes);
      const size_t shown = std::min(blocks.width, width - x);
      for (uint32_t r = 0; r < rows; ++r) {
        for (size_t p = 0; p < planes.size(); ++p) {
          const uint8_t* row = planes[p].get() + blocks.row_bytes * r;
          const bool is_alone = planes.size() > 1;
          unpack(form_,
                 row,
                 is_alone ? shown : shown * size_t(form_.channels),
                 samples.data() + p,
                 is_alone ? size_t(form_.channels) : 1);
        }
        take(int(x), int(y + r), std::span(samples).first(shown * size_t(form_.channels)));
      }
      if (width - x <= blocks.width) break;  // x must not wrap
    }
    if (height - y <= blocks.height) break;
  }
}

}  // namespace cgs
