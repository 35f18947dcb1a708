// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/om.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/mesh_arrays.h"
#include "io/meshes/om_format.h"
#include "io/ply/frame.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

void write_chunk(AtomicFile& file, const OmChunk& chunk) {
  std::string head;
  append_bytes(head, chunk.bits());
  file.write(head);
}

void write_property(AtomicFile& file, OmEntity entity, std::string_view name, uint64_t bytes) {
  std::string head;
  append_bytes(head, OmChunk{entity, OmType::Property, true}.bits());
  append_bytes(head, static_cast<uint8_t>(name.size()));
  head += name;
  append_bytes(head, static_cast<uint32_t>(bytes));
  file.write(head);
}

// Calls `append` with a string to fill for every number below `count`.
template <typename Append>
void write_each(AtomicFile& file, size_t count, const Append& append) {
  std::string record;
  for (size_t i = 0; i < count; ++i) {
    record.clear();
    append(record, i);
    file.write(record);
  }
}

void write_om_vertices(AtomicFile& file, const TriangleMesh& mesh, const Frame& frame) {
  const size_t count = mesh.vertices.size();
  write_chunk(file, {OmEntity::Vertex, OmType::Position, false, true, 3});
  write_each(file, count, [&](std::string& out, size_t v) {
    const Eigen::Vector3d p = frame.file_from_internal(mesh.vertices[v].cast<double>());
    for (const double c : p) append_bytes(out, static_cast<float>(c));
  });
  if (!mesh.normals.empty()) {
    write_chunk(file, {OmEntity::Vertex, OmType::Normal, false, true, 3});
    write_each(file, count, [&](std::string& out, size_t v) {
      for (const float c : mesh.normals[v]) append_bytes(out, c);
    });
  }
  if (!mesh.colors.empty()) {
    write_chunk(file, {OmEntity::Vertex, OmType::Color, false, false, 3});
    write_each(file, count, [&](std::string& out, size_t v) {
      for (const float c : mesh.colors[v]) append_bytes(out, color_byte(c));
    });
  }
  if (!mesh.support.empty()) {
    write_property(file, OmEntity::Vertex, kSupportName, sizeof(float) * count);
    write_each(
        file, count, [&](std::string& out, size_t v) { append_bytes(out, mesh.support[v]); });
  }
  if (!mesh.sigma.empty()) {
    write_property(file, OmEntity::Vertex, kSigmaName, sizeof(float) * count);
    write_each(file, count, [&](std::string& out, size_t v) {
      const double sigma = mesh.sigma[v] * frame.scale;
      append_bytes(out, sigma >= 0 ? static_cast<float>(sigma) : -1.0f);  // NaN too
    });
  }
}

void write_faces(AtomicFile& file, const TriangleMesh& mesh) {
  const size_t vertices = mesh.vertices.size();
  const unsigned code = vertices <= 0x100 ? 0 : vertices <= 0x10000 ? 1 : 2;
  write_chunk(file, {OmEntity::Face, OmType::Topology, false, false, 1, code});
  write_each(file, mesh.faces.size(), [&](std::string& out, size_t f) {
    for (const uint32_t corner : mesh.faces[f]) {
      append_bytes(out, corner);
      out.resize(out.size() - sizeof(corner) + (size_t{1} << code));
    }
  });
  if (mesh.provenance.empty()) return;
  write_property(file, OmEntity::Face, kProvenanceName, mesh.faces.size());
  write_each(file, mesh.faces.size(), [&](std::string& out, size_t f) {
    append_bytes(out, static_cast<uint8_t>(mesh.provenance[f]));
  });
}

uint32_t edge_count(const TriangleMesh& mesh) {
  std::vector<uint64_t> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const auto& [a, b, c] : mesh.faces) {
    for (const auto& [low, high] : {std::minmax(a, b), std::minmax(b, c), std::minmax(c, a)}) {
      edges.push_back(uint64_t{low} << 32 | high);
    }
  }
  std::sort(edges.begin(), edges.end());
  return static_cast<uint32_t>(std::unique(edges.begin(), edges.end()) - edges.begin());
}

// OpenMesh has no properties beyond 64 KiB of text; this is a few hundred bytes.
void write_frame(AtomicFile& file, const TriangleMesh& mesh, const Frame& frame) {
  std::string text = frame_comments(frame, "");
  if (!mesh.provenance.empty()) text.append(kLabelled).append("\n");
  std::string length;
  append_bytes(length, static_cast<uint16_t>(text.size()));
  write_property(file, OmEntity::Mesh, kFrameName, length.size() + text.size());
  file.write(length + text);
}

}  // namespace

void write_om(const std::filesystem::path& path, const TriangleMesh& mesh, const Frame& frame) {
  require_writable(mesh, "write_om");
  constexpr size_t kMost = size_t{1} << 30;  // so that the bytes of a property have 32 bits
  if (mesh.vertices.size() >= kMost || mesh.faces.size() >= kMost) {
    throw LimitError("a .om file holds fewer than 1073741824 vertices and faces");
  }
  std::string header = "OMT";
  append_bytes(header, om_version(1, 2));
  append_bytes(header, static_cast<uint32_t>(mesh.vertices.size()));
  append_bytes(header, static_cast<uint32_t>(mesh.faces.size()));
  append_bytes(header, edge_count(mesh));
  AtomicFile file(path);
  file.write(header);
  write_om_vertices(file, mesh, frame);
  write_faces(file, mesh);
  write_frame(file, mesh, frame);
  write_chunk(file, {OmEntity::End, OmType::Position});
  file.commit();
}

}  // namespace cgs
