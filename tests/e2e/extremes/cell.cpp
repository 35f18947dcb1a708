// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/extremes/cell.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <sstream>
#include <string_view>

#include <nlohmann/json.hpp>

#include "tests/support/full_sweep.h"
#include "tests/support/scene_files.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/stereo_scene.h"

namespace cgs::test {

namespace fs = std::filesystem;

namespace {

constexpr int kViews = 24;
constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr double kTexture = 0.12;

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

// Coordinates of few bits, so that scaling and moving them by whole numbers rounds nothing.
Eigen::Vector3d coarse(const Eigen::Vector3d& p) { return (p * 1024).array().round() / 1024; }

std::vector<TexturedPatch> patches() {
  std::vector<TexturedPatch> out = {
      {{0, 0, 3.5}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}};
  add_box(out, {-0.55, -0.45, 2.6}, {0.05, 0.25, 3.2});
  add_box(out, {0.25, -0.2, 2.9}, {0.75, 0.5, 3.4});
  return out;
}

Camera camera_of(int view) {
  const double angle = 0.075 * (view - 11.5);
  const Eigen::Vector3d target(0, 0, 3);
  const Eigen::Vector3d center(3 * std::sin(angle), 0.02 * view - 0.3, 3 - 3 * std::cos(angle));
  return looking_at(coarse(center), target, kWidth, kHeight, 70);
}

std::string view_name(int view) {
  return std::string("v") + char('0' + view / 10) + char('0' + view % 10);
}

const std::vector<std::string>& photographs() {
  static const std::vector<std::string> kPhotographs = [] {
    std::vector<std::string> out;
    for (int view = 0; view < kViews; ++view) {
      const ColorImage image = photograph(patches(), camera_of(view), kTexture);
      std::vector<std::string> rows(kHeight);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          for (const float c : image(x, y)) rows[size_t(y)] += char(std::lround(255 * c));
        }
      }
      out.push_back(png(kWidth, rows));
    }
    return out;
  }();
  return kPhotographs;
}

}  // namespace

double Cell::bits(double extent) const {
  const double farthest = std::max(move.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
  const double spacing = std::nextafter(farthest, 2 * farthest) - farthest;
  return std::log2(scale * extent / spacing);
}

bool Cell::is_exact() const {
  int exponent = 0;
  const bool is_power = std::frexp(scale, &exponent) == 0.5;
  const double grid = std::ldexp(scale, -8);  // the scene is between 2 and 4 wide
  const Eigen::Vector3d cells = move / grid;
  return is_power && cells == Eigen::Vector3d(cells.array().round()) &&
         (move.isZero(0) || bits(1) > 29);
}

const std::vector<Cell>& cells() {
  static const std::vector<Cell> kCells = [] {
    const std::vector<std::pair<std::string_view, Eigen::Vector3d>> moves = {
        {"T=0", Eigen::Vector3d::Zero()},
        {"T=1e3", Eigen::Vector3d(1e3, -1e3, 1e3)},
        {"T=UTM", Eigen::Vector3d(4.5e5, 5.4e6, 100)},
        {"T=ECEF", Eigen::Vector3d(-2.49e6, -4.68e6, 3.53e6)}};
    const bool is_full = is_full_sweep();
    std::vector<Cell> out;
    for (const auto& [name, move] : moves) {
      for (const double scale : {0x1p-20, 1e-6, 1e-3, 1.0, 1e3, 1e6, 0x1p20}) {
        const bool is_corner = (scale == 0x1p-20 || scale == 0x1p20) && !name.starts_with("T=1");
        if (!is_full && name != "T=UTM" && scale != 1 && !is_corner) continue;
        std::ostringstream label;
        label << "S=" << scale << " " << name;
        out.push_back({scale, move, label.str()});
      }
    }
    return out;
  }();
  return kCells;
}

void write_scene(const fs::path& folder, const Cell& cell) {
  std::string frames;
  for (int view = 0; view < kViews; ++view) {
    const std::string image = "images/" + view_name(view) + ".png";
    write_bytes(folder / image, photographs()[size_t(view)]);
    const Camera camera = camera_of(view);
    Eigen::Matrix3d axes = camera.world_from_cam.linear();
    axes.rightCols<2>() *= -1;  // OpenGL: +y up, +z backward
    const Eigen::Vector3d center = cell.place(camera.center());
    std::string rows;
    for (int r = 0; r < 3; ++r) {
      rows += "[" + number(axes(r, 0)) + "," + number(axes(r, 1)) + "," + number(axes(r, 2)) + "," +
              number(center[r]) + "],";
    }
    frames += std::string(frames.empty() ? "" : ",\n") + R"({"file_path":")" + image +
              R"(","transform_matrix":[)" + rows + "[0,0,0,1]]}";
  }
  write_bytes(folder / "transforms.json",
              R"({"fl_x":70,"fl_y":70,"cx":32,"cy":24,"w":64,"h":48,"frames":[)" + frames + "]}");
}

DepthMap true_depth_of(int view) { return true_depth(patches(), camera_of(view)); }

std::vector<Eigen::Vector3d> torus_points() { return torus_mesh(0.75, 0.25, 40, 20).points; }

double torus_volume() {
  const MeasurableMesh torus = torus_mesh(0.75, 0.25, 40, 20);
  double sum = 0;
  for (const auto& f : torus.mesh.faces) {
    sum += torus.points[f[0]].dot(torus.points[f[1]].cross(torus.points[f[2]])) / 6;
  }
  return std::abs(sum);
}

void write_torus(const fs::path& file, const Cell& cell) {
  const MeasurableMesh torus = torus_mesh(0.75, 0.25, 40, 20);
  std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                    std::to_string(torus.points.size()) +
                    "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                    std::to_string(torus.mesh.faces.size()) +
                    "\nproperty list uchar int vertex_index\nend_header\n";
  for (const Eigen::Vector3d& p : torus.points) {
    const Eigen::Vector3d q = cell.place(p);
    out += packed(q.x(), q.y(), q.z());
  }
  for (const auto& f : torus.mesh.faces) out += packed(uint8_t{3}, f[0], f[1], f[2]);
  write_bytes(file, out);
}

std::vector<Eigen::Vector3d> PlyColumns::in_world() const {
  std::vector<Eigen::Vector3d> out;
  for (size_t i = 0; i < columns.at("x").size(); ++i) {
    const Eigen::Vector3d p(columns.at("x")[i], columns.at("y")[i], columns.at("z")[i]);
    out.emplace_back(p + origin);
  }
  return out;
}

PlyColumns read_ply_columns(const fs::path& file) {
  const std::string bytes = read_bytes(file);
  const size_t data = bytes.find("end_header\n") + 11;
  std::istringstream header(bytes.substr(0, data));
  PlyColumns out;
  std::vector<std::pair<std::string, std::string>> fields;  // type, name
  size_t count = 0;
  size_t faces = 0;
  size_t after_list = 0;  // bytes of a face behind its corners
  std::string element;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "comment" && words >> word && word == "file_origin") {
      words >> out.origin.x() >> out.origin.y() >> out.origin.z();
    } else if (word == "element") {
      words >> element;
      words >> (element == "vertex" ? count : faces);
    } else if (word == "property") {
      std::string type;
      words >> type >> word;
      if (element == "vertex") fields.emplace_back(type, word);
      if (element == "face" && type != "list") after_list += type == "uchar" ? 1 : 4;
    }
  }
  const char* at = bytes.data() + data;
  for (size_t i = 0; i < count; ++i) {
    for (const auto& [type, name] : fields) {
      double value = 0;
      if (type == "float") {
        float single = 0;
        std::memcpy(&single, at, 4);
        value = single;
      }
      if (type == "double") std::memcpy(&value, at, 8);
      at += type == "double" ? 8 : type == "uchar" ? 1 : type == "ushort" ? 2 : 4;
      out.columns[name].push_back(value);
    }
  }
  for (size_t i = 0; i < faces; ++i, at += 13 + after_list) {
    std::memcpy(out.faces.emplace_back().data(), at + 1, 12);
  }
  return out;
}

std::vector<Eigen::Vector3d> read_obj_points(const fs::path& file) {
  std::istringstream lines(read_bytes(file));
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> out;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    Eigen::Vector3d p;
    if (word == "v" && words >> p.x() >> p.y() >> p.z()) out.emplace_back(p + origin);
    if (word == "#" && words >> word && word == "file_origin") {
      words >> origin.x() >> origin.y() >> origin.z();
    }
  }
  return out;
}

std::vector<Eigen::Vector3d> read_stl_corners(const fs::path& file) {
  const std::string bytes = read_bytes(file);
  std::vector<Eigen::Vector3d> out;
  for (size_t facet = 84; facet + 50 <= bytes.size(); facet += 50) {
    for (size_t corner = 0; corner < 3; ++corner) {
      std::array<float, 3> p{};
      std::memcpy(p.data(), bytes.data() + facet + 12 + 12 * corner, 12);
      out.emplace_back(p[0], p[1], p[2]);
    }
  }
  return out;
}

void write_moved_model(const fs::path& plain, const fs::path& folder, const Cell& cell) {
  std::string ply = read_bytes(plain / "gaussians.ply");
  const PlyColumns columns = read_ply_columns(plain / "gaussians.ply");
  const size_t data = ply.find("end_header\n") + 11;
  const size_t count = columns.columns.at("x").size();
  const size_t stride = (ply.size() - data) / count / 4;  // all are floats
  std::vector<float> values(count * stride);
  std::memcpy(values.data(), ply.data() + data, 4 * values.size());
  std::istringstream header(ply.substr(0, data));
  std::string head;
  std::map<std::string, size_t> place;
  for (std::string line; std::getline(header, line);) {
    if (line.rfind("comment", 0) == 0) continue;
    if (line.rfind("property float ", 0) == 0) place.emplace(line.substr(15), place.size());
    head += line + "\n";
    if (line.rfind("format ", 0) == 0 && !cell.is_refused()) {
      head += "comment file_origin " + number(cell.move.x()) + " " + number(cell.move.y()) + " " +
              number(cell.move.z()) + "\n";
    }
  }
  const Eigen::Vector3d offset = cell.is_refused() ? cell.move : Eigen::Vector3d::Zero();
  for (size_t i = 0; i < count; ++i) {
    float* row = &values[i * stride];
    for (int k = 0; k < 3; ++k) {
      float& p = row[place.at(std::string(1, char('x' + k)))];
      p = float(cell.scale * p + offset[k]);
      float& s = row[place.at("scale_" + std::to_string(k))];
      s = float(s + std::log(cell.scale));
    }
  }
  write_bytes(folder / "gaussians.ply",
              head + std::string(reinterpret_cast<const char*>(values.data()), 4 * values.size()));
  nlohmann::json cameras = nlohmann::json::parse(read_bytes(plain / "cameras.json"));
  nlohmann::json moved = nlohmann::json::array();
  for (nlohmann::json& camera : cameras) {
    for (const char* ours : {"frame", "internal_position", "role", "image_path", "near", "far"}) {
      camera.erase(ours);
    }
    for (int k = 0; k < 3; ++k) {
      camera["position"][size_t(k)] =
          cell.scale * camera["position"][size_t(k)].get<double>() + offset[k];
    }
    moved.push_back(camera);
  }
  write_bytes(folder / "cameras.json", moved.dump());
}

}  // namespace cgs::test
