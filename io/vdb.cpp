// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/vdb.h"

#include <ios>
#include <sstream>
#include <string_view>

#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>

#include "io/atomic_file.h"
#include "io/content_uuid.h"

namespace cgs {

namespace {

// Start of every file: magic (8), file version (4), library version (8), has offsets (1), UUID.
constexpr size_t kUuidOffset = 21;
constexpr size_t kUuidLength = 36;
constexpr int64_t kMagic = 0x56444220;
constexpr uint32_t kOldestVersion = 222;  // OpenVDB 2.0; older layouts take other code paths

/// Gives access to the writer for any seekable stream: io::File writes to paths only, and does not
/// notice a full disk; io::Stream leaves out the offsets that let readers pick one grid.
class SeekableArchive : public openvdb::io::Archive {
 public:
  Ptr copy() const override { return std::make_shared<SeekableArchive>(*this); }
  void write_to(std::ostream& out,
                const openvdb::GridCPtrVec& grids,
                const openvdb::MetaMap& metadata) const {
    Archive::write(out, grids, /*seekable=*/true, metadata);
  }
};

void screen_header(std::string_view bytes, const std::filesystem::path& path) {
  ByteReader reader(bytes, path);
  if (reader.get<int64_t>("magic number") != kMagic) {
    refuse_foreign_content(path, bytes, "OpenVDB");
    reader.fail(Defect::Magic, "expected OpenVDB");
  }
  const auto version = reader.get<uint32_t>("file version");
  if (version < kOldestVersion || version > openvdb::OPENVDB_FILE_VERSION) {
    reader.fail(Defect::Unsupported,
                "file version " + std::to_string(version) + ", allowed are " +
                    std::to_string(kOldestVersion) + " to " +
                    std::to_string(openvdb::OPENVDB_FILE_VERSION));
  }
  (void)reader.take(8 + 1 + kUuidLength, "header");
}

}  // namespace

void write_vdb(const std::filesystem::path& path,
               const std::vector<openvdb::GridBase::ConstPtr>& grids,
               const std::map<std::string, std::string>& metadata) {
  openvdb::initialize();
  require(!grids.empty(), "write_vdb: number of grids must be > 0", grids.size());
  for (const auto& grid : grids) require(grid != nullptr, "write_vdb: a grid must not be", "null");
  openvdb::MetaMap file_metadata;
  for (const auto& [key, value] : metadata) {
    file_metadata.insertMeta(key, openvdb::StringMetadata(value));
  }
  std::ostringstream out(std::ios::binary);
  out.exceptions(std::ios::badbit | std::ios::failbit);
  SeekableArchive().write_to(out, grids, file_metadata);
  std::string bytes = std::move(out).str();
  // The library stamps every file with a random UUID.
  const std::string_view body = std::string_view(bytes).substr(kUuidOffset + kUuidLength);
  bytes.replace(kUuidOffset, kUuidLength, content_uuid(body));
  write_file(path, bytes);
}

std::vector<openvdb::GridBase::Ptr> read_vdb(const std::filesystem::path& path,
                                             const ReadLimits& limits) {
  openvdb::initialize();
  std::string bytes = read_file(path, limits);
  screen_header(bytes, path);
  std::istringstream in(std::move(bytes), std::ios::binary);
  // The library does not look at the state of its stream: a short read must end it at once.
  in.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  try {
    openvdb::io::Stream stream(in, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = stream.getGrids();
    if (!grids || grids->empty()) throw BadInput(Defect::Empty, path, "no grids");
    return *grids;
  } catch (const Error&) {
    throw;
  } catch (const std::ios_base::failure&) {
    throw BadInput(Defect::Truncated, path, "the file ends within a grid");
  } catch (const openvdb::LookupError& error) {
    throw BadInput(Defect::Unsupported, path, error.what());
  } catch (const std::exception& error) {
    throw BadInput(Defect::Syntax, path, error.what());
  }
}

}  // namespace cgs
