// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace cgs {

/// The files inside a ZIP archive that is in memory; only what other formats are made of: stored or
/// deflated, not encrypted, below 4 GiB.
/// Source: PKWARE, APPNOTE.TXT 6.3.
class ZipArchive {
 public:
  /// Reads the central directory. The bytes must outlive the archive.
  /// \throws BadInput Magic (no archive), Truncated, Schema (a name twice), Unsupported (several
  ///         disks, 64-bit archives); LimitError (more than 65,535 files)
  ZipArchive(std::string_view bytes, std::filesystem::path path);

  bool has(const std::string& name) const { return entries_.count(name) > 0; }

  /// The content of a file, at most `max_bytes` long.
  /// \throws BadInput Missing, Unsupported (compression method, encryption), Truncated, Syntax,
  ///         Mismatch (its checksum); LimitError
  std::string read(const std::string& name, uint64_t max_bytes) const;

 private:
  struct Entry {
    uint16_t method = 0;
    uint16_t flags = 0;
    uint32_t checksum = 0;
    uint32_t packed = 0;
    uint32_t size = 0;
    uint32_t offset = 0;
  };
  std::string_view bytes_;
  std::filesystem::path path_;
  std::map<std::string, Entry> entries_;
};

}  // namespace cgs
