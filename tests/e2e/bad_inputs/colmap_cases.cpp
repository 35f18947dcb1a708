// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

Case model_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::vector<std::string>& words,
                const std::function<void(ColmapFiles&)>& change) {
  return {row, damage, expected, words, [change](const fs::path& folder) {
            ColmapFiles files = colmap_files();
            change(files);
            write_colmap_scene(folder, files);
            return info_call(folder);
          }};
}

std::string one_camera(int32_t model,
                       const std::vector<double>& p,
                       uint64_t w = 32,
                       uint64_t h = 24) {
  return packed(uint64_t{1}) + colmap_camera(1, model, p, w, h);
}

// The images of the valid model, the second one changed.
std::string images(const std::function<void(ColmapImageFields&)>& change) {
  std::string out = packed(uint64_t{3});
  for (uint32_t i = 0; i < 3; ++i) {
    ColmapImageFields image;
    image.id = i + 1;
    image.translation = {-0.1 * i, 0, 0};
    image.name = std::to_string(i) + ".png";
    if (i == 1) change(image);
    out += colmap_image(image);
  }
  return out;
}

void add_colmap_cameras(Cases& cases) {
  cases.push_back(model_case("C01", "2^63 cameras", "COUNT", {"cameras.bin"}, [](ColmapFiles& f) {
    f.cameras.replace(0, 8, packed(uint64_t{1} << 63));
  }));
  cases.push_back(model_case(
      "C02", "cut within the parameters", "TRUNCATED|COUNT", {"cameras.bin"}, [](ColmapFiles& f) {
        f.cameras.resize(f.cameras.size() - 5);
      }));
  for (const int32_t model : {99, -1}) {
    cases.push_back(model_case(
        "C03", "unknown model", "UNSUPPORTED", {"cameras.bin", "PINHOLE"}, [=](ColmapFiles& f) {
          f.cameras = one_camera(model, {1, 2, 3, 4});
        }));
  }
  cases.push_back(
      model_case("C04", "width 0", "VALUE", {"cameras.bin", "camera 1"}, [](ColmapFiles& f) {
        f.cameras = one_camera(1, {30, 30, 16, 12}, 0);
      }));
  cases.push_back(model_case(
      "C04", "height 2^40", "LIMIT|VALUE", {"cameras.bin", "camera"}, [](ColmapFiles& f) {
        f.cameras = one_camera(1, {30, 30, 16, 12}, 32, uint64_t{1} << 40);
      }));
  cases.push_back(model_case(
      "C04", "2^30 x 2^30 pixels", "LIMIT|VALUE", {"cameras.bin", "camera"}, [](ColmapFiles& f) {
        f.cameras = one_camera(1, {30, 30, 16, 12}, 1 << 30, 1 << 30);
      }));
  for (const double focal : {0.0, -30.0, kNan, kInf}) {
    cases.push_back(model_case("C05",
                               "focal length " + std::to_string(focal),
                               "VALUE",
                               {"cameras.bin", "camera 1", "fx"},
                               [=](ColmapFiles& f) {
                                 f.cameras = one_camera(1, {focal, 30, 16, 12});
                               }));
  }
  cases.push_back(model_case("C05", "cx 1e300", "VALUE", {"camera 1", "cx"}, [](ColmapFiles& f) {
    f.cameras = one_camera(1, {30, 30, 1e300, 12});
  }));
  cases.push_back(model_case("C06", "camera id twice", "SYNTAX", {"camera"}, [](ColmapFiles& f) {
    const std::string camera = colmap_camera(1, 1, {30, 30, 16, 12});
    f.cameras = packed(uint64_t{2}) + camera + camera;
  }));
  cases.push_back(model_case("C06", "image id twice", "SYNTAX", {"images.bin"}, [](ColmapFiles& f) {
    f.images = images([](ColmapImageFields& image) { image.id = 1; });
  }));
  for (const int32_t model : {6, 7}) {
    cases.push_back(
        model_case("C22", "full OpenCV or FOV", "UNSUPPORTED", {"undistort"}, [=](ColmapFiles& f) {
          f.cameras = one_camera(model, {30, 30, 16, 12, 0, 0, 0, 0});
        }));
  }
  for (const double k1 : {-3.0, kNan}) {
    cases.push_back(model_case(
        "C22", "a fisheye that folds, or is NaN", "VALUE", {"camera 1"}, [=](ColmapFiles& f) {
          f.cameras = one_camera(5, {30, 30, 16, 12, k1, 0, 0, 0});
        }));
  }
  cases.push_back(model_case("C22", "a fisheye", "OK", {}, [](ColmapFiles& f) {
    f.cameras = one_camera(5, {30, 30, 16, 12, 0.01, 0, 0, 0});
  }));
  cases.push_back(
      model_case("C22", "a fisheye of 200 degrees", "OK+W", {"60 degrees"}, [](ColmapFiles& f) {
        f.cameras = one_camera(5, {9, 9, 16, 12, 0.01, 0, 0, 0});
      }));
}

Case image_case(const std::string& row,
                const std::string& damage,
                const std::string& expected,
                const std::vector<std::string>& words,
                const std::function<void(ColmapImageFields&)>& change) {
  return model_case(
      row, damage, expected, words, [=](ColmapFiles& f) { f.images = images(change); });
}

void add_images(Cases& cases) {
  cases.push_back(model_case(
      "C07", "a name that never ends", "TRUNCATED|LIMIT|COUNT", {"images.bin"}, [](ColmapFiles& f) {
        f.images.resize(8 + 4 + 7 * 8 + 4 + 3);
      }));
  cases.push_back(
      image_case("C07", "a name of 5000 bytes", "LIMIT", {"images.bin"}, [](ColmapImageFields& i) {
        i.name = std::string(5000, 'a');
      }));
  cases.push_back(image_case(
      "C07", "a name of 3000 bytes", "OK+W|OPEN|PATH|MISSING", {}, [](ColmapImageFields& i) {
        i.name = std::string(3000, 'a');
      }));
  cases.push_back(
      image_case("C08", "../../etc/passwd", "PATH", {"etc/passwd"}, [](ColmapImageFields& i) {
        i.name = "../../etc/passwd";
      }));
  cases.push_back(image_case(
      "C09", "/etc/passwd", "PATH", {"etc/passwd", "absolute"}, [](ColmapImageFields& i) {
        i.name = "/etc/passwd";
      }));
  cases.push_back(
      image_case("C10", "backslashes in a name", "OK+W|MISSING", {}, [](ColmapImageFields& i) {
        i.name = "sub\\1.png";
      }));
  cases.push_back(model_case("C11", "2^60 keypoints", "COUNT", {"images.bin"}, [](ColmapFiles& f) {
    f.images.replace(f.images.size() - 32, 8, packed(uint64_t{1} << 60));
  }));
  cases.push_back(image_case(
      "C12", "camera 9 of 1", "REF", {"1.png", "9"}, [](ColmapImageFields& i) { i.camera = 9; }));
  cases.push_back(image_case("C13", "rotation 0", "VALUE", {"1.png"}, [](ColmapImageFields& i) {
    i.rotation = {0, 0, 0, 0};
  }));
  cases.push_back(image_case("C13", "rotation NaN", "VALUE", {"1.png"}, [](ColmapImageFields& i) {
    i.rotation[2] = kNan;
  }));
  cases.push_back(
      image_case("C13", "rotation of length 1.1", "OK+W", {"1.png"}, [](ColmapImageFields& i) {
        i.rotation[0] = 1.1;
      }));
  cases.push_back(
      image_case("C13", "translation Inf", "VALUE", {"1.png"}, [](ColmapImageFields& i) {
        i.translation[0] = kInf;
      }));
  cases.push_back(
      image_case("C15", "keypoint without a 3D point", "OK", {}, [](ColmapImageFields& i) {
        i.point_of_keypoint = ~uint64_t{0};
      }));
  cases.push_back(model_case("C23", "one image", "EMPTY", {"2"}, [](ColmapFiles& f) {
    f.images = packed(uint64_t{1}) + colmap_image({});
    f.points = packed(uint64_t{1}) + colmap_point({0, 0, 1.5}, {{1, 0}});
  }));
  cases.push_back(model_case("C24", "all centres equal", "VALUE", {"baseline"}, [](ColmapFiles& f) {
    f.images = packed(uint64_t{2});
    for (uint32_t i = 0; i < 2; ++i) {
      ColmapImageFields image;
      image.id = i + 1;
      image.name = std::to_string(i) + ".png";
      f.images += colmap_image(image);
    }
  }));
  cases.push_back(
      model_case("C25", "camera of twice the size", "OK+W", {"scaled"}, [](ColmapFiles& f) {
        f.cameras = one_camera(1, {60, 60, 32, 24}, 64, 48);
      }));
  cases.push_back(model_case(
      "C25", "camera of another shape", "MISMATCH", {"32 x 24", "64 x 24"}, [](ColmapFiles& f) {
        f.cameras = one_camera(1, {60, 60, 32, 12}, 64, 24);
      }));
  cases.push_back(
      image_case("C26", "one image missing", "OK+W", {"gone.png"}, [](ColmapImageFields& i) {
        i.name = "gone.png";
      }));
  cases.push_back({"C26", "all images missing", "MISSING", {"0.png"}, [](const fs::path& folder) {
                     write_colmap_scene(folder);
                     fs::remove_all(folder / "scene/images");
                     return info_call(folder);
                   }});
}

void add_points(Cases& cases) {
  cases.push_back(
      model_case("C14", "some observations name nothing", "OK+W", {"dropped"}, [](ColmapFiles& f) {
        f.points = packed(uint64_t{1}) + colmap_point({0, 0, 1.5}, {{1, 0}, {99, 0}, {2, 77}});
      }));
  cases.push_back(model_case("C14", "no observation names anything", "REF", {}, [](ColmapFiles& f) {
    f.points = packed(uint64_t{1}) + colmap_point({0, 0, 1.5}, {{98, 0}, {99, 0}});
  }));
  cases.push_back(
      model_case("C14", "2^60 observations", "COUNT", {"points3D.bin"}, [](ColmapFiles& f) {
        f.points = packed(uint64_t{1}) + colmap_point({0, 0, 1.5}, {{1, 0}});
        f.points.replace(f.points.size() - 16, 8, packed(uint64_t{1} << 60));
      }));
  for (const double x : {kNan, kInf}) {
    cases.push_back(
        model_case("C16", "a point that is not finite", "OK+W", {"dropped 1"}, [=](ColmapFiles& f) {
          f.points = packed(uint64_t{2}) + colmap_point({x, 0, 1.5}, {{1, 0}}) +
                     colmap_point({0, 0, 1.5}, {{1, 0}});
        }));
  }
  // Depth comes from the photographs here: sparse points are welcome, not needed.
  cases.push_back(model_case(
      "C17", "0 points", "OK|EMPTY", {}, [](ColmapFiles& f) { f.points = packed(uint64_t{0}); }));
  cases.push_back(model_case(
      "C27", "a point at a camera centre", "OK+W", {"camera centre"}, [](ColmapFiles& f) {
        f.points = packed(uint64_t{2}) + colmap_point({0, 0, 0}, {{1, 0}}) +
                   colmap_point({0, 0, 1.5}, {{1, 0}});
      }));
}

Case text_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::vector<std::string>& words,
               const std::pair<std::string, std::string>& file) {
  return {row, damage, expected, words, [=](const fs::path& folder) {
            write_colmap_text_scene(folder);
            write_bytes(folder / "scene/sparse/0" / file.first, file.second);
            return info_call(folder);
          }};
}

}  // namespace

Cases colmap_cases() {
  Cases cases;
  add_colmap_cameras(cases);
  add_images(cases);
  add_points(cases);
  cases.push_back({"C18", "binary and text", "OK+W", {".bin"}, [](const fs::path& folder) {
                     write_colmap_scene(folder);
                     write_colmap_text_scene(folder);
                     return info_call(folder);
                   }});
  cases.push_back(text_case("C19",
                            "an image without its keypoints",
                            "SYNTAX",
                            {"images.txt", "line"},
                            {"images.txt", "1 1 0 0 0 0 0 0 1 0.png\n\n2 1 0 0 0 -1 0 0 1 1.png"}));
  cases.push_back(text_case("C20",
                            "decimal commas",
                            "SYNTAX",
                            {"cameras.txt", "1:"},
                            {"cameras.txt", "1 PINHOLE 32 24 30,5 30 16 12\n"}));
  cases.push_back(
      {"C21", "rigs beside the model", "OK|UNSUPPORTED", {}, [](const fs::path& folder) {
         write_colmap_scene(folder);
         write_bytes(folder / "scene/sparse/0/rigs.bin", std::string(64, '\1'));
         return info_call(folder);
       }});
  return cases;
}

}  // namespace cgs::test
