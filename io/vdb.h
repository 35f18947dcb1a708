// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "io/byte_reader.h"

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
/// A short file ends in an exception, but OpenVDB and blosc trust sizes inside the file: content
/// from strangers must be read in a process of its own.
/// \throws BadInput Magic, Unsupported (a newer file version, an unknown grid type), Truncated,
///         Syntax, Empty (no grid); LimitError
std::vector<openvdb::GridBase::Ptr> read_vdb(const std::filesystem::path& path,
                                             const ReadLimits& limits = {});

}  // namespace cgs
