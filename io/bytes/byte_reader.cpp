// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/byte_reader.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cgs {

namespace {

/// Closes a descriptor on every way out.
class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return value_; }

 private:
  int value_;
};

std::string mebibytes(uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

}  // namespace

namespace {

// O_NONBLOCK: a FIFO nobody writes to must not hang us before fstat can refuse it.
int open_for_reading(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
}

uint64_t regular_file_size(const Descriptor& file, const std::filesystem::path& path) {
  if (file.get() < 0) throw BadInput(Defect::Open, path, std::generic_category().message(errno));
  struct stat info = {};
  if (::fstat(file.get(), &info) != 0)
    throw BadInput(Defect::Open, path, std::generic_category().message(errno));
  if (!S_ISREG(info.st_mode)) throw BadInput(Defect::Open, path, "not a regular file");
  return static_cast<uint64_t>(info.st_size);
}

uint64_t size_of_content(const Descriptor& file, const std::filesystem::path& path) {
  const uint64_t size = regular_file_size(file, path);
  if (size == 0) throw BadInput(Defect::Empty, path, "empty file");
  return size;
}

std::string first_bytes(const Descriptor& file, uint64_t count, const std::filesystem::path& path) {
  std::string bytes(count, '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n =
        ::pread(file.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw BadInput(Defect::Open, path, std::generic_category().message(errno));
    if (n == 0) {
      throw BadInput(Defect::Truncated, path, "shrank to " + std::to_string(done) + " bytes");
    }
    done += static_cast<size_t>(n);
  }
  return bytes;
}

}  // namespace

std::string read_file(const std::filesystem::path& path, const ReadLimits& limits) {
  const Descriptor file(open_for_reading(path));
  const uint64_t size = size_of_content(file, path);
  if (size > limits.max_file_bytes) {
    throw LimitError(printable(path) + ": " + mebibytes(size) + ", allowed are " +
                     mebibytes(limits.max_file_bytes));
  }
  return first_bytes(file, size, path);
}

std::string read_file_start(const std::filesystem::path& path, uint64_t max_bytes) {
  const Descriptor file(open_for_reading(path));
  return first_bytes(file, std::min(size_of_content(file, path), max_bytes), path);
}

void read_in_parts(const std::filesystem::path& path,
                   const std::function<void(std::string_view)>& take) {
  const Descriptor file(open_for_reading(path));
  (void)regular_file_size(file, path);
  std::string part(size_t{1} << 20, '\0');
  while (true) {
    const ssize_t n = ::read(file.get(), part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw BadInput(Defect::Open, path, std::generic_category().message(errno));
    if (n == 0) return;
    take(std::string_view(part).substr(0, static_cast<size_t>(n)));
  }
}

void refuse_foreign_content(const std::filesystem::path& path,
                            std::string_view bytes,
                            std::string_view expected) {
  const auto starts = [&](std::string_view magic) {
    return bytes.substr(0, magic.size()) == magic;
  };
  const auto refuse = [&](const std::string& found) {
    throw BadInput(Defect::Magic, path, "expected " + std::string(expected) + ", found " + found);
  };
  if (starts("version https://git-lfs")) refuse("a Git LFS pointer; run git lfs pull");
  if (starts("<!DOCTYPE") || starts("<!doctype") || starts("<html") || starts("<HTML")) {
    refuse("what looks like HTML");
  }
  if (starts("\x1f\x8b") || starts("PK\x03\x04") || starts("\x28\xb5\x2f\xfd")) {
    refuse("compressed data; decompress it first");
  }
}

std::string_view ByteReader::take(size_t n, std::string_view what) {
  if (n > remaining()) {
    fail(Defect::Truncated,
         std::string(what) + " needs " + std::to_string(n) + " bytes, " +
             std::to_string(remaining()) + " are left");
  }
  const std::string_view out = bytes_.substr(offset_, n);
  offset_ += n;
  return out;
}

std::string_view ByteReader::take_c_string(size_t max_bytes, std::string_view what) {
  const size_t end = bytes_.find('\0', offset_);
  if (end == std::string_view::npos) fail(Defect::Truncated, std::string(what) + " never ends");
  if (end - offset_ > max_bytes) {
    throw LimitError(printable(path_) + ": " + std::string(what) + " at byte " +
                     std::to_string(offset_) + " is longer than " + std::to_string(max_bytes) +
                     " bytes");
  }
  const std::string_view out = bytes_.substr(offset_, end - offset_);
  offset_ = end + 1;
  return out;
}

void ByteReader::expect_records(uint64_t count, uint64_t bytes_each, std::string_view what) const {
  uint64_t bytes = 0;
  if (!__builtin_mul_overflow(count, bytes_each, &bytes) && bytes <= remaining()) return;
  fail(Defect::Count,
       "declares " + std::to_string(count) + " " + std::string(what) + ", the file has room for " +
           std::to_string(remaining() / bytes_each));
}

void ByteReader::fail(Defect defect, const std::string& reason) const {
  throw BadInput(defect, path_, "at byte " + std::to_string(offset_) + ": " + reason);
}

namespace {

template <typename T>
bool parse_whole(std::string_view token, T& value) {
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  return error == std::errc() && end == token.data() + token.size() && !token.empty();
}

}  // namespace

bool parse_number(std::string_view token, double& value) {
  constexpr std::string_view kStarts = "0123456789.";
  if (token.size() > 1 && token[0] == '+' && kStarts.find(token[1]) != std::string_view::npos) {
    token.remove_prefix(1);
  }
  return parse_whole(token, value);
}

bool parse_measured(std::string_view token, double& value) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (parse_number(token, value)) return true;
  const bool is_negative = token.starts_with('-');
  std::string_view digits = token;
  if (is_negative || digits.starts_with('+')) digits.remove_prefix(1);
  const double sign = is_negative ? -1 : 1;
  if (digits.starts_with("1.#")) {
    value = digits.starts_with("1.#INF") ? sign * kInfinite : std::nan("");
    return true;
  }
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.starts_with('-') || end != digits.data() + digits.size()) return false;
  if (error == std::errc()) return !std::isfinite(value);  // "+nan"
  if (error != std::errc::result_out_of_range) return false;
  const size_t exponent = digits.find_first_of("eE");
  const bool is_small = exponent == std::string_view::npos
                            ? digits.find_first_of("0.") == 0
                            : digits.substr(exponent + 1).starts_with('-');
  value = is_small ? 0 : sign * kInfinite;
  return true;
}

bool parse_number(std::string_view token, int64_t& value) { return parse_whole(token, value); }
bool parse_number(std::string_view token, uint64_t& value) { return parse_whole(token, value); }

}  // namespace cgs
