// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/om_reader.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes/byte_reader.h"
#include "io/meshes/material_labels.h"
#include "io/meshes/om_format.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

/// A halfedge of a file: the one after it along its face, and the vertex it runs to.
struct OmHalfedge {
  uint32_t next = 0;
  uint32_t to = 0;
};

class OmReader {
 public:
  OmReader(std::string_view bytes, const std::filesystem::path& path)
      : in_(bytes, path), path_(path) {}

  ParsedMesh read() {
    read_header();
    while (read_chunk()) {
    }
    if (out_.positions.size() != vertices_) {
      throw BadInput(Defect::Schema, path_, "no coordinates of its vertices");
    }
    if (faces_ > 0 && !has_topology_) {
      throw BadInput(Defect::Schema, path_, "no corners of its faces");
    }
    for (uint64_t f = 0; f < faces_; ++f) add_face(f);
    tell();
    drop_unusable(out_, path_);
    return std::move(out_);
  }

 private:
  void read_header() {
    constexpr uint8_t kNewest = om_version(2, 2);
    const std::string_view magic = in_.take(2, "header");
    if (magic != "OM") throw BadInput(Defect::Magic, path_, "does not start with OM");
    const char form = in_.get<char>("header");
    version_ = in_.get<uint8_t>("header");
    if (version_ > kNewest) {
      in_.fail(Defect::Unsupported,
               "version " + std::to_string(version_ >> 5) + "." + std::to_string(version_ & 31) +
                   " of the format, known are those up to 2.2");
    }
    corners_each_ = form == 'T' ? 3 : form == 'Q' ? 4 : 0;
    if (corners_each_ == 0 && form != 'P') {
      in_.fail(Defect::Magic, "neither triangles, quadrilaterals nor polygons");
    }
    vertices_ = in_.get<uint32_t>("number of vertices");
    faces_ = in_.get<uint32_t>("number of faces");
    edges_ = in_.get<uint32_t>("number of edges");
    in_.expect_records(vertices_, 3 * sizeof(float), "vertices");
    in_.expect_records(faces_, 1, "faces");
    if (vertices_ == 0) throw BadInput(Defect::Empty, path_, "0 vertices");
  }

  uint64_t count_of(OmEntity entity) const {
    switch (entity) {
      case OmEntity::Vertex:
        return vertices_;
      case OmEntity::Face:
        return faces_;
      case OmEntity::Edge:
        return edges_;
      case OmEntity::Halfedge:
        return 2 * edges_;
      case OmEntity::Mesh:
        return 1;
      default:
        in_.fail(Defect::Unsupported, "data of neither vertices, edges, faces nor the mesh");
    }
  }

  /// \return false for the last one
  bool read_chunk() {
    const auto chunk = OmChunk::from_bits(in_.get<uint16_t>("head of a chunk"));
    if (chunk.entity == OmEntity::End) return false;
    const uint64_t count = count_of(chunk.entity);
    const std::string_view name = chunk.is_named ? take_name() : std::string_view();
    const bool is_of_vertices = chunk.entity == OmEntity::Vertex;
    switch (chunk.type) {
      case OmType::Position:
        if (!is_of_vertices) in_.fail(Defect::Unsupported, "coordinates of other than vertices");
        read_positions(chunk);
        break;
      case OmType::Normal:
        read_normals(chunk, count);
        break;
      case OmType::TextureCoordinate:
        skip(count, chunk.dimensions * float_bytes(chunk));
        has_texture_coordinates_ = true;
        break;
      case OmType::Status:
        read_status(chunk, count);
        break;
      case OmType::Color:
        read_colors(chunk, count);
        break;
      case OmType::Property:
        read_property(chunk, name);
        break;
      case OmType::Topology:
        read_topology(chunk, count);
        break;
      default:
        in_.fail(Defect::Unsupported, "a chunk of unknown type");
    }
    return true;
  }

  std::string_view take_name() {
    return in_.take(in_.get<uint8_t>("length of a name"), "name of a property");
  }
  void skip(uint64_t count, uint64_t bytes_each) {
    in_.expect_records(count, bytes_each, "numbers");
    (void)in_.take(count * bytes_each, "numbers");
  }
  size_t float_bytes(const OmChunk& chunk) const {
    if (chunk.size_code > 1)
      in_.fail(Defect::Unsupported, "numbers that are neither float nor double");
    return chunk.size_code == 0 ? sizeof(float) : sizeof(double);
  }
  Eigen::Vector3d take_vector(size_t bytes, std::string_view what) {
    Eigen::Vector3d out;
    for (double& c : out)
      c = bytes == sizeof(float) ? double{in_.get<float>(what)} : in_.get<double>(what);
    return out;
  }
  void expect_three(const OmChunk& chunk) const {
    if (chunk.dimensions != 3) in_.fail(Defect::Unsupported, "vectors of other than three numbers");
  }

  void read_positions(const OmChunk& chunk) {
    expect_three(chunk);
    const size_t bytes = float_bytes(chunk);
    in_.expect_records(vertices_, 3 * bytes, "vertices");
    out_.digits = bytes == sizeof(float) ? kFloatDigits : kDoubleDigits;
    out_.positions.clear();
    out_.positions.reserve(vertices_);
    for (uint64_t v = 0; v < vertices_; ++v) {
      out_.positions.push_back(take_vector(bytes, "a vertex"));
    }
  }

  void read_normals(const OmChunk& chunk, uint64_t count) {
    expect_three(chunk);
    const size_t bytes = float_bytes(chunk);
    if (chunk.entity != OmEntity::Vertex) return skip(count, 3 * bytes);
    in_.expect_records(count, 3 * bytes, "normals");
    out_.mesh.normals.clear();
    for (uint64_t v = 0; v < count; ++v) {
      out_.mesh.normals.emplace_back(take_vector(bytes, "a normal").cast<float>());
    }
  }

  void read_colors(const OmChunk& chunk, uint64_t count) {
    expect_three(chunk);
    if (chunk.is_number || chunk.size_code != 0) {
      in_.fail(Defect::Unsupported, "colours of other than a byte each");
    }
    has_other_colors_ |= chunk.entity != OmEntity::Vertex;
    if (chunk.entity != OmEntity::Vertex) return skip(count, 3);
    in_.expect_records(count, 3, "colours");
    out_.mesh.colors.clear();
    for (uint64_t v = 0; v < count; ++v) {
      Eigen::Vector3f& color = out_.mesh.colors.emplace_back();
      for (float& c : color) c = static_cast<float>(in_.get<uint8_t>("a colour")) / 255;
    }
  }

  void read_status(const OmChunk& chunk, uint64_t count) {
    constexpr uint32_t kDeleted = 1;
    if (chunk.entity != OmEntity::Face) return skip(count, sizeof(uint32_t));
    in_.expect_records(count, sizeof(uint32_t), "states of faces");
    is_deleted_.assign(count, 0);
    for (uint8_t& deleted : is_deleted_) {
      deleted = (in_.get<uint32_t>("the state of a face") & kDeleted) != 0 ? 1 : 0;
    }
  }

  void read_property(const OmChunk& chunk, std::string_view name) {
    if (version_ > om_version(2, 1)) (void)take_name();  // of its type
    ByteReader content(in_.take(in_.get<uint32_t>("length of a property"), "a property"), path_);
    const auto is = [&](OmEntity entity, std::string_view ours, uint64_t bytes) {
      if (chunk.entity != entity || name != ours) return false;
      if (content.remaining() == bytes) return true;
      in_.fail(Defect::Count,
               std::string(ours) + " has " + std::to_string(content.remaining()) +
                   " bytes and not " + std::to_string(bytes));
    };
    const auto take_floats = [&](std::vector<float>& out) {
      out.clear();
      for (uint64_t v = 0; v < vertices_; ++v) out.push_back(content.get<float>(name));
    };
    if (is(OmEntity::Vertex, kSupportName, sizeof(float) * vertices_)) {
      take_floats(out_.mesh.support);
    } else if (is(OmEntity::Vertex, kSigmaName, sizeof(float) * vertices_)) {
      take_floats(out_.mesh.sigma);
    } else if (is(OmEntity::Face, kProvenanceName, faces_)) {
      labels_ = content.take(faces_, name);
    } else if (chunk.entity == OmEntity::Mesh && name == kFrameName) {
      read_frame(content);
    } else {
      constexpr size_t kShown = 200;  // characters
      if (unread_.size() < kShown) unread_.append(unread_.empty() ? "" : ", ").append(name);
    }
  }

  void read_frame(ByteReader& content) {
    const std::string_view text = content.take(content.get<uint16_t>("a length"), kFrameName);
    out_.comments.clear();
    for (size_t at = 0; at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      out_.comments.emplace_back(text.substr(at, end - at));
      at = end + 1;
    }
  }

  // A whole number of the file; those below 0 and those too large for a file become the largest.
  uint32_t take_whole(size_t bytes, bool is_signed) {
    uint64_t out = 0;
    std::memcpy(&out, in_.take(bytes, "a number").data(), bytes);
    constexpr uint64_t kLargest = std::numeric_limits<uint32_t>::max();
    const bool is_negative = is_signed && (out >> (8 * bytes - 1)) != 0;
    return static_cast<uint32_t>(is_negative ? kLargest : std::min(out, kLargest));
  }

  void read_topology(const OmChunk& chunk, uint64_t count) {
    const size_t bytes = size_t{1} << chunk.size_code;
    const bool lists_corners = version_ < om_version(2, 0);
    if (chunk.entity == OmEntity::Face) {
      has_topology_ = true;
      return lists_corners ? read_corners(bytes) : read_starts(bytes);
    }
    if (chunk.entity != OmEntity::Halfedge) return skip(count, bytes);
    in_.expect_records(count, 3 * bytes, "halfedges");
    halfedges_.resize(count);
    for (OmHalfedge& halfedge : halfedges_) {
      halfedge.next = take_whole(bytes, true);
      halfedge.to = take_whole(bytes, true);
      (void)take_whole(bytes, true);  // its face, which the faces tell
    }
  }

  void read_corners(size_t bytes) {
    const uint64_t each = corners_each_ > 0 ? corners_each_ * bytes : sizeof(uint16_t);
    in_.expect_records(faces_, each, "faces");
    corners_.clear();
    ends_.clear();
    for (uint64_t f = 0; f < faces_; ++f) {
      const uint64_t corners = corners_each_ > 0 ? corners_each_ : in_.get<uint16_t>("a face");
      for (uint64_t k = 0; k < corners; ++k) {
        corners_.push_back(checked_corner(f, take_whole(bytes, false)));
      }
      ends_.push_back(corners_.size());
    }
  }

  void read_starts(size_t bytes) {
    in_.expect_records(faces_, bytes, "faces");
    starts_.resize(faces_);
    for (uint32_t& start : starts_) start = take_whole(bytes, true);
  }

  uint32_t checked_corner(uint64_t face, uint32_t vertex) const {
    if (vertex < vertices_) return vertex;
    throw BadInput(Defect::Ref,
                   path_,
                   "face " + std::to_string(face) + " names a vertex that is not there, of " +
                       std::to_string(vertices_));
  }

  std::vector<uint32_t> listed_corners(uint64_t face) const {
    const auto at = [&](uint64_t i) { return corners_.begin() + static_cast<std::ptrdiff_t>(i); };
    return {at(face > 0 ? ends_[face - 1] : 0), at(ends_[face])};
  }

  // Each halfedge is passed once, in whatever circles they run.
  std::vector<uint32_t> walked_corners(uint64_t face) {
    is_passed_.resize(halfedges_.size(), 0);
    std::vector<uint32_t> out;
    uint32_t at = starts_[face];
    do {
      if (at >= halfedges_.size() || is_passed_[at] != 0) {
        throw BadInput(
            Defect::Ref,
            path_,
            "the halfedges of face " + std::to_string(face) +
                (at >= halfedges_.size() ? " lead to one that is not there" : " are not its own"));
      }
      is_passed_[at] = 1;
      out.push_back(checked_corner(face, halfedges_[at].to));
      at = halfedges_[at].next;
    } while (at != starts_[face]);
    return out;
  }

  void add_face(uint64_t face) {
    if (!is_deleted_.empty() && is_deleted_[face] != 0) {
      ++deleted_;
      return;
    }
    const std::vector<uint32_t> corners =
        ends_.empty() ? walked_corners(face) : listed_corners(face);
    if (corners.size() < 3) ++too_small_;
    append_polygon(corners, out_.positions, out_.mesh.faces);
    if (!labels_.empty()) out_.mesh.provenance.resize(out_.mesh.faces.size(), label(face));
  }

  Provenance label(uint64_t face) const {
    const auto number = static_cast<uint8_t>(labels_[face]);
    if (number < kProvenanceCount) return static_cast<Provenance>(number);
    throw BadInput(Defect::Value,
                   path_,
                   "face " + std::to_string(face) + " has " + std::string(kProvenanceName) + " " +
                       std::to_string(number) + ", allowed are 0 to " +
                       std::to_string(kProvenanceCount - 1));
  }

  void tell() {
    const auto say = [&](bool is_so, const std::string& what) {
      if (is_so) out_.warnings.push_back(what);
    };
    const auto& lines = out_.comments;
    const bool was_labelled = std::find(lines.begin(), lines.end(), kLabelled) != lines.end();
    say(was_labelled && out_.mesh.provenance.empty() && !out_.mesh.faces.empty(), kLostLabels);
    say(has_other_colors_, "colours of faces are not read");
    say(has_texture_coordinates_, "texture coordinates are not read");
    say(!unread_.empty(), "not read: " + printable(unread_));
    say(deleted_ > 0, "left out " + std::to_string(deleted_) + " faces that are marked as deleted");
    say(too_small_ > 0, "dropped " + std::to_string(too_small_) + " faces of fewer than 3 corners");
    say(in_.remaining() > 0, "trailing " + std::to_string(in_.remaining()) + " bytes ignored");
  }

  ByteReader in_;
  const std::filesystem::path& path_;
  uint8_t version_ = 0;
  uint64_t corners_each_ = 0;  // 0 = each face says it
  uint64_t vertices_ = 0;
  uint64_t faces_ = 0;
  uint64_t edges_ = 0;
  bool has_topology_ = false;
  std::vector<uint32_t> corners_;  // of versions below 2.0, of all faces
  std::vector<uint64_t> ends_;     // of the corners of every face
  std::vector<uint32_t> starts_;   // from 2.0 on: a halfedge of every face
  std::vector<OmHalfedge> halfedges_;
  std::vector<uint8_t> is_passed_;
  std::vector<uint8_t> is_deleted_;
  std::string_view labels_;
  std::string unread_;
  bool has_texture_coordinates_ = false;
  bool has_other_colors_ = false;
  uint64_t deleted_ = 0;
  uint64_t too_small_ = 0;
  ParsedMesh out_;
};

}  // namespace

ParsedMesh read_om(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OM");
  return OmReader(bytes, path).read();
}

}  // namespace cgs
