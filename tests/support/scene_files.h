// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstdio>

#include <gtest/gtest.h>
#include <zlib.h>
// jpeglib.h needs FILE declared before it.
#include <cstring>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include <jpeglib.h>

#include "libcgs/core/error.h"

namespace cgs::test {

/// Name of the defect an action is refused for: "LIMIT" for LimitError, "" if nothing is refused.
inline std::string defect_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const BadInput& error) {
    return std::string(defect_name(error.defect()));
  } catch (const LimitError&) {
    return "LIMIT";
  }
  return "";
}

/// The message of whatever an action throws.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// Little-endian bytes of numbers one after the other.
template <typename... T>
std::string packed(const T&... values) {
  std::string out;
  const auto append = [&](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  (append(values), ...);
  return out;
}

inline std::string big_endian(uint32_t value) {
  return {static_cast<char>(value >> 24),
          static_cast<char>(value >> 16 & 0xFF),
          static_cast<char>(value >> 8 & 0xFF),
          static_cast<char>(value & 0xFF)};
}

inline std::string png_chunk(const std::string& name, const std::string& data) {
  const std::string body = name + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()));
  return big_endian(uint32_t(data.size())) + body + big_endian(uint32_t(sum));
}

inline std::string deflated(const std::string& data) {
  std::string out(compressBound(data.size()), '\0');
  uLongf size = out.size();
  compress(reinterpret_cast<Bytef*>(out.data()),
           &size,
           reinterpret_cast<const Bytef*>(data.data()),
           data.size());
  out.resize(size);
  return out;
}

/// What the PNG specification calls the header: colour types are grey 0, RGB 2, palette 3,
/// grey + alpha 4, RGBA 6.
struct PngKind {
  int color_type = 2;
  int bit_depth = 8;
};

/// A PNG of the given packed rows (big-endian samples), optionally with more chunks before them.
inline std::string png(uint32_t width,
                       const std::vector<std::string>& rows,
                       PngKind kind = {},
                       const std::string& chunks = "") {
  std::string raw;
  for (const std::string& row : rows) raw += '\0' + row;
  const std::string kinds = {char(kind.bit_depth), char(kind.color_type), 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" +
         png_chunk("IHDR", big_endian(width) + big_endian(uint32_t(rows.size())) + kinds) + chunks +
         png_chunk("IDAT", deflated(raw)) + png_chunk("IEND", "");
}

/// An RGB PNG whose pixels differ, also from those of another seed.
inline std::string rgb_png(int width, int height, int seed = 0) {
  std::vector<std::string> rows;
  for (int y = 0; y < height; ++y) {
    std::string row;
    for (int x = 0; x < width; ++x) {
      row += {char(x * 5 + seed), char(y * 7 + 3 * seed), char((x * y) + seed)};
    }
    rows.push_back(row);
  }
  return png(uint32_t(width), rows);
}

/// A JPEG of a smooth ramp; components 1 = grey, 3 = RGB, 4 = CMYK.
inline std::string jpeg(int width, int height, int components = 3) {
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = JDIMENSION(width);
  info.image_height = JDIMENSION(height);
  info.input_components = components;
  info.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 3 ? JCS_RGB : JCS_CMYK;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 95, TRUE);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < height; ++y) {
    std::vector<unsigned char> row;
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < components; ++c) row.push_back((unsigned char)(2 * x + y + 40 * c));
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&info, &pointer, 1);
  }
  jpeg_finish_compress(&info);
  std::string out(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&info);
  std::free(bytes);
  return out;
}

/// A version 1 .npy of any element bytes.
inline std::string npy(const std::string& descr,
                       const std::string& shape,
                       const std::string& data,
                       bool fortran_order = false) {
  std::string header = "{'descr': '" + descr +
                       "', 'fortran_order': " + (fortran_order ? "True" : "False") +
                       ", 'shape': " + shape + ", }";
  header.resize((10 + header.size() + 1 + 63) / 64 * 64 - 11, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + packed(uint16_t(header.size())) + header + data;
}

/// The .npy of rows of doubles.
inline std::string npy_of_rows(const std::vector<std::vector<double>>& rows) {
  std::string data;
  for (const auto& row : rows) {
    for (const double value : row) data += packed(value);
  }
  std::ostringstream shape;
  shape << "(" << rows.size() << ", " << (rows.empty() ? 0 : rows[0].size()) << ")";
  return npy("<f8", shape.str(), data);
}

}  // namespace cgs::test
