// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/npy.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::npy_test {
namespace {

using test::defect_of;
using test::npy;
using test::packed;

class ReadNpy : public testing::Test {
 protected:
  NpyArray read(const std::string& bytes) {
    test::write_bytes(dir_ / "a.npy", bytes);
    return read_npy(dir_ / "a.npy");
  }
  std::string refused(const std::string& bytes) {
    return defect_of([&] { read(bytes); });
  }
  test::TempDir dir_;
};

template <typename T>
std::string swapped(T value) {
  std::string bytes = packed(value);
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

TEST_F(ReadNpy, ReadsEitherByteOrderAndWidth) {
  const std::vector<double> expected = {1.5, -2.25, 3e8};
  EXPECT_EQ(read(npy("<f8", "(3,)", packed(1.5, -2.25, 3e8))).values, expected);
  EXPECT_EQ(read(npy(">f8", "(3,)", swapped(1.5) + swapped(-2.25) + swapped(3e8))).values,
            expected);
  EXPECT_EQ(read(npy("<f4", "(3,)", packed(1.5f, -2.25f, 3e8f))).values, expected);
  EXPECT_EQ(read(npy(">f4", "(3,)", swapped(1.5f) + swapped(-2.25f) + swapped(3e8f))).values,
            expected);
}

TEST_F(ReadNpy, ReadsHalvesAndWholeNumbersOf16Bits) {
  const uint16_t one_and_a_half = 0x3e00;  // IEEE 754 binary16
  const uint16_t largest = 0x7bff;
  const uint16_t smallest = 0x0001;
  const NpyArray halves = read(npy("<f2", "(3,)", packed(one_and_a_half, largest, smallest)));
  EXPECT_EQ(halves.values, (std::vector<double>{1.5, 65504, std::ldexp(1, -24)}));
  EXPECT_EQ(halves.whole_bits, 0);
  EXPECT_EQ(read(npy(">f2", "(1,)", swapped(one_and_a_half))).values, std::vector<double>{1.5});
  const NpyArray whole = read(npy("<u2", "(2,)", packed(uint16_t{1500}, uint16_t{65535})));
  EXPECT_EQ(whole.values, (std::vector<double>{1500, 65535}));
  EXPECT_EQ(whole.whole_bits, 16);
  EXPECT_EQ(read(npy(">i2", "(2,)", swapped(int16_t{-7}) + swapped(int16_t{300}))).values,
            (std::vector<double>{-7, 300}));
}

TEST_F(ReadNpy, TurnsFortranOrderIntoCOrder) {
  // a[i][j][k] = 100 i + 10 j + k of shape (2, 3, 2), stored with i fastest.
  std::string data;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) data += packed(100.0 * i + 10 * j + k);
    }
  }
  const NpyArray array = read(npy("<f8", "(2, 3, 2)", data, true));
  EXPECT_EQ(array.shape, (std::vector<size_t>{2, 3, 2}));
  EXPECT_EQ(array.values,
            (std::vector<double>{0, 1, 10, 11, 20, 21, 100, 101, 110, 111, 120, 121}));
}

TEST_F(ReadNpy, ReadsScalarsAndEmptyArrays) {
  EXPECT_EQ(read(npy("<f8", "()", packed(7.0))).values, (std::vector<double>{7}));
  EXPECT_TRUE(read(npy("<f8", "(0, 17)", "")).values.empty());
  EXPECT_TRUE(read(npy("<f8", "(0, 17)", "", true)).values.empty());
}

TEST_F(ReadNpy, RefusesEveryTruncation) {
  const std::string whole = npy("<f8", "(2, 2)", packed(1.0, 2.0, 3.0, 4.0));
  ASSERT_NO_THROW(read(whole));
  for (size_t n = 0; n < whole.size(); ++n) {
    const std::string defect = refused(whole.substr(0, n));
    EXPECT_TRUE(defect == "TRUNCATED" || defect == "MAGIC" || defect == "EMPTY")
        << "cut to " << n << " bytes: '" << defect << "'";
  }
}

TEST_F(ReadNpy, SurvivesEveryDamagedByte) {
  const std::string whole = npy("<f8", "(2, 2)", packed(1.0, 2.0, 3.0, 4.0));
  for (size_t i = 0; i < whole.size(); ++i) {
    for (const char value : {'\x00', '\x7f', '\x80', '\xff'}) {
      std::string bytes = whole;
      bytes[i] = value;
      EXPECT_NO_FATAL_FAILURE(refused(bytes));
    }
  }
}

TEST_F(ReadNpy, RefusesSizesThatCannotBe) {
  const std::string magic("\x93NUMPY\x02\x00", 8);
  EXPECT_EQ(refused(magic + packed(uint32_t(0xFFFFFFF0))), "COUNT");
  EXPECT_EQ(refused(magic + packed(uint32_t(4000))), "TRUNCATED");
  EXPECT_EQ(refused(npy("<f8", "(8589934592, 8589934592)", packed(1.0))), "COUNT");
  EXPECT_EQ(refused(npy("<f8", "(2305843009213693952, 1)", packed(1.0))), "COUNT");
  EXPECT_EQ(refused(npy("<f8", "(3,)", packed(1.0, 2.0))), "TRUNCATED");
  EXPECT_EQ(refused(npy("<f8", "(2,621, 401)", packed(1.0))), "TRUNCATED");
}

TEST_F(ReadNpy, RefusesOtherElementTypes) {
  EXPECT_EQ(refused(npy("|O", "(1,)", packed(1.0))), "UNSUPPORTED");
  EXPECT_EQ(refused(npy("<ixy", "(1,)", packed(1.0))), "UNSUPPORTED");
  EXPECT_EQ(refused(npy("", "(1,)", packed(1.0))), "UNSUPPORTED");
  EXPECT_EQ(refused(npy("<i8", "(1,)", packed(1.0))), "UNSUPPORTED");
}

TEST_F(ReadNpy, RefusesHeadersOutsideTheGrammar) {
  const auto with_header = [](const std::string& header) {
    return std::string("\x93NUMPY\x01\x00", 8) + packed(uint16_t(header.size())) + header;
  };
  EXPECT_EQ(refused(with_header("__import__('os').system('id')\n")), "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': '<f8', 'shape': (1,)}")), "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': '<f8', 'descr': '<f8'}")), "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': '<f8', 'fortran_order': 0, 'shape': (1,)}")), "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': '<f8', 'fortran_order': True, 'shape': (-1,)}")),
            "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': '<f8', 'fortran_order': True, 'shape': (1,)} x")),
            "SYNTAX");
  EXPECT_EQ(refused(with_header("{'descr': [('x', '<f8')]}")), "UNSUPPORTED");
  std::string version = npy("<f8", "(1,)", packed(1.0));
  version[6] = 9;
  EXPECT_EQ(refused(version), "MAGIC");
}

}  // namespace
}  // namespace cgs::npy_test
