// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace cgs {

class ByteReader;

/// The files inside a ZIP archive that is in memory; only what other formats are made of: stored or
/// deflated, not encrypted, with 32-bit or 64-bit sizes. Nothing is ever written to disk.
/// Own code, because archives come from strangers: what libraries state of sizes and names is what
/// the file claims, and several files of one name, as attacks use them, would pass.
/// Source: PKWARE, APPNOTE.TXT 6.3.
class ZipArchive {
 public:
  /// Reads the central directory. The bytes must outlive the archive.
  /// \throws BadInput Truncated (no directory), Syntax, Schema (a name twice), Path (a name that
  ///         would leave a folder), Count (a size that its bytes cannot unpack to), Unsupported
  ///         (several disks); LimitError: more than 65,535 files, or files that unpack to more than
  ///         64 MiB and 200 times the archive together
  ZipArchive(std::string_view bytes, std::filesystem::path path);

  bool has(const std::string& name) const { return entries_.count(name) > 0; }
  std::vector<std::string> names() const;

  /// The content of a file, at most `max_bytes` long.
  /// \throws BadInput Missing, Unsupported (compression method, encryption), Truncated, Syntax,
  ///         Count (it is longer or shorter than stated), Mismatch (its checksum); LimitError
  std::string read(const std::string& name, uint64_t max_bytes) const;

  /// The first bytes of a file, `most` of them unless it is shorter; its checksum is not looked at.
  /// \throws BadInput as read()
  std::string read_start(const std::string& name, size_t most) const;

 private:
  struct Entry {
    uint16_t method = 0;
    uint16_t flags = 0;
    uint32_t checksum = 0;
    uint64_t packed = 0;
    uint64_t size = 0;
    uint64_t offset = 0;
  };
  Entry next_entry(ByteReader& directory, std::string& name) const;
  const Entry& entry(const std::string& name) const;
  std::string_view packed_bytes(const Entry& entry, const std::string& shown) const;
  std::string_view bytes_;
  std::filesystem::path path_;
  std::map<std::string, Entry> entries_;
};

}  // namespace cgs
