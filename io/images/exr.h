// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// Pixels, counted from the first that a file holds.
struct ExrWindow {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
  bool operator==(const ExrWindow&) const = default;
};

/// The content of an OpenEXR file: named 32-bit float channels of one size.
struct ExrImage {
  int width = 0;
  int height = 0;
  /// Name and row-major values, row 0 on top. Files keep channels in the order of their names.
  std::vector<std::pair<std::string, std::vector<float>>> channels;
  std::map<std::string, std::string> text;  ///< String attributes.
  /// The picture that a file was cropped from, or reaches beyond (displayWindow); of a file that
  /// was read.
  ExrWindow display;
  /// The standard attribute worldToCamera, to be multiplied from the left of column vectors:
  /// camera axes +x right, +y up, +z into the scene (left-handed, as OpenEXR defines it).
  std::optional<Eigen::Matrix4f> world_to_camera;

  /// Values of a channel; nullptr if there is none of that name.
  const std::vector<float>* find(const std::string& channel) const;
};

/// Writes a single-part scanline file, 32-bit float, ZIP. Every bit of every value is kept, NaN
/// included.
/// \throws InvalidInput if there is no pixel or no channel, a channel has a wrong size, or two have
///         one name; IoError
/// Source: OpenEXR file layout, openexr.com.
void write_exr(const std::filesystem::path& path, const ExrImage& image);

/// Reads an image of a single part, of a tiled one the finest level; half and unsigned channels
/// become float.
///
/// The header and the table of chunks are checked before the library sees a byte. What its decoders
/// are not proof against (tiles; compression other than NONE, RLE, ZIPS and ZIP) is decoded in a
/// child process.
/// \throws BadInput Magic, Unsupported (deep, multi-part, subsampled channels), Syntax, Truncated,
///         Schema (no channel); LimitError (pixels, size or number of attributes; memory or time of
///         the child process)
ExrImage read_exr(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace cgs
