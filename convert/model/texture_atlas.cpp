// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/texture_atlas.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <stb_rect_pack.h>

#include "convert/model/texture.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/mesh/halfedges.h"

namespace cgs {

namespace {

// Of a photograph around the faces of its chart: what bilinear lookups and mipmaps reach for.
constexpr int kMargin = 4;  // [pixels of the atlas]

/// Faces of one photograph that are cut out of it together.
struct Chart {
  int photograph = 0;
  Eigen::AlignedBox2d box;  ///< Of the faces, in the photograph [pixels].
  double pixel = 0;         ///< Median size on the surface [internal units].
};

struct Charts {
  std::vector<Chart> charts;
  std::vector<int> of_face;  ///< PhotoTexture::kNone as in the texture.
};

/// Adds one face to a chart. \return the size of a pixel there
double extend(const TriangleMesh& mesh, const Camera& camera, size_t face, Chart& chart) {
  double depth = 0;
  for (const uint32_t v : mesh.faces[face]) {
    const Eigen::Vector3d uvz = camera.project(mesh.vertices[v].cast<double>());
    chart.box.extend(uvz.head<2>());
    depth += uvz.z() / 3;
  }
  return camera.pixel_size(depth);
}

Charts charts_of(const TriangleMesh& mesh, const PhotoTexture& texture) {
  const auto adjacent = halfedges::adjacent_faces(mesh);
  Charts out;
  out.of_face.assign(mesh.faces.size(), PhotoTexture::kNone);
  for (uint32_t start = 0; start < mesh.faces.size(); ++start) {
    const int photograph = texture.of_face[start];
    if (photograph < 0 || out.of_face[start] >= 0) continue;
    const Camera& camera = texture.photographs[static_cast<size_t>(photograph)].camera;
    const int number = static_cast<int>(out.charts.size());
    Chart chart{photograph, {}, 0};
    std::vector<double> pixels;
    std::vector<uint32_t> faces = {start};
    out.of_face[start] = number;
    for (size_t i = 0; i < faces.size(); ++i) {
      pixels.push_back(extend(mesh, camera, faces[i], chart));
      for (const uint32_t next : adjacent[faces[i]]) {
        if (texture.of_face[next] != photograph || out.of_face[next] >= 0) continue;
        out.of_face[next] = number;
        faces.push_back(next);
      }
    }
    chart.pixel = median(pixels);
    out.charts.push_back(chart);
  }
  return out;
}

/// How much smaller a chart becomes, whose pixels are to be as large as a texel at least.
double share_of(const Chart& chart, double texel) { return std::min(1.0, chart.pixel / texel); }

double room(const Chart& chart, double texel) {
  const Eigen::Vector2d size = chart.box.sizes() * share_of(chart, texel);
  return (size.array() + 2 * kMargin).prod();
}

/// Joins charts that take no more room together than apart, as those within and close to each other
/// do: a ragged surface has thousands of few faces each.
Charts joined(Charts all, double texel) {
  std::vector<Chart>& charts = all.charts;
  std::vector<size_t> order(charts.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return room(charts[a], texel) > room(charts[b], texel);
  });
  std::map<int, std::vector<size_t>> left;  // of each photograph, those that are no part yet
  for (const size_t i : order) left[charts[i].photograph].push_back(i);
  std::vector<int> number(charts.size(), PhotoTexture::kNone);  // of the chart it becomes a part of
  std::vector<Chart> out;
  for (auto& [photograph, rest] : left) {
    while (!rest.empty()) {
      Chart whole = charts[rest.front()];
      const auto becomes_part = [&](size_t i) {
        const Chart both{
            photograph, whole.box.merged(charts[i].box), std::max(whole.pixel, charts[i].pixel)};
        if (room(both, texel) > room(whole, texel) + room(charts[i], texel)) return false;
        whole = both;
        number[i] = static_cast<int>(out.size());
        return true;
      };
      while (std::erase_if(rest, becomes_part) > 0) {
      }
      out.push_back(whole);
    }
  }
  charts = std::move(out);
  for (int& chart : all.of_face) {
    if (chart >= 0) chart = number[static_cast<size_t>(chart)];
  }
  return all;
}

/// The part of a photograph that a chart shows, with a margin.
/// \param texel  [internal units]; its pixels are made as large where they are smaller
Photograph cut_out(const Chart& chart, const Photograph& photograph, double texel) {
  const double share = share_of(chart, texel);
  const double margin = kMargin / share;
  const Eigen::Vector2i limit(photograph.camera.width, photograph.camera.height);
  const Eigen::Vector2i low =
      (chart.box.min().array() - margin).floor().cast<int>().max(0).matrix();
  const Eigen::Vector2i high =
      (chart.box.max().array() + margin).ceil().cast<int>().min(limit.array()).matrix();
  Photograph out;
  out.camera = photograph.camera;
  out.camera.width = high.x() - low.x();
  out.camera.height = high.y() - low.y();
  out.camera.cx -= low.x();
  out.camera.cy -= low.y();
  out.image = ColorImage(out.camera.width, out.camera.height, Eigen::Vector3f::Zero());
  for (int y = 0; y < out.camera.height; ++y) {
    for (int x = 0; x < out.camera.width; ++x) {
      out.image(x, y) = photograph.image(low.x() + x, low.y() + y);
    }
  }
  const auto reduced = [&](int size) { return std::max(1, int(std::lround(share * size))); };
  const int width = reduced(out.camera.width);
  const int height = reduced(out.camera.height);
  if (width != out.camera.width || height != out.camera.height) reduce(out, width, height);
  return out;
}

/// Places of photographs in one picture of a width; as high as they need.
/// \return nothing if that is more than kLargestAtlasSide
/// Source: skyline, bottom left, as stb_rect_pack has it; the tallest first.
std::optional<TextureAtlas> packed_into(const std::vector<Photograph>& photographs, int width) {
  std::vector<stbrp_rect> rects;
  for (const Photograph& photograph : photographs) {
    stbrp_rect rect{};
    rect.w = photograph.camera.width;
    rect.h = photograph.camera.height;
    rects.push_back(rect);
  }
  std::vector<stbrp_node> nodes(static_cast<size_t>(width));
  stbrp_context context;
  stbrp_init_target(&context, width, kLargestAtlasSide, nodes.data(), width);
  if (stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size())) == 0) return {};
  TextureAtlas out;
  out.size.x() = width;
  for (const stbrp_rect& rect : rects) {
    out.corner.emplace_back(rect.x, rect.y);
    out.size.y() = std::max(out.size.y(), rect.y + rect.h);
  }
  return out;
}

/// About as wide as it is high.
std::optional<TextureAtlas> packed(const std::vector<Photograph>& photographs) {
  double area = 0;
  int widest = 0;
  for (const Photograph& photograph : photographs) {
    area += double(photograph.camera.width) * photograph.camera.height;
    widest = std::max(widest, photograph.camera.width);
  }
  constexpr double kRoomBetween = 1.1;  // of the area, which no packing can do without
  const int width = std::max(widest, static_cast<int>(std::sqrt(kRoomBetween * area)) + 1);
  return width <= kLargestAtlasSide ? packed_into(photographs, width) : std::nullopt;
}

}  // namespace

PackedTexture packed_texture(const TriangleMesh& mesh, const PhotoTexture& texture, double texel) {
  Charts charts = charts_of(mesh, texture);
  double finest = charts.charts.front().pixel;
  for (const Chart& chart : charts.charts) finest = std::min(finest, chart.pixel);
  PackedTexture out;
  out.texel = std::max(texel, finest);
  charts = joined(std::move(charts), out.texel);
  out.texture.of_face = std::move(charts.of_face);
  constexpr double kCoarser = 1.05;
  for (;; out.texel *= kCoarser) {
    out.texture.photographs.clear();
    for (const Chart& chart : charts.charts) {
      out.texture.photographs.push_back(
          cut_out(chart, texture.photographs[static_cast<size_t>(chart.photograph)], out.texel));
      out.texture.photographs.back().name =
          "chart " + std::to_string(out.texture.photographs.size());
    }
    out.texture.atlas = packed(out.texture.photographs);
    if (out.texture.atlas) return out;
  }
}

}  // namespace cgs
