// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/bytes.h"

#include <cstring>

#include <gtest/gtest.h>

namespace cgs::glb_bytes_test {
namespace {

uint32_t number_at(const std::string& bytes, size_t at) {
  uint32_t out = 0;
  std::memcpy(&out, bytes.data() + at, sizeof out);  // of this little-endian machine
  return out;
}

// glTF 2.0, 4.4: chunks end at multiples of four bytes, JSON filled with spaces, the rest with 0.
TEST(GlbBytes, HasTheChunksOfTheSpecification) {
  const std::string glb = glb_bytes("{\"a\":1}", "12345");
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(number_at(glb, 4), 2U);
  EXPECT_EQ(number_at(glb, 8), glb.size());
  EXPECT_EQ(number_at(glb, 12), 8U);
  EXPECT_EQ(glb.substr(16, 12), "JSON{\"a\":1} ");
  EXPECT_EQ(number_at(glb, 28), 8U);
  EXPECT_EQ(glb.substr(32),
            std::string("BIN\0"
                        "12345\0\0\0",
                        12));
}

TEST(GlbBytes, HasNoChunkForNothing) {
  const std::string glb = glb_bytes("{}", "");
  EXPECT_EQ(glb.size(), 12U + 8 + 4);
  EXPECT_EQ(number_at(glb, 8), glb.size());
}

}  // namespace
}  // namespace cgs::glb_bytes_test
