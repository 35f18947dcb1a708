// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/sha256.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cgs::sha256_test {
namespace {

// The examples of FIPS 180-4 (NIST, "SHA256.pdf" and "SHA_All.pdf").
TEST(Sha256, IsThatOfTheStandardsExamples) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// Lengths around those at which the length of the text needs a block of its own.
TEST(Sha256, TellsEveryLengthApart) {
  std::vector<std::string> seen;
  for (size_t length = 50; length < 70; ++length) seen.push_back(sha256(std::string(length, 'x')));
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::unique(seen.begin(), seen.end()), seen.end());
}

}  // namespace
}  // namespace cgs::sha256_test
