// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "io/bytes/byte_reader.h"

namespace cgs {

/// Writes grids as one .vdb file that can be opened at random places, values exact.
///
/// Grids carry their own name, class and transform. The file is made in memory, so that a full disk
/// is noticed, and the same grids give the same bytes.
/// \param metadata  of the file as a whole; every value becomes a string
/// \throws InvalidInput if there is no grid or one is null; IoError
void write_vdb(const std::filesystem::path& path,
               const std::vector<openvdb::GridBase::ConstPtr>& grids,
               const std::map<std::string, std::string>& metadata);

/// Reads every grid of a .vdb file, with all values.
///
/// Safe for content from strangers: the library sees the bytes only after screen_vdb(), which also
/// says which files are read. Files of write_vdb() are also held against their checksum.
/// \throws BadInput as screen_vdb(); Syntax also for a wrong checksum; LimitError
std::vector<openvdb::GridBase::Ptr> read_vdb(const std::filesystem::path& path,
                                             const ReadLimits& limits = {});

}  // namespace cgs
