// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/painted_fill.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "libcgs/reconstruct/synthetic_sight.h"
#include "libcgs/render/hidden_depth.h"
#include "libcgs/render/membrane.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

/// A painted view and what is known of its holes.
struct Painting {
  PaintedView view;
  RenderBuffers shown;  ///< With what earlier views painted.
  MaskMap open;         ///< 1 = to be filled from this one.
  DepthMap far_side;    ///< Where the far side of what is open goes on.
  DepthMap depth;       ///< Of what is painted; NaN = nowhere.
};

constexpr std::array<std::pair<int, int>, 4> kNeighbours = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

Painting painting_of(const Model& model,
                     const std::vector<SupportView>& inputs,
                     const Gaussians& earlier,
                     const Camera& camera,
                     ViewFill& report) {
  Painting out{{camera, {}, {}, {}}, render_camera(model, inputs, camera), {}, {}, {}};
  const RenderBuffers fill = rasterize(earlier, camera);
  out.open = MaskMap(camera.width, camera.height, 0);
  for (size_t i = 0; i < out.open.data.size(); ++i) {
    if (!is_hole(out.shown.hole.data[i])) continue;
    ++report.holes;
    const bool is_filled = shows_fill(out.shown, fill, i);
    report.filled_before += is_filled ? 1 : 0;
    out.open.data[i] = is_filled ? 0 : 1;
  }
  out.shown = with_fill(std::move(out.shown), fill);
  out.far_side = hidden_depth(out.shown, out.open);
  out.depth = out.far_side;
  return out;
}

void check_size(const PaintedView& view, const Camera& camera) {
  require(view.picture.width == camera.width && view.picture.height == camera.height,
          "a painted picture must be of the size of its camera; its width",
          view.picture.width);
  const MaskMap& left_open = view.left_open;
  require(
      left_open.empty() || (left_open.width == camera.width && left_open.height == camera.height),
      "the mask of what was not painted must be of the size of the camera; its width",
      left_open.width);
}

bool is_left_open(const Painting& painting, size_t pixel) {
  const MaskMap& left_open = painting.view.left_open;
  return !left_open.empty() && left_open.data[pixel] != 0;
}

void take_view(PaintedView view, Painting& painting, ViewFill& report) {
  check_size(view, painting.view.camera);
  view.camera = painting.view.camera;
  painting.view = std::move(view);
  for (size_t i = 0; i < painting.open.data.size(); ++i) {
    if (painting.open.data[i] == 0) continue;
    if (is_left_open(painting, i)) {
      painting.open.data[i] = 0;
      painting.depth.data[i] = kNaN;
      ++report.left_open;
      continue;
    }
    report.unplaced += std::isnan(painting.depth.data[i]) ? 1 : 0;
    report.moved_back += painting.depth.data[i] > painting.far_side.data[i] ? 1 : 0;
  }
}

// Moves what is to be painted out of the way of input views.
void clear_sights(const std::vector<SupportView>& inputs, Painting& painting) {
  const Camera& camera = painting.view.camera;
  DepthMap& depth = painting.depth;
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      if (painting.open(x, y) == 0 || std::isnan(depth(x, y))) continue;
      depth(x, y) = hidden_from_all(inputs, camera, x, y, depth(x, y));
    }
  });
}

// By how much a painted pixel beside a seam differs from the far side next to it; nothing where it
// has none.
std::optional<Eigen::Vector3f> seam_offset(const Painting& painting,
                                           const ColorImage& around,
                                           int x,
                                           int y) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float count = 0;
  for (const auto& [dx, dy] : kNeighbours) {
    const int u = x + dx;
    const int v = y + dy;
    if (!around.contains(u, v) || painting.open(u, v) != 0) continue;
    if (is_left_open(painting, around.index(u, v))) continue;
    const float there = painting.shown.median_depth(u, v);
    const float here = painting.depth(x, y);
    const bool goes_on = there >= kFarSide * here && here >= kFarSide * there;
    if (!goes_on) continue;  // what stands before it, the sky behind it, or unknown
    sum += around(u, v) - painting.view.picture(x, y);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

// What was painted, with colours that go over into those of the far side.
ColorImage without_seams(const Painting& painting) {
  const float reach = static_cast<float>(painting.view.picture.width) / 64;  // [pixels]
  constexpr int kSweeps = 100;
  const ColorImage around = picture(painting.shown);
  ColorImage out = painting.view.picture;
  Raster<MembranePixel> pixels(out.width, out.height, MembranePixel::Outside);
  std::array<Raster<float>, 3> offset;
  offset.fill(Raster<float>(out.width, out.height, 0));
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      if (painting.open(x, y) == 0 || std::isnan(painting.depth(x, y))) continue;
      const auto at_seam = seam_offset(painting, around, x, y);
      pixels(x, y) = at_seam ? MembranePixel::Fixed : MembranePixel::Open;
      for (int c = 0; at_seam && c < 3; ++c)
        offset.at(static_cast<size_t>(c))(x, y) = (*at_seam)[c];
    }
  }
  for (int c = 0; c < 3; ++c) {
    Raster<float>& plane = offset.at(static_cast<size_t>(c));
    relax_membrane(plane, pixels, reach, kSweeps);
    for (size_t i = 0; i < out.data.size(); ++i) {
      out.data[i][c] = std::clamp(out.data[i][c] + plane.data[i], 0.0f, 1.0f);
    }
  }
  return out;
}

// How a painted surface moves on from pixel to pixel along an axis; a pixel sideways where it is
// torn.
Eigen::Vector3d step_on(const Painting& painting, int x, int y, int dx, int dy) {
  const Camera& camera = painting.view.camera;
  const double z = painting.depth(x, y);
  const Eigen::Vector3d here = camera.unproject(x + 0.5, y + 0.5, z);
  const Eigen::Vector3d flat = camera.unproject(x + 0.5 + dx, y + 0.5 + dy, z) - here;
  const auto to = [&](int sign) -> std::optional<Eigen::Vector3d> {
    constexpr double kTorn = 0.05;  // of the depth, from a pixel to the next
    const int u = x + sign * dx;
    const int v = y + sign * dy;
    if (!painting.depth.contains(u, v)) return std::nullopt;
    const double beside = painting.depth(u, v);
    if (!(std::abs(beside - z) < kTorn * z)) return std::nullopt;  // also if unknown
    return sign * (camera.unproject(u + 0.5, v + 0.5, beside) - here);
  };
  const auto after = to(1);
  const auto before = to(-1);
  if (after && before) return 0.5 * (*after + *before);
  return after ? *after : before ? *before : flat;
}

// A disc of half a pixel along the surface.
void add_disc(const Painting& painting, int x, int y, Gaussians& out) {
  constexpr double kRadius = 0.5;  // [pixels]
  constexpr double kFlat = 0.2;    // thickness, in radii
  const double pixel = painting.view.camera.pixel_size(double(painting.depth(x, y)));
  Eigen::Matrix3d M;
  M.col(0) = step_on(painting, x, y, 1, 0);
  M.col(1) = step_on(painting, x, y, 0, 1);
  M.col(2) = kFlat * pixel * M.col(0).cross(M.col(1)).normalized();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(kRadius * kRadius * M * M.transpose());
  Eigen::Matrix3d R = axes.eigenvectors();
  if (R.determinant() < 0) R.col(0) *= -1;
  const Eigen::Quaterniond turn(R);
  const double z = painting.depth(x, y);
  out.position.push_back(painting.view.camera.unproject(x + 0.5, y + 0.5, z).cast<float>());
  const Eigen::Vector3d variance = axes.eigenvalues().cwiseMax(1e-4 * pixel * pixel);
  out.scale.push_back(variance.cwiseSqrt().cast<float>());
  out.rotation.push_back(Eigen::Vector4d(turn.w(), turn.x(), turn.y(), turn.z()).cast<float>());
}

// The Gaussians of a painting; tags count from its own source.
Gaussians discs_of(const Painting& painting, const ColorImage& colors) {
  constexpr float kOpacity = 0.98f;
  Gaussians out;
  for (int y = 0; y < colors.height; ++y) {
    for (int x = 0; x < colors.width; ++x) {
      if (painting.open(x, y) == 0 || std::isnan(painting.depth(x, y))) continue;
      add_disc(painting, x, y, out);
      out.sh.push_back((colors(x, y) - Eigen::Vector3f::Constant(0.5f)) / kShC0);
    }
  }
  out.opacity.assign(out.size(), kOpacity);
  out.provenance.assign(out.size(), Provenance::Inferred);
  out.synthetic.assign(out.size(), 1);
  out.synthetic_sources = {painting.view.source};
  return out;
}

void check_painted(const Model& model, size_t views) {
  require(!model.priors.empty(),
          "what is a hole is told by the input views of a model; the number of these",
          model.priors.size());
  constexpr size_t kMost = 255;
  require(views <= kMost, "the number of painted views must be <= 255", views);
}

}  // namespace

double open_share(const PaintedFill& fill) {
  size_t holes = 0;
  size_t open = 0;
  for (const ViewFill& view : fill.views) {
    holes += view.holes;
    open += view.left_open + view.unplaced + view.shone_through;
  }
  return holes == 0 ? 0 : double(open) / double(holes);
}

PaintedFill lift_painted(const Model& model,
                         const std::vector<PaintedView>& views,
                         const Progress& progress) {
  std::vector<Camera> cameras;
  for (const PaintedView& view : views) {
    check_size(view, view.camera);
    cameras.push_back(view.camera);
  }
  return lift_painted(
      model, cameras, [&views](size_t k, const ViewToPaint&) { return views[k]; }, progress);
}

PaintedFill lift_painted(const Model& model,
                         const std::vector<Camera>& cameras,
                         const HolePainter& paint,
                         const Progress& progress) {
  check_painted(model, cameras.size());
  const std::vector<SupportView> inputs = support_views(model);
  const SyntheticSight sight(model);
  PaintedFill out;
  for (size_t k = 0; k < cameras.size(); ++k) {
    report(progress, double(k) / double(cameras.size()));
    ViewFill& told = out.views.emplace_back();
    Painting painting = painting_of(model, inputs, out.gaussians, cameras[k], told);
    clear_sights(inputs, painting);
    const ViewToPaint to_paint{cameras[k], inputs, painting.shown, painting.open, painting.depth};
    take_view(paint(k, to_paint), painting, told);
    const size_t before = out.gaussians.size();
    append(out.gaussians, discs_of(painting, without_seams(painting)));
    told.lifted = out.gaussians.size() - before;
    sight.drop_visible(out.gaussians);
  }
  // Those of an earlier view may only show once a later one is there.
  const std::vector<uint8_t>& tags = out.gaussians.synthetic;
  for (size_t k = 0; k < cameras.size(); ++k) {
    ViewFill& told = out.views[k];
    const auto kept = std::count(tags.begin(), tags.end(), static_cast<uint8_t>(k + 1));
    told.shone_through = told.lifted - static_cast<size_t>(kept);
    told.lifted = static_cast<size_t>(kept);
  }
  report(progress, 1);
  return out;
}

}  // namespace cgs
