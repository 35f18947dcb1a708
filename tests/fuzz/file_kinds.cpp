// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/file_kinds.h"

#include <cstring>
#include <stdexcept>

#include <openvdb/openvdb.h>

#include "io/bytes/checkpoint.h"
#include "io/images/exif.h"
#include "io/images/exr.h"
#include "io/images/image.h"
#include "io/images/npy.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/cameras_json_scene.h"
#include "io/scenes/colmap_model.h"
#include "io/scenes/control_points.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/llff.h"
#include "io/scenes/metashape.h"
#include "io/scenes/polycam.h"
#include "io/scenes/realitycapture.h"
#include "io/scenes/rgbd_frames.h"
#include "io/scenes/strecha.h"
#include "io/scenes/transforms_json.h"
#include "io/volumes/vdb.h"
#include "libcgs/priors/onnx_input.h"
#include "tests/support/exif_segment.h"
#include "tests/support/heif_file.h"
#include "tests/support/onnx_file.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/tiff_file.h"
#include "tests/support/zip_bytes.h"

namespace cgs::test {

namespace {

namespace fs = std::filesystem;
using Kinds = std::vector<FileKind>;
using Folder = const fs::path&;

/// A kind whose valid file has these bytes and whose reader needs nothing but its path.
template <typename Read>
FileKind of_bytes(const std::string& name,
                  const std::string& file,
                  const std::function<std::string()>& bytes,
                  const Read& read) {
  return {name,
          file,
          [=](Folder folder) { write_bytes(folder / file, bytes()); },
          [=](Folder folder) { (void)read(folder / file); }};
}

// --- pictures and arrays --------------------------------------------------------------------

std::string tiff_bytes() {
  std::string out = "II*" + std::string(1, '\0') + packed(uint32_t{8}, uint16_t{9});
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
    out += packed(uint16_t(tag), uint16_t(type), uint32_t{1}, value);
  }
  return out + packed(uint32_t{0}) + std::string(108, 'g');
}

void add_pictures(Kinds& kinds) {
  const auto read = [](const fs::path& file) {
    MaskMap mask;
    (void)image_size(file);
    (void)read_image(file, &mask);
    return lens_hint(file, image_size(file)).focal + exif_orientation(file);
  };
  kinds.push_back(of_bytes(
      "png", "a.png", [] { return rgb_png(12, 9); }, read));
  const auto grey16 = [] {
    return png(12, std::vector<std::string>(9, std::string(48, 'q')), {4, 16});
  };
  kinds.push_back(of_bytes("png-16-bit", "a.png", grey16, read));
  const auto palette = [] {
    return png(12,
               std::vector<std::string>(9, std::string(12, '\3')),
               {3, 8},
               png_chunk("PLTE", std::string(30, 'p')));
  };
  kinds.push_back(of_bytes("png-palette", "a.png", palette, read));
  const auto with_exif = [] {
    std::string bytes = jpeg(16, 12);
    return bytes.insert(2, orientation_segment(6));
  };
  kinds.push_back(of_bytes("jpeg", "a.jpg", with_exif, read));
  FileKind heic = of_bytes(
      "heic", "a.heic", [] { return heif(ColorImage(16, 12, Eigen::Vector3f::Ones())); }, read);
  heic.is_isolated = true;
  kinds.push_back(heic);
  kinds.push_back(of_bytes("tiff", "a.tif", tiff_bytes, read));
  kinds.push_back(of_bytes(
      "jpeg-inks", "a.jpg", [] { return jpeg(16, 12, 4); }, read));
  const auto planes = [] {
    const auto tags =
        with_tags(tiff_tags(12, 9, 4, 16, 5), {{259, 3, {8}}, {317, 3, {2}}, {284, 3, {2}}});
    return tiff_file(tags, std::vector<std::string>(4, deflated(std::string(216, 'g'))), true);
  };
  kinds.push_back(of_bytes("tiff-planes", "a.tif", planes, read));
  const auto tiles = [] {
    const auto tags =
        with_tags(tiff_tags(12, 9, 1, 4, 3),
                  {{320, 3, std::vector<uint32_t>(48, 30000)}, {322, 3, {16}}, {323, 3, {16}}});
    return tiff_file(tags, {std::string(128, 'g')});
  };
  kinds.push_back(of_bytes("tiff-tiles", "a.tif", tiles, read));
  const auto read_lens = [](const fs::path& file) { return lens_hint(file, {36, 24}); };
  const auto exif = [] { return exif_tiff({{0x920a, 5, 280}, {0xa405, 3, 28}}, true); };
  kinds.push_back(of_bytes("exif-of-tiff", "a.tif", exif, read_lens));
  const auto exif_in_png = [=] {
    std::string bytes = rgb_png(12, 9);
    constexpr size_t kEnd = 12;  // the last chunk
    return bytes.insert(bytes.size() - kEnd, png_chunk("eXIf", exif()));
  };
  kinds.push_back(of_bytes("exif-of-png", "a.png", exif_in_png, read_lens));
}

void add_arrays(Kinds& kinds) {
  const auto rows = [] {
    std::vector<std::vector<double>> out;
    for (int i = 0; i < 2; ++i) {
      out.push_back({0, 1, 0, 0.1 * i, 24, -1, 0, 0, 0, 32, 0, 0, 1, 0, 30, 1, 10});
    }
    return npy_of_rows(out);
  };
  const auto read_array = [](const fs::path& file) { return read_npy(file); };
  kinds.push_back(of_bytes("npy", "a.npy", rows, read_array));
  kinds.push_back({"llff",
                   "poses_bounds.npy",
                   [=](Folder folder) {
                     for (int i = 0; i < 2; ++i) {
                       write_bytes(folder / ("images/" + std::to_string(i) + ".png"),
                                   rgb_png(32, 24, i));
                     }
                     write_bytes(folder / "poses_bounds.npy", rows());
                   },
                   [](Folder folder) { (void)read_llff({folder}); }});
  const auto read_depth = [](const fs::path& file) { return read_depth_file(file); };
  const auto pfm = [] {
    std::string out = "Pf\n4 3\n-1.0\n";
    for (int i = 0; i < 12; ++i) out += packed(0.5f * float(i));
    return out;
  };
  kinds.push_back(of_bytes("pfm", "a.pfm", pfm, read_depth));
  const auto depth = [] { return npy("<f4", "(2, 3)", std::string(24, '\1')); };
  kinds.push_back(of_bytes("depth-npy", "a.npy", depth, read_depth));
  for (const uint16_t method : {uint16_t{0}, uint16_t{8}}) {
    const auto npz = [=] {
      return zip_bytes({{"depth.npy", depth()}, {"focal.npy", npy("<f8", "()", packed(1.5))}},
                       {.method = method, .is_64_bits = method == 8});
    };
    kinds.push_back(of_bytes(method == 0 ? "npz" : "npz-deflated", "a.npz", npz, read_depth));
  }
  const auto map = [] { return "3&2&1&" + std::string(24, '\1'); };
  kinds.push_back(of_bytes("colmap-depth", "a.png.geometric.bin", map, read_depth));
}

bool is_equal(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

void read_exr_twice(Folder folder) {
  const ExrImage first = read_exr(folder / "a.exr");
  constexpr size_t kMost = 1 << 20;  // pixels: larger ones would take all the time and memory
  if (size_t(first.width) * size_t(first.height) > kMost) return;
  write_exr(folder / "again.exr", first);
  const ExrImage second = read_back([&] { return read_exr(folder / "again.exr"); });
  require(second.channels.size() == first.channels.size(), "channels were lost");
  for (const auto& [name, values] : first.channels) {
    const std::vector<float>* const back = second.find(name);
    require(back != nullptr && is_equal(*back, values), "values were changed");
  }
}

void add_containers(Kinds& kinds) {
  kinds.push_back({"checkpoint",
                   "work.checkpoint",
                   [](Folder folder) { write_checkpoint(folder, "work", 7, "state of work"); },
                   [](Folder folder) {
                     const auto state = read_checkpoint(folder, "work", 7).state;
                     require(!state || *state == "state of work", "a damaged state was taken");
                   }});
  const auto read_network = [](const fs::path& file) {
    const std::string bytes = read_bytes(file);
    return onnx_input_shape(bytes).size() + onnx_weights_defect(bytes).size();
  };
  kinds.push_back(of_bytes(
      "onnx", "a.onnx", [] { return onnx_network(8, 6); }, read_network));
  kinds.push_back({"exr",
                   "a.exr",
                   [](Folder folder) {
                     ExrImage image;
                     image.width = 7;
                     image.height = 20;
                     for (const char* name : {"A", "Z"}) {
                       std::vector<float> values(140);
                       for (size_t i = 0; i < values.size(); ++i) {
                         values[i] = float(i % 13) + 0.25f;
                       }
                       image.channels.emplace_back(name, values);
                     }
                     image.text["cgs:units"] = "m";
                     write_exr(folder / "a.exr", image);
                   },
                   read_exr_twice});
}

// As another program writes it: no checksum stands before the decoder.
void write_foreign_vdb(Folder folder) {
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
  write_vdb(folder / "a.vdb", {distance, state}, {{"creator", "cgs"}});
  std::string bytes = read_bytes(folder / "a.vdb");
  bytes[21 + 14] = '4';
  write_bytes(folder / "a.vdb", bytes);
}

void read_vdb_twice(Folder folder) {
  const std::vector<openvdb::GridBase::Ptr> first = read_vdb(folder / "a.vdb");
  for (const auto& grid : first) grid->clearMetadata();  // of others; ours is all text and numbers
  write_vdb(folder / "again.vdb", {first.begin(), first.end()}, {});
  const auto second = read_back([&] { return read_vdb(folder / "again.vdb"); });
  require(second.size() == first.size(), "grids were lost");
  for (size_t i = 0; i < first.size(); ++i) {
    require(second[i]->type() == first[i]->type(), "values became others");
    require(second[i]->activeVoxelCount() == first[i]->activeVoxelCount(), "voxels were lost");
  }
}

void add_volumes(Kinds& kinds) {
  kinds.push_back({"vdb", "a.vdb", write_foreign_vdb, read_vdb_twice});
}

// --- cameras --------------------------------------------------------------------------------

void write_two_images(Folder folder) {
  for (int i = 0; i < 2; ++i) {
    write_bytes(folder / ("images/" + std::to_string(i) + ".png"), rgb_png(32, 24, i));
  }
}

/// A kind of scene description beside images/0.png and images/1.png, in text.
template <typename Read>
FileKind of_cameras(const std::string& name,
                    const std::string& file,
                    const std::string& text,
                    const Read& read) {
  return {name,
          file,
          [=](Folder folder) {
            write_two_images(folder);
            write_bytes(folder / file, text);
          },
          [=](Folder folder) { (void)read({folder}); }};
}

void add_scene_descriptions(Kinds& kinds) {
  kinds.push_back(of_cameras("transforms-json",
                             "transforms.json",
                             R"({"w": 32, "h": 24, "fl_x": 30, "cx": 16, "k1": 0.01, "frames": [
{"file_path": "images/0.png", "is_fisheye": true, "k4": 0.001, "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]},
{"file_path": "b\u00e9.png", "transform_matrix": [[1,0,0,1e-1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})",
                             read_transforms_json));
  kinds.push_back(of_cameras("splat-cameras-json",
                             "cameras.json",
                             R"([{"id": 0, "img_name": "0", "width": 32, "height": 24,
  "position": [1, 0, 0], "rotation": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], "fy": 55, "fx": 50},
 {"id": 1, "img_name": "1.png", "width": 32, "height": 24,
  "position": [1, 1, 0], "rotation": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], "fy": 55, "fx": 50}])",
                             read_cameras_json_scene));
  kinds.push_back(of_cameras(
      "metashape",
      "cameras.xml",
      R"(<?xml version="1.0"?><document version="1.5.0"><chunk label="c" enabled="true"><sensors>
<sensor id="0" label="c" type="frame"><resolution width="32" height="24"/>
<calibration type="frame" class="adjusted"><resolution width="32" height="24"/>
<f>30</f><cx>1</cx><cy>-1</cy><b1>.1</b1><k1>-.1</k1><p1>.001</p1></calibration></sensor></sensors>
<components><component id="0"><transform><rotation>1 0 0 0 1 0 0 0 1</rotation>
<translation>4e5 5e6 100</translation><scale>2</scale></transform></component></components>
<cameras><camera id="1" sensor_id="0" component_id="0" label="0">
<transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>
<camera id="2" sensor_id="0" component_id="0" label="1.png">
<transform>1 0 0 .5 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera></cameras></chunk></document>)",
      read_metashape));
  kinds.push_back(
      of_cameras("realitycapture",
                 "export.csv",
                 "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n"
                 "0.png,10,20,5,30,70,-8,28.5,0.01,-0.02,-0.05,0.01,-0.002,0,0.001,-0.0005\n"
                 "C:\\photos\\1.jpg,11,20.5,5,35,75,-6,28.5,0.01,-0.02,0,0,0,0,0,0\n",
                 read_realitycapture));
  const std::string keyframe =
      R"({"fx": 30, "fy": 30, "cx": 16, "cy": 12, "width": 32, "height": 24, "blur_score": 90.5,
"t_00": 1, "t_01": 0, "t_02": 0, "t_03": 0.3, "t_10": 0, "t_11": 1, "t_12": 0, "t_13": 1.2,
"t_20": 0, "t_21": 0, "t_22": 1, "t_23": -0.5})";
  const std::string camera = "keyframes/corrected_cameras/17.json";
  kinds.push_back({"polycam",
                   camera,
                   [=](Folder folder) {
                     write_bytes(folder / "keyframes/corrected_cameras/18.json", keyframe);
                     for (const char* name : {"17", "18"}) {
                       write_bytes(
                           folder / ("keyframes/corrected_images/" + std::string(name) + ".jpg"),
                           jpeg(32, 24));
                     }
                     write_bytes(folder / camera, keyframe);
                   },
                   [](Folder folder) { (void)read_polycam({folder}); }});
  const auto write_frames = [](Folder folder) {
    write_bytes(folder / "camera-intrinsics.txt", "30 0 16\n0 30 12\n0 0 1\n");
    for (const char* name : {"frame-0", "frame-1"}) {
      write_bytes(folder / (std::string(name) + ".color.png"), rgb_png(32, 24));
      write_bytes(folder / (std::string(name) + ".pose.txt"),
                  "1 0 0 0.5\n0 1 0 -1e-1\n0 0 1 2\n0 0 0 1\n");
    }
  };
  const auto read_frames = [](Folder folder) { (void)read_rgbd_frames({folder}); };
  kinds.push_back({"rgbd-pose", "frame-0.pose.txt", write_frames, read_frames});
  kinds.push_back({"rgbd-intrinsics", "camera-intrinsics.txt", write_frames, read_frames});
  const auto write_open3d = [](Folder folder) {
    write_bytes(folder / "intrinsic.json",
                R"({"width": 32, "height": 24,
"intrinsic_matrix": [30, 0, 0, 0, 30, 0, 15.5, 11.5, 1]})");
    write_bytes(folder / "trajectory.log",
                "0 0 1\n1 0 0 0.5\n0 1 0 -1e-1\n0 0 1 2\n0 0 0 1\n"
                "1 1 2\n1 0 0 0\n0 1 0 nan\n0 0 1 2\n0 0 0 1\n");
    for (const char* name : {"0.png", "1.png"}) {
      write_bytes(folder / ("color/" + std::string(name)), rgb_png(32, 24));
      write_bytes(folder / ("depth/" + std::string(name)), rgb_png(32, 24));
    }
  };
  kinds.push_back({"open3d-trajectory", "trajectory.log", write_open3d, read_frames});
  kinds.push_back({"open3d-intrinsics", "intrinsic.json", write_open3d, read_frames});
  kinds.push_back({"strecha",
                   "0.png.camera",
                   [](Folder folder) {
                     write_bytes(folder / "0.png", rgb_png(32, 24));
                     write_bytes(folder / "0.png.camera",
                                 "30 0 16\n0 30 12\n0 0 1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
                                 "0.5 0 0\n32 24\n");
                   },
                   [](Folder folder) { (void)read_strecha({folder}); }});
}

Scene two_cameras(Folder folder) {
  Scene scene;
  scene.kind = SceneKind::Llff;
  scene.folder = folder;
  scene.frame = centimetre_frame();
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
  return scene;
}

void add_our_cameras(Kinds& kinds) {
  kinds.push_back(of_bytes(
      "control-points",
      "survey.csv",
      [] {
        return std::string(
            "# grid\nname;role;x;y;z;sigma;view;px;py\nA;;4.5e5;-5e6;1;0.01;left;1;2.5\n"
            "A;;;;;;right;3;4\n\"B\";check;1;2;3;;;;\n");
      },
      read_control_points));
  kinds.push_back(
      {"cameras-json",
       "cameras.json",
       [](Folder folder) { write_cameras_json(folder / "cameras.json", two_cameras(folder)); },
       [](Folder folder) {
         const Scene scene = read_cameras_json(folder / "cameras.json");
         write_cameras_json(folder / "again.json", scene);
         const Scene again = read_cameras_json(folder / "again.json");
         require(again.views.size() == scene.views.size(), "cameras were lost");
       }});
}

void add_colmap_binary(Kinds& kinds) {
  const auto cameras = [] {
    return packed(uint64_t{3}, uint32_t{1}, int32_t{1}, uint64_t{32}, uint64_t{24}, 30.0, 30.0) +
           packed(16.0, 12.0, uint32_t{2}, int32_t{4}, uint64_t{32}, uint64_t{24}) +
           packed(30.0, 30.0, 16.0, 12.0, 0.01, 0.0, 0.0, 0.0) +
           packed(uint32_t{3}, int32_t{5}, uint64_t{32}, uint64_t{24}, 15.0, 15.0, 16.0, 12.0) +
           packed(0.01, 0.0, 0.0, 0.0);
  };
  kinds.push_back(of_bytes("colmap-cameras-bin", "a.bin", cameras, [](const fs::path& path) {
    (void)read_colmap_cameras_binary(path);
  }));
  const auto images = [] {
    std::string out = packed(uint64_t{2});
    for (uint32_t i = 1; i < 3; ++i) {
      out += packed(i, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, uint32_t{1}) + "0.png" + '\0' +
             packed(uint64_t{1}, 3.0, 4.0, ~uint64_t{0});
    }
    return out;
  };
  kinds.push_back(of_bytes("colmap-images-bin", "a.bin", images, read_colmap_images_binary));
  const auto points = [] {
    return packed(uint64_t{1}, uint64_t{7}, 0.0, 0.0, 1.5) + "rgb" +
           packed(0.5, uint64_t{2}, 1u, 0u, 2u, 0u);
  };
  kinds.push_back(of_bytes("colmap-points-bin", "a.bin", points, read_colmap_points_binary));
}

void add_colmap_text(Kinds& kinds) {
  const auto text = [](std::string bytes) { return [=] { return bytes; }; };
  kinds.push_back(
      of_bytes("colmap-cameras-txt",
               "a.txt",
               text("# cameras\n1 PINHOLE 32 24 30 30.5 16 12\n2 OPENCV 32 24 30 30 16 12 0 0 0 0\n"
                    "3 OPENCV_FISHEYE 32 24 15 15 16 12 0.01 0 0 0\n"),
               [](const fs::path& path) { (void)read_colmap_cameras_text(path); }));
  kinds.push_back(of_bytes("colmap-images-txt",
                           "a.txt",
                           text("1 1 0 0 0 0 0 0 1 0.png\n3 4 7\n2 1 0 0 0 -0.1 0 0 1 b c.png\n\n"),
                           read_colmap_images_text));
  kinds.push_back(of_bytes("colmap-points-txt",
                           "a.txt",
                           text("7 0 0 1.5 9 9 9 0.5 1 0 2 0\n8 0 0 1.5 9 9 9 0.5\n"),
                           read_colmap_points_text));
}

}  // namespace

const std::vector<FileKind>& file_kinds() {
  static const Kinds all = [] {
    Kinds kinds;
    add_pictures(kinds);
    add_arrays(kinds);
    add_containers(kinds);
    add_volumes(kinds);
    add_scene_descriptions(kinds);
    add_our_cameras(kinds);
    add_colmap_binary(kinds);
    add_colmap_text(kinds);
    const Kinds assets = asset_kinds();
    kinds.insert(kinds.end(), assets.begin(), assets.end());
    return kinds;
  }();
  return all;
}

}  // namespace cgs::test
