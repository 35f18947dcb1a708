// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/measure/section.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "meshing/measure/surface_measures.h"

namespace cgs {

namespace {

// A piece of the section within one face, between two edges of the mesh.
struct Piece {
  size_t from;
  size_t to;
  uint32_t face;
};

// All pieces, and where the plane crosses the edges.
class Crossings {
 public:
  Crossings(const MeasurableMesh& mesh, const CutPlane& plane) : mesh_(mesh), plane_(plane) {
    heights_.reserve(mesh.points.size());
    for (const Eigen::Vector3d& p : mesh.points) {
      heights_.push_back((p - plane.point).dot(plane.normal));
    }
    std::vector<std::array<uint64_t, 2>> ends;
    for (uint32_t f = 0; f < mesh.mesh.faces.size(); ++f) add_face(f, ends);
    std::vector<uint64_t> edges;
    for (const auto& pair : ends) edges.insert(edges.end(), pair.begin(), pair.end());
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    const auto node = [&](uint64_t edge) {
      return static_cast<size_t>(std::lower_bound(edges.begin(), edges.end(), edge) -
                                 edges.begin());
    };
    for (size_t i = 0; i < pieces.size(); ++i) {
      pieces[i].from = node(ends[i][0]);
      pieces[i].to = node(ends[i][1]);
    }
    for (const uint64_t edge : edges) {
      nodes.push_back(cross(static_cast<uint32_t>(edge >> 32), static_cast<uint32_t>(edge)));
    }
  }

  struct Node {
    Eigen::Vector2d place;
    double sigma;  // of the surface along its normal
  };
  std::vector<Node> nodes;
  std::vector<Piece> pieces;

 private:
  static uint64_t key(uint32_t a, uint32_t b) {
    return uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }

  void add_face(uint32_t f, std::vector<std::array<uint64_t, 2>>& ends) {
    const auto& face = mesh_.mesh.faces[f];
    const auto above = [&](size_t k) { return heights_[face.at(k % 3)] >= 0; };
    for (size_t k = 0; k < 3; ++k) {
      if (above(k) == above(k + 1) || above(k) == above(k + 2)) continue;
      // Corner k alone on its side: the inside stays to the left of the piece.
      const uint64_t first = key(face.at(k), face.at((k + 1) % 3));
      const uint64_t second = key(face.at((k + 2) % 3), face.at(k));
      ends.push_back(above(k) ? std::array{first, second} : std::array{second, first});
      pieces.push_back({0, 0, f});
      return;
    }
  }

  Node cross(uint32_t low, uint32_t high) const {
    const double t = heights_[low] / (heights_[low] - heights_[high]);
    const Eigen::Vector3d p =
        mesh_.points[low] + t * (mesh_.points[high] - mesh_.points[low]) - plane_.point;
    Node out{{p.dot(plane_.right), p.dot(plane_.up)}, std::nan("")};
    if (!mesh_.mesh.sigma.empty()) {
      out.sigma = (1 - t) * double(mesh_.mesh.sigma[low]) + t * double(mesh_.mesh.sigma[high]);
    }
    return out;
  }

  const MeasurableMesh& mesh_;
  const CutPlane& plane_;
  std::vector<double> heights_;
};

// A line as nodes and the faces between them.
struct Chain {
  std::vector<size_t> nodes;
  std::vector<uint32_t> faces;
  bool closed = false;
};

class Stitcher {
 public:
  explicit Stitcher(const Crossings& crossings)
      : pieces_(crossings.pieces), used_(crossings.pieces.size(), 0) {
    for (size_t i = 0; i < pieces_.size(); ++i) {
      at_.push_back({pieces_[i].from, i});
      at_.push_back({pieces_[i].to, i});
    }
    std::sort(at_.begin(), at_.end());
  }

  std::vector<Chain> stitch() {
    std::vector<Chain> out;
    for (size_t i = 0; i < at_.size();) {  // open lines first, from their ends
      size_t end = i;
      while (end < at_.size() && at_[end].first == at_[i].first) ++end;
      const size_t piece = at_[i].second;
      if ((end - i) % 2 == 1 && used_[piece] == 0) out.push_back(follow(piece, at_[i].first));
      i = end;
    }
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
      if (used_[piece] == 0) out.push_back(follow(piece, pieces_[piece].from));
    }
    return out;
  }

 private:
  Chain follow(size_t piece, size_t start) {
    constexpr auto kNoPiece = static_cast<size_t>(-1);
    Chain chain;
    size_t node = start;
    size_t backwards = 0;
    while (piece != kNoPiece) {
      used_[piece] = 1;
      chain.nodes.push_back(node);
      chain.faces.push_back(pieces_[piece].face);
      if (pieces_[piece].from != node) ++backwards;
      node = pieces_[piece].from == node ? pieces_[piece].to : pieces_[piece].from;
      if (node == start) break;
      piece = kNoPiece;
      for (auto it = std::lower_bound(at_.begin(), at_.end(), std::pair{node, size_t{0}});
           it != at_.end() && it->first == node;
           ++it) {
        if (used_[it->second] == 0 && (piece == kNoPiece || pieces_[it->second].from == node)) {
          piece = it->second;
        }
      }
    }
    chain.closed = node == start;
    if (!chain.closed) chain.nodes.push_back(node);
    if (2 * backwards > chain.faces.size()) {
      std::reverse(chain.faces.begin(), chain.faces.end());
      std::reverse(chain.nodes.begin() + (chain.closed ? 1 : 0), chain.nodes.end());
    }
    return chain;
  }

  const std::vector<Piece>& pieces_;
  std::vector<uint8_t> used_;
  std::vector<std::pair<size_t, size_t>> at_;  // node and piece, sorted
};

// Without pieces of no length, which vertices in the plane leave.
DrawnLine drawn(const Chain& chain, const Crossings& crossings, const MeasurableMesh& mesh) {
  DrawnLine out;
  out.closed = chain.closed;
  const size_t count = chain.nodes.size();
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& here = crossings.nodes[chain.nodes[i]].place;
    const bool last = i + 1 == count;
    if (last && !chain.closed) {
      out.points.push_back(here);
      break;
    }
    if (here == crossings.nodes[chain.nodes[(i + 1) % count]].place) continue;
    out.points.push_back(here);
    if (mesh.states_provenance()) {
      out.of_segment.push_back(mesh.mesh.provenance[chain.faces[i]]);
    }
  }
  return out;
}

double signed_area(const DrawnLine& line) {
  double sum = 0;
  const Eigen::Vector2d& first = line.points.front();
  for (size_t i = 0; i < line.points.size(); ++i) {
    const Eigen::Vector2d a = line.points[i] - first;
    const Eigen::Vector2d b = line.points[(i + 1) % line.points.size()] - first;
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum / 2;
}

// What the surface moves the line by, within the plane: more, the flatter they meet.
double shift_in_plane(const MeasurableMesh& mesh, const CutPlane& plane, uint32_t face) {
  const auto& f = mesh.mesh.faces[face];
  const Eigen::Vector3d normal = (mesh.points[f[1]] - mesh.points[f[0]])
                                     .cross(mesh.points[f[2]] - mesh.points[f[0]])
                                     .stableNormalized();
  const double across = normal.dot(plane.normal);
  constexpr double kFlattest = 0.1;  // below, the first-order rule says nothing any more
  return 1 / std::max(kFlattest, std::sqrt(std::max(0.0, 1 - across * across)));
}

struct Cut {
  const MeasurableMesh& mesh;
  const CutPlane& plane;
  const Crossings& crossings;
};

struct Uncertainty {
  double stated_length = 0;
  SigmaSum lengths;
  double ends = 0;  // of open lines: sum of the squares of what they are off by along the surface
  SigmaSum areas;
};

// A cut through a face: from one of its edges to another.
struct FaceCut {
  uint32_t face = 0;
  double sigma = 0;  // of its ends, across the surface
  Eigen::Vector2d along;
};

// Those of a line but for those without length, which a plane through a vertex leaves: their
// direction means nothing.
std::vector<FaceCut> face_cuts(const Crossings& crossings, const Chain& chain) {
  constexpr double kNoLength = 1e-12;  // of the line's extent
  Eigen::AlignedBox2d box;
  for (const auto node : chain.nodes) box.extend(crossings.nodes[node].place);
  std::vector<FaceCut> out;
  for (size_t i = 0; i < chain.faces.size(); ++i) {
    const auto& a = crossings.nodes[chain.nodes[i]];
    const auto& b = crossings.nodes[chain.nodes[(i + 1) % chain.nodes.size()]];
    const Eigen::Vector2d along = b.place - a.place;
    if (along.norm() <= kNoLength * box.diagonal().norm()) continue;
    out.push_back({chain.faces[i], (a.sigma + b.sigma) / 2, along});
  }
  return out;
}

bool is_invented(const MeasurableMesh& mesh, uint32_t face) {
  return mesh.states_provenance() && !has_evidence(mesh.mesh.provenance[face]);
}

// Adds a line's share to sigma of length and area, and to the stated length. Where all surface
// moves outwards, an outline grows and a hole in it shrinks: the area gains by both.
void add_uncertainty(const Cut& cut, const Chain& chain, bool bounds_area, Uncertainty& sum) {
  const auto& [mesh, plane, crossings] = cut;
  const std::vector<FaceCut> cuts = face_cuts(crossings, chain);
  for (size_t i = 0; i < cuts.size(); ++i) {
    const auto& [face, sigma_across, along] = cuts[i];
    const double sigma = sigma_across * shift_in_plane(mesh, plane, face);
    if (!std::isfinite(sigma) || is_invented(mesh, face)) continue;
    sum.stated_length += along.norm();
    if (bounds_area) sum.areas.add(sigma * along.norm());
    if (i + 1 == cuts.size() && !chain.closed) continue;
    const Eigen::Vector2d before = along.stableNormalized();
    const Eigen::Vector2d after = cuts[(i + 1) % cuts.size()].along.stableNormalized();
    const Eigen::Vector2d middle = (before + after).stableNormalized();
    const Eigen::Vector2d outwards(middle.y(), -middle.x());
    sum.lengths.add(sigma * (before - after).dot(outwards));
  }
  if (chain.closed) return;
  for (const auto& [node, face] : {std::pair(chain.nodes.front(), chain.faces.front()),
                                   std::pair(chain.nodes.back(), chain.faces.back())}) {
    const double sigma = kTangential * crossings.nodes[node].sigma;
    if (std::isfinite(sigma) && !is_invented(mesh, face)) sum.ends += sigma * sigma;
  }
}

}  // namespace

CutPlane cut_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  require(normal.allFinite() && normal.norm() > 0,
          "the normal of a plane needs a direction",
          normal.transpose());
  CutPlane out;
  out.point = point;
  out.normal = normal.stableNormalized();
  Eigen::Index axis = 0;
  if (out.normal.cwiseAbs().maxCoeff(&axis) == 1) {
    out.right = axis == 0 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
    out.up = axis == 2 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
    return out;
  }
  out.right = Eigen::Vector3d::UnitZ().cross(out.normal).normalized();
  out.up = out.normal.cross(out.right);
  return out;
}

Section section(const MeasurableMesh& mesh, const CutPlane& plane) {
  const Crossings crossings(mesh, plane);
  const std::vector<Chain> chains = Stitcher(crossings).stitch();
  Section out;
  std::vector<const Chain*> kept;
  for (const Chain& chain : chains) {
    DrawnLine line = drawn(chain, crossings, mesh);
    if (line.points.size() < (line.closed ? 3 : 2)) continue;
    for (size_t i = 0; i < line.segments(); ++i) {
      const double piece = (line.points[(i + 1) % line.points.size()] - line.points[i]).norm();
      out.length.value += piece;
      if (!line.of_segment.empty()) {
        out.length.by_provenance.at(static_cast<size_t>(line.of_segment[i])) += piece;
      }
    }
    if (!line.closed) ++out.open_lines;
    out.lines.push_back(std::move(line));
    kept.push_back(&chain);
  }
  Uncertainty sum;
  out.area.dimension = 2;
  for (size_t i = 0; i < out.lines.size(); ++i) {
    // Material lies to the left of lines, as it lies behind faces for the volume.
    const double area = out.lines[i].closed ? signed_area(out.lines[i]) : 0;
    out.area.value += area;
    add_uncertainty({mesh, plane, crossings}, *kept[i], area != 0, sum);
  }
  out.area.value = std::abs(out.area.value);  // faces may all look inward
  out.length.stated = sum.stated_length / (out.length.value > 0 ? out.length.value : 1);
  out.area.stated = out.length.stated;
  if (out.length.stated > 0) {
    out.length.sigma = std::hypot(sum.lengths.sigma(), std::sqrt(sum.ends));
    out.area.sigma = sum.areas.sigma();
  }
  if (out.open_lines > 0) out.area.value = out.area.sigma = std::nan("");
  return out;
}

}  // namespace cgs
