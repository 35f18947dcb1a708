// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_reader.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "io/glb/container.h"
#include "io/splats/compressed_ply.h"
#include "io/splats/dot_splat.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/ksplat.h"
#include "io/splats/sog.h"
#include "io/splats/splat_glb_reader.h"
#include "io/splats/spz_reader.h"

namespace cgs {

namespace {

bool looks_like_gltf(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.starts_with("glTF")) return true;
  return is_gltf_text(bytes) &&
         (lower_extension(path) == ".gltf" || bytes.find("\"asset\"") != std::string_view::npos);
}

RawSplats parse(std::string bytes, const std::filesystem::path& path) {
  const std::string_view all = bytes;
  if (all.substr(0, 4) == "ply\n" || all.substr(0, 4) == "ply\r") {
    return is_compressed_ply(parse_ply_header(all, path)) ? parse_compressed_ply(all, path)
                                                          : parse_gaussian_ply(all, path);
  }
  if (looks_like_spz(all)) return parse_spz(all, path);
  if (looks_like_sog(all)) return parse_sog(all, path);
  if (looks_like_ksplat(all)) return parse_ksplat(all, path);
  if (looks_like_gltf(all, path)) return parse_splat_glb(std::move(bytes), path);
  // First: the bytes of a coordinate may be those that another format starts with.
  if (looks_like_dot_splat(all)) return parse_dot_splat(all, path);
  refuse_foreign_content(path, all, "splats");
  throw BadInput(Defect::Magic,
                 path,
                 "no splats: expected .ply, .spz, .sog or its meta.json, .ksplat, .glb, .gltf, or "
                 "records of .splat (32 bytes each)");
}

}  // namespace

std::optional<SplatCount> stated_splats(const std::filesystem::path& path) {
  const std::string start = read_file_start(path, ReadLimits().max_header_bytes);
  SplatCount out;
  std::error_code unknown;
  out.file_bytes = std::filesystem::file_size(path, unknown);
  if (unknown) return {};
  if (looks_like_sog(start)) {
    const SogCount found = stated_sog_splats(read_file(path), path);
    out.splats = found.splats;
    out.harmonics = found.harmonics;
    return out;
  }
  if (looks_like_gltf(start, path)) {
    const GlbSplatCount found = count_glb_splats(path);
    out.splats = found.splats;
    out.harmonics = found.harmonics;
    return out;
  }
  if (looks_like_spz(start)) {
    const SpzCount found = stated_spz_splats(start, path);
    out.splats = std::min(found.splats, kSpzSplatsPerByte * out.file_bytes);
    out.harmonics = found.harmonics;
    return out;
  }
  if (start.substr(0, 3) != "ply") {
    constexpr uint64_t kRecord = 32;
    if (looks_like_ksplat(start) || out.file_bytes % kRecord != 0) return {};
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
  RawSplats raw = parse(read_file(path), path);  // whose bytes are gone before they are judged
  return examine_splats(std::move(raw), path, frame);
}

}  // namespace cgs
