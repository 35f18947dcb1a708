// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/splats/splat_volume.h"
#include "convert/text/terminal.h"
#include "io/meshes/gltf.h"

namespace cgs {

/// What `cgs convert` is asked for; lengths are as the user typed them.
struct ConversionRequest {
  std::filesystem::path input;
  std::filesystem::path output;
  std::string as;  ///< "mesh" or "splats" for .ply and .glb, which can be both; empty = rule.
  bool open_surface = false;  ///< Leave meshes open where nothing was seen.
  std::string simplify;  ///< Largest error; "0" = none; empty = a quarter of a voxel for meshes
                         ///< from volumes, none for meshes and for splats without cameras.
  std::string compression_error;              ///< Of a .glb; empty = 1/16384 of its size.
  GlbEncoding encoding = GlbEncoding::Draco;  ///< Of a .glb with a mesh.
  bool local_origin = false;                  ///< Of a .glb, as GlbOptions.
  std::string assume_unit;  ///< Unit of one scene unit where the input does not say.
  std::vector<double>
      up;  ///< World direction; empty = of the input, else +z for meshes, -y as 3DGS files lie.
  int spz_version = 3;
  bool filter_floaters = false;  ///< Leave out splats of find_floaters().
  SplatVolumeRequest volume;
};

/// Reads the input, runs the stages between, and writes the output.
/// \return what was found and made, for a report
/// \throws InvalidInput (no such pair; a printable file of unknown scale), BadInput, LimitError,
///         NumericalError (no surface), IoError
nlohmann::ordered_json convert_file(const ConversionRequest& request, Terminal& terminal);

/// The pairs that convert_file() knows, as a table for people.
std::string conversion_table();

}  // namespace cgs
