// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/zip.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/scene_files.h"
#include "tests/support/zip_bytes.h"

namespace cgs::zip_test {
namespace {

const std::string kText(5000, 'a');

std::string defect(const std::string& bytes, const std::string& name = "a.txt") {
  try {
    (void)ZipArchive(bytes, "x.sog").read(name, 10'000);
  } catch (const BadInput& error) {
    return std::string(defect_name(error.defect()));
  } catch (const LimitError&) {
    return "LIMIT";
  }
  return "OK";
}

TEST(Zip, ReadsStoredAndDeflatedFiles) {
  for (const uint16_t method : {uint16_t{0}, uint16_t{8}}) {
    const std::string bytes = test::zip_bytes({{"a.txt", kText}, {"b/c.bin", "xyz"}},
                                              {.method = method, .comment = "hi"});
    const ZipArchive archive(bytes, "x.sog");
    EXPECT_EQ(archive.read("a.txt", 5000), kText);
    EXPECT_EQ(archive.read("b/c.bin", 5000), "xyz");
    EXPECT_TRUE(archive.has("b/c.bin"));
    EXPECT_FALSE(archive.has("c.bin"));
  }
}

TEST(Zip, RefusesWhatItCannotTrust) {
  using Files = std::vector<std::pair<std::string, std::string>>;
  const Files files = {{"a.txt", kText}};
  EXPECT_EQ(defect(test::zip_bytes(files)), "OK");
  EXPECT_EQ(defect(test::zip_bytes(files), "b.txt"), "MISSING");
  EXPECT_EQ(defect(test::zip_bytes(files, {.checksum_change = 1})), "MISMATCH");
  EXPECT_EQ(defect(test::zip_bytes(files, {.method = 12})), "UNSUPPORTED");
  EXPECT_EQ(defect(test::zip_bytes(files, {.flags = 1})), "UNSUPPORTED");
  EXPECT_EQ(defect(test::zip_bytes({{"a.txt", kText}, {"a.txt", "b"}})), "SCHEMA");
  EXPECT_EQ(defect(test::zip_bytes({{"a.txt", std::string(20'000, 'a')}})), "LIMIT");
  EXPECT_EQ(defect("PK\x03\x04 and nothing more"), "TRUNCATED");
}

TEST(Zip, ReadsSizesOf64Bits) {
  const std::string bytes =
      test::zip_bytes({{"a.txt", kText}, {"b", "xyz"}}, {.method = 8, .is_64_bits = true});
  const ZipArchive archive(bytes, "x.npz");
  EXPECT_EQ(archive.read("a.txt", 5000), kText);
  EXPECT_EQ(archive.read("b", 5000), "xyz");
  EXPECT_EQ(archive.names(), (std::vector<std::string>{"a.txt", "b"}));
}

TEST(Zip, ReadsTheStartOfAFile) {
  for (const uint16_t method : {uint16_t{0}, uint16_t{8}}) {
    const std::string bytes = test::zip_bytes({{"a", "abcdef"}}, {.method = method});
    const ZipArchive archive(bytes, "x.npz");
    EXPECT_EQ(archive.read_start("a", 4), "abcd");
    EXPECT_EQ(archive.read_start("a", 100), "abcdef");
  }
}

TEST(Zip, RefusesSizesThatLie) {
  for (const bool is_64_bits : {false, true}) {
    for (const uint16_t method : {uint16_t{0}, uint16_t{8}}) {
      for (const int64_t change : {-4990, -1, 1, 3000, 100'000'000}) {
        const test::ZipDamage lie = {
            .method = method, .size_change = change, .is_64_bits = is_64_bits};
        EXPECT_EQ(defect(test::zip_bytes({{"a.txt", kText}}, lie)), "COUNT") << change;
      }
    }
  }
  const test::ZipDamage huge = {.method = 8, .size_change = int64_t{1} << 50, .is_64_bits = true};
  EXPECT_EQ(defect(test::zip_bytes({{"a.txt", kText}}, huge)), "COUNT");
}

TEST(Zip, RefusesWhatUnpacksToTooMuch) {
  const std::string large(size_t{40} << 20, '\0');
  const auto opened = [](const std::string& bytes) {
    return test::defect_of([&] { ZipArchive(bytes, "x.3mf"); });
  };
  // One is within what small archives may unpack to, two are not.
  EXPECT_EQ(opened(test::zip_bytes({{"a", large}}, {.method = 8})), "");
  EXPECT_EQ(opened(test::zip_bytes({{"a", large}, {"b", large}}, {.method = 8})), "LIMIT");
}

// Many entries of one stream would be read as often as there are entries.
TEST(Zip, RefusesFilesThatOverlap) {
  std::string bytes = test::zip_bytes({{"a.txt", kText}, {"b.txt", "xyz"}});
  const size_t second = bytes.rfind("PK\x01\x02");
  for (const size_t field : {20, 24}) {  // sizes packed and unpacked
    bytes.replace(second + field, 4, test::packed(static_cast<uint32_t>(kText.size())));
  }
  bytes.replace(second + 42, 4, std::string(4, '\0'));  // its place
  EXPECT_EQ(defect(bytes), "COUNT");
}

TEST(Zip, RefusesNamesThatLeaveAFolder) {
  for (const char* name : {"../a.txt", "x/../../a", "/etc/a", "..\\a", "C:/a", ""}) {
    EXPECT_EQ(defect(test::zip_bytes({{"a.txt", kText}, {name, "b"}})), "PATH") << name;
  }
  EXPECT_EQ(defect(test::zip_bytes({{"a.txt", kText}, {"b/..c/d..", "b"}})), "OK");
}

TEST(Zip, RefusesEveryTruncation) {
  for (const bool is_64_bits : {false, true}) {
    const std::string whole =
        test::zip_bytes({{"a.txt", kText}}, {.method = 8, .is_64_bits = is_64_bits});
    for (size_t n = 0; n < whole.size(); ++n) {
      EXPECT_NE(defect(whole.substr(0, n)), "OK") << n;
    }
  }
}

}  // namespace
}  // namespace cgs::zip_test
