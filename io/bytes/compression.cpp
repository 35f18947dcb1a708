// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/compression.h"

#include <algorithm>
#include <new>

#include <zlib.h>
#include <zstd.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr int kRawWindow = -15;       // zlib's numbers for a stream without header …
constexpr int kZlibWindow = 15;       // … with its own …
constexpr int kGzipWindow = 15 + 16;  // … and for gzip
constexpr uInt kPiece = 1U << 30;     // zlib counts in 32 bits

Bytef* bytes_of(const char* text) {
  // zlib takes its input without const but does not write to it.
  return reinterpret_cast<Bytef*>(const_cast<char*>(text));
}

int window_of(DeflateWrapping wrapping) {
  if (wrapping == DeflateWrapping::Gzip) return kGzipWindow;
  return wrapping == DeflateWrapping::Zlib ? kZlibWindow : kRawWindow;
}

/// zlib's state and how far it is, released on every way out.
class Inflater {
 public:
  Inflater(std::string_view bytes,
           DeflateWrapping wrapping,
           const std::filesystem::path& path,
           std::string_view what)
      : bytes_(bytes), path_(path), what_(what) {
    if (inflateInit2(&stream_, window_of(wrapping)) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  std::string take(size_t size) {
    if (!can_inflate_to(bytes_.size(), size)) {
      throw BadInput(Defect::Count,
                     path_,
                     what_ + " should hold " + std::to_string(size) + " bytes, " +
                         std::to_string(bytes_.size()) + " compressed ones cannot");
    }
    std::string out(size, '\0');
    size_t made = 0;
    while (made < size) {
      const size_t more = step(out.data() + made, size - made);
      if (more == 0) {
        throw BadInput(state_ == Z_STREAM_END ? Defect::Count : Defect::Truncated,
                       path_,
                       what_ + " needs " + std::to_string(size) + " bytes, its stream holds " +
                           std::to_string(made));
      }
      made += more;
    }
    return out;
  }

  /// What still comes, of at most `most` bytes.
  std::string rest(size_t most) {
    std::string out(most, '\0');
    size_t made = 0;
    while (made < most) {
      const size_t more = step(out.data() + made, most - made);
      if (more == 0) break;
      made += more;
    }
    out.resize(made);
    return out;
  }

  /// Nothing more may come, and the checksum must be there and right.
  void expect_end() {
    char more = 0;
    if (step(&more, 1) > 0) {
      throw BadInput(Defect::Count, path_, what_ + " is longer than it says");
    }
    if (state_ != Z_STREAM_END) throw BadInput(Defect::Truncated, path_, what_ + " has no end");
  }

 private:
  /// \return bytes made: 0 at the end of the stream or of what is there of it.
  size_t step(char* out, size_t size) {
    size_t made = 0;
    while (made == 0 && state_ != Z_STREAM_END) {
      const auto in = static_cast<uInt>(std::min<size_t>(bytes_.size() - taken_, kPiece));
      const auto room = static_cast<uInt>(std::min<size_t>(size, kPiece));
      stream_.next_in = bytes_of(bytes_.data() + taken_);
      stream_.avail_in = in;
      stream_.next_out = bytes_of(out);
      stream_.avail_out = room;
      state_ = ::inflate(&stream_, Z_NO_FLUSH);
      const size_t consumed = in - stream_.avail_in;
      taken_ += consumed;
      made = room - stream_.avail_out;
      if (state_ != Z_OK && state_ != Z_STREAM_END && state_ != Z_BUF_ERROR) {
        throw BadInput(Defect::Syntax,
                       path_,
                       what_ + " is damaged: deflate stream, byte " + std::to_string(taken_));
      }
      if (consumed == 0 && made == 0) break;
    }
    return made;
  }

  std::string_view bytes_;
  const std::filesystem::path& path_;
  std::string what_;
  z_stream stream_ = {};
  size_t taken_ = 0;
  int state_ = Z_OK;
};

}  // namespace

std::string inflate(std::string_view bytes,
                    DeflateWrapping wrapping,
                    size_t size,
                    const std::filesystem::path& path,
                    std::string_view what) {
  return inflate(bytes, wrapping, SizeRange{size, size}, path, what);
}

std::string inflate(std::string_view bytes,
                    DeflateWrapping wrapping,
                    const SizeRange& size,
                    const std::filesystem::path& path,
                    std::string_view what) {
  Inflater inflater(bytes, wrapping, path, what);
  std::string out = inflater.take(size.least);
  out += inflater.rest(size.most - size.least);
  inflater.expect_end();
  return out;
}

std::string inflate_start(std::string_view bytes,
                          DeflateWrapping wrapping,
                          size_t size,
                          const std::filesystem::path& path,
                          std::string_view what) {
  return Inflater(bytes, wrapping, path, what).take(size);
}

bool can_inflate_to(uint64_t packed, uint64_t size) {
  constexpr uint64_t kHighestRatio = 1032;
  return size / kHighestRatio <= packed;
}

std::string gzip(std::string_view bytes) {
  z_stream stream = {};
  constexpr int kMemoryLevel = 9;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, kMemoryLevel, 0) != Z_OK) {
    throw std::bad_alloc();
  }
  std::string out;
  std::string piece(size_t{1} << 20, '\0');
  size_t taken = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    if (stream.avail_in == 0) {
      const auto in = static_cast<uInt>(std::min<size_t>(bytes.size() - taken, kPiece));
      stream.next_in = bytes_of(bytes.data() + taken);
      stream.avail_in = in;
      taken += in;
    }
    stream.next_out = bytes_of(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = deflate(&stream, taken == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    out.append(piece.data(), piece.size() - stream.avail_out);
  }
  deflateEnd(&stream);
  return out;
}

std::string zstd_decompress(std::string_view bytes,
                            size_t size,
                            const std::filesystem::path& path,
                            std::string_view what) {
  std::string out(size, '\0');
  const size_t made = ZSTD_decompress(out.data(), size, bytes.data(), bytes.size());
  if (ZSTD_isError(made) != 0) {
    throw BadInput(Defect::Syntax,
                   path,
                   std::string(what) + " is damaged: " + std::string(ZSTD_getErrorName(made)));
  }
  if (made == size) return out;
  throw BadInput(Defect::Mismatch,
                 path,
                 std::string(what) + " holds " + std::to_string(made) + " bytes, expected are " +
                     std::to_string(size));
}

}  // namespace cgs
