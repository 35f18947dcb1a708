// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/bad_inputs/valid_inputs.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include <fcntl.h>
#include <sys/file.h>

#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "tests/support/run_cgs.h"

namespace cgs::test {

std::string picture_png(int view) {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    std::string row;
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + 2 * view;
      const auto level = [](double v) { return static_cast<char>(std::lround(127 + 90 * v)); };
      row += {level(std::sin(0.9 * u) * std::cos(1.3 * y)), level(std::sin(0.5 * u + y)), 127};
    }
    rows.push_back(row);
  }
  return png(kWidth, rows);
}

Call info_call(const fs::path& folder) {
  return {{"info", folder / "scene", "--json"}, [folder] {
            for (const std::string& warning : read_scene(folder / "scene").warnings) {
              std::fprintf(stderr, "cgs: warning: %s\n", one_line(warning).c_str());
            }
          }};
}
Call train_call(const fs::path& folder) {
  return {{"train", folder / "scene", "-q", "-o", folder / "out"}, {}};
}
Call run_call(const fs::path& folder) {
  return {{"run", folder / "scene", "-q", "-o", folder / "out"}, {}};
}
Call render_call(const fs::path& folder) {
  return {{"render", folder / "model", "-q", "--views", "0", "-o", folder / "out"}, {}};
}
Call mesh_call(const fs::path& folder) {
  return {{"mesh", folder / "volume.vdb", "-q", "-o", folder / "out"}, {}};
}

void lock_for_good(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) != 0) throw std::runtime_error("cannot lock");
}

nlohmann::json transforms() {
  nlohmann::json document = {
      {"w", kWidth}, {"h", kHeight}, {"fl_x", kFocal}, {"fl_y", kFocal}, {"cx", 16}, {"cy", 12}};
  for (int i = 0; i < 3; ++i) {
    document["frames"].push_back(
        {{"file_path", "images/" + std::to_string(i) + ".png"},
         {"transform_matrix", {{1, 0, 0, 0.1 * i}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
  }
  return document;
}

namespace {

void write_pictures(const fs::path& folder) {
  for (int i = 0; i < 3; ++i) {
    write_bytes(folder / ("scene/images/" + std::to_string(i) + ".png"), picture_png(i));
  }
}

}  // namespace

void write_transforms_scene(const fs::path& folder, const nlohmann::json& document) {
  write_pictures(folder);
  write_bytes(folder / "scene/transforms.json", document.dump(1));
}

std::vector<std::vector<double>> llff_rows(int views) {
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < views; ++i) {
    // Columns of the 3 x 5 block: down, right, backward, position, (height, width, focal).
    rows.push_back({0, 1, 0, 0.1 * i, kHeight, -1, 0, 0, 0, kWidth, 0, 0, 1, 0, kFocal, 1, 10});
  }
  return rows;
}

void write_llff_scene(const fs::path& folder, const std::string& poses) {
  write_pictures(folder);
  write_bytes(folder / "scene/poses_bounds.npy", poses);
}

std::string colmap_camera(uint32_t id,
                          int32_t model,
                          const std::vector<double>& parameters,
                          uint64_t width,
                          uint64_t height) {
  std::string out = packed(id, model, width, height);
  for (const double value : parameters) out += packed(value);
  return out;
}

std::string colmap_image(const ColmapImageFields& fields) {
  std::string out = packed(fields.id);
  for (const double value : fields.rotation) out += packed(value);
  for (const double value : fields.translation) out += packed(value);
  out += packed(fields.camera) + fields.name + '\0';
  return out + packed(uint64_t{1}, 3.0, 4.0, fields.point_of_keypoint);
}

std::string colmap_point(const std::array<double, 3>& xyz,
                         const std::vector<std::pair<uint32_t, uint32_t>>& track) {
  std::string out = packed(uint64_t{7}, xyz[0], xyz[1], xyz[2]) + std::string(3, '\x40');
  out += packed(0.5, uint64_t{track.size()});
  for (const auto& [image, keypoint] : track) out += packed(image, keypoint);
  return out;
}

ColmapFiles colmap_files() {
  ColmapFiles files;
  files.cameras = packed(uint64_t{1}) + colmap_camera(1, 1, {kFocal, kFocal, 16, 12});
  files.images = packed(uint64_t{3});
  for (uint32_t i = 0; i < 3; ++i) {
    ColmapImageFields image;
    image.id = i + 1;
    image.translation = {-0.1 * i, 0, 0};
    image.name = std::to_string(i) + ".png";
    files.images += colmap_image(image);
  }
  files.points = packed(uint64_t{2}) + colmap_point({0, 0, 1.5}, {{1, 0}, {2, 0}}) +
                 colmap_point({0.1, 0, 1.5}, {{2, 0}, {3, 0}});
  return files;
}

void write_colmap_scene(const fs::path& folder, const ColmapFiles& files) {
  write_pictures(folder);
  write_bytes(folder / "scene/sparse/0/cameras.bin", files.cameras);
  write_bytes(folder / "scene/sparse/0/images.bin", files.images);
  write_bytes(folder / "scene/sparse/0/points3D.bin", files.points);
}

void write_colmap_text_scene(const fs::path& folder) {
  write_pictures(folder);
  write_bytes(folder / "scene/sparse/0/cameras.txt", "# cameras\n1 PINHOLE 32 24 30 30 16 12\n");
  write_bytes(folder / "scene/sparse/0/images.txt",
              "1 1 0 0 0 0 0 0 1 0.png\n3 4 7\n2 1 0 0 0 -0.1 0 0 1 1.png\n3 4 7\n"
              "3 1 0 0 0 -0.2 0 0 1 2.png\n3 4 7\n");
  write_bytes(folder / "scene/sparse/0/points3D.txt", "7 0 0 1.5 9 9 9 0.5 1 0 2 0\n");
}

void write_strecha_scene(const fs::path& folder) {
  write_pictures(folder);
  for (int i = 0; i < 3; ++i) {
    std::ostringstream text;
    text << "30 0 16\n0 30 12\n0 0 1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" << 0.1 * i << " 0 0\n32 24\n";
    write_bytes(folder / ("scene/images/" + std::to_string(i) + ".png.camera"), text.str());
  }
}

namespace {

/// What the program makes of the valid scene.
class Made {
 public:
  Made() {
    write_transforms_scene(dir_.path());
    program("run " + (dir_ / "scene").string() + " -q -o " + (dir_ / "out").string());
  }
  void copy(const std::string& from, const fs::path& to) const {
    fs::create_directories(to.parent_path());
    fs::copy(dir_ / from, to, fs::copy_options::recursive);
  }
  const fs::path& folder() const { return dir_.path(); }

 private:
  static void program(const std::string& arguments) {
    const ProgramResult result = run_cgs(arguments);
    if (result.exit_code != 0) throw std::runtime_error("the valid twin fails: " + result.err);
  }
  TempDir dir_;
};

const Made& made() {
  static const Made kMade;
  return kMade;
}

}  // namespace

void write_model_folder(const fs::path& folder) { made().copy("out/model", folder / "model"); }
void write_volume_file(const fs::path& folder) {
  made().copy("out/volume.vdb", folder / "volume.vdb");
}
void write_finished_run(const fs::path& folder) {
  made().copy("scene", folder / "scene");
  made().copy("out", folder / "out");
  // The record names the scene by its path.
  const fs::path record = folder / "out/run.json";
  std::string text = read_bytes(record);
  const std::string old = (made().folder() / "scene").string();
  for (size_t at = 0; (at = text.find(old, at)) != std::string::npos;) {
    text.replace(at, old.size(), (folder / "scene").string());
  }
  write_bytes(record, text);
}

void SplatPly::set(size_t row, const std::string& name, double value) {
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].second == name) rows.at(row).at(i) = value;
  }
}

void SplatPly::remove(const std::string& name) {
  for (size_t i = properties.size(); i-- > 0;) {
    if (properties[i].second != name) continue;
    properties.erase(properties.begin() + static_cast<ptrdiff_t>(i));
    for (auto& row : rows) row.erase(row.begin() + static_cast<ptrdiff_t>(i));
  }
}

std::string SplatPly::bytes() const {
  std::ostringstream out;
  out << "ply\nformat " << format << " 1.0\n" << before_elements << "element vertex ";
  out << (count.empty() ? std::to_string(rows.size()) : count) << "\n";
  for (const auto& [type, name] : properties) out << "property " << type << " " << name << "\n";
  out << "end_header\n";
  std::string body;
  for (const auto& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) {
      if (format == "ascii") {
        std::ostringstream number;
        number << row[i];
        body += number.str() + (i + 1 < row.size() ? " " : "\n");
        continue;
      }
      std::string value =
          properties[i].first == "double" ? packed(row[i]) : packed(static_cast<float>(row[i]));
      if (format == "binary_big_endian") std::reverse(value.begin(), value.end());
      body += value;
    }
  }
  return out.str() + body + after;
}

SplatPly splats(int count, int sh_rest) {
  SplatPly ply;
  for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"}) {
    ply.properties.emplace_back("float", name);
  }
  for (int i = 0; i < sh_rest; ++i) {
    ply.properties.emplace_back("float", "f_rest_" + std::to_string(i));
  }
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2"}) {
    ply.properties.emplace_back("float", name);
  }
  for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) {
    ply.properties.emplace_back("float", name);
  }
  for (int i = 0; i < count; ++i) {
    std::vector<double> row = {0.02 * i, 0.01 * (i % 7), -1.5, 0.25, 0.5, -0.25};
    row.insert(row.end(), static_cast<size_t>(sh_rest), 0.125);
    row.insert(row.end(), {2, -4, -4.5, -5, 1, 0, 0, 0});
    ply.rows.push_back(row);
  }
  return ply;
}

}  // namespace cgs::test
