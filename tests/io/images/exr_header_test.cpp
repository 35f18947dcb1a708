// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exr_header.h"

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "tests/support/full_disk.h"

namespace cgs::exr_header_test {
namespace {

/// A small file made by hand from the specification, with every part open to damage.
struct RawExr {
  uint32_t magic = 0x01312f76;
  uint32_t version = 2;
  uint8_t compression = 0;
  std::array<int32_t, 4> window = {10, 20, 11, 22};  // 2 x 3 pixels
  std::array<int32_t, 2> sampling = {1, 1};
  bool has_channel = true;
  std::string extra;                              // further attributes
  std::vector<int64_t> offset_error = {0, 0, 0};  // added to the table of chunks
  int32_t size_error = 0;

  std::string bytes() const {
    std::string out;
    append_bytes(out, magic);
    append_bytes(out, version);
    std::string channels;
    if (has_channel) {
      channels += std::string("Z\0", 2);
      append_bytes(channels, int32_t{2});  // float
      append_bytes(channels, int32_t{0});
      for (const int32_t s : sampling) append_bytes(channels, s);
    }
    channels += '\0';
    out += attribute("channels", "chlist", channels);
    out += attribute("compression", "compression", std::string(1, static_cast<char>(compression)));
    std::string box;
    for (const int32_t edge : window) append_bytes(box, edge);
    out += attribute("dataWindow", "box2i", box) + extra + '\0';
    const size_t chunks = out.size() + 3 * 8;
    for (size_t i = 0; i < 3; ++i) {
      append_bytes(out, static_cast<int64_t>(chunks + i * 16) + offset_error[i]);
    }
    for (int32_t i = 0; i < 3; ++i) {
      append_bytes(out, 20 + i);
      append_bytes(out, 8 + size_error);
      out += std::string(8, '\0');
    }
    return out;
  }

  static std::string attribute(const std::string& name,
                               const std::string& type,
                               const std::string& value) {
    std::string out = name + '\0' + type + '\0';
    append_bytes(out, static_cast<uint32_t>(value.size()));
    return out + value;
  }
};

std::string defect(const RawExr& file) {
  return test::defect_of(file.bytes(), [](const auto& path) {
    screen_exr(test::read_bytes(path), path, ReadLimits{});
  });
}

TEST(ScreenExr, PassesAPlainImage) { EXPECT_EQ(defect({}), "OK"); }

TEST(ScreenExr, RefusesOtherFilesAndKinds) {
  EXPECT_EQ(defect({.magic = 0x12345678}), "MAGIC");
  EXPECT_EQ(defect({.version = 3}), "MAGIC");
  EXPECT_EQ(defect({.version = 2 | 0x800}), "UNSUPPORTED");
  EXPECT_EQ(defect({.version = 2 | 0x1000}), "UNSUPPORTED");
  EXPECT_EQ(defect({.compression = 10}), "UNSUPPORTED");
  EXPECT_EQ(defect({.compression = 2}), "OK");
}

TEST(ScreenExr, TellsWhatMustNotBeDecodedHere) {
  const auto screening = [](const RawExr& file) {
    return screen_exr(file.bytes(), "a.exr", ReadLimits{});
  };
  EXPECT_TRUE(screening({}).is_harmless);
  EXPECT_TRUE(screening({.compression = 2}).is_harmless);
  for (uint8_t method = 4; method < 10; ++method) {
    EXPECT_FALSE(screening({.compression = method}).is_harmless);
  }
  EXPECT_FALSE(screening({.version = 2 | 0x200}).is_harmless);
}

TEST(ScreenExr, RefusesWindowsThatAreNone) {
  EXPECT_EQ(defect({.window = {0, 0, 999999999, 63}}), "LIMIT");
  EXPECT_EQ(defect({.window = {0, 0, 46340, 46340}}), "LIMIT");
  EXPECT_EQ(defect({.window = {5, 5, 4, 9}}), "SYNTAX");
  EXPECT_EQ(defect({.window = {2000000000, 0, 2000000001, 2}}), "SYNTAX");
  EXPECT_EQ(defect({.window = {-2147483647 - 1, 0, 2147483647, 2}}), "SYNTAX");
}

TEST(ScreenExr, RefusesOddChannels) {
  EXPECT_EQ(defect({.sampling = {2, 1}}), "UNSUPPORTED");
  EXPECT_EQ(defect({.sampling = {1, 0}}), "UNSUPPORTED");
  EXPECT_EQ(defect({.has_channel = false}), "SCHEMA");
}

TEST(ScreenExr, RefusesBadTablesOfChunks) {
  EXPECT_EQ(defect({.offset_error = {0, 1 << 20, 0}}), "TRUNCATED");
  EXPECT_EQ(defect({.offset_error = {0, -100, 0}}), "SYNTAX");
  EXPECT_EQ(defect({.offset_error = {16, 0, 0}}), "SYNTAX");
  EXPECT_EQ(defect({.compression = 2, .size_error = 1}), "TRUNCATED");
  EXPECT_EQ(defect({.size_error = 1}), "SYNTAX");
  EXPECT_EQ(defect({.size_error = -9}), "SYNTAX");
}

TEST(ScreenExr, RefusesBadAttributes) {
  std::string many;
  for (int i = 0; i < 100000; ++i)
    many += RawExr::attribute("a" + std::to_string(i), "int", "1234");
  EXPECT_EQ(defect({.extra = many}), "LIMIT");
  std::string big = std::string("a\0string\0", 9);
  append_bytes(big, int32_t{0x7fffffff});
  EXPECT_EQ(defect({.extra = big}), "LIMIT");
  EXPECT_EQ(defect({.extra = RawExr::attribute("multiView", "stringvector", "")}), "SYNTAX");
}

TEST(ScreenExr, RefusesEveryTruncation) {
  test::expect_every_truncation_is_refused(RawExr{}.bytes(), [](const auto& path) {
    screen_exr(test::read_bytes(path), path, ReadLimits{});
  });
}

}  // namespace
}  // namespace cgs::exr_header_test
