// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/colmap_writer.h"

#include <array>
#include <cassert>
#include <charconv>
#include <sstream>

#include "io/bytes/atomic_file.h"

namespace cgs {

namespace {

// A number as the shortest text that reads back as the same number.
struct Exact {
  double value;
};

std::ostream& operator<<(std::ostream& out, const Exact& number) {
  std::array<char, 32> text = {};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number.value).ptr;
  return out.write(text.data(), end - text.data());
}

void write_camera(uint32_t id, const ColmapCamera& colmap, std::ostream& out) {
  const Camera& c = colmap.camera;
  const auto& [k1, k2, p1, p2, k3] = colmap.distortion;
  assert(k3 == 0 && !colmap.fisheye);
  const bool has_one_focal = c.fx == c.fy;
  const bool is_radial = k2 == 0 && p1 == 0 && p2 == 0;
  const char* model = "OPENCV";
  std::vector<double> parameters = {c.fx, c.fy, c.cx, c.cy, k1, k2, p1, p2};
  if (has_one_focal && is_radial) {
    model = k1 == 0 ? "SIMPLE_PINHOLE" : "SIMPLE_RADIAL";
    parameters = {c.fx, c.cx, c.cy};
    if (k1 != 0) parameters.push_back(k1);
  } else if (is_radial && k1 == 0) {
    model = "PINHOLE";
    parameters.resize(4);
  }
  out << id << " " << model << " " << c.width << " " << c.height;
  for (const double parameter : parameters) out << " " << Exact{parameter};
  out << "\n";
}

std::string cameras_text(const ColmapModel& model) {
  std::ostringstream out;
  out << "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (const auto& [id, camera] : model.cameras) write_camera(id, camera, out);
  return out.str();
}

// Per image, which point each of its places shows; -1 = none.
std::map<uint32_t, std::vector<int64_t>> points_shown(const ColmapModel& model) {
  std::map<uint32_t, std::vector<int64_t>> shown;
  for (const ColmapImage& image : model.images) shown[image.id].assign(image.points.size(), -1);
  for (size_t i = 0; i < model.points.size(); ++i) {
    for (const auto& [image, place] : model.points[i].track) {
      shown.at(image).at(place) = static_cast<int64_t>(i + 1);
    }
  }
  return shown;
}

std::string images_text(const ColmapModel& model) {
  const auto shown = points_shown(model);
  std::ostringstream out;
  out << "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of X Y POINT3D_ID\n";
  for (const ColmapImage& image : model.images) {
    out << image.id;
    for (const double q : image.rotation) out << " " << Exact{q};
    for (const double t : image.translation) out << " " << Exact{t};
    out << " " << image.camera_id << " " << image.name << "\n";
    for (size_t k = 0; k < image.points.size(); ++k) {
      out << (k > 0 ? " " : "") << Exact{image.points[k].x()} << " " << Exact{image.points[k].y()}
          << " " << shown.at(image.id)[k];
    }
    out << "\n";
  }
  return out.str();
}

std::string points_text(const ColmapModel& model) {
  std::ostringstream out;
  out << "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n";
  for (size_t i = 0; i < model.points.size(); ++i) {
    const ColmapPoint& point = model.points[i];
    out << i + 1;
    for (const double x : point.position) out << " " << Exact{x};
    for (const int level : point.color) out << " " << level;
    out << " " << Exact{point.error};
    for (const auto& [image, place] : point.track) out << " " << image << " " << place;
    out << "\n";
  }
  return out.str();
}

}  // namespace

void write_colmap_text(const std::filesystem::path& folder, const ColmapModel& model) {
  make_output_folder(folder);
  write_file(folder / "cameras.txt", cameras_text(model));
  write_file(folder / "images.txt", images_text(model));
  write_file(folder / "points3D.txt", points_text(model));
}

}  // namespace cgs
