// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/byte_writer.h"

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "io/bytes/byte_reader.h"

namespace cgs::byte_writer_test {
namespace {

TEST(AppendBytes, IsLittleEndian) {
  std::string out = "x";
  append_bytes(out, uint32_t{0x01020304});
  EXPECT_EQ(out, std::string("x\4\3\2\1"));
}

TEST(AppendNumber, ReadsBackExactly) {
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double value : {0.1, -1.0 / 3, 1e300, tiny, 5.4e6, -0.0}) {
    std::string out;
    append_number(out, value);
    double back = 1;
    EXPECT_TRUE(parse_number(out, back)) << out;
    EXPECT_EQ(back, value);
  }
  std::mt19937_64 random(5);
  for (int i = 0; i < 100'000; ++i) {
    const uint64_t bits = random();
    const auto value = std::bit_cast<double>(bits);
    const auto single = std::bit_cast<float>(static_cast<uint32_t>(bits));
    if (!std::isfinite(value) || !std::isfinite(single)) continue;
    std::string wide;
    std::string narrow;
    append_number(wide, value);
    append_number(narrow, single);
    double back = 0;
    ASSERT_TRUE(parse_number(wide, back)) << wide;
    ASSERT_EQ(back, value) << wide;
    ASSERT_TRUE(parse_number(narrow, back)) << narrow;
    ASSERT_EQ(static_cast<float>(back), single) << narrow;
  }
  std::string shortest;
  append_number(shortest, 0.1f);
  EXPECT_EQ(shortest, "0.1");
}

}  // namespace
}  // namespace cgs::byte_writer_test
