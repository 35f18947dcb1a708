// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/jpeg.h"

// jpeglib.h needs FILE declared before it.
#include <cstdio>
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on
#include <csetjmp>
#include <cstddef>
#include <new>

#include "io/bytes/byte_reader.h"

namespace cgs {

namespace {

// What libjpeg calls instead of exit() and fprintf().
struct JpegErrors {
  jpeg_error_mgr base;  // first, so that a pointer to it is a pointer to this
  std::jmp_buf jump;
  char message[JMSG_LENGTH_MAX];
};

void on_jpeg_error(j_common_ptr info) {
  auto* errors = reinterpret_cast<JpegErrors*>(info->err);
  info->err->format_message(info, errors->message);
  std::longjmp(errors->jump, 1);  // NOLINT(cert-err52-cpp): the way out libjpeg documents
}

// Whether a warning tells that coded data is lost. Others are of headers that cameras write oddly,
// such as Samsung's "Se = 0" of sequential scans, and decode as they do everywhere.
bool is_damage(const jpeg_error_mgr& warning) {
  switch (warning.msg_code) {
    case JWRN_ADOBE_XFORM:
    case JWRN_BOGUS_PROGRESSION:
    case JWRN_JFIF_MAJOR:
    case JWRN_NOT_SEQUENTIAL:
      return false;
    case JWRN_EXTRANEOUS_DATA: {
      // Stray bytes between segments, or padding before the end marker (a cut picture would be
      // another warning); but those before a restart marker were to be decoded.
      const int marker = warning.msg_parm.i[1];
      return marker >= JPEG_RST0 && marker <= JPEG_RST0 + 7;
    }
    default:
      return true;
  }
}

void on_jpeg_message(j_common_ptr info, int level) {
  constexpr int kWarning = -1;
  if (level != kWarning || !is_damage(*info->err)) return;
  auto* errors = reinterpret_cast<JpegErrors*>(info->err);
  if (info->err->num_warnings++ == 0) info->err->format_message(info, errors->message);
}

// Decodes into samples, which holds width * height * channels bytes. Only plain data lives in this
// frame, since an error leaves it by longjmp.
// \return false after an error; errors.message says which
bool decode_into(const unsigned char* bytes,
                 unsigned long size,
                 const ImageHeader& header,
                 unsigned char* samples,
                 JpegErrors& errors) {
  jpeg_decompress_struct info;
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = on_jpeg_error;
  errors.base.emit_message = on_jpeg_message;
  errors.message[0] = '\0';
  jpeg_create_decompress(&info);
  if (setjmp(errors.jump) != 0) {  // NOLINT(cert-err52-cpp)
    jpeg_destroy_decompress(&info);
    return false;
  }
  jpeg_mem_src(&info, bytes, size);
  jpeg_read_header(&info, TRUE);
  info.out_color_space = header.inks == 4 ? JCS_CMYK : JCS_RGB;
  jpeg_start_decompress(&info);
  const int channels = header.inks == 4 ? 4 : 3;
  const bool is_as_announced = info.output_width == static_cast<JDIMENSION>(header.width) &&
                               info.output_height == static_cast<JDIMENSION>(header.height) &&
                               info.output_components == channels;
  if (!is_as_announced) {
    std::snprintf(errors.message, sizeof errors.message, "second frame header of another size");
    jpeg_destroy_decompress(&info);
    return false;
  }
  const size_t stride = size_t{info.output_width} * size_t(channels);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = samples + size_t{info.output_scanline} * stride;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);  // reads on to the end marker: a missing one is a warning
  jpeg_destroy_decompress(&info);
  return true;
}

}  // namespace

JpegPixels decode_jpeg(std::string_view bytes,
                       const ImageHeader& header,
                       const std::filesystem::path& path) {
  JpegPixels out;
  out.channels = header.inks == 4 ? 4 : 3;
  out.samples.resize(size_t(out.channels) * size_t(header.width) * size_t(header.height));
  JpegErrors errors = {};
  const bool is_decoded = decode_into(reinterpret_cast<const unsigned char*>(bytes.data()),
                                      bytes.size(),
                                      header,
                                      reinterpret_cast<unsigned char*>(out.samples.data()),
                                      errors);
  if (!is_decoded && errors.base.msg_code == JERR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (!is_decoded) throw BadInput(Defect::Syntax, path, std::string("JPEG: ") + errors.message);
  if (errors.base.num_warnings > 0) {
    throw BadInput(Defect::Truncated,
                   path,
                   std::string("JPEG data is cut or damaged (") + errors.message + ")");
  }
  return out;
}

}  // namespace cgs
