// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cgs {

/// A file that appears whole or not at all.
///
/// Bytes go to a temporary file in the same folder; commit() checks every write, flushes to the
/// disk, and renames. Without commit() the temporary is removed and an older file of that name
/// stays as it was.
///
/// Use: AtomicFile file("mesh.ply"); file.write(bytes); file.commit();
class AtomicFile {
 public:
  /// \throws IoError if the temporary cannot be created.
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// \throws IoError if the disk does not take all of it.
  void write(std::string_view bytes);
  void write(std::span<const std::byte> bytes);

  /// All that was written so far lies on the disk; only commit() gives it its name.
  /// \throws IoError if the disk does not take all of it.
  void sync();

  /// For libraries that only write to a path: the temporary's path, after closing our handle.
  /// commit() then reopens it to flush it.
  std::filesystem::path release_to_library();

  /// \throws IoError if flushing or renaming fails.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path part_;
  int descriptor_ = -1;
  std::string buffer_;
  void flush_buffer();
};

/// Keeps other programs that also ask for it out of a folder while it lives. It leaves no file
/// behind and ends with the process, however that ends.
class FolderLock {
 public:
  /// \throws IoError if another process holds it.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// Removes the temporaries of AtomicFile that processes which are gone left in a folder, not below
/// it. Does nothing if there is no such folder.
/// \throws IoError
void remove_abandoned_files(const std::filesystem::path& folder);

/// Writes a whole file atomically.
/// \throws IoError
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Creates a folder and its parents and checks that files can be created in it.
/// \throws IoError
void make_output_folder(const std::filesystem::path& folder);

/// Makes a folder as make_output_folder() and takes it and parents that it made away again should
/// nothing have come into them while this lives.
class NewFolder {
 public:
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

 private:
  std::vector<std::filesystem::path> made_;  // the innermost first
};

}  // namespace cgs
