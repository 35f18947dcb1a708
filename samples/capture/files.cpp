// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/files.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "io/bytes/atomic_file.h"
#include "libcgs/core/error.h"
#include "samples/capture/render.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

void write_png(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes)) throw IoError(path, "PNG encoder failed");
  write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat bgr8(const ColorImage& image) {
  cv::Mat out(image.height, image.width, CV_8UC3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3f level = (255 * image(x, y)).array().round();
      out.at<cv::Vec3b>(y, x) = {static_cast<uint8_t>(level.z()),
                                 static_cast<uint8_t>(level.y()),
                                 static_cast<uint8_t>(level.x())};
    }
  }
  return out;
}

// A raster of floats whose pixels are consecutive channels of the given names.
void write_exr(const std::filesystem::path& path,
               const float* pixels,
               const std::array<int, 2>& size,
               const std::vector<const char*>& channels) {
  AtomicFile file(path);
  const std::string part = file.release_to_library().string();
  try {
    Imf::Header header(size[0], size[1]);
    Imf::FrameBuffer buffer;
    const size_t stride = channels.size() * sizeof(float);
    for (size_t c = 0; c < channels.size(); ++c) {
      header.channels().insert(channels[c], Imf::Channel(Imf::FLOAT));
      auto* base = const_cast<char*>(reinterpret_cast<const char*>(pixels + c));
      buffer.insert(channels[c],
                    Imf::Slice(Imf::FLOAT, base, stride, stride * static_cast<size_t>(size[0])));
    }
    Imf::OutputFile out(part.c_str(), header);
    out.setFrameBuffer(buffer);
    out.writePixels(size[1]);
  } catch (const std::exception& error) {
    throw IoError(path, error.what());
  }
  file.commit();
}

void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment unit metre\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(mesh.faces.size()) +
                      "\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const auto& v : mesh.vertices) {
    bytes.append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(float));
  }
  for (const auto& f : mesh.faces) {
    bytes += '\3';
    bytes.append(reinterpret_cast<const char*>(f.data()), sizeof(f));
  }
  write_file(path, bytes);
}

// OpenGL cameras look along -z with +y up: two axes change sign.
Json opengl_pose(const Camera& camera) {
  Eigen::Matrix4d pose = camera.world_from_cam.matrix();
  pose.col(1) *= -1;
  pose.col(2) *= -1;
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
  return rows;
}

std::string image_path(const CaptureView& view) { return "images/" + view.name + ".png"; }

void write_cameras(const std::filesystem::path& folder,
                   const std::vector<CaptureView>& views,
                   const std::optional<PlantedWater>& water) {
  Json transforms = {{"camera_model", "OPENCV"}};
  Json capture = {{"unit", "m"}, {"input", Json::array()}, {"held_out", Json::array()}};
  for (const auto& view : views) {
    const Camera& c = view.camera;
    transforms["frames"].push_back({{"file_path", image_path(view)},
                                    {"w", c.width},
                                    {"h", c.height},
                                    {"fl_x", c.fx},
                                    {"fl_y", c.fy},
                                    {"cx", c.cx},
                                    {"cy", c.cy},
                                    {"transform_matrix", opengl_pose(c)}});
    transforms[view.input ? "train_filenames" : "test_filenames"].push_back(image_path(view));
    capture[view.input ? "input" : "held_out"].push_back(view.name);
  }
  if (water) {
    capture["water"] = {{"attenuation", water->attenuation},
                        {"backscatter", water->backscatter},
                        {"veil", water->veil}};
    if (water->lamp_range > 0) capture["water"]["lamp_range"] = water->lamp_range;
  }
  write_file(folder / "transforms.json", transforms.dump(1) + "\n");
  write_file(folder / "capture.json", capture.dump(1) + "\n");
}

void write_truth(const std::filesystem::path& folder,
                 const std::string& name,
                 const ViewTruth& truth) {
  const std::array<int, 2> size{truth.depth.width, truth.depth.height};
  write_exr(folder / (name + "_depth.exr"), truth.depth.data.data(), size, {"Z"});
  write_exr(folder / (name + "_normal.exr"),
            truth.normal.data.front().data(),
            size,
            {"N.X", "N.Y", "N.Z"});
  cv::Mat seen(size[1], size[0], CV_8UC1);
  std::memcpy(seen.data, truth.seen.data.data(), truth.seen.data.size());
  write_png(folder / (name + "_seen.png"), seen);
}

}  // namespace

void write_capture(const std::filesystem::path& folder,
                   const PortalScene& scene,
                   const std::vector<CaptureView>& views,
                   std::span<const Camera> inputs,
                   const std::optional<PlantedWater>& water) {
  make_output_folder(folder / "images");
  make_output_folder(folder / "truth");
  const std::vector<float> sky = sky_visibility(scene);
  for (const auto& view : views) {
    const ViewTruth truth = view_truth(scene, view.camera, inputs);
    ColorImage picture = render_view(scene, sky, view.camera, view.seed);
    if (water) {
      write_png(folder / "truth" / (view.name + "_clear.png"), bgr8(picture));
      picture = under_water(picture, view.camera, truth.depth, *water);
    }
    write_png(folder / image_path(view), bgr8(picture));
    write_truth(folder / "truth", view.name, truth);
  }
  write_mesh(folder / "truth" / "mesh.ply", scene.mesh);
  write_cameras(folder, views, water);
}

void write_masks(const std::filesystem::path& folder,
                 const PortalScene& scene,
                 const std::vector<CaptureView>& views,
                 const std::string& part) {
  const auto named = std::find_if(
      scene.parts.begin(), scene.parts.end(), [&](const auto& p) { return p.name == part; });
  require(named != scene.parts.end(), "a part of the scene must be named", part);
  make_output_folder(folder / "masks");
  for (const auto& view : views) {
    const Raster<uint8_t> shown =
        part_mask(scene, view.camera, static_cast<size_t>(named - scene.parts.begin()));
    cv::Mat mask(shown.height, shown.width, CV_8UC1);
    std::memcpy(mask.data, shown.data.data(), shown.data.size());
    write_png(folder / "masks" / (view.name + ".png"), mask);
  }
  write_mesh(folder / "truth" / (part + ".ply"), part_mesh(scene, *named));
}

}  // namespace cgs
