// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/zip.h"

#include <utility>

#include <zlib.h>

#include "io/byte_reader.h"
#include "io/compression.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kEndMagic("PK\x05\x06", 4);
constexpr std::string_view kEntryMagic("PK\x01\x02", 4);
constexpr std::string_view kLocalMagic("PK\x03\x04", 4);
constexpr size_t kEndBytes = 22;
constexpr size_t kLongestComment = 65535;
constexpr uint16_t kStored = 0;
constexpr uint16_t kDeflated = 8;

}  // namespace

ZipArchive::ZipArchive(std::string_view bytes, std::filesystem::path path)
    : bytes_(bytes), path_(std::move(path)) {
  const size_t end = bytes.rfind(kEndMagic);
  if (end == std::string_view::npos || bytes.size() - end > kEndBytes + kLongestComment) {
    throw BadInput(Defect::Truncated, path_, "a ZIP archive without its directory; is it cut?");
  }
  ByteReader tail(bytes.substr(end), path_);
  (void)tail.take(8, "end of the directory");
  const auto here = tail.get<uint16_t>("number of files");
  const auto count = tail.get<uint16_t>("number of files");
  (void)tail.get<uint32_t>("size of the directory");
  const auto offset = tail.get<uint32_t>("place of the directory");
  const auto comment_bytes = tail.get<uint16_t>("comment");
  if (tail.remaining() < comment_bytes) throw BadInput(Defect::Truncated, path_, "ZIP comment");
  if (here != count || offset == UINT32_MAX) {
    throw BadInput(Defect::Unsupported, path_, "a ZIP archive of several disks or above 4 GiB");
  }
  if (offset > end) throw BadInput(Defect::Truncated, path_, "the ZIP directory is cut");
  ByteReader reader(bytes.substr(0, end), path_);
  (void)reader.take(offset, "files");
  for (int i = 0; i < count; ++i) {
    if (reader.take(4, "directory") != kEntryMagic) reader.fail(Defect::Syntax, "no file entry");
    (void)reader.take(4, "versions");
    Entry entry;
    entry.flags = reader.get<uint16_t>("flags");
    entry.method = reader.get<uint16_t>("method");
    (void)reader.take(4, "time");
    entry.checksum = reader.get<uint32_t>("checksum");
    entry.packed = reader.get<uint32_t>("size");
    entry.size = reader.get<uint32_t>("size");
    const auto name = reader.get<uint16_t>("name");
    const auto extra = reader.get<uint16_t>("extra field");
    const auto comment = reader.get<uint16_t>("comment");
    (void)reader.take(8, "attributes");
    entry.offset = reader.get<uint32_t>("place of a file");
    const std::string key(reader.take(name, "name"));
    (void)reader.take(size_t{extra} + comment, "extra field");
    if (!entries_.emplace(key, entry).second) {
      reader.fail(Defect::Schema, "a second file " + one_line(key.substr(0, 60)));
    }
  }
}

std::string ZipArchive::read(const std::string& name, uint64_t max_bytes) const {
  const auto found = entries_.find(name);
  const std::string shown = one_line(name.substr(0, 60));
  if (found == entries_.end()) throw BadInput(Defect::Missing, path_, "has no file " + shown);
  const Entry& entry = found->second;
  if ((entry.flags & 1U) != 0) throw BadInput(Defect::Unsupported, path_, shown + " is encrypted");
  if (entry.method != kStored && entry.method != kDeflated) {
    throw BadInput(
        Defect::Unsupported, path_, shown + ": compression method " + std::to_string(entry.method));
  }
  if (entry.size > max_bytes) {
    throw LimitError(printable(path_) + ": " + shown + " has " + std::to_string(entry.size) +
                     " bytes, allowed are " + std::to_string(max_bytes));
  }
  ByteReader reader(bytes_, path_);
  (void)reader.take(entry.offset, shown);
  if (reader.take(4, shown) != kLocalMagic) reader.fail(Defect::Syntax, "no file begins here");
  (void)reader.take(22, shown);
  const auto name_bytes = reader.get<uint16_t>("name");
  const auto extra = reader.get<uint16_t>("extra field");
  (void)reader.take(size_t{name_bytes} + extra, "name");
  const std::string_view packed = reader.take(entry.packed, shown);
  if (entry.method == kStored && entry.packed != entry.size) {
    throw BadInput(Defect::Mismatch, path_, shown + " is stored but has two sizes");
  }
  std::string out = entry.method == kStored
                        ? std::string(packed)
                        : inflate(packed, DeflateWrapping::None, entry.size, path_, shown);
  const auto* const first = reinterpret_cast<const Bytef*>(out.data());
  if (crc32_z(0, first, out.size()) != entry.checksum) {
    throw BadInput(Defect::Mismatch, path_, shown + ": the checksum is wrong");
  }
  return out;
}

}  // namespace cgs
