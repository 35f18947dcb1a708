// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "io/images/image_header.h"

namespace cgs {

/// What the samples of a TIFF file mean.
struct TiffForm {
  enum class Kind : uint8_t { Grey, White, Rgb, Palette, Inks, Lab };  // White: 0 is white
  Kind kind = Kind::Grey;
  int channels = 1;               ///< Samples of a pixel, those beside its colour included.
  int alpha = -1;                 ///< Which of them is opacity; -1: none.
  bool is_premultiplied = false;  ///< Colours are multiplied by it.
  int bits = 8;                   ///< Of a sample.
  bool is_float = false;
  /// Colours of a palette in [0, 1], by the value of the sample.
  std::vector<std::array<float, 3>> palette;

  /// The value of a whole number that means 1.
  double full() const;
  int color_channels() const;
};

/// The pixels of the first page of a TIFF file, in strips or tiles, of whole numbers of 1 to 32
/// bits or floats of 16 to 64, interleaved or in planes, with whatever compression libtiff knows.
/// Source: TIFF 6.0; Adobe Photoshop TIFF technical notes 3 (floats); BigTIFF (AWare Systems).
class TiffPixels {
 public:
  /// \param header  of these bytes, which must outlive this
  /// \throws BadInput Syntax for what libtiff refuses, Unsupported (signed samples); LimitError
  TiffPixels(std::string_view bytes, const ImageHeader& header, const std::filesystem::path& path);
  ~TiffPixels();
  TiffPixels(const TiffPixels&) = delete;
  TiffPixels& operator=(const TiffPixels&) = delete;

  /// False for colours that are coded in another way, as ICCLab or LogLuv: read() must not be
  /// called then, and `form` says nothing.
  bool is_read() const { return is_read_; }
  const TiffForm& form() const { return form_; }

  /// Gets part of a row as stored: place (x, y) of its first pixel, and all samples of its pixels.
  using TakeRow = std::function<void(int x, int y, std::span<const float> samples)>;
  /// Calls `take` for all pixels, in the order of the file.
  /// \throws BadInput Truncated for damaged data; LimitError for tiles far larger than the picture
  void read(const TakeRow& take) const;

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
  TiffForm form_;
  bool is_read_ = false;
};

}  // namespace cgs
