// SPDX-License-Identifier: GPL-3.0-or-later
//
// Small valid files of every format, cut at every length and with every byte changed in several
// ways: each reader must return something or throw an Error of ours. CGS_SWEEP=full tries all
// places, else a share of them is tried that takes a few seconds.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <sys/resource.h>
#include <unistd.h>

#include "io/cameras_json.h"
#include "io/colmap_model.h"
#include "io/exr.h"
#include "io/gaussian_ply.h"
#include "io/image.h"
#include "io/llff.h"
#include "io/mesh_ply.h"
#include "io/npy.h"
#include "io/png.h"
#include "io/splat_reader.h"
#include "io/spz.h"
#include "io/strecha.h"
#include "io/transforms_json.h"
#include "io/vdb.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs {
namespace {

namespace fs = std::filesystem;

using test::packed;
using test::read_bytes;
using test::TempDir;
using test::write_bytes;

// --- what a crash leaves on the terminal ----------------------------------------------------

std::array<char, 200> current_case;  // read by a signal handler

void on_crash(int signal) {
  const char* const what = signal == SIGALRM ? "hangs: " : "crash: ";
  (void)!::write(STDERR_FILENO, what, 7);
  (void)!::write(STDERR_FILENO, current_case.data(), std::strlen(current_case.data()));
  (void)!::write(STDERR_FILENO, "\n", 1);
  (void)std::signal(signal, SIG_DFL);
  (void)std::raise(signal);
}

constexpr bool is_sanitized() {
#ifdef __SANITIZE_ADDRESS__
  return true;
#else
  return false;
#endif
}

bool is_full() {
  const char* const wish = std::getenv("CGS_SWEEP");
  return wish != nullptr && std::string(wish) == "full";
}

/// Totals over all formats, printed at the end.
struct Totals {
  int64_t tried = 0;
  int64_t refused = 0;
  double seconds = 0;
};
Totals totals;

class Bounds : public testing::Environment {
 public:
  void SetUp() override {
    if (is_sanitized()) return;  // which reserves terabytes, and reports crashes itself
    const struct rlimit addresses = {rlim_t{6} << 30, rlim_t{6} << 30};
    setrlimit(RLIMIT_AS, &addresses);
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS}) std::signal(signal, on_crash);
  }
  void TearDown() override {
    if (totals.tried == 0) return;
    std::printf("sweep: %lld files, %lld refused, %lld read, %.1f s\n",
                static_cast<long long>(totals.tried),
                static_cast<long long>(totals.refused),
                static_cast<long long>(totals.tried - totals.refused),
                totals.seconds);
  }
};
const testing::Environment* const kBounds = testing::AddGlobalTestEnvironment(new Bounds);

// --- the sweep ------------------------------------------------------------------------------

using Read = std::function<void(const fs::path& file)>;

/// Damages one file in all ways and counts how its reader ends.
class Sweep {
 public:
  Sweep(std::string name, fs::path file, Read read)
      : name_(std::move(name)),
        file_(std::move(file)),
        read_(std::move(read)),
        good_(read_bytes(file_)) {}

  /// \param share  files per kind of damage that are tried unless all are asked for
  void run(size_t share) {
    const auto start = std::chrono::steady_clock::now();
    ASSERT_NO_THROW(read_(file_)) << name_ << ": the valid twin";
    const size_t step = is_full() ? std::max<size_t>(1, good_.size() / 8192)
                                  : std::max<size_t>(1, good_.size() / share);
    for (size_t n = 0; n < good_.size(); n += step) attempt(good_.substr(0, n), "cut to", n);
    for (int kind = 0; kind < 6; ++kind) {
      // Not the same places for each kind.
      for (size_t at = size_t(kind) * step / 6; at < good_.size(); at += step) {
        std::string bytes = good_;
        const auto old = static_cast<uint8_t>(bytes[at]);
        const std::array<int, 6> changed = {0, 0xff, 0x7f, 0x80, old ^ 1, old ^ 0x40};
        if (changed[size_t(kind)] == old) continue;
        bytes[at] = static_cast<char>(changed[size_t(kind)]);
        attempt(bytes, "byte set to", at, changed[size_t(kind)]);
      }
    }
    write_bytes(file_, good_);
    totals.seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

 private:
  void attempt(const std::string& bytes, const char* damage, size_t at, int value = 0) {
    std::snprintf(current_case.data(),
                  current_case.size(),
                  "%s: %s %zu 0x%02x",
                  name_.c_str(),
                  damage,
                  at,
                  static_cast<unsigned>(value));
    write_bytes(file_, bytes);
    ++totals.tried;
    const auto start = std::chrono::steady_clock::now();
    try {
      read_(file_);
    } catch (const Error& error) {
      ++totals.refused;
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << current_case.data() << ": " << text;
    } catch (const std::exception& error) {
      ADD_FAILURE() << current_case.data() << ": " << error.what();
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    EXPECT_LT(took.count(), is_sanitized() ? 60 : 10) << current_case.data();
  }

  std::string name_;
  fs::path file_;
  Read read_;
  std::string good_;
};

void sweep(const std::string& name, const fs::path& file, const Read& read, size_t share = 60) {
  Sweep(name, file, read).run(share);
}

// --- valid files ----------------------------------------------------------------------------

TEST(Sweep, Images) {
  const TempDir dir;
  const auto read = [](const fs::path& file) {
    MaskMap mask;
    (void)image_size(file);
    (void)read_image(file, &mask);
  };
  write_bytes(dir / "a.png", test::rgb_png(12, 9));
  sweep("RGB PNG", dir / "a.png", read);
  write_bytes(dir / "a.png",
              test::png(12, std::vector<std::string>(9, std::string(48, 'q')), {4, 16}));
  sweep("16-bit grey and alpha PNG", dir / "a.png", read);
  const std::string palette = test::png_chunk("PLTE", std::string(30, 'p'));
  write_bytes(dir / "a.png",
              test::png(12, std::vector<std::string>(9, std::string(12, '\3')), {3, 8}, palette));
  sweep("palette PNG", dir / "a.png", read);
  write_bytes(dir / "a.jpg", test::jpeg(16, 12));
  sweep("JPEG", dir / "a.jpg", read);
  std::string tiff = "II*" + std::string(1, '\0') + packed(uint32_t{8}, uint16_t{9});
  const std::array<std::array<uint32_t, 3>, 9> tags = {{{256, 4, 12},
                                                        {257, 4, 9},
                                                        {258, 3, 8},
                                                        {259, 3, 1},
                                                        {262, 3, 1},
                                                        {273, 4, 122},
                                                        {277, 3, 1},
                                                        {278, 4, 9},
                                                        {279, 4, 108}}};
  for (const auto& [tag, type, value] : tags) {
    tiff += packed(uint16_t(tag), uint16_t(type), uint32_t{1}, value);
  }
  write_bytes(dir / "a.tif", tiff + packed(uint32_t{0}) + std::string(108, 'g'));
  sweep("TIFF", dir / "a.tif", read);
}

TEST(Sweep, Arrays) {
  const TempDir dir;
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < 2; ++i) {
    write_bytes(dir / ("images/" + std::to_string(i) + ".png"), test::rgb_png(32, 24, i));
    rows.push_back({0, 1, 0, 0.1 * i, 24, -1, 0, 0, 0, 32, 0, 0, 1, 0, 30, 1, 10});
  }
  write_bytes(dir / "poses_bounds.npy", test::npy_of_rows(rows));
  sweep("npy", dir / "poses_bounds.npy", [](const fs::path& file) { (void)read_npy(file); });
  sweep("LLFF", dir / "poses_bounds.npy", [&](const fs::path&) { (void)read_llff({dir.path()}); });
}

TEST(Sweep, Transforms) {
  const TempDir dir;
  write_bytes(dir / "images/0.png", test::rgb_png(32, 24));
  write_bytes(dir / "transforms.json",
              R"({"w": 32, "h": 24, "fl_x": 30, "cx": 16, "k1": 0.01, "frames": [
{"file_path": "images/0.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]},
{"file_path": "b\u00e9.png", "transform_matrix": [[1,0,0,1e-1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
  sweep("transforms.json", dir / "transforms.json", [&](const fs::path&) {
    (void)read_transforms_json({dir.path()});
  });
}

TEST(Sweep, ColmapBinary) {
  const TempDir dir;
  const auto read = [](auto function) {
    return [function](const fs::path& file) { (void)function(file); };
  };
  write_bytes(dir / "cameras.bin",
              packed(uint64_t{2},
                     uint32_t{1},
                     int32_t{1},
                     uint64_t{32},
                     uint64_t{24},
                     30.0,
                     30.0,
                     16.0,
                     12.0,
                     uint32_t{2},
                     int32_t{4},
                     uint64_t{32},
                     uint64_t{24}) +
                  packed(30.0, 30.0, 16.0, 12.0, 0.01, 0.0, 0.0, 0.0));
  sweep("cameras.bin", dir / "cameras.bin", read(read_colmap_cameras_binary));
  std::string images = packed(uint64_t{2});
  for (uint32_t i = 1; i < 3; ++i) {
    images += packed(i, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, uint32_t{1}) + "0.png" + '\0' +
              packed(uint64_t{1}, 3.0, 4.0, ~uint64_t{0});
  }
  write_bytes(dir / "images.bin", images);
  sweep("images.bin", dir / "images.bin", read(read_colmap_images_binary));
  write_bytes(dir / "points3D.bin",
              packed(uint64_t{1}, uint64_t{7}, 0.0, 0.0, 1.5) + "rgb" +
                  packed(0.5, uint64_t{2}, 1u, 0u, 2u, 0u));
  sweep("points3D.bin", dir / "points3D.bin", read(read_colmap_points_binary));
}

TEST(Sweep, ColmapText) {
  const TempDir dir;
  write_bytes(dir / "cameras.txt",
              "# cameras\n1 PINHOLE 32 24 30 30.5 16 12\n2 OPENCV 32 24 30 30 16 12 0 0 0 0\n");
  sweep("cameras.txt", dir / "cameras.txt", [](const fs::path& file) {
    (void)read_colmap_cameras_text(file);
  });
  write_bytes(dir / "images.txt",
              "1 1 0 0 0 0 0 0 1 0.png\n3 4 7\n2 1 0 0 0 -0.1 0 0 1 b c.png\n\n");
  sweep("images.txt", dir / "images.txt", [](const fs::path& file) {
    (void)read_colmap_images_text(file);
  });
  write_bytes(dir / "points3D.txt", "7 0 0 1.5 9 9 9 0.5 1 0 2 0\n8 0 0 1.5 9 9 9 0.5\n");
  sweep("points3D.txt", dir / "points3D.txt", [](const fs::path& file) {
    (void)read_colmap_points_text(file);
  });
}

TEST(Sweep, Strecha) {
  const TempDir dir;
  write_bytes(dir / "0.png", test::rgb_png(32, 24));
  write_bytes(dir / "0.png.camera",
              "30 0 16\n0 30 12\n0 0 1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.5 0 0\n32 24\n");
  sweep(
      ".camera", dir / "0.png.camera", [&](const fs::path&) { (void)read_strecha({dir.path()}); });
}

Gaussians few_splats() {
  Gaussians g;
  g.sh_degree = 1;
  for (int i = 0; i < 3; ++i) {
    g.position.emplace_back(0.1f * float(i), 0.2f, 0.3f);
    g.scale.emplace_back(0.01f, 0.02f, 0.015f);
    g.rotation.emplace_back(1, 0, 0, 0);
    g.opacity.push_back(0.5f);
    for (int k = 0; k < 4; ++k) g.sh.emplace_back(0.1f, 0.2f, 0.3f);
  }
  return g;
}

TEST(Sweep, Ply) {
  const TempDir dir;
  const auto read_splats = [](const fs::path& file) { (void)read_gaussian_ply(file); };
  write_gaussian_ply(dir / "g.ply", few_splats(), test::centimetre_frame());
  sweep("PLY of Gaussians", dir / "g.ply", read_splats);
  std::string ascii = "ply\nformat ascii 1.0\nelement vertex 2\n";
  for (const char* name : {"x",
                           "y",
                           "z",
                           "f_dc_0",
                           "f_dc_1",
                           "f_dc_2",
                           "opacity",
                           "scale_0",
                           "scale_1",
                           "scale_2",
                           "rot_0",
                           "rot_1",
                           "rot_2",
                           "rot_3"}) {
    ascii += std::string("property float ") + name + "\n";
  }
  write_bytes(dir / "g.ply",
              ascii +
                  "end_header\n0 1 2 .1 .2 .3 0 -4 -4 -5 1 0 0 0\n"
                  "1 1e0 -2 .1 .2 .3 0.5 -4 -4 -5 1 0 0 0\n");
  sweep("ascii PLY of Gaussians", dir / "g.ply", read_splats);
  write_mesh_ply(dir / "m.ply", test::labelled_sphere(4, 4), test::centimetre_frame());
  sweep("PLY of a mesh", dir / "m.ply", [](const fs::path& file) { (void)read_mesh_ply(file); });
}

TEST(Sweep, Spz) {
  const TempDir dir;
  const auto read = [](const fs::path& file) { (void)read_splats(file); };
  for (const int version : {2, 3}) {
    write_spz(dir / "g.spz", few_splats(), test::centimetre_frame(), {.version = version});
    sweep("SPZ " + std::to_string(version), dir / "g.spz", read);
  }
}

TEST(Sweep, CamerasJson) {
  const TempDir dir;
  Scene scene;
  scene.kind = "LLFF";
  scene.folder = dir.path();
  scene.frame = test::centimetre_frame();
  for (int i = 0; i < 2; ++i) {
    View view;
    view.name = std::to_string(i);
    view.camera.width = 32;
    view.camera.height = 24;
    view.camera.fx = view.camera.fy = 30;
    view.camera.cx = 16;
    view.camera.cy = 12;
    view.camera.world_from_cam = Eigen::Isometry3d(Eigen::Translation3d(0.1 * i, 0, 0));
    view.near = 1;
    view.far = 3;
    scene.views.push_back(view);
  }
  scene.input = {0, 1};
  write_cameras_json(dir / "cameras.json", scene);
  sweep("cameras.json", dir / "cameras.json", [](const fs::path& file) {
    (void)read_cameras_json(file);
  });
}

TEST(Sweep, Exr) {
  const TempDir dir;
  ExrImage image;
  image.width = 7;
  image.height = 20;
  for (const char* name : {"A", "Z"}) {
    std::vector<float> values(140);
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 13) + 0.25f;
    image.channels.emplace_back(name, values);
  }
  image.text["cgs:units"] = "m";
  write_exr(dir / "a.exr", image);
  sweep(
      "EXR", dir / "a.exr", [](const fs::path& file) { (void)read_exr(file); }, 150);
}

// As another program writes it: no checksum stands before the decoder.
TEST(Sweep, Vdb) {
  const TempDir dir;
  openvdb::initialize();
  auto distance = openvdb::FloatGrid::create(0.25f);
  distance->setName("tsdf");
  auto state = openvdb::Int32Grid::create(0);
  state->setName("state");
  for (int i = 0; i < 40; ++i) {
    distance->tree().setValue({i % 7, i % 5, i}, 0.01f * float(i));
    state->tree().setValue({i % 7, i % 5, i}, i % 3);
  }
  state->tree().addTile(3, openvdb::Coord(8192, 0, 0), 2, true);
  write_vdb(dir / "a.vdb", {distance, state}, {{"creator", "cgs"}});
  std::string bytes = read_bytes(dir / "a.vdb");
  bytes[21 + 14] = '4';
  write_bytes(dir / "a.vdb", bytes);
  sweep(
      "VDB", dir / "a.vdb", [](const fs::path& file) { (void)read_vdb(file); }, 150);
}

}  // namespace
}  // namespace cgs
