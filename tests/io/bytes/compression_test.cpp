// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/compression.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include "libcgs/core/error.h"
#include "tests/support/temp_dir.h"

namespace cgs::compression_test {
namespace {

std::string sample_text() {
  std::string out;
  for (int i = 0; i < 100'000; ++i) out += std::to_string(i * 7919 % 10007);
  return out;
}

Defect defect_of(const std::string& packed, size_t size) {
  try {
    (void)inflate(packed, DeflateWrapping::Gzip, size, "a.spz", "content");
  } catch (const BadInput& error) {
    return error.defect();
  }
  return Defect::Missing;
}

TEST(Compression, GzipIsReadByZlib) {
  const std::string text = sample_text();
  const test::TempDir dir;
  test::write_bytes(dir / "a.gz", gzip(text));
  gzFile file = gzopen((dir / "a.gz").c_str(), "rb");
  std::string back(text.size() + 1, '\0');
  back.resize(static_cast<size_t>(gzread(file, back.data(), static_cast<unsigned>(back.size()))));
  gzclose(file);
  EXPECT_EQ(back, text);
  EXPECT_EQ(gzip(text), gzip(text));
}

TEST(Compression, InflatesAllOrTheStart) {
  const std::string text = sample_text();
  const std::string packed = gzip(text);
  EXPECT_EQ(inflate(packed, DeflateWrapping::Gzip, text.size(), "a", "it"), text);
  EXPECT_EQ(inflate_start(packed, DeflateWrapping::Gzip, 10, "a", "it"), text.substr(0, 10));
  const std::string raw = packed.substr(10, packed.size() - 18);
  EXPECT_EQ(inflate(raw, DeflateWrapping::None, text.size(), "a", "it"), text);
}

TEST(Compression, TellsWhatIsWrong) {
  const std::string text = sample_text();
  const std::string packed = gzip(text);
  EXPECT_EQ(defect_of(packed, text.size() + 1), Defect::Count);
  EXPECT_EQ(defect_of(packed, text.size() - 1), Defect::Count);
  EXPECT_EQ(defect_of(packed.substr(0, packed.size() / 2), text.size()), Defect::Truncated);
  EXPECT_EQ(defect_of(packed.substr(0, packed.size() - 1), text.size()), Defect::Truncated);
  std::string changed = packed;
  changed[changed.size() - 7] ^= 1;  // the checksum
  EXPECT_EQ(defect_of(changed, text.size()), Defect::Syntax);
  EXPECT_EQ(defect_of(packed, packed.size() * 2000), Defect::Count);
  std::string damaged = packed;
  for (size_t i = 1000; i < 1100; ++i) damaged[i] = '\x55';
  EXPECT_EQ(defect_of(damaged, text.size()), Defect::Syntax);
  EXPECT_EQ(defect_of("plain text, not compressed", 20), Defect::Syntax);
}

TEST(Compression, ZstandardMustHoldWhatWasPromised) {
  const std::string text = sample_text();
  std::string packed(ZSTD_compressBound(text.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), text.data(), text.size(), 3));
  EXPECT_EQ(zstd_decompress(packed, text.size(), "a", "it"), text);
  EXPECT_THROW((void)zstd_decompress(packed, text.size() + 1, "a", "it"), BadInput);
  EXPECT_THROW((void)zstd_decompress(packed, text.size() - 1, "a", "it"), BadInput);
  packed[packed.size() / 2] ^= 0x55;
  packed.resize(packed.size() - 9);
  EXPECT_THROW((void)zstd_decompress(packed, text.size(), "a", "it"), BadInput);
}

}  // namespace
}  // namespace cgs::compression_test
