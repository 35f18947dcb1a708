// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/atomic_file.h"

#include <cerrno>
#include <charconv>
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kBufferSize = size_t{1} << 20;
constexpr std::string_view kPart = ".part";  // followed by the number of the process

// The process a temporary belongs to; 0 if the name is not that of one. Numbers with a leading
// zero are the parts of an archive.
pid_t process_of(const std::string& name) {
  const size_t at = name.rfind(kPart);
  if (at == std::string::npos) return 0;
  const char* const first = name.data() + at + kPart.size();
  const char* const end = name.data() + name.size();
  pid_t process = 0;
  const auto [rest, error] = std::from_chars(first, end, process);
  return error == std::errc() && rest == end && *first != '0' && process > 0 ? process : 0;
}

bool is_gone(pid_t process) { return ::kill(process, 0) != 0 && errno == ESRCH; }

void write_all(int descriptor, std::string_view bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0)
      throw IoError(path,
                    n < 0 ? std::generic_category().message(errno) : "the disk took no bytes");
    bytes.remove_prefix(static_cast<size_t>(n));
  }
}

void sync_to_disk(int descriptor, const std::filesystem::path& path) {
  if (::fsync(descriptor) != 0) throw IoError(path, std::generic_category().message(errno));
}

// The process that holds a lock of an open file, as Linux lists them; 0 where it does not say.
pid_t holder_of_lock(int descriptor) {
  struct stat file = {};
  if (::fstat(descriptor, &file) != 0) return 0;
  const std::string inode = ":" + std::to_string(file.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, place;
    pid_t process = 0;
    words >> number >> kind >> mode >> access >> process >> place;
    if (words && kind == "FLOCK" && place.ends_with(inode)) return process;
  }
  return 0;
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)), part_(path_) {
  part_ += std::string(kPart) + std::to_string(::getpid());
  descriptor_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw IoError(path_, std::generic_category().message(errno));
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);  // finds nothing after commit()
}

void AtomicFile::flush_buffer() {
  write_all(descriptor_, buffer_, path_);
  buffer_.clear();
}

void AtomicFile::write(std::string_view bytes) {
  buffer_ += bytes;
  if (buffer_.size() >= kBufferSize) flush_buffer();
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  write(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

void AtomicFile::sync() {
  flush_buffer();
  sync_to_disk(descriptor_, path_);
}

std::filesystem::path AtomicFile::release_to_library() {
  flush_buffer();
  ::close(std::exchange(descriptor_, -1));
  return part_;
}

void AtomicFile::commit() {
  if (descriptor_ < 0) {
    descriptor_ = ::open(part_.c_str(), O_RDWR | O_CLOEXEC);
    if (descriptor_ < 0) throw IoError(path_, std::generic_category().message(errno));
  }
  flush_buffer();
  sync_to_disk(descriptor_, path_);
  if (::close(std::exchange(descriptor_, -1)) != 0)
    throw IoError(path_, std::generic_category().message(errno));
  std::error_code error;
  std::filesystem::rename(part_, path_, error);  // same folder, so the move is atomic
  if (error) throw IoError(path_, error.message());
  // The name itself must survive a power cut too.
  const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
  const int folder_descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_descriptor >= 0) {
    (void)::fsync(folder_descriptor);
    ::close(folder_descriptor);
  }
}

FolderLock::FolderLock(const std::filesystem::path& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
  if (errno != EWOULDBLOCK) return;  // a file system without locks
  const pid_t holder = holder_of_lock(descriptor_);
  ::close(descriptor_);
  const std::string who = holder > 0 ? " (process " + std::to_string(holder) + ")" : "";
  throw IoError(folder,
                "another run" + who + " is writing to this folder; wait for it or choose another");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void remove_abandoned_files(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) return;
  std::vector<std::filesystem::path> found;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const pid_t process = process_of(entry->path().filename().string());
    std::error_code ignored;  // what has gone is no temporary
    if (process > 0 && is_gone(process) && entry->is_regular_file(ignored)) {
      found.push_back(entry->path());
    }
  }
  if (error) throw IoError(folder, error.message());
  for (const std::filesystem::path& path : found) {
    std::filesystem::remove(path, error);
    if (error) throw IoError(path, error.message());
  }
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

void make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    throw IoError(folder, error ? error.message() : "exists, but is not a folder");
  }
  const AtomicFile probe(folder / ".probe");  // removed again, as it is never committed
}

NewFolder::NewFolder(const std::filesystem::path& folder) {
  std::error_code ignored;  // told by make_output_folder()
  for (std::filesystem::path at = folder;
       !at.empty() && !std::filesystem::exists(at, ignored) && !ignored;
       at = at.parent_path()) {
    made_.push_back(at);
  }
  make_output_folder(folder);
}

NewFolder::~NewFolder() {
  std::error_code is_not_empty;
  for (const std::filesystem::path& folder : made_) {
    std::filesystem::remove(folder, is_not_empty);
  }
}

}  // namespace cgs
