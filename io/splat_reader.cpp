// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splat_reader.h"

#include <algorithm>
#include <system_error>

#include "io/byte_reader.h"
#include "io/compressed_ply.h"
#include "io/dot_splat.h"
#include "io/gaussian_ply.h"
#include "io/sog.h"
#include "io/spz.h"

namespace cgs {

namespace {

/// The header of a .ksplat: version 0.1, then at least one section of a size that fits the file.
bool looks_like_ksplat(std::string_view bytes) {
  constexpr size_t kHeaderBytes = 4096;
  return bytes.size() > kHeaderBytes && bytes[0] == 0 && bytes[1] == 1 && bytes[2] == 0 &&
         bytes[3] == 0;
}

RawSplats parse(const std::string& bytes, const std::filesystem::path& path) {
  const std::string_view all = bytes;
  if (all.substr(0, 3) == "ply") {
    return is_compressed_ply(parse_ply_header(all, path)) ? parse_compressed_ply(all, path)
                                                          : parse_gaussian_ply(all, path);
  }
  if (looks_like_spz(all)) return parse_spz(all, path);
  if (looks_like_sog(all)) return parse_sog(all, path);
  if (looks_like_ksplat(all)) {
    throw BadInput(Defect::Unsupported, path, ".ksplat; save it as .ply, .spz, .sog or .splat");
  }
  if (all.substr(0, 4) == "glTF" || all.find("\"asset\"") < 65536) {
    throw BadInput(
        Defect::Unsupported, path, "glTF; splats are read from .ply, .spz, .sog and .splat only");
  }
  refuse_foreign_content(path, all, "splats");
  if (looks_like_dot_splat(all)) return parse_dot_splat(all, path);
  throw BadInput(Defect::Magic,
                 path,
                 "no splats: expected .ply, .spz, .sog, or records of .splat (32 bytes each)");
}

}  // namespace

std::optional<SplatCount> stated_splats(const std::filesystem::path& path) {
  const std::string start = read_file_start(path, ReadLimits().max_header_bytes);
  SplatCount out;
  std::error_code unknown;
  out.file_bytes = std::filesystem::file_size(path, unknown);
  if (unknown) return {};
  if (start.substr(0, 3) != "ply") {
    constexpr uint64_t kRecord = 32;
    const bool is_plain = !looks_like_spz(start) && !looks_like_sog(start);
    if (!is_plain || out.file_bytes % kRecord != 0) return {};
    out.splats = out.file_bytes / kRecord;
    return out;
  }
  const PlyHeader header = parse_ply_header(start, path);
  const PlyElement* const vertex = header.find("vertex");
  if (vertex == nullptr) return {};
  out.splats = std::min(vertex->count, out.file_bytes);  // no splat is smaller than a byte
  const PlyElement* const packed = header.find("sh");
  for (const PlyProperty& p : (packed == nullptr ? vertex : packed)->properties) {
    if (p.name.compare(0, 7, "f_rest_") == 0) ++out.harmonics;
  }
  out.harmonics = 1 + (out.harmonics - 1) / 3;
  return out;
}

GaussianFile read_splats(const std::filesystem::path& path, const std::optional<Frame>& frame) {
  RawSplats raw;
  {
    const std::string bytes = read_file(path);  // gone before the splats are judged
    raw = parse(bytes, path);
  }
  return examine_splats(std::move(raw), path, frame);
}

}  // namespace cgs
