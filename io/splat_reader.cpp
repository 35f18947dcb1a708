// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splat_reader.h"

#include <utility>

#include "io/byte_reader.h"
#include "io/compressed_ply.h"
#include "io/dot_splat.h"
#include "io/gaussian_ply.h"
#include "io/ksplat.h"
#include "io/sog.h"
#include "io/splat_glb_reader.h"
#include "io/spz.h"

namespace cgs {

namespace {

RawSplats parse(std::string bytes, const std::filesystem::path& path) {
  const std::string_view all = bytes;
  if (all.substr(0, 3) == "ply") {
    return is_compressed_ply(parse_ply_header(all, path)) ? parse_compressed_ply(all, path)
                                                          : parse_gaussian_ply(all, path);
  }
  if (looks_like_spz(all)) return parse_spz(all, path);
  if (looks_like_sog(all)) return parse_sog(all, path);
  if (looks_like_ksplat(all)) return parse_ksplat(all, path);
  if (all.substr(0, 4) == "glTF") return parse_splat_glb(std::move(bytes), path);
  if (all.find("\"asset\"") < 65536) {
    throw BadInput(Defect::Unsupported, path, "glTF as text; splats are read from .glb");
  }
  refuse_foreign_content(path, all, "splats");
  if (looks_like_dot_splat(all)) return parse_dot_splat(all, path);
  throw BadInput(
      Defect::Magic,
      path,
      "no splats: expected .ply, .spz, .sog, .ksplat, .glb, or records of .splat (32 bytes each)");
}

}  // namespace

GaussianFile read_splats(const std::filesystem::path& path, const std::optional<Frame>& frame) {
  RawSplats raw = parse(read_file(path), path);  // whose bytes are gone before they are judged
  return examine_splats(std::move(raw), path, frame);
}

}  // namespace cgs
