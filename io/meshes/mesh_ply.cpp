// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/mesh_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/mesh_arrays.h"
#include "io/meshes/material_labels.h"
#include "io/meshes/texture_file.h"
#include "io/ply/frame.h"
#include "io/ply/rows.h"

namespace cgs {

namespace {

/// How the header line of files with labels begins, without "comment "; the numbers and names
/// follow, in earlier versions fewer.
constexpr std::string_view kPlyLabels = "provenance 0 inferred 1 single view 2 observed";

/// "provenance 0 inferred 1 single view …"
std::string labels_text() {
  std::string out = "provenance";
  for (size_t i = 0; i < kProvenanceCount; ++i) {
    out += ' ' + std::to_string(i) + ' ';
    out += kProvenanceTraits.at(i).name;
  }
  return out;
}

std::string header_text(const TriangleMesh& mesh,
                        const Frame& frame,
                        const std::vector<VertexScalar>& scalars) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment ";
  out += kPlyGenerator;
  out += '\n';
  out += ply_frame_comments(frame);
  if (!mesh.provenance.empty()) out += "comment " + labels_text() + "\n";
  out += "element vertex " + std::to_string(mesh.vertices.size()) + "\n";
  out += "property float x\nproperty float y\nproperty float z\n";
  if (!mesh.normals.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.colors.empty()) {
    out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  if (!mesh.support.empty()) out += "property float quality\n";
  if (!mesh.sigma.empty()) out += "property float scalar_sigma\n";
  for (const VertexScalar& scalar : scalars) out += "property float " + scalar.name + "\n";
  out += "element face " + std::to_string(mesh.faces.size()) + "\n";
  out += "property list uchar int vertex_indices\n";
  if (!mesh.provenance.empty()) out += "property uchar scalar_provenance\nproperty float quality\n";
  return out + "end_header\n";
}

void append_vertex(std::string& out, const TriangleMesh& mesh, const Frame& frame, size_t i) {
  const Eigen::Vector3f p = frame.file_from_internal(mesh.vertices[i].cast<double>()).cast<float>();
  for (const float c : p) append_bytes(out, c);
  if (!mesh.normals.empty()) {
    for (const float c : mesh.normals[i]) append_bytes(out, c);
  }
  if (!mesh.colors.empty()) {
    for (const float c : mesh.colors[i]) append_bytes(out, color_byte(c));
  }
  if (!mesh.support.empty()) append_bytes(out, mesh.support[i]);
  if (!mesh.sigma.empty()) {
    const double sigma = mesh.sigma[i] * frame.scale;
    append_bytes(out, sigma >= 0 ? static_cast<float>(sigma) : -1.0f);  // NaN too
  }
}

/// Where an element keeps a colour.
struct ColorColumns {
  std::array<int, 3> at = {-1, -1, -1};
  float scale = 1;       ///< To [0, 1], but for floats up to 255.
  float below_zero = 0;  ///< What to add to signed numbers that ran over.
  bool has_any() const { return at[0] >= 0; }
  Eigen::Vector3f of(const PlyRow& row) const {
    Eigen::Vector3f out;
    for (int k = 0; k < 3; ++k) {
      const auto value = static_cast<float>(row.values[static_cast<size_t>(at.at(size_t(k)))]);
      out[k] = scale * (value < 0 ? value + below_zero : value);
    }
    return out;
  }
};

/// Positions of the properties we know within an element; -1 = the file does not have it.
struct VertexColumns {
  std::array<int, 3> position{};
  std::array<int, 3> normal{};
  ColorColumns color;
  std::array<int, 2> texcoord = {-1, -1};
  int quality = -1;
  int sigma = -1;
  bool has_normals() const { return *std::min_element(normal.begin(), normal.end()) >= 0; }
};

/// Names that programs give to the three parts of a colour, the usual ones first.
constexpr std::array<std::array<const char*, 3>, 3> kColorNames = {
    {{"red", "green", "blue"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}, {"r", "g", "b"}}};

/// Position of a scalar property; lists of that name do not count.
int find_scalar(const PlyElement& element, std::string_view name) {
  const int i = element.find(name);
  return i >= 0 && !element.properties[static_cast<size_t>(i)].is_list ? i : -1;
}

ColorColumns color_columns(const PlyElement& element) {
  ColorColumns out;
  for (const auto& names : kColorNames) {
    std::array<int, 3> found{};
    for (size_t k = 0; k < 3; ++k) found.at(k) = find_scalar(element, names.at(k));
    if (*std::min_element(found.begin(), found.end()) < 0) continue;
    const PlyType type = element.properties[static_cast<size_t>(found[0])].type;
    const bool is_wide = type == PlyType::UInt16 || type == PlyType::Int16;
    const bool is_float = type == PlyType::Float32 || type == PlyType::Float64;
    out.at = found;
    out.scale = is_float ? 1.0f : is_wide ? 1.0f / 65535.0f : 1.0f / 255.0f;
    out.below_zero = type == PlyType::Int8 ? 256.0f : type == PlyType::Int16 ? 65536.0f : 0.0f;
    break;
  }
  return out;
}

/// Texture coordinates of vertices; -1 where there are none.
std::array<int, 2> texcoord_columns(const PlyElement& vertex) {
  constexpr std::array<std::array<const char*, 2>, 4> kNames = {
      {{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}};
  for (const auto& names : kNames) {
    const std::array<int, 2> found = {find_scalar(vertex, names[0]), find_scalar(vertex, names[1])};
    if (found[0] >= 0 && found[1] >= 0) return found;
  }
  return {-1, -1};
}

/// The pictures that comments name, as MeshLab, Metashape and others do.
std::vector<std::string> texture_names(const PlyHeader& header) {
  constexpr std::string_view kKey = "TextureFile ";
  std::vector<std::string> out;
  for (const std::string& comment : header.comments) {
    if (!comment.starts_with(kKey)) continue;
    const size_t begin = std::min(comment.find_first_not_of(" \t", kKey.size()), comment.size());
    out.push_back(comment.substr(begin, comment.find_last_not_of(" \t") + 1 - begin));
  }
  return out;
}

/// Whether a scalar called quality is the support that write_mesh_ply() keeps there: MeshLab and
/// others call any number of a vertex so.
bool quality_is_support(const PlyHeader& header, const PlyElement& vertex) {
  const PlyElement* face = header.find("face");
  return is_our_ply(header.comments) || vertex.find("scalar_sigma") >= 0 ||
         (face != nullptr && face->find("scalar_provenance") >= 0);
}

VertexColumns vertex_columns(const PlyHeader& header, const std::filesystem::path& path) {
  const PlyElement* vertex = header.find("vertex");
  if (vertex == nullptr) throw BadInput(Defect::Schema, path, "missing element vertex");
  if (vertex->count == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  constexpr std::array<const char*, 3> kPosition = {"x", "y", "z"};
  constexpr std::array<const char*, 3> kNormal = {"nx", "ny", "nz"};
  VertexColumns out;
  for (size_t k = 0; k < 3; ++k) {
    out.position.at(k) = find_scalar(*vertex, kPosition.at(k));
    out.normal.at(k) = find_scalar(*vertex, kNormal.at(k));
    if (out.position.at(k) < 0) {
      throw BadInput(Defect::Schema, path, std::string("missing property ") + kPosition.at(k));
    }
  }
  if (quality_is_support(header, *vertex)) out.quality = find_scalar(*vertex, "quality");
  out.sigma = find_scalar(*vertex, "scalar_sigma");
  out.color = color_columns(*vertex);
  out.texcoord = texcoord_columns(*vertex);
  return out;
}

/// Warning of a file that had labels, or may have had them; empty for others. Programs that know
/// scalars of vertices only keep scalar_sigma.
std::string lost_labels(const PlyHeader& header) {
  const PlyElement* face = header.find("face");
  if (face == nullptr || face->count == 0) return "";
  if (find_scalar(*face, "scalar_provenance") >= 0) return "";
  const auto& comments = header.comments;
  const auto lists_labels = [](const std::string& line) { return line.starts_with(kPlyLabels); };
  if (std::any_of(comments.begin(), comments.end(), lists_labels)) return kLostLabels;
  if (is_our_ply(comments) || find_scalar(*header.find("vertex"), "scalar_sigma") < 0) return "";
  return "it states sigma, but not where its faces come from: another program may have left out "
         "the labels of a file of ours";
}

/// Whether a file shows a picture on its faces, as MeshLab and VCG write them.
bool states_texture(const PlyHeader& header) {
  const PlyElement* face = header.find("face");
  return face != nullptr && face->find("texcoord") >= 0;
}

/// What a file says beyond what is read, for a warning: numbers of vertices by name, and elements
/// that may be faces of another form.
std::string unread_properties(const PlyHeader& header, const ParsedMesh& read) {
  constexpr std::array<std::string_view, 13> kKnown = {"x",
                                                       "y",
                                                       "z",
                                                       "nx",
                                                       "ny",
                                                       "nz",
                                                       "alpha",
                                                       "diffuse_alpha",
                                                       "a",
                                                       "quality",
                                                       "scalar_sigma",
                                                       "s",
                                                       "t"};
  const PlyElement& vertex = *header.find("vertex");
  const ColorColumns color = color_columns(vertex);
  const std::array<int, 2> texcoord = texcoord_columns(vertex);
  const auto is_taken = [&](const PlyProperty& property) {
    const int at = vertex.find(property.name);
    const bool is_texcoord = read.has_textures && (at == texcoord[0] || at == texcoord[1]);
    return is_texcoord || std::find(color.at.begin(), color.at.end(), at) != color.at.end();
  };
  std::string out;
  const auto add = [&](const std::string& what) {
    constexpr size_t kShown = 200;  // characters
    if (out.size() < kShown) out += (out.empty() ? "" : ", ") + printable(what);
  };
  for (const PlyProperty& property : vertex.properties) {
    const bool is_known = std::find(kKnown.begin(), kKnown.end(), property.name) != kKnown.end();
    const bool is_other_quality = property.name == "quality" && !quality_is_support(header, vertex);
    if ((!is_known && !is_taken(property)) || is_other_quality) add(property.name);
  }
  const bool has_other_colors = !read.mesh.colors.empty() && !read.has_textures;
  if (has_other_colors && !texture_names(header).empty()) add("its texture");
  return out;
}

/// Collects rows; positions stay double in file coordinates until the frame is known.
class MeshRows {
 public:
  MeshRows(const PlyHeader& header, const std::filesystem::path& path)
      : path_(path), columns_(vertex_columns(header, path)) {
    vertex_count_ = header.find("vertex")->count;
    shows_pictures_ = !columns_.color.has_any() && !texture_names(header).empty();
    if (const PlyElement* face = header.find("face")) {
      indices_ = list_of_vertices(*face);
      provenance_ = find_scalar(*face, "scalar_provenance");
      face_color_ = color_columns(*face);
      texcoords_ = face->find("texcoord");
      if (texcoords_ >= 0 && !face->properties[static_cast<size_t>(texcoords_)].is_list) {
        texcoords_ = -1;
      }
      texture_ = find_scalar(*face, "texnumber");
      if (face->count > 0 && indices_ < 0) {
        throw BadInput(Defect::Schema, path, "faces have no list vertex_indices");
      }
    }
    if (const PlyElement* strips = header.find("tristrips")) {
      strip_ = list_of_vertices(*strips);
      if (strips->count > 0 && strip_ < 0) {
        throw BadInput(Defect::Schema, path, "triangle strips have no list vertex_indices");
      }
      if (strip_ >= 0) {
        restart_ = largest_of(strips->properties[static_cast<size_t>(strip_)].type);
      }
    }
  }

  void add(const PlyElement& element, uint64_t row_number, const PlyRow& row) {
    if (element.name == "vertex") add_vertex(row);
    if (element.name == "face") add_face(row_number, row);
    if (element.name == "tristrips") add_strips(row_number, row);
  }

  std::vector<Eigen::Vector3d> positions;
  TriangleMesh mesh;
  CornerColors colors_of_faces;
  std::map<size_t, std::vector<PaintedCorner>> painted;  ///< By the number of the picture.
  uint64_t dropped_faces = 0;

 private:
  Eigen::Vector3d triple(const PlyRow& row, const std::array<int, 3>& columns) const {
    return {row.values[static_cast<size_t>(columns[0])],
            row.values[static_cast<size_t>(columns[1])],
            row.values[static_cast<size_t>(columns[2])]};
  }

  static int list_of_vertices(const PlyElement& element) {
    int out = element.find("vertex_indices");
    if (out < 0) out = element.find("vertex_index");
    return out >= 0 && element.properties[static_cast<size_t>(out)].is_list ? out : -1;
  }

  /// What -1 is in a type without sign; -1 for others.
  static double largest_of(PlyType type) {
    switch (type) {
      case PlyType::UInt8:
        return std::numeric_limits<uint8_t>::max();
      case PlyType::UInt16:
        return std::numeric_limits<uint16_t>::max();
      case PlyType::UInt32:
        return std::numeric_limits<uint32_t>::max();
      default:
        return -1;
    }
  }

  void add_vertex(const PlyRow& row) {
    positions.push_back(triple(row, columns_.position));
    if (columns_.has_normals()) {
      mesh.normals.emplace_back(triple(row, columns_.normal).cast<float>());
    }
    if (columns_.color.has_any()) mesh.colors.push_back(columns_.color.of(row));
    if (shows_pictures_ && columns_.texcoord[0] >= 0) {
      const double u = row.values[static_cast<size_t>(columns_.texcoord[0])];
      const double v = row.values[static_cast<size_t>(columns_.texcoord[1])];
      painted[0].push_back({static_cast<uint32_t>(positions.size() - 1),
                            {static_cast<float>(u), static_cast<float>(v)}});
    }
    if (columns_.quality >= 0) {
      mesh.support.push_back(static_cast<float>(row.values[static_cast<size_t>(columns_.quality)]));
    }
    if (columns_.sigma >= 0) {
      mesh.sigma.push_back(static_cast<float>(row.values[static_cast<size_t>(columns_.sigma)]));
    }
  }

  void add_face(uint64_t row_number, const PlyRow& row) {
    if (indices_ < 0) return;
    const std::vector<double>& corners = row.lists[static_cast<size_t>(indices_)];
    for (const double corner : corners) require_vertex(corner, "face ", row_number);
    if (corners.size() < 3) ++dropped_faces;
    polygon_.assign(corners.begin(), corners.end());
    append_polygon(polygon_, positions, mesh.faces);
    if (face_color_.has_any() && !columns_.color.has_any()) {
      const Eigen::Vector3f color = face_color_.of(row);
      for (const uint32_t corner : polygon_) colors_of_faces.add(corner, color);
    }
    if (shows_pictures_ && texcoords_ >= 0) paint(row);
    if (provenance_ >= 0 && mesh.faces.size() > mesh.provenance.size()) {
      mesh.provenance.resize(mesh.faces.size(), label(row_number, row));
    }
  }

  // Two numbers for each corner.
  void paint(const PlyRow& row) {
    const std::vector<double>& list = row.lists[static_cast<size_t>(texcoords_)];
    const double number = texture_ < 0 ? 0 : row.values[static_cast<size_t>(texture_)];
    if (list.size() < 2 * polygon_.size() || !(number >= 0)) return;
    std::vector<PaintedCorner>& corners = painted[static_cast<size_t>(std::min(number, 1e6))];
    for (size_t k = 0; k < polygon_.size(); ++k) {
      corners.push_back(
          {polygon_[k], {static_cast<float>(list[2 * k]), static_cast<float>(list[2 * k + 1])}});
    }
  }

  void require_vertex(double corner, const char* what, uint64_t row_number) const {
    const bool is_whole = std::abs(corner) < 1e15 && corner == std::floor(corner);  // no NaN
    if (is_whole && corner >= 0 && corner < static_cast<double>(vertex_count_)) return;
    std::string number;
    if (is_whole) append_number(number, static_cast<int64_t>(corner));
    if (!is_whole) append_number(number, corner);  // of a list of floats
    throw BadInput(Defect::Ref,
                   path_,
                   what + std::to_string(row_number) + " names vertex " + number + " of " +
                       std::to_string(vertex_count_));
  }

  // -1 ends a strip. Corners that are named twice begin triangles that turn the other way, and have
  // no area themselves.
  void add_strips(uint64_t row_number, const PlyRow& row) {
    if (strip_ < 0) return;
    polygon_.clear();  // of the strip so far
    for (const double corner : row.lists[static_cast<size_t>(strip_)]) {
      if (corner == -1 || (corner == restart_ && corner >= static_cast<double>(vertex_count_))) {
        polygon_.clear();
        continue;
      }
      require_vertex(corner, "triangle strip ", row_number);
      polygon_.push_back(static_cast<uint32_t>(corner));
      const size_t n = polygon_.size();
      if (n < 3) continue;
      std::array<uint32_t, 3> face = {polygon_[n - 3], polygon_[n - 2], polygon_[n - 1]};
      if (n % 2 == 0) std::swap(face[0], face[1]);
      const bool is_flat = face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
      if (!is_flat) mesh.faces.push_back(face);
    }
    if (provenance_ >= 0) mesh.provenance.resize(mesh.faces.size(), Provenance::Inferred);
  }

  Provenance label(uint64_t row_number, const PlyRow& row) const {
    const double value = row.values[static_cast<size_t>(provenance_)];
    for (const Provenance known : kProvenanceOrder) {
      if (value == static_cast<double>(known)) return known;
    }
    throw BadInput(Defect::Value,
                   path_,
                   "face " + std::to_string(row_number) + " has scalar_provenance " +
                       std::to_string(value) + ", allowed are 0 to " +
                       std::to_string(kProvenanceCount - 1));
  }

  const std::filesystem::path& path_;
  VertexColumns columns_;
  uint64_t vertex_count_ = 0;
  int indices_ = -1;
  int provenance_ = -1;
  int strip_ = -1;
  double restart_ = -1;  // ends a strip, as -1 does
  ColorColumns face_color_;
  int texcoords_ = -1;  // of the corners of faces
  int texture_ = -1;    // the number of their picture
  bool shows_pictures_ = false;
  std::vector<uint32_t> polygon_;
};

void paint_by_pictures(const MeshRows& rows,
                       const std::vector<std::string>& names,
                       const std::filesystem::path& path,
                       ParsedMesh& out) {
  CornerColors colors;
  for (const auto& [number, corners] : rows.painted) {
    if (number >= names.size()) continue;
    const bool is_read = paint_corners(path, names[number], {}, corners, colors, out.warnings);
    out.has_textures = out.has_textures || is_read;
  }
  if (!colors.empty()) colors.settle(out);
}

}  // namespace

void write_mesh_ply(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame) {
  write_mesh_ply(path, mesh, frame, {});
}

void write_mesh_ply(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const std::vector<VertexScalar>& scalars) {
  require_writable(mesh, "write_mesh_ply");
  for (const VertexScalar& scalar : scalars) {
    require(scalar.values.size() == mesh.vertices.size(),
            "write_mesh_ply: " + scalar.name + " must have a number per vertex",
            scalar.values.size());
  }
  AtomicFile file(path);
  file.write(header_text(mesh, frame, scalars));
  std::string record;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    record.clear();
    append_vertex(record, mesh, frame, i);
    for (const VertexScalar& scalar : scalars) append_bytes(record, scalar.values[i]);
    file.write(record);
  }
  for (size_t i = 0; i < mesh.faces.size(); ++i) {
    record.assign(1, '\3');
    for (const uint32_t corner : mesh.faces[i]) append_bytes(record, corner);
    if (!mesh.provenance.empty()) {
      append_bytes(record, static_cast<uint8_t>(mesh.provenance[i]));
      append_bytes(record, static_cast<float>(mesh.provenance[i]));
    }
    file.write(record);
  }
  file.commit();
}

ParsedMesh parse_mesh_ply(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  PlyHeader header = parse_ply_header(bytes, path);
  MeshRows rows(header, path);
  const uint64_t trailing = read_ply_rows(
      bytes, path, header, [&](const PlyElement& element, uint64_t i, const PlyRow& row) {
        rows.add(element, i, row);
      });
  ParsedMesh out{std::move(rows.positions), std::move(rows.mesh), header.comments, {}};
  if (const PlyElement* vertex = header.find("vertex")) {
    const int x = vertex->find("x");
    const bool is_double =
        x >= 0 && vertex->properties[static_cast<size_t>(x)].type == PlyType::Float64;
    const bool is_text = header.format == PlyFormat::Ascii;
    out.digits = is_double || is_text ? kDoubleDigits : kFloatDigits;
  }
  settle_colors(out);
  const size_t warnings = out.warnings.size();
  paint_by_pictures(rows, texture_names(header), path, out);
  if (!out.has_textures && !rows.colors_of_faces.empty()) rows.colors_of_faces.settle(out);
  if (out.mesh.colors.empty() && out.warnings.size() == warnings && states_texture(header)) {
    out.warnings.emplace_back(
        "textures and colours of faces are not read, only colours of vertices, which it has none "
        "of");
  }
  const std::string lost = lost_labels(header);
  if (!lost.empty()) out.warnings.push_back(lost);
  const std::string unread = unread_properties(header, out);
  if (!unread.empty()) out.warnings.push_back("not read: " + unread);
  if (trailing > 0) {
    out.warnings.push_back("trailing " + std::to_string(trailing) + " bytes ignored");
  }
  if (rows.dropped_faces > 0) {
    out.warnings.push_back("dropped " + std::to_string(rows.dropped_faces) +
                           " faces of fewer than 3 corners");
  }
  drop_unusable(out, path);
  return out;
}

MeshFile read_mesh_ply(const std::filesystem::path& path, const std::optional<Frame>& frame) {
  ParsedMesh parsed = parse_mesh_ply(path);
  check_significance(parsed, path);
  PlyPlacement placement =
      ply_placement(parsed.comments, opposite_corners(parsed.positions), frame);
  MeshFile out{std::move(parsed.mesh), placement.frame, std::move(placement.warnings)};
  out.mesh.vertices.reserve(parsed.positions.size());
  for (const Eigen::Vector3d& p : parsed.positions) {
    out.mesh.vertices.emplace_back(placement.internal(p).cast<float>());
  }
  for (float& sigma : out.mesh.sigma) sigma = internal_sigma(sigma, out.frame);
  out.warnings.insert(out.warnings.end(), parsed.warnings.begin(), parsed.warnings.end());
  return out;
}

}  // namespace cgs
