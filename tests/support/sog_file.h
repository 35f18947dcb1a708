// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <webp/encode.h>

#include "tests/support/temp_dir.h"
#include "tests/support/zip_bytes.h"

namespace cgs::test {

using SogPixel = std::array<uint8_t, 4>;

inline std::string webp(const std::vector<SogPixel>& pixels, int width) {
  uint8_t* bytes = nullptr;
  WebPConfig config;
  WebPPicture picture;
  WebPConfigInit(&config);
  WebPPictureInit(&picture);
  config.lossless = 1;
  config.exact = 1;  // colours of transparent pixels are data here
  picture.use_argb = 1;
  picture.width = width;
  picture.height = static_cast<int>(pixels.size()) / width;
  WebPPictureImportRGBA(&picture, pixels[0].data(), 4 * width);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  EXPECT_NE(WebPEncode(&config, &picture), 0);
  bytes = writer.mem;
  std::string out(reinterpret_cast<const char*>(bytes), writer.size);
  WebPPictureFree(&picture);
  WebPMemoryWriterClear(&writer);
  return out;
}

/// Two splats in images of 2 x 1 pixels.
struct SogFile {
  std::vector<SogPixel> low = {SogPixel{0, 255, 52, 255}, SogPixel{255, 0, 0, 255}};
  std::vector<SogPixel> high = {SogPixel{0, 255, 18, 255}, SogPixel{255, 0, 128, 255}};
  std::vector<SogPixel> rotation = {SogPixel{255, 128, 128, 252}, SogPixel{128, 128, 128, 254}};
  std::vector<SogPixel> scale = {SogPixel{0, 1, 255, 255}, SogPixel{3, 3, 3, 255}};
  std::vector<SogPixel> color = {SogPixel{10, 20, 30, 51}, SogPixel{40, 50, 60, 0}};
  std::vector<SogPixel> labels = {SogPixel{1, 0, 0, 255}, SogPixel{0, 0, 0, 255}};
  nlohmann::json meta = {{"version", 2},
                         {"count", 2},
                         {"means",
                          {{"mins", {-1.0, -2.0, 0.0}},
                           {"maxs", {1.0, 0.5, 2.0}},
                           {"files", {"low.webp", "high.webp"}}}},
                         {"quats", {{"files", {"quats.webp"}}}},
                         {"scales", {{"files", {"scales.webp"}}}},
                         {"sh0", {{"files", {"sh0.webp"}}}}};

  SogFile() {
    for (int i = 0; i < 256; ++i) meta["scales"]["codebook"].push_back(-0.03125 * i);
    for (int i = 0; i < 256; ++i) meta["sh0"]["codebook"].push_back(0.015625 * i - 2);
  }
  void add_harmonics() {
    meta["shN"] = {{"count", 2}, {"bands", 1}, {"files", {"palette.webp", "labels.webp"}}};
    for (int i = 0; i < 256; ++i) meta["shN"]["codebook"].push_back(0.0078125 * i);
  }
  /// meta.json and its images, by their names.
  std::vector<std::pair<std::string, std::string>> files() const {
    std::vector<SogPixel> palette(64 * 3, SogPixel{0, 0, 0, 255});
    palette[3] = {1, 2, 3, 255};  // of the second entry
    palette[5] = {7, 8, 9, 255};
    return {{"meta.json", meta.dump()},
            {"low.webp", webp(low, static_cast<int>(low.size()))},
            {"high.webp", webp(high, 2)},
            {"quats.webp", webp(rotation, 2)},
            {"scales.webp", webp(scale, 2)},
            {"sh0.webp", webp(color, 2)},
            {"palette.webp", webp(palette, 64 * 3)},
            {"labels.webp", webp(labels, 2)}};
  }
  std::string bytes() const { return zip_bytes(files()); }
  /// The same unpacked, as programs that serve it from the web have it.
  void unpack(const std::filesystem::path& folder) const {
    for (const auto& [name, content] : files()) write_bytes(folder / name, content);
  }
};

}  // namespace cgs::test
