// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "io/images/image.h"

namespace cgs {

/// What a photograph says about the lens that took it.
struct LensHint {
  std::string camera;  ///< Maker and model, as printable text; empty = not said.
  double focal = 0;    ///< [pixels of the stored image]; 0 = not said.
  double sigma = 0;    ///< Relative standard deviation of `focal`.
  double marked = 0;   ///< Focal length as the lens is marked [mm]; 0 = not said.
  double zoom = 1;     ///< Digital zoom; `focal` is 0 where the camera used it.
};

/// Reads the Exif part of an image, as exif_part() finds it: focal length from the resolution of
/// the focal plane, else, or where that contradicts it, from the focal length as on 35 mm film.
/// What is damaged or absurd counts as not said, and so does any focal length with digital zoom:
/// programs differ in whether they include it.
///
/// The film equivalent compares diagonals and is rounded to whole millimetres. Where the picture
/// has another shape than the usual sensors (3:2 and 4:3) it was cut, and sigma is larger.
/// \param size  of the stored image
/// \throws BadInput as read_file_start()
/// Source: CIPA DC-008 (Exif 2.32) 4.6.5; CIPA DCG-001, "equivalent focal length".
LensHint lens_hint(const std::filesystem::path& path, const ImageSize& size);

/// How a photograph lies in its file, as the Exif tag counts: 1 upright, 2 mirrored, 3 upside down,
/// 4 mirrored and upside down, 5 to 8 with rows and columns exchanged (6 and 8 as phones store
/// pictures held upright). 1 for what says nothing valid, and for what is neither JPEG nor
/// TIFF: HEIC and AVIF were turned by their decoder, and of PNG and WebP most programs turn none.
/// \throws BadInput as read_file_start(); of a TIFF as parse_image_header()
/// Source: CIPA DC-008 (Exif 2.32) 4.6.4, Orientation; TIFF 6.0 section 8.
int exif_orientation(const std::filesystem::path& path);

}  // namespace cgs
