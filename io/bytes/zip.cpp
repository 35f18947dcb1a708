// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/zip.h"

#include <algorithm>
#include <utility>

#include <zlib.h>

#include "io/bytes/byte_reader.h"
#include "io/bytes/compression.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kEndMagic("PK\x05\x06", 4);
constexpr std::string_view kEnd64Magic("PK\x06\x06", 4);
constexpr std::string_view kEnd64PlaceMagic("PK\x06\x07", 4);
constexpr std::string_view kEntryMagic("PK\x01\x02", 4);
constexpr std::string_view kLocalMagic("PK\x03\x04", 4);
constexpr size_t kEndBytes = 22;
constexpr size_t kEnd64PlaceBytes = 20;
constexpr size_t kEntryBytes = 46;
constexpr size_t kLongestComment = 65535;
constexpr uint64_t kMostFiles = 65535;
constexpr uint16_t kStored = 0;
constexpr uint16_t kDeflated = 8;

/// Where the directory begins and how many files it lists.
struct Directory {
  uint64_t offset = 0;
  uint64_t count = 0;
  size_t end = 0;  ///< It lies before this.
};

// The place and length of a directory that needs 64 bits.
Directory directory_of_64_bits(std::string_view bytes, size_t end, const std::filesystem::path& p) {
  if (end < kEnd64PlaceBytes) throw BadInput(Defect::Truncated, p, "the ZIP directory is cut");
  ByteReader place(bytes.substr(end - kEnd64PlaceBytes, kEnd64PlaceBytes), p);
  if (place.take(4, "place of the directory") != kEnd64PlaceMagic) {
    throw BadInput(Defect::Unsupported, p, "a ZIP archive of several disks or above 4 GiB");
  }
  (void)place.take(4, "disk");
  const auto record = place.get<uint64_t>("place of the directory");
  ByteReader reader(bytes.substr(0, end), p);
  if (record > end) throw BadInput(Defect::Truncated, p, "the ZIP directory is cut");
  (void)reader.take(record, "files");
  if (reader.take(4, "directory") != kEnd64Magic) reader.fail(Defect::Syntax, "no end of files");
  (void)reader.take(20, "end of the directory");
  const auto here = reader.get<uint64_t>("number of files");
  Directory out;
  out.count = reader.get<uint64_t>("number of files");
  (void)reader.get<uint64_t>("size of the directory");
  out.offset = reader.get<uint64_t>("place of the directory");
  out.end = end;
  if (here != out.count) throw BadInput(Defect::Unsupported, p, "a ZIP archive of several disks");
  return out;
}

Directory find_directory(std::string_view bytes, const std::filesystem::path& path) {
  const size_t end = bytes.rfind(kEndMagic);
  if (end == std::string_view::npos || bytes.size() - end > kEndBytes + kLongestComment) {
    throw BadInput(Defect::Truncated, path, "a ZIP archive without its directory; is it cut?");
  }
  ByteReader tail(bytes.substr(end), path);
  (void)tail.take(8, "end of the directory");
  const auto here = tail.get<uint16_t>("number of files");
  const auto count = tail.get<uint16_t>("number of files");
  (void)tail.get<uint32_t>("size of the directory");
  const auto offset = tail.get<uint32_t>("place of the directory");
  const auto comment_bytes = tail.get<uint16_t>("comment");
  if (tail.remaining() < comment_bytes) throw BadInput(Defect::Truncated, path, "ZIP comment");
  Directory out = {offset, count, end};
  const bool has_64_bits =
      end >= kEnd64PlaceBytes && bytes.substr(end - kEnd64PlaceBytes, 4) == kEnd64PlaceMagic;
  if (offset == UINT32_MAX || (count == UINT16_MAX && has_64_bits)) {
    out = directory_of_64_bits(bytes, end, path);
  } else if (here != count) {
    throw BadInput(Defect::Unsupported, path, "a ZIP archive of several disks");
  }
  if (out.offset > end) throw BadInput(Defect::Truncated, path, "the ZIP directory is cut");
  if (out.count > kMostFiles) {
    throw LimitError(printable(path) + ": declares " + std::to_string(out.count) +
                     " files, allowed are " + std::to_string(kMostFiles));
  }
  return out;
}

// What does not fit into 32 bits stands in an extra field, in this order.
void read_64_bit_fields(std::string_view extra,
                        const std::vector<uint64_t*>& values,
                        const std::filesystem::path& path) {
  constexpr uint16_t kSizes = 1;
  const auto needs_more = [](const uint64_t* value) { return *value == UINT32_MAX; };
  if (std::none_of(values.begin(), values.end(), needs_more)) return;
  ByteReader fields(extra, path);
  while (fields.remaining() >= 4) {
    const auto id = fields.get<uint16_t>("extra field");
    const std::string_view data = fields.take(fields.get<uint16_t>("extra field"), "extra field");
    if (id != kSizes) continue;
    ByteReader sizes(data, path);
    for (uint64_t* value : values) {
      if (needs_more(value)) *value = sizes.get<uint64_t>("64-bit size");
    }
    return;
  }
}

// Nothing is extracted, but a name that would lead elsewhere is no accident.
bool leaves_a_folder(const std::string& written) {
  const std::string name = with_slashes(written);
  const bool has_drive = name.size() > 1 && name[1] == ':';
  if (name.empty() || name[0] == '/' || has_drive) return true;
  const std::string between = "/" + name + "/";
  return between.find("/../") != std::string::npos || name.find('\0') != std::string::npos;
}

std::string shown_name(const std::string& name) { return one_line(name.substr(0, 60)); }

}  // namespace

ZipArchive::Entry ZipArchive::next_entry(ByteReader& directory, std::string& name) const {
  if (directory.take(4, "directory") != kEntryMagic) {
    directory.fail(Defect::Syntax, "no file entry");
  }
  (void)directory.take(4, "versions");
  Entry out;
  out.flags = directory.get<uint16_t>("flags");
  out.method = directory.get<uint16_t>("method");
  (void)directory.take(4, "time");
  out.checksum = directory.get<uint32_t>("checksum");
  out.packed = directory.get<uint32_t>("size");
  out.size = directory.get<uint32_t>("size");
  const auto name_bytes = directory.get<uint16_t>("name");
  const auto extra_bytes = directory.get<uint16_t>("extra field");
  const auto comment_bytes = directory.get<uint16_t>("comment");
  (void)directory.take(8, "attributes");
  out.offset = directory.get<uint32_t>("place of a file");
  name = directory.take(name_bytes, "name");
  const std::string_view extra = directory.take(extra_bytes, "extra field");
  (void)directory.take(comment_bytes, "comment");
  read_64_bit_fields(extra, {&out.size, &out.packed, &out.offset}, path_);
  const bool is_possible =
      out.method == kStored ? out.packed == out.size : can_inflate_to(out.packed, out.size);
  const bool is_read = out.method == kStored || out.method == kDeflated;
  if (is_read && (out.packed > bytes_.size() || !is_possible)) {
    throw BadInput(Defect::Count,
                   path_,
                   shown_name(name) + " should unpack from " + std::to_string(out.packed) +
                       " bytes to " + std::to_string(out.size) + ", which cannot be");
  }
  return out;
}

ZipArchive::ZipArchive(std::string_view bytes, std::filesystem::path path)
    : bytes_(bytes), path_(std::move(path)) {
  const Directory directory = find_directory(bytes, path_);
  ByteReader reader(bytes.substr(0, directory.end), path_);
  (void)reader.take(directory.offset, "files");
  reader.expect_records(directory.count, kEntryBytes, "files");
  uint64_t packed = 0;  // files lie one after the other
  uint64_t unpacked = 0;
  for (uint64_t i = 0; i < directory.count; ++i) {
    std::string name;
    const Entry entry = next_entry(reader, name);
    if (leaves_a_folder(name)) {
      throw BadInput(Defect::Path, path_, "holds a file named '" + shown_name(name) + "'");
    }
    const bool is_read = entry.method == kStored || entry.method == kDeflated;
    if (is_read) unpacked += entry.size;
    if (is_read) packed += entry.packed;
    if (packed > bytes.size()) {
      throw BadInput(
          Defect::Count, path_, "its files overlap: together they are longer than it is");
    }
    if (!entries_.emplace(name, entry).second) {
      reader.fail(Defect::Schema, "a second file " + shown_name(name));
    }
  }
  constexpr uint64_t kMayUnpack = uint64_t{64} << 20;
  constexpr uint64_t kHighestRatio = 200;
  const uint64_t most = std::max(kMayUnpack, kHighestRatio * bytes.size());
  if (unpacked > most) {
    throw LimitError(printable(path_) + ": unpacks from " + std::to_string(bytes.size()) +
                     " bytes to " + std::to_string(unpacked) + ", allowed are " +
                     std::to_string(most));
  }
}

std::vector<std::string> ZipArchive::names() const {
  std::vector<std::string> out;
  for (const auto& [name, entry] : entries_) out.push_back(name);
  return out;
}

const ZipArchive::Entry& ZipArchive::entry(const std::string& name) const {
  const auto found = entries_.find(name);
  const std::string shown = shown_name(name);
  if (found == entries_.end()) throw BadInput(Defect::Missing, path_, "has no file " + shown);
  const Entry& entry = found->second;
  if ((entry.flags & 1U) != 0) throw BadInput(Defect::Unsupported, path_, shown + " is encrypted");
  if (entry.method != kStored && entry.method != kDeflated) {
    throw BadInput(
        Defect::Unsupported, path_, shown + ": compression method " + std::to_string(entry.method));
  }
  return entry;
}

std::string_view ZipArchive::packed_bytes(const Entry& entry, const std::string& shown) const {
  ByteReader reader(bytes_, path_);
  if (entry.offset > bytes_.size()) reader.fail(Defect::Truncated, shown + " lies past the end");
  (void)reader.take(entry.offset, shown);
  if (reader.take(4, shown) != kLocalMagic) reader.fail(Defect::Syntax, "no file begins here");
  (void)reader.take(22, shown);
  const auto name_bytes = reader.get<uint16_t>("name");
  const auto extra = reader.get<uint16_t>("extra field");
  (void)reader.take(size_t{name_bytes} + extra, "name");
  return reader.take(entry.packed, shown);
}

std::string ZipArchive::read(const std::string& name, uint64_t max_bytes) const {
  const Entry& file = entry(name);
  const std::string shown = shown_name(name);
  if (file.size > max_bytes) {
    throw LimitError(printable(path_) + ": " + shown + " has " + std::to_string(file.size) +
                     " bytes, allowed are " + std::to_string(max_bytes));
  }
  const std::string_view packed = packed_bytes(file, shown);
  std::string out = file.method == kStored
                        ? std::string(packed)
                        : inflate(packed, DeflateWrapping::None, file.size, path_, shown);
  const auto* const first = reinterpret_cast<const Bytef*>(out.data());
  if (crc32_z(0, first, out.size()) != file.checksum) {
    throw BadInput(Defect::Mismatch, path_, shown + ": the checksum is wrong");
  }
  return out;
}

std::string ZipArchive::read_start(const std::string& name, size_t most) const {
  const Entry& file = entry(name);
  const std::string shown = shown_name(name);
  const std::string_view packed = packed_bytes(file, shown);
  const size_t size = std::min<uint64_t>(file.size, most);
  return file.method == kStored ? std::string(packed.substr(0, size))
                                : inflate_start(packed, DeflateWrapping::None, size, path_, shown);
}

}  // namespace cgs
