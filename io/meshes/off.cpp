// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/off.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "io/bytes/byte_reader.h"

namespace cgs {

namespace {

using OffWords = std::vector<std::string_view>;

OffWords words_of(std::string_view line) { return tokens(line.substr(0, line.find('#'))); }

bool is_whole_number(std::string_view word) {
  uint64_t unused = 0;
  return parse_number(word, unused);
}

struct OffHeader {
  uint64_t vertices = 0;
  uint64_t faces = 0;
  size_t normal = 0;  ///< Place of the first part among the numbers of a vertex; 0 = it has none.
  size_t color = 0;   ///< Likewise.
};

/// Whether a word begins with a keyword of the format, "STCNOFF": its letters before "OFF".
std::optional<std::string_view> kind_in(std::string_view word) {
  const size_t end = word.find("OFF");
  if (end == std::string_view::npos) return std::nullopt;
  std::string_view rest = word.substr(0, end);
  for (const std::string_view letter : {"ST", "C", "N", "4", "n"}) {
    if (rest.starts_with(letter)) rest.remove_prefix(letter.size());
  }
  const bool is_other_order = rest == "N" || rest == "C";  // "NCOFF", as some write it
  if (!rest.empty() && !is_other_order) return std::nullopt;
  return word.substr(0, end);
}

/// The numbers may follow the keyword on its line, in some files even without a blank; and the
/// keyword may be left out.
OffHeader read_header(TextLines& lines) {
  OffWords words = words_of(expect_line(lines, "the OFF keyword"));
  if (words.empty()) lines.fail(Defect::Magic, "does not start with OFF");
  const auto kind = kind_in(words[0]);
  const bool is_bare =
      words.size() == 3 && std::all_of(words.begin(), words.end(), is_whole_number);
  if (!kind && !is_bare) lines.fail(Defect::Magic, "does not start with OFF");
  OffHeader out;
  if (kind) {
    if (kind->find_first_of("4n") != std::string_view::npos) {
      lines.fail(Defect::Unsupported, "only three dimensions are supported");
    }
    if (kind->find('N') != std::string_view::npos) out.normal = 3;
    if (kind->find('C') != std::string_view::npos) out.color = out.normal + 3;
    words[0].remove_prefix(kind->size() + 3);
    if (words[0].empty()) words.erase(words.begin());
  }
  if (!words.empty() && words[0] == "BINARY") {
    lines.fail(Defect::Unsupported, "binary OFF is not supported");
  }
  if (words.empty()) words = words_of(expect_line(lines, "the numbers of vertices and faces"));
  if (words.size() < 2) lines.fail(Defect::Syntax, "expected the numbers of vertices and faces");
  out.vertices = lines.count(words[0]);
  out.faces = lines.count(words[1]);
  return out;
}

Eigen::Vector3d off_triple(const TextLines& lines, const OffWords& words, size_t at) {
  return {lines.measured(words[at]), lines.measured(words[at + 1]), lines.measured(words[at + 2])};
}

/// Whether colours are whole numbers from 0 to 255 or floats up to 1, which may be written without
/// a point, so that all of them are looked at.
class ColorScale {
 public:
  void look_at(std::span<const std::string_view> words, const TextLines& lines) {
    are_whole_ = are_whole_ && std::all_of(words.begin(), words.end(), is_whole_number);
    for (const std::string_view word : words) {
      brightest_ = std::max(brightest_, lines.measured(word));
    }
  }
  /// What one is divided by.
  float white() const { return are_whole_ && brightest_ > 1 ? 255 : 1; }

 private:
  bool are_whole_ = true;
  double brightest_ = 0;
};

/// The vertices and what is said of them.
class OffVertices {
 public:
  OffVertices(TextLines& lines, const OffHeader& header, ParsedMesh& out)
      : lines_(lines), header_(header), out_(out) {}

  void read() {
    for (uint64_t i = 0; i < header_.vertices; ++i) add(words_of(expect_line(lines_, "a vertex")));
    if (!all_have_normals_) out_.mesh.normals.clear();
    for (Eigen::Vector3f& color : out_.mesh.colors) color /= scale_.white();
    settle_colors(out_);
    fill_in_colors(out_, colored_);
  }

 private:
  void add(const OffWords& words) {
    if (words.size() < 3) lines_.fail(Defect::Syntax, "a vertex needs three coordinates");
    out_.positions.push_back(off_triple(lines_, words, 0));
    all_have_normals_ = all_have_normals_ && header_.normal > 0 && words.size() >= 6;
    if (all_have_normals_) {
      const Eigen::Vector3d n = off_triple(lines_, words, header_.normal);
      const double length = n.norm();
      out_.mesh.normals.emplace_back((length > 0 ? n / length : n).cast<float>());
    }
    if (header_.color == 0 || words.size() < header_.color + 3) return;
    colored_.push_back(out_.positions.size() - 1);
    out_.mesh.colors.emplace_back(off_triple(lines_, words, header_.color).cast<float>());
    const size_t numbers = std::min<size_t>(words.size() - header_.color, 4);  // with the opacity
    scale_.look_at(std::span(words).subspan(header_.color, numbers), lines_);
  }

  TextLines& lines_;
  const OffHeader& header_;
  ParsedMesh& out_;
  std::vector<size_t> colored_;  // vertices that state a colour
  ColorScale scale_;
  bool all_have_normals_ = true;
};

/// The faces, and their colours: three or four numbers behind the corners, whole ones from 0 to 255
/// or floats up to 1. A single one is a place in a colour map elsewhere.
class OffFaces {
 public:
  OffFaces(TextLines& lines, const OffHeader& header, ParsedMesh& out)
      : lines_(lines), header_(header), out_(out) {}

  void read() {
    for (uint64_t i = 0; i < header_.faces; ++i) add(words_of(expect_line(lines_, "a face")));
    settle_face_colors();
    if (has_numbered_colors_) {
      out_.warnings.emplace_back("colours of faces that are numbers of a colour map are not read");
    }
    if (dropped_ > 0) {
      out_.warnings.push_back("dropped " + std::to_string(dropped_) +
                              " faces of fewer than 3 corners");
    }
  }

 private:
  void add(const OffWords& words) {
    const uint64_t count = words.empty() ? 0 : lines_.count(words[0]);
    if (words.empty() || count > words.size() - 1) {
      lines_.fail(Defect::Count, "a face has fewer corners than it says");
    }
    corners_.clear();
    for (uint64_t k = 1; k <= count; ++k) {
      const uint64_t corner = lines_.count(words[k]);
      if (corner >= header_.vertices) {
        lines_.fail(Defect::Ref,
                    "a face names vertex " + std::to_string(corner) + " of " +
                        std::to_string(header_.vertices));
      }
      corners_.push_back(static_cast<uint32_t>(corner));
    }
    if (count < 3) ++dropped_;
    append_polygon(corners_, out_.positions, out_.mesh.faces);
    if (out_.mesh.colors.empty())
      add_color({words.begin() + static_cast<ptrdiff_t>(count) + 1, words.end()});
  }

  void add_color(const OffWords& words) {
    if (words.size() == 1) has_numbered_colors_ = true;
    if (words.size() < 3) return;
    const Eigen::Vector3f color = off_triple(lines_, words, 0).cast<float>();
    scale_.look_at(std::span(words).first(3), lines_);
    for (const uint32_t corner : corners_) colors_.emplace_back(corner, color);
  }

  void settle_face_colors() {
    if (colors_.empty()) return;
    const float scale = 1 / scale_.white();
    CornerColors of_corners;
    for (const auto& [corner, color] : colors_) of_corners.add(corner, scale * color);
    of_corners.settle(out_);
  }

  TextLines& lines_;
  const OffHeader& header_;
  ParsedMesh& out_;
  std::vector<uint32_t> corners_;
  std::vector<std::pair<uint32_t, Eigen::Vector3f>> colors_;  // of corners
  ColorScale scale_;
  bool has_numbered_colors_ = false;
  uint64_t dropped_ = 0;
};

/// Takes words off a text and writes each record of them on a line of its own.
class OffRecords {
 public:
  explicit OffRecords(const std::string& bytes) {
    size_t at = 0;
    while (at < bytes.size()) {
      const size_t end = std::min(bytes.find('\n', at), bytes.size());
      for (const std::string_view word : words_of(std::string_view(bytes).substr(at, end - at))) {
        words_.push_back(word);
      }
      at = end + 1;
    }
  }
  /// \pre count > 0
  /// \return false where fewer are left
  bool take(uint64_t count) {
    if (count > words_.size() - next_) return false;
    for (uint64_t i = 0; i < count; ++i) out_.append(words_[next_++]).push_back(' ');
    out_.back() = '\n';
    return true;
  }
  std::optional<uint64_t> number_ahead(size_t steps = 0) const {
    uint64_t out = 0;
    const bool is_there = next_ + steps < words_.size();
    return is_there && parse_number(words_[next_ + steps], out) ? std::optional(out) : std::nullopt;
  }
  bool is_at_end() const { return next_ == words_.size(); }
  std::string text() && { return std::move(out_); }

 private:
  OffWords words_;
  size_t next_ = 0;
  std::string out_;
};

/// The format takes any white space between numbers; where lines are no records, this makes them
/// such. Records can only be told apart without lines where the file states nothing but points and
/// faces; nullopt for others.
std::optional<std::string> one_record_per_line(const std::string& bytes) {
  OffRecords records(bytes);
  if (!bytes.starts_with("OFF") || !records.take(1)) return std::nullopt;
  const auto vertices = records.number_ahead();
  const auto faces = records.number_ahead(1);
  if (!vertices || !faces || !records.take(3)) return std::nullopt;
  for (uint64_t i = 0; i < *vertices; ++i) {
    if (!records.take(3)) return std::nullopt;
  }
  for (uint64_t i = 0; i < *faces; ++i) {
    const auto corners = records.number_ahead();
    if (!corners || *corners > bytes.size() || !records.take(*corners + 1)) return std::nullopt;
  }
  if (!records.is_at_end()) return std::nullopt;
  return std::move(records).text();
}

ParsedMesh parse_off(const std::string& bytes, const std::filesystem::path& path) {
  TextLines lines(bytes, path);
  const OffHeader header = read_header(lines);
  ByteReader(bytes, path).expect_records(header.vertices, 6, "vertices");
  ByteReader(bytes, path).expect_records(header.faces, 2, "faces");
  if (header.vertices == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  ParsedMesh out;
  OffVertices(lines, header, out).read();
  OffFaces(lines, header, out).read();
  drop_unusable(out, path);
  return out;
}

}  // namespace

ParsedMesh read_off(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  refuse_foreign_content(path, bytes, "OFF");
  try {
    return parse_off(bytes, path);
  } catch (const BadInput&) {
    const auto records = one_record_per_line(bytes);
    if (!records) throw;
    return parse_off(*records, path);
  }
}

}  // namespace cgs
