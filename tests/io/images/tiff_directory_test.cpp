// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff_directory.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::tiff_directory_test {
namespace {

const std::filesystem::path kPath = "a.tif";

constexpr uint16_t kText = 2;
constexpr uint16_t kShort = 3;
constexpr uint16_t kLong = 4;
constexpr uint16_t kUnknown = 14;
constexpr uint16_t kLong8 = 16;

/// An entry of a directory: its one number, or where its values lie.
struct Entry {
  uint16_t tag = 0;
  uint16_t type = kLong;
  uint64_t count = 1;
  uint64_t place = 0;
};

/// A TIFF file of one directory, and bytes after that.
struct TiffBytes {
  bool is_big_endian = false;
  bool is_big_tiff = false;

  std::string number(uint64_t value, size_t width) const {
    std::string out;
    for (size_t i = 0; i < width; ++i) {
      out += static_cast<char>(value >> (8 * (is_big_endian ? width - 1 - i : i)));
    }
    return out;
  }
  size_t wide() const { return is_big_tiff ? 8 : 4; }
  size_t start() const { return is_big_tiff ? 16 : 8; }
  size_t size_of(size_t entries) const {
    return (is_big_tiff ? 8 : 2) + entries * (is_big_tiff ? 20 : 12) + wide();
  }
  std::string head() const {
    const std::string order = is_big_endian ? "MM" : "II";
    return is_big_tiff ? order + number(43, 2) + number(8, 2) + number(0, 2) + number(16, 8)
                       : order + number(42, 2) + number(8, 4);
  }
  std::string directory(const std::vector<Entry>& entries) const {
    std::string out = number(entries.size(), is_big_tiff ? 8 : 2);
    for (const Entry& e : entries) {
      out += number(e.tag, 2) + number(e.type, 2) + number(e.count, wide());
      // A value that is narrower than its field stands at the beginning of that.
      const size_t narrow = e.type == kShort ? 2 : 4;
      const size_t width = e.count == 1 && e.type != kLong8 ? narrow : wide();
      out += number(e.place, width) + std::string(wide() - width, '\0');
    }
    return out + number(0, wide());
  }
  std::string file(const std::vector<Entry>& entries) const { return head() + directory(entries); }
};

const std::vector<TiffBytes> kKinds = {{false, false}, {true, false}, {false, true}, {true, true}};

std::string defect(const std::string& bytes, const std::function<void(const TiffDirectory&)>& act) {
  try {
    act(TiffDirectory(bytes, kPath));
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("a.tif"), std::string::npos) << error.what();
    return std::string(defect_name(error.defect()));
  }
  return "OK";
}

TEST(TiffDirectory, ReadsValuesInAndBesideTheEntryInAnyByteOrderAndWidth) {
  for (const TiffBytes& kind : kKinds) {
    const size_t beside = kind.start() + kind.size_of(3);
    std::string bytes =
        kind.file({{256, kShort, 1, 1920}, {257, kLong, 1, 70'000}, {273, kLong, 3, beside}});
    for (const uint64_t value : {11UL, 22UL, 4'000'000'000UL}) bytes += kind.number(value, 4);
    const TiffDirectory directory(bytes, kPath);
    EXPECT_EQ(directory.is_big_endian(), kind.is_big_endian);
    EXPECT_EQ(directory.value(256), 1920u);
    EXPECT_EQ(directory.value(257), 70'000u);
    EXPECT_EQ(directory.values(273), (std::vector<uint64_t>{11, 22, 4'000'000'000}));
    EXPECT_EQ(directory.field(273)->bytes.size(), 12u);
    EXPECT_TRUE(directory.values(1).empty());
    EXPECT_FALSE(directory.value(1));
    EXPECT_FALSE(directory.field(1));
  }
}

TEST(TiffDirectory, FollowsATagToAnotherDirectory) {
  for (const TiffBytes& kind : kKinds) {
    const size_t other = kind.start() + kind.size_of(2);
    const std::string bytes = kind.file({{0x8769, kLong, 1, other},
                                         {0x014a, kind.is_big_tiff ? kLong8 : kLong, 1, other}}) +
                              kind.directory({{0xa405, kShort, 1, 28}});
    const TiffDirectory first(bytes, kPath);
    for (const uint64_t tag : {0x8769, 0x014a}) {
      ASSERT_TRUE(first.directory(tag));
      EXPECT_EQ(first.directory(tag)->value(0xa405), 28u);
    }
    EXPECT_FALSE(first.value(0xa405));
    EXPECT_FALSE(first.directory(0x8825));
  }
}

// Whoever turns a picture upright writes there.
TEST(TiffDirectory, TellsWhereAShortLiesAndNothingOfOtherTypes) {
  for (const TiffBytes& kind : kKinds) {
    std::string bytes =
        kind.file({{273, kLong, 1, 6}, {274, kShort, 1, 6}, {258, kShort, 3, kind.start()}});
    const TiffDirectory directory(bytes, kPath);
    const auto place = directory.place_of_short(274);
    ASSERT_TRUE(place);
    EXPECT_EQ(directory.number(*place, 2), 6u);
    EXPECT_FALSE(directory.place_of_short(273));
    EXPECT_FALSE(directory.place_of_short(258)) << "three values do not lie in the entry";
    EXPECT_FALSE(directory.place_of_short(1));
  }
}

TEST(TiffDirectory, HasNoFieldOfAnUnknownTypeAndNoNumberOfAText) {
  for (const TiffBytes& kind : kKinds) {
    const std::string bytes = kind.file({{256, kUnknown, 1, 0}, {271, kText, 4, 0}});
    EXPECT_FALSE(TiffDirectory(bytes, kPath).field(256));
    EXPECT_EQ(TiffDirectory(bytes, kPath).field(271)->bytes.size(), 4u);
    for (const uint64_t tag : {256UL, 271UL}) {
      EXPECT_EQ(defect(bytes, [&](const auto& d) { (void)d.values(tag); }), "SYNTAX") << tag;
    }
  }
}

TEST(TiffDirectory, ReadsNothingBeyondTheFile) {
  const auto read = [](const TiffDirectory& d) { (void)d.values(273); };
  constexpr uint64_t kFar = UINT32_MAX - 1;
  for (const TiffBytes& kind : kKinds) {
    const uint64_t farthest = kind.is_big_tiff ? UINT64_MAX - 1 : kFar;
    EXPECT_EQ(defect(kind.file({{273, kLong, 3, farthest}}), read), "TRUNCATED");
    EXPECT_EQ(defect(kind.file({{273, kLong, farthest, 8}}), read), "COUNT");
    const std::string end = kind.file({{273, kLong, 3, kind.start() + kind.size_of(1)}});
    EXPECT_EQ(defect(end + std::string(11, '\0'), read), "TRUNCATED");
    EXPECT_EQ(defect(end + std::string(12, '\0'), read), "OK");
    const std::string head = kind.head();
    const size_t width = kind.is_big_tiff ? 8 : 2;
    EXPECT_EQ(defect(head + kind.number(4097, width), read), "COUNT");
    EXPECT_EQ(defect(head + kind.number(1, width), read), "TRUNCATED");
    EXPECT_EQ(defect(head.substr(0, 6), read), "TRUNCATED");
    const auto follow = [](const TiffDirectory& d) { (void)d.directory(273); };
    EXPECT_EQ(defect(kind.file({{273, kind.is_big_tiff ? kLong8 : kLong, 1, farthest}}), follow),
              "TRUNCATED");
  }
}

}  // namespace
}  // namespace cgs::tiff_directory_test
