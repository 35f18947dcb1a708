// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "libcgs/core/error.h"

namespace cgs {

/// Upper bounds that every reader applies before it allocates.
struct ReadLimits {
  uint64_t max_file_bytes = uint64_t{4} << 30;
  uint64_t max_pixels = uint64_t{1} << 28;  ///< Per image.
  uint64_t max_json_bytes = uint64_t{256} << 20;
  int max_json_depth = 64;
  uint64_t max_header_bytes = uint64_t{1} << 20;  ///< Text headers (PLY, npy).
  uint64_t max_views = 100'000;
  uint64_t max_name_bytes = 4096;
};

/// The whole content of a regular file, opened without following a FIFO or device into a hang.
/// \throws BadInput Open (missing, not a regular file, no permission), Empty; LimitError.
std::string read_file(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Hands a regular file over in parts, whatever its size; an empty one in none.
/// \throws BadInput Open
void read_in_parts(const std::filesystem::path& path,
                   const std::function<void(std::string_view)>& take);

/// The first `max_bytes` of a regular file, or all of it if it is shorter: enough for most headers.
/// \throws BadInput as read_file()
std::string read_file_start(const std::filesystem::path& path, uint64_t max_bytes);

/// Refuses, with advice, what is often found under a wrong name: HTML, Git LFS pointers, archives.
/// `expected` names the format for the message ("PLY").
/// \throws BadInput Magic
void refuse_foreign_content(const std::filesystem::path& path,
                            std::string_view bytes,
                            std::string_view expected);

/// A cursor over the bytes of a file that cannot leave them. Multi-byte values are little-endian.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::filesystem::path path)
      : bytes_(bytes), path_(std::move(path)) {}

  size_t offset() const { return offset_; }
  size_t remaining() const { return bytes_.size() - offset_; }
  const std::filesystem::path& path() const { return path_; }

  /// The next n bytes.
  /// \throws BadInput Truncated
  std::string_view take(size_t n, std::string_view what);

  /// One little-endian number.
  template <typename T>
  T get(std::string_view what) {
    static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
    T value;
    std::memcpy(&value, take(sizeof(T), what).data(), sizeof(T));
    return value;
  }

  /// Bytes up to a terminating NUL, which is consumed.
  /// \throws BadInput Truncated; LimitError
  std::string_view take_c_string(size_t max_bytes, std::string_view what);

  /// Checks that `count` records of at least `bytes_each` bytes can still follow; call before
  /// allocating for them.
  /// \throws BadInput Count
  void expect_records(uint64_t count, uint64_t bytes_each, std::string_view what) const;

  /// \throws BadInput with the current offset in the message.
  [[noreturn]] void fail(Defect defect, const std::string& reason) const;

 private:
  std::string_view bytes_;
  size_t offset_ = 0;
  std::filesystem::path path_;
};

/// The whole token as a number: no locale, no leftovers, no overflow; a number that need not be
/// whole may begin with "+".
/// \return false if it is none.
bool parse_number(std::string_view token, double& value);
bool parse_number(std::string_view token, int64_t& value);
bool parse_number(std::string_view token, uint64_t& value);

/// The same for measured values as programs print them, which may be lacking: "nan", "-inf",
/// "1.#QNAN" of older C libraries, and what is too large (infinite) or too small (0) for double.
bool parse_measured(std::string_view token, double& value);

}  // namespace cgs
