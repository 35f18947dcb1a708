// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_loss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "libcgs/render/rasterizer.h"
#include "libcgs/render/virtual_cameras.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr int kViews = 8;
constexpr int kSize = 256;

void compare_centres(const Gaussians& source,
                     const Gaussians& written,
                     std::span<const uint32_t> order,
                     SplatLoss& out) {
  double largest = 0;
  double sum = 0;
  for (size_t i = 0; i < written.size(); ++i) {
    const Eigen::Vector3f& before = source.position[order.empty() ? i : order[i]];
    const double move = (written.position[i] - before).cast<double>().norm();
    largest = std::max(largest, move);
    sum += move * move;
  }
  out.largest_move = largest;
  out.rms_move = std::sqrt(sum / static_cast<double>(written.size()));
}

/// Peak signal-to-noise ratio over all pictures, of the pixels where either shows splats.
std::optional<double> psnr_of_pictures(const Gaussians& source,
                                       const Gaussians& written,
                                       const std::vector<Camera>& cameras,
                                       const Progress& progress) {
  constexpr float kNothing = 0.05f;  // alpha below which there is nothing
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < cameras.size(); ++k) {
    report(progress, double(k) / double(cameras.size()));
    const RenderBuffers a = rasterize(source, cameras[k]);
    const RenderBuffers b = rasterize(written, cameras[k]);
    for (size_t i = 0; i < a.alpha.data.size(); ++i) {
      if (std::max(a.alpha.data[i], b.alpha.data[i]) < kNothing) continue;
      const Eigen::Vector3f x = a.color.data[i].cwiseMin(1.0f);
      const Eigen::Vector3f y = b.color.data[i].cwiseMin(1.0f);
      sum += (x - y).cast<double>().squaredNorm();
      count += 3;
    }
  }
  if (count == 0) return std::nullopt;
  if (sum == 0) return std::numeric_limits<double>::infinity();
  return -10 * std::log10(sum / static_cast<double>(count));
}

std::string percent(double part) {
  if (part < 1e-5) return "under 0.001 %";
  std::ostringstream out;
  out.precision(2);
  out << 100 * part << " %";
  return out.str();
}

}  // namespace

SplatLoss splat_loss(const Gaussians& source,
                     const Gaussians& written,
                     std::span<const uint32_t> order,
                     const Progress& progress) {
  SplatLoss out;
  out.dropped = source.size() - std::min(source.size(), written.size());
  if (source.size() == written.size()) compare_centres(source, written, order, out);
  VirtualCameraOptions options;
  options.views = kViews;
  options.size = kSize;
  const VirtualCameras cameras = virtual_cameras(source, options);
  out.extent = 2 * cameras.radius;
  out.views = cameras.cameras.size();
  out.psnr = psnr_of_pictures(source, written, cameras.cameras, progress);
  out.sh_degree_before = source.sh_degree;
  out.sh_degree_after = written.sh_degree;
  out.provenance_before = !source.provenance.empty();
  out.provenance_after = !written.provenance.empty();
  return out;
}

std::string splat_loss_line(const SplatLoss& loss, const Frame& frame) {
  std::ostringstream out;
  out.precision(1);
  out << std::fixed << "the file reads back with ";
  if (!loss.largest_move) {
    out << loss.dropped << " splats missing";
  } else if (*loss.largest_move == 0) {
    out << "centres as they were";
  } else {
    out << "centres moved by up to " << format_length(*loss.largest_move, frame) << " ("
        << percent(*loss.largest_move / loss.extent) << " of the scene), "
        << format_length(*loss.rms_move, frame) << " rms (" << percent(*loss.rms_move / loss.extent)
        << ")";
  }
  if (loss.sh_degree_after < loss.sh_degree_before) {
    out << ", colours that " << (loss.sh_degree_after == 0 ? "no longer" : "less finely")
        << " change with direction";
  }
  if (loss.provenance_before && !loss.provenance_after) out << ", without provenance";
  out << "; " << loss.views << " pictures ";
  if (!loss.psnr) {
    out << "show too little to compare";
  } else if (std::isinf(*loss.psnr)) {
    out << "are the same";
  } else {
    out << "agree to " << *loss.psnr << " dB PSNR";
  }
  return out.str();
}

Json splat_loss_to_json(const SplatLoss& loss, const Frame& frame) {
  Json out = {{"dropped", loss.dropped}, {"centres", nullptr}};
  if (loss.largest_move) {
    out["centres"] = {{"largest_move", *loss.largest_move * frame.scale},
                      {"rms_move", *loss.rms_move * frame.scale},
                      {"unit", frame.unit_name()},
                      {"largest_of_extent", *loss.largest_move / loss.extent},
                      {"rms_of_extent", *loss.rms_move / loss.extent}};
  }
  Json psnr;
  if (loss.psnr) psnr = std::isinf(*loss.psnr) ? Json("same") : Json(*loss.psnr);
  out["pictures"] = {{"psnr", psnr}, {"views", loss.views}};
  out["sh_degree"] = {{"before", loss.sh_degree_before}, {"after", loss.sh_degree_after}};
  out["provenance"] = {{"before", loss.provenance_before}, {"after", loss.provenance_after}};
  return out;
}

}  // namespace cgs
