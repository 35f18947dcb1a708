// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/rows.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "tests/support/full_disk.h"

namespace cgs::ply_rows_test {
namespace {

struct Seen {
  std::vector<std::vector<double>> rows;
  std::vector<std::vector<double>> lists;
  uint64_t trailing = 0;
};

Seen read(const std::string& bytes) {
  Seen seen;
  const PlyHeader header = parse_ply_header(bytes, "bad.bin");
  seen.trailing =
      read_ply_rows(bytes, "bad.bin", header, [&](const PlyElement&, uint64_t, const PlyRow& row) {
        seen.rows.push_back(row.values);
        for (const auto& list : row.lists) {
          if (!list.empty()) seen.lists.push_back(list);
        }
      });
  return seen;
}

std::string defect(const std::string& bytes) {
  return test::defect_of(bytes, [](const auto& path) { (void)read(test::read_bytes(path)); });
}

std::string header(const std::string& format, const std::string& count) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + count +
         "\nproperty float x\nproperty short s\nproperty list uchar int l\nend_header\n";
}

/// One record; `swap` turns every number around.
std::string record(float x, int16_t s, const std::vector<int32_t>& list, bool swap) {
  std::string out;
  const auto add = [&](auto value) {
    std::string bytes;
    append_bytes(bytes, value);
    if (swap) std::reverse(bytes.begin(), bytes.end());
    out += bytes;
  };
  add(x);
  add(s);
  add(static_cast<uint8_t>(list.size()));
  for (const int32_t entry : list) add(entry);
  return out;
}

TEST(ReadPlyRows, AllThreeFormatsAgree) {
  const std::string little = header("binary_little_endian", "2") +
                             record(1.5f, -2, {7, -8, 9}, false) + record(-0.25f, 300, {}, false);
  const std::string big = header("binary_big_endian", "2") + record(1.5f, -2, {7, -8, 9}, true) +
                          record(-0.25f, 300, {}, true);
  const std::string ascii = header("ascii", "2") + "1.5 -2 3 7 -8 9\r\n\n  -0.25\t300 0\n";
  const std::vector<std::vector<double>> rows = {{1.5, -2, 3}, {-0.25, 300, 0}};
  for (const std::string& bytes : {little, big, ascii}) {
    const Seen seen = read(bytes);
    EXPECT_EQ(seen.rows, rows);
    EXPECT_EQ(seen.lists, (std::vector<std::vector<double>>{{7, -8, 9}}));
    EXPECT_EQ(seen.trailing, 0u);
  }
}

TEST(ReadPlyRows, LinesMayEndInAnyOfThreeWays) {
  const std::string text = header("ascii", "2") + "1.5 -2 3 7 -8 9\n-0.25 300 0\n";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string bytes;
    for (const char c : text) bytes += c == '\n' ? end : std::string(1, c);
    const Seen seen = read(bytes);
    EXPECT_EQ(seen.rows, (std::vector<std::vector<double>>{{1.5, -2, 3}, {-0.25, 300, 0}}));
    EXPECT_EQ(seen.trailing, 0u);
  }
}

TEST(ReadPlyRows, CountsBytesAfterTheLastRecord) {
  EXPECT_EQ(read(header("binary_little_endian", "1") + record(1, 2, {3}, false) + "abc").trailing,
            3u);
}

TEST(ReadPlyRows, RefusesEveryTruncation) {
  for (const bool binary : {true, false}) {
    const std::string whole = binary ? header("binary_little_endian", "2") +
                                           record(1, 2, {3, 4}, false) + record(5, 6, {7}, false)
                                     : header("ascii", "2") + "1 2 2 3 4\n5 6 1 7";
    test::expect_every_truncation_is_refused(
        whole, [](const auto& path) { (void)read(test::read_bytes(path)); });
  }
}

TEST(ReadPlyRows, RefusesCountsBeforeItBelievesThem) {
  const std::string hundred(100, '\0');
  EXPECT_EQ(defect(header("binary_little_endian", "18446744073709551615") + hundred), "COUNT");
  EXPECT_EQ(defect(header("binary_little_endian", "4294967296") + hundred), "COUNT");
  EXPECT_EQ(defect(header("binary_little_endian", "2305843009213693952") + hundred), "COUNT");
  EXPECT_EQ(defect(header("binary_little_endian", "15") + hundred), "TRUNCATED");
  EXPECT_EQ(defect(header("ascii", "4294967296") + "1 2 0\n"), "COUNT");
  EXPECT_EQ(defect(header("ascii", "3") + "1 2 0\n1 2 0\n"), "TRUNCATED");
}

TEST(ReadPlyRows, RefusesListLengthsBeyondTheFile) {
  const std::string start = header("binary_little_endian", "1") + std::string(6, '\0');
  EXPECT_EQ(defect(start + "\xff" + std::string(8, '\0')), "COUNT");
  EXPECT_EQ(defect(start + "\x03" + std::string(8, '\0')), "TRUNCATED");
  const std::string wide =
      "ply\nformat binary_little_endian 1.0\nelement f 1\nproperty list int int l\nend_header\n";
  std::string negative;
  append_bytes(negative, int32_t{-1});
  EXPECT_EQ(defect(wide + negative), "COUNT");
  std::string huge;
  append_bytes(huge, int32_t{0x7fffffff});
  EXPECT_EQ(defect(wide + huge), "COUNT");
}

TEST(ReadPlyRows, HoldsAsciiToItsLinesAndTypes) {
  const auto row = [](const std::string& text) {
    return defect(header("ascii", "1") + text + "\n");
  };
  EXPECT_EQ(row("1 2 0"), "OK");
  EXPECT_EQ(row("nan 2 0"), "OK");
  EXPECT_EQ(row("-inf 2 0"), "OK");
  EXPECT_EQ(row("1 2"), "SYNTAX");
  EXPECT_EQ(row("1 2 0 5"), "SYNTAX");
  EXPECT_EQ(row("1e400 2 0"), "SYNTAX");
  EXPECT_EQ(row("0x1p3 2 0"), "SYNTAX");
  EXPECT_EQ(row("1,5 2 0"), "SYNTAX");
  EXPECT_EQ(row("1 2.5 0"), "SYNTAX");
  EXPECT_EQ(row("1 nan 0"), "SYNTAX");
  EXPECT_EQ(row("1 2 -1"), "COUNT");
  EXPECT_EQ(row("1 2 200 1"), "COUNT");
}

}  // namespace
}  // namespace cgs::ply_rows_test
