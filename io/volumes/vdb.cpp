// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/volumes/vdb.h"

#include <ios>
#include <sstream>
#include <string_view>

#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/content_uuid.h"
#include "io/volumes/vdb_screen.h"

namespace cgs {

namespace {

// Before it: magic (8), file version (4), library version (8), has offsets (1).
constexpr size_t kUuidOffset = 21;
constexpr size_t kUuidLength = 36;
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

// Files of write_vdb() carry the hash of their content as UUID, of the version that marks such;
// the library and other programs write random ones.
void check_content(std::string_view bytes, const std::filesystem::path& path) {
  const std::string_view uuid = bytes.substr(kUuidOffset, kUuidLength);
  constexpr size_t kVersionAt = 14;
  if (uuid[kVersionAt] != '8') return;
  if (uuid == content_uuid(bytes.substr(kUuidOffset + kUuidLength))) return;
  throw BadInput(Defect::Syntax, path, "damaged: the content does not match its checksum");
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
  const std::vector<size_t> delayed_load_types = screen_vdb(bytes, path, limits);
  check_content(bytes, path);
  for (const size_t at : delayed_load_types) bytes[at] = '-';
  std::istringstream in(std::move(bytes), std::ios::binary);
  // The library does not look at the state of its stream: a short read must end it at once.
  in.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  try {
    openvdb::io::Stream stream(in, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = stream.getGrids();
    if (!grids || grids->empty()) throw BadInput(Defect::Empty, path, "no grids");
    for (const auto& grid : *grids) grid->removeMeta(openvdb::GridBase::META_FILE_DELAYED_LOAD);
    return *grids;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
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
