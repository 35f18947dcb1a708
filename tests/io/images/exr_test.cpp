// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exr.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfTiledOutputFile.h>
#include <gtest/gtest.h>
#include <half.h>

#include "io/scenes/depth_file.h"
#include "tests/support/full_disk.h"

namespace cgs::exr_test {
namespace {

ExrImage sample(int width, int height) {
  ExrImage image;
  image.width = width;
  image.height = height;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  for (const char* name : {"B", "G.deep.name", "Z"}) {
    std::vector<float> values(pixels);
    for (size_t i = 0; i < pixels; ++i) values[i] = 0.1f * static_cast<float>(i) - 3;
    image.channels.emplace_back(name, values);
  }
  std::vector<float>& odd = image.channels[2].second;
  odd[0] = std::bit_cast<float>(0x7fc12345u);  // a NaN with a message
  odd[1] = -std::numeric_limits<float>::infinity();
  odd[2] = std::numeric_limits<float>::denorm_min();
  odd[3] = -0.0f;
  image.text = {{"cgs:units", "mm"}, {"note", "two\nlines"}};
  image.world_to_camera = Eigen::Matrix4f::Random();
  return image;
}

TEST(Exr, ComesBackBitForBit) {
  const test::TempDir dir;
  const ExrImage image = sample(37, 21);
  write_exr(dir / "a.exr", image);
  const ExrImage back = read_exr(dir / "a.exr");
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 21);
  ASSERT_EQ(back.channels.size(), 3u);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(back.channels[c].first, image.channels[c].first);
    const auto& a = image.channels[c].second;
    EXPECT_EQ(std::memcmp(a.data(), back.channels[c].second.data(), a.size() * sizeof(float)), 0);
  }
  EXPECT_EQ(back.text.at("cgs:units"), "mm");
  EXPECT_EQ(back.text.at("note"), "two\nlines");
  ASSERT_TRUE(back.world_to_camera.has_value());
  EXPECT_EQ(*back.world_to_camera, *image.world_to_camera);
  ASSERT_NE(back.find("Z"), nullptr);
  EXPECT_EQ(back.find("Y"), nullptr);
}

TEST(Exr, StoresTheCameraForRowVectors) {
  const test::TempDir dir;
  ExrImage image = sample(4, 2);
  Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
  m(0, 3) = 7;  // a translation belongs into the fourth row of the file
  image.world_to_camera = m;
  write_exr(dir / "a.exr", image);
  const std::string bytes = test::read_bytes(dir / "a.exr");
  const std::string key("worldToCamera\0m44f\0\x40\0\0\0", 23);
  const size_t at = bytes.find(key);
  ASSERT_NE(at, std::string::npos);
  float value = 0;
  std::memcpy(&value, bytes.data() + at + key.size() + 12 * sizeof(float), sizeof(float));
  EXPECT_EQ(value, 7.0f);
}

TEST(Exr, GivesEqualBytesForEqualImages) {
  const test::TempDir dir;
  ExrImage image = sample(40, 40);
  write_exr(dir / "a.exr", image);
  write_exr(dir / "b.exr", image);
  EXPECT_EQ(test::read_bytes(dir / "a.exr"), test::read_bytes(dir / "b.exr"));
}

// Writes the channel Z with OpenEXR as it is.
void write_compressed(const std::filesystem::path& path,
                      const ExrImage& image,
                      Imf::Compression method,
                      unsigned tile_width) {
  Imf::Header header(image.width, image.height);
  header.compression() = method;
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  header.insert("note", Imf::StringAttribute("by another program"));
  const std::vector<float>& values = *image.find("Z");
  auto* base = const_cast<char*>(reinterpret_cast<const char*>(values.data()));
  Imf::FrameBuffer buffer;
  buffer.insert("Z", {Imf::FLOAT, base, sizeof(float), sizeof(float) * size_t(image.width)});
  if (tile_width > 0) {
    header.setTileDescription(Imf::TileDescription(tile_width, 8));
    Imf::TiledOutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  } else {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(image.height);
  }
}

ExrImage ramp(int width, int height) {
  ExrImage image = sample(width, height);
  std::vector<float>& values = image.channels[2].second;
  for (size_t i = 0; i < values.size(); ++i) values[i] = 5 + 0.01f * static_cast<float>(i);
  return image;
}

TEST(Exr, ReadsEveryCompressionAndTiles) {
  const test::TempDir dir;
  const ExrImage image = ramp(37, 45);
  const std::vector<float>& expected = *image.find("Z");
  const std::map<Imf::Compression, float> largest_errors = {{Imf::ZIP_COMPRESSION, 0},
                                                            {Imf::PIZ_COMPRESSION, 0},
                                                            {Imf::PXR24_COMPRESSION, 1e-4f},
                                                            {Imf::B44_COMPRESSION, 0},
                                                            {Imf::B44A_COMPRESSION, 0},
                                                            {Imf::DWAA_COMPRESSION, 0},
                                                            {Imf::DWAB_COMPRESSION, 0}};
  for (const auto& [method, largest] : largest_errors) {
    for (const unsigned tile_width : {0u, 16u, 5000u}) {
      SCOPED_TRACE(std::to_string(method) + ", tiles of " + std::to_string(tile_width));
      write_compressed(dir / "a.exr", image, method, tile_width);
      const ExrImage back = read_exr(dir / "a.exr");
      ASSERT_EQ(back.width, 37);
      ASSERT_EQ(back.height, 45);
      EXPECT_EQ(back.text.at("note"), "by another program");
      ASSERT_EQ(back.channels.size(), 1u);
      const std::vector<float>& values = *back.find("Z");
      for (size_t i = 0; i < expected.size(); ++i) {
        ASSERT_LE(std::abs(values[i] - expected[i]), largest * expected[i]);
      }
    }
  }
}

// Colours of 16 bits are what the lossy methods are made for.
// As compositors write what they crop to its content.
TEST(Exr, TellsThePictureItWasCroppedFrom) {
  const test::TempDir dir;
  for (const Imf::Compression method : {Imf::ZIP_COMPRESSION, Imf::DWAA_COMPRESSION}) {
    const Imath::Box2i data({8, 6}, {15, 11});
    Imf::Header header(Imath::Box2i({-2, 0}, {37, 29}), data);
    header.compression() = method;  // the second is decoded in a process of its own
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    std::vector<float> values(8 * 6, 2.5f);
    Imf::FrameBuffer buffer;
    buffer.insert(
        "Z", Imf::Slice::Make(Imf::FLOAT, values.data(), data, sizeof(float), 8 * sizeof(float)));
    {
      Imf::OutputFile file((dir / "a.exr").c_str(), header);
      file.setFrameBuffer(buffer);
      file.writePixels(6);
    }
    const ExrImage image = read_exr(dir / "a.exr");
    EXPECT_EQ(image.width, 8);
    EXPECT_EQ(image.display, (ExrWindow{-10, -6, 40, 30}));
    const Raster<float> depth = read_depth_file(dir / "a.exr").values;
    ASSERT_EQ(depth.width, 40);
    ASSERT_EQ(depth.height, 30);
    EXPECT_EQ(std::count(depth.data.begin(), depth.data.end(), 2.5f), 48);
    EXPECT_EQ(depth(10, 6), 2.5f);
    EXPECT_TRUE(std::isnan(depth(9, 6)));
  }
}

TEST(Exr, ReadsHalvesOfLossyCompression) {
  const test::TempDir dir;
  constexpr int kWidth = 40;
  constexpr int kHeight = 50;
  std::vector<Imath::half> values(kWidth * kHeight);
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = Imath::half(0.5f + 0.4f * std::sin(0.01f * static_cast<float>(i)));
  }
  for (const auto method : {Imf::RLE_COMPRESSION,
                            Imf::ZIPS_COMPRESSION,
                            Imf::B44_COMPRESSION,
                            Imf::B44A_COMPRESSION,
                            Imf::DWAA_COMPRESSION,
                            Imf::DWAB_COMPRESSION}) {
    SCOPED_TRACE(method);
    Imf::Header header(kWidth, kHeight);
    header.compression() = method;
    Imf::FrameBuffer buffer;
    for (const char* name : {"R", "G", "B"}) {
      header.channels().insert(name, Imf::Channel(Imf::HALF));
      auto* base = reinterpret_cast<char*>(values.data());
      buffer.insert(name, {Imf::HALF, base, sizeof(Imath::half), sizeof(Imath::half) * kWidth});
    }
    {
      Imf::OutputFile file((dir / "a.exr").c_str(), header);
      file.setFrameBuffer(buffer);
      file.writePixels(kHeight);
    }
    const ExrImage back = read_exr(dir / "a.exr");
    ASSERT_EQ(back.channels.size(), 3u);
    for (size_t i = 0; i < values.size(); ++i) {
      ASSERT_NEAR((*back.find("G"))[i], static_cast<float>(values[i]), 0.03f) << i;
    }
  }
}

TEST(Exr, RefusesLinesWithoutPixels) {
  const test::TempDir dir;
  write_compressed(dir / "a.exr", ramp(16, 4), Imf::NO_COMPRESSION, 0);
  std::string bytes = test::read_bytes(dir / "a.exr");
  ASSERT_NO_THROW((void)read_exr(dir / "a.exr"));
  const size_t last = bytes.size() - 16 * sizeof(float) - 4;  // the size of the last chunk
  bytes.replace(last, 4, std::string(4, '\0'));
  EXPECT_EQ(test::defect_of(bytes, [](const auto& path) { (void)read_exr(path); }), "SYNTAX");
}

TEST(Exr, RefusesMoreChannelsThanFitIntoMemory) {
  const test::TempDir dir;
  ExrImage even = ramp(64, 64);
  std::fill(even.channels[2].second.begin(), even.channels[2].second.end(), 1.0f);
  write_compressed(dir / "a.exr", even, Imf::PIZ_COMPRESSION, 16);
  ReadLimits limits;
  limits.max_file_bytes = 64 * 64 * sizeof(float);
  EXPECT_NO_THROW((void)read_exr(dir / "a.exr", limits));
  --limits.max_file_bytes;
  EXPECT_THROW((void)read_exr(dir / "a.exr", limits), LimitError);
}

TEST(Exr, RefusesEveryTruncationOfWhatAChildDecodes) {
  const test::TempDir dir;
  write_compressed(dir / "a.exr", ramp(20, 24), Imf::PIZ_COMPRESSION, 0);
  const std::string whole = test::read_bytes(dir / "a.exr");
  for (size_t size = whole.size() - 1; size > 0; size -= std::min(size, whole.size() / 23)) {
    const std::string defect =
        test::defect_of(whole.substr(0, size), [](const auto& path) { (void)read_exr(path); });
    EXPECT_NE(defect, "OK") << size << " of " << whole.size();
  }
}

TEST(Exr, RefusesEveryTruncation) {
  const test::TempDir dir;
  write_exr(dir / "a.exr", sample(5, 20));
  test::expect_every_truncation_is_refused(test::read_bytes(dir / "a.exr"),
                                           [](const auto& path) { (void)read_exr(path); });
}

TEST(Exr, SurvivesEveryFlippedByte) {
  const test::TempDir dir;
  write_exr(dir / "a.exr", sample(5, 20));
  const std::string whole = test::read_bytes(dir / "a.exr");
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ 0xff);
    (void)test::defect_of(bytes, [](const auto& path) {
      const ExrImage image = read_exr(path);
      EXPECT_LE(image.channels.size() * image.channels[0].second.size(), size_t{1} << 28);
    });
  }
}

TEST(Exr, RefusesToWriteNonsense) {
  const test::TempDir dir;
  const auto refused = [&](const auto& damage) {
    ExrImage image = sample(4, 4);
    damage(image);
    EXPECT_THROW(write_exr(dir / "a.exr", image), InvalidInput);
  };
  refused([](ExrImage& i) { i.width = 0; });
  refused([](ExrImage& i) { i.channels.clear(); });
  refused([](ExrImage& i) { i.channels[1].second.pop_back(); });
  refused([](ExrImage& i) { i.channels[1].first = i.channels[0].first; });
  refused([](ExrImage& i) { i.channels[1].first.clear(); });
}

TEST(Exr, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed([](const auto& path) { write_exr(path, sample(40, 40)); });
}

}  // namespace
}  // namespace cgs::exr_test
