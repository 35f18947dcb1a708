// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <libheif/heif.h>

#include "libcgs/core/raster.h"

namespace cgs::test {

/// How a HEIC or AVIF file is written.
struct HeifKind {
  heif_compression_format codec = heif_compression_HEVC;
  heif_orientation orientation = heif_orientation_normal;  ///< How it is to be turned when shown.
  std::string exif;                                        ///< From the TIFF header on; or empty.
  std::string profile;                                     ///< ICC; or empty.
  bool has_alpha = false;                                  ///< The left half is transparent.
};

/// A picture as such a file, of the best quality that is not lossless.
inline std::string heif(const ColorImage& picture, const HeifKind& kind = {}) {
  const auto ok = [](const heif_error& error) {
    EXPECT_EQ(error.code, heif_error_Ok) << error.message;
  };
  heif_image* image = nullptr;
  const int channels = kind.has_alpha ? 4 : 3;
  ok(heif_image_create(picture.width,
                       picture.height,
                       heif_colorspace_RGB,
                       kind.has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB,
                       &image));
  ok(heif_image_add_plane(
      image, heif_channel_interleaved, picture.width, picture.height, 8 * channels));
  int stride = 0;
  uint8_t* const rows = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        rows[y * stride + channels * x + c] =
            static_cast<uint8_t>(std::lround(255 * picture(x, y)[c]));
      }
      if (kind.has_alpha) rows[y * stride + channels * x + 3] = 2 * x < picture.width ? 0 : 255;
    }
  }
  if (!kind.profile.empty()) {
    ok(heif_image_set_raw_color_profile(image, "prof", kind.profile.data(), kind.profile.size()));
  }
  heif_context* const context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  ok(heif_context_get_encoder_for_format(context, kind.codec, &encoder));
  ok(heif_encoder_set_lossy_quality(encoder, 95));
  heif_encoding_options* const options = heif_encoding_options_alloc();
  options->image_orientation = kind.orientation;
  heif_image_handle* handle = nullptr;
  ok(heif_context_encode_image(context, image, encoder, options, &handle));
  if (!kind.exif.empty()) {
    ok(heif_context_add_exif_metadata(
        context, handle, kind.exif.data(), static_cast<int>(kind.exif.size())));
  }
  std::string out;
  heif_writer writer{};
  writer.writer_api_version = 1;
  writer.write = [](heif_context*, const void* data, size_t size, void* to) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), size);
    return heif_error{heif_error_Ok, heif_suberror_Unspecified, ""};
  };
  ok(heif_context_write(context, &writer, &out));
  heif_encoding_options_free(options);
  heif_image_handle_release(handle);
  heif_encoder_release(encoder);
  heif_context_free(context);
  heif_image_release(image);
  return out;
}

}  // namespace cgs::test
