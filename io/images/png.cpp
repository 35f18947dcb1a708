// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/png.h"

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
// The C libraries' headers must follow <cstdio>.
#include <jpeglib.h>
#include <png.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/lack_of_memory.h"
#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

template <typename T>
void require_size(const Raster<T>& image, int largest) {
  const bool good =
      image.width > 0 && image.height > 0 && image.width <= largest && image.height <= largest;
  require(good,
          "picture sides must be 1 to " + std::to_string(largest) + " pixels",
          std::to_string(image.width) + "x" + std::to_string(image.height));
}

std::string rgb_bytes(const ColorImage& image) {
  std::string bytes;
  bytes.reserve(image.data.size() * 3);
  for (const Eigen::Vector3f& color : image.data) {
    for (const float c : color) bytes += static_cast<char>(color_byte(c));
  }
  return bytes;
}

std::string png_bytes(int width, int height, png_uint_32 format, const std::string& pixels) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string out(size, '\0');
  errno = 0;
  if (png_image_write_to_memory(&image, out.data(), &size, 0, pixels.data(), 0, nullptr) == 0) {
    throw_if_memory_ran_out();
    throw NumericalError(std::string("PNG encoder: ") + image.message);
  }
  out.resize(size);
  return out;
}

/// libjpeg reports errors through a call that must not return.
struct JpegEscape {
  jpeg_error_mgr base = {};
  std::jmp_buf escape = {};
};

void leave_jpeg(j_common_ptr info) {
  std::longjmp(reinterpret_cast<JpegEscape*>(info->err)->escape, 1);  // NOLINT(bugprone-*)
}

/// What goes into the encoder and what comes out; `bytes` is the library's, to be freed.
struct JpegJob {
  const char* rgb = nullptr;
  int width = 0;
  int height = 0;
  int quality = 0;
  unsigned char* bytes = nullptr;
  unsigned long size = 0;  // the type libjpeg wants
};

/// No object with a destructor may live here: an error jumps out. \return false on an error.
bool compress_jpeg(JpegJob& job) {
  jpeg_compress_struct info = {};
  JpegEscape errors;
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = leave_jpeg;
  if (setjmp(errors.escape) != 0) {  // NOLINT(cert-err52-cpp)
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, &job.bytes, &job.size);
  info.image_width = static_cast<JDIMENSION>(job.width);
  info.image_height = static_cast<JDIMENSION>(job.height);
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, job.quality, TRUE);
  info.comp_info[0].h_samp_factor = 1;
  info.comp_info[0].v_samp_factor = 1;
  info.optimize_coding = TRUE;
  jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    const size_t offset = size_t{info.next_scanline} * static_cast<size_t>(job.width) * 3;
    auto* row = const_cast<JSAMPROW>(reinterpret_cast<const JSAMPLE*>(job.rgb + offset));
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

}  // namespace

std::string encode_png(const ColorImage& image) {
  require_size(image, PNG_USER_WIDTH_MAX);
  return png_bytes(image.width, image.height, PNG_FORMAT_RGB, rgb_bytes(image));
}

std::string encode_png(const ColorImage& image, const MaskMap& shown) {
  require_size(image, PNG_USER_WIDTH_MAX);
  require(shown.width == image.width && shown.height == image.height,
          "a picture's mask must be as wide and high as the picture, its width",
          shown.width);
  std::string bytes;
  bytes.reserve(image.data.size() * 4);
  for (size_t i = 0; i < image.data.size(); ++i) {
    for (const float c : image.data[i]) bytes += static_cast<char>(color_byte(c));
    bytes += shown.data[i] != 0 ? '\xff' : '\0';
  }
  return png_bytes(image.width, image.height, PNG_FORMAT_RGBA, bytes);
}

std::string encode_png(const MaskMap& mask) {
  require_size(mask, PNG_USER_WIDTH_MAX);
  std::string grey;
  grey.reserve(mask.data.size());
  for (const uint8_t value : mask.data) grey += value != 0 ? '\xff' : '\0';
  return png_bytes(mask.width, mask.height, PNG_FORMAT_GRAY, grey);
}

std::string encode_jpeg(const ColorImage& image, int quality) {
  require_size(image, JPEG_MAX_DIMENSION);
  require(quality >= 1 && quality <= 100, "JPEG quality must be 1 to 100", quality);
  const std::string rgb = rgb_bytes(image);
  JpegJob job{rgb.data(), image.width, image.height, quality};
  const bool good = compress_jpeg(job);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(job.bytes, &std::free);
  if (!good) throw std::bad_alloc();
  return {reinterpret_cast<const char*>(job.bytes), job.size};
}

void write_png(const std::filesystem::path& path, const ColorImage& image) {
  write_file(path, encode_png(image));
}

void write_png(const std::filesystem::path& path, const MaskMap& mask) {
  write_file(path, encode_png(mask));
}

}  // namespace cgs
