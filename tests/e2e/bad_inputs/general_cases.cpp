// SPDX-License-Identifier: GPL-3.0-or-later
#include <clocale>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <thread>

#include <sys/stat.h>

#include "io/images/exr.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "io/scenes/cameras_json.h"
#include "io/scenes/depth_file.h"
#include "io/scenes/scene_reader.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_glb_reader.h"
#include "io/volumes/vdb.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"
#include "tests/support/run_cgs.h"
#include "tests/support/sample_splats.h"
#include "tests/support/threemf_file.h"

namespace cgs::test {

namespace {

/// A file of some format within a valid input, and the reader of that input.
struct Target {
  std::string name;
  std::string file;
  bool is_text = false;
  std::function<void(const fs::path& folder)> write;
  std::function<void(const fs::path& folder)> read;
};

void read_whole_scene(const fs::path& folder) {
  Scene scene = read_scene(folder / "scene");
  load_images(scene, scene.input);
}

void write_jpeg_scene(const fs::path& folder) {
  nlohmann::json document = transforms();
  document["frames"][1]["file_path"] = "images/1.jpg";
  write_transforms_scene(folder, document);
  write_bytes(folder / "scene/images/1.jpg", jpeg(kWidth, kHeight));
}

void write_mesh(const fs::path& folder) {
  write_bytes(folder / "mesh.ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
}

std::vector<Target> targets() {
  const auto plain = [](const fs::path& folder) { write_transforms_scene(folder); };
  const auto llff = [](const fs::path& folder) { write_llff_scene(folder); };
  const auto colmap = [](const fs::path& folder) { write_colmap_scene(folder); };
  const auto scene = read_whole_scene;
  const std::string sparse = "scene/sparse/0/";
  return {{"PNG", "scene/images/1.png", false, plain, scene},
          {"JPEG", "scene/images/1.jpg", false, write_jpeg_scene, scene},
          {"npy", "scene/poses_bounds.npy", false, llff, scene},
          {"transforms.json", "scene/transforms.json", true, plain, scene},
          {"cameras.bin", sparse + "cameras.bin", false, colmap, scene},
          {"images.bin", sparse + "images.bin", false, colmap, scene},
          {"points3D.bin", sparse + "points3D.bin", false, colmap, scene},
          {"cameras.txt", sparse + "cameras.txt", true, write_colmap_text_scene, scene},
          {"images.txt", sparse + "images.txt", true, write_colmap_text_scene, scene},
          {"points3D.txt", sparse + "points3D.txt", true, write_colmap_text_scene, scene},
          {".camera", "scene/images/1.png.camera", true, write_strecha_scene, scene},
          {"Gaussians",
           "model/gaussians.ply",
           false,
           write_model_folder,
           [](const fs::path& folder) { (void)read_gaussian_ply(folder / "model/gaussians.ply"); }},
          {"cameras.json",
           "model/cameras.json",
           true,
           write_model_folder,
           [](const fs::path& folder) { (void)read_cameras_json(folder / "model/cameras.json"); }},
          {"EXR",
           "model/priors/1.exr",
           false,
           write_model_folder,
           [](const fs::path& folder) { (void)read_exr(folder / "model/priors/1.exr"); }},
          {"VDB",
           "volume.vdb",
           false,
           write_volume_file,
           [](const fs::path& folder) { (void)read_vdb(folder / "volume.vdb"); }},
          {"splats in GLB",
           "splats.glb",
           false,
           [](const fs::path& folder) {
             write_splat_glb(folder / "splats.glb", varied_splats(3, 1), Frame{});
           },
           [](const fs::path& folder) {
             const fs::path file = folder / "splats.glb";
             (void)parse_splat_glb(read_file(file), file);
           }},
          {"mesh",
           "mesh.ply",
           true,
           write_mesh,
           [](const fs::path& folder) { (void)read_mesh_ply(folder / "mesh.ply"); }},
          {"npz",
           "depth.npz",
           false,
           [](const fs::path& folder) {
             const std::string array = npy("<f4", "(2, 3)", std::string(24, '\1'));
             write_bytes(folder / "depth.npz", zip_bytes({{"a.npy", array}}, {.method = 8}));
           },
           [](const fs::path& folder) { (void)read_depth_file(folder / "depth.npz"); }},
          {"COLMAP depth",
           "a.jpg.geometric.bin",
           false,
           [](const fs::path& folder) {
             write_bytes(folder / "a.jpg.geometric.bin", "3&2&1&" + std::string(24, '\1'));
           },
           [](const fs::path& folder) { (void)read_depth_file(folder / "a.jpg.geometric.bin"); }},
          {"3MF",
           "mesh.3mf",
           false,
           [](const fs::path& folder) { write_bytes(folder / "mesh.3mf", ThreeMfFile().bytes()); },
           [](const fs::path& folder) { (void)read_mesh_file(folder / "mesh.3mf"); }}};
}

constexpr const char* kAnyRefusal =
    "EMPTY|OPEN|MAGIC|SYNTAX|SCHEMA|UNSUPPORTED|TRUNCATED|COUNT|VALUE|REF|PATH|MISSING|MISMATCH|"
    "LIMIT";

/// Adds one case per target: the file is changed by `change`, then read.
class PerTarget {
 public:
  explicit PerTarget(Cases& cases) : cases_(cases) {}
  using Change = std::function<void(const fs::path& file)>;
  using Applies = std::function<bool(const Target&)>;

  void add(
      const std::string& row,
      const std::string& damage,
      const std::string& expected,
      const Change& change,
      const Applies& applies = [](const Target&) { return true; }) {
    add_all(row, damage, expected, change, applies, false);
  }
  void add_without_rights(const std::string& row,
                          const std::string& damage,
                          const std::string& expected,
                          const Change& change) {
    add_all(
        row, damage, expected, change, [](const Target&) { return true; }, true);
  }

 private:
  void add_all(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const Change& change,
               const Applies& applies,
               bool has_no_rights) {
    for (const Target& target : targets()) {
      if (!applies(target)) continue;
      std::vector<std::string> words;
      if (expected.find("OK") == std::string::npos) {
        words.push_back(fs::path(target.file).filename().string());
      }
      cases_.push_back(
          {row, target.name + ": " + damage, expected, words, [=](const fs::path& folder) {
             target.write(folder);
             change(folder / target.file);
             return Call{{}, [=] { target.read(folder); }, 0, has_no_rights};
           }});
    }
  }

  Cases& cases_;
};

void add_odd_files(PerTarget& each) {
  const auto is_points = [](const Target& t) { return t.name == "points3D.txt"; };
  each.add(
      "G01",
      "zero bytes",
      "EMPTY",
      [](const fs::path& file) { write_bytes(file, ""); },
      [=](const Target& t) { return !is_points(t); });
  each.add(
      "G01", "zero bytes", "OK", [](const fs::path& file) { write_bytes(file, ""); }, is_points);
  each.add("G02", "a folder", "OPEN", [](const fs::path& file) {
    fs::remove(file);
    fs::create_directory(file);
  });
  each.add("G03", "a FIFO", "OPEN", [](const fs::path& file) {
    fs::remove(file);
    ::mkfifo(file.c_str(), 0600);
  });
  for (const char* device : {"/dev/zero", "/dev/full"}) {
    each.add("G04", std::string("link to ") + device, "OPEN|PATH", [=](const fs::path& file) {
      fs::remove(file);
      fs::create_symlink(device, file);
    });
  }
  // A scene may lack photographs that its cameras name: these are counted.
  each.add("G06", "link to nothing", "OPEN|PATH|MISSING|OK", [](const fs::path& file) {
    fs::remove(file);
    fs::create_symlink(file.filename().string() + ".gone", file);
  });
  each.add("G06", "link to itself", "OPEN|PATH", [](const fs::path& file) {
    fs::remove(file);
    fs::create_symlink(file.filename(), file);
  });
  each.add_without_rights("G05", "no permission", "OPEN", [](const fs::path& file) {
    fs::permissions(file, fs::perms::none);
  });
  // Else the folder could be what cannot be read.
  each.add_without_rights("G05", "a reader of no rights", "OK", [](const fs::path&) {});
}

void add_foreign_content(PerTarget& each) {
  const auto content = [&](const char* row, const char* what, const std::string& bytes) {
    each.add(row, what, "MAGIC", [=](const fs::path& file) { write_bytes(file, bytes); });
  };
  content("G09", "HTML", "<!DOCTYPE html><html><body>404 Not Found</body></html>\n");
  content("G10",
          "Git LFS pointer",
          "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 12345\n");
  content("G11", "gzip", std::string("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + std::string(40, 'x'));
  each.add(
      "G11",
      "zip",
      "MAGIC",
      [](const fs::path& file) {
        write_bytes(file, std::string("PK\x03\x04", 4) + std::string(60, '\0'));
      },
      [](const Target& t) { return t.name != "npz" && t.name != "3MF"; });
  each.add(
      "G08",
      "PNG bytes",
      "MAGIC|SYNTAX|UNSUPPORTED|COUNT|TRUNCATED|SCHEMA|LIMIT",
      [](const fs::path& file) { write_bytes(file, picture_png(0)); },
      [](const Target& t) { return t.name != "PNG" && t.name != "JPEG"; });
  each.add(
      "G08",
      "PLY bytes",
      "MAGIC",
      [](const fs::path& file) { write_bytes(file, splats(3).bytes()); },
      [](const Target& t) { return t.name == "PNG" || t.name == "JPEG" || t.name == "EXR"; });
}

void add_damage(PerTarget& each) {
  for (int k = 0; k < 16; ++k) {
    const size_t length = size_t{1} << k;
    each.add("G12",
             "cut to " + std::to_string(length) + " bytes",
             std::string(kAnyRefusal) + "|OK",
             [=](const fs::path& file) { write_bytes(file, read_bytes(file).substr(0, length)); });
  }
  const auto is_exact = [](const Target& t) { return !t.is_text; };
  each.add(
      "G12",
      "cut in half",
      kAnyRefusal,
      [](const fs::path& file) {
        write_bytes(file, read_bytes(file).substr(0, fs::file_size(file) / 2));
      },
      is_exact);
  each.add(
      "G12",
      "cut by one byte",
      "TRUNCATED|SYNTAX|COUNT",
      [](const fs::path& file) { fs::resize_file(file, fs::file_size(file) - 1); },
      is_exact);
  for (const char pattern : {'\0', '\x7f', '\x80', '\xff'}) {
    for (size_t at = 0; at < 1024; at += 251) {
      each.add("G13",
               "byte " + std::to_string(at) + " set to " + std::to_string(uint8_t(pattern)),
               std::string(kAnyRefusal) + "|OK",
               [=](const fs::path& file) {
                 std::string bytes = read_bytes(file);
                 if (at < bytes.size()) bytes[at] = pattern;
                 write_bytes(file, bytes);
               });
    }
  }
  each.add(
      "G15", "5 GiB, mostly holes", std::string(kAnyRefusal) + "|OK", [](const fs::path& file) {
        fs::resize_file(file, uint64_t{5} << 30);
      });
}

void add_text(PerTarget& each) {
  const auto is_text = [](const Target& t) { return t.is_text && t.name != "mesh"; };
  each.add(
      "G16",
      "byte order mark",
      "OK",
      [](const fs::path& file) { write_bytes(file, "\xef\xbb\xbf" + read_bytes(file)); },
      is_text);
  each.add(
      "G16",
      "lines that end as on Windows",
      "OK",
      [](const fs::path& file) {
        std::string out;
        for (const char c : read_bytes(file)) out += c == '\n' ? "\r\n" : std::string(1, c);
        write_bytes(file, out);
      },
      [](const Target& t) { return t.is_text; });
}

// The file shrinks and grows while it is read, again and again.
void add_shrinking(Cases& cases) {
  cases.push_back({"G14",
                   "a file that shrinks while it is read",
                   std::string(kAnyRefusal) + "|OK",
                   {},
                   [](const fs::path& folder) {
                     write_volume_file(folder);
                     return Call{{}, [=] {
                                   const fs::path file = folder / "volume.vdb";
                                   const auto size = fs::file_size(file);
                                   std::thread writer([&] {
                                     for (int i = 0; i < 2000; ++i) {
                                       fs::resize_file(file, i % 2 == 0 ? size / 3 : size);
                                     }
                                   });
                                   for (int i = 0; i < 50; ++i) {
                                     try {
                                       (void)read_file(file);
                                     } catch (const BadInput&) {
                                     }
                                   }
                                   writer.join();
                                   (void)read_file(file);
                                 }};
                   }});
}

void add_names(Cases& cases) {
  const std::vector<std::string> names = {
      "a\nb.png", "\x1b[31mred.png", "\xff\xfe.png", std::string(251, 'n') + ".png"};
  for (const std::string& name : names) {
    for (const bool json : {false, true}) {
      cases.push_back({"G07", "a name with odd bytes", "OK", {}, [=](const fs::path& folder) {
                         write_llff_scene(folder);
                         fs::rename(folder / "scene/images/1.png", folder / "scene/images" / name);
                         Call call = info_call(folder);
                         call.read = nullptr;
                         if (!json) call.arguments.pop_back();
                         return call;
                       }});
    }
    cases.push_back({"G07",
                     "a damaged file with odd bytes in its name",
                     "TRUNCATED",
                     {},
                     [=](const fs::path& folder) {
                       write_llff_scene(folder);
                       fs::remove(folder / "scene/images/1.png");
                       write_bytes(folder / "scene/images" / name, picture_png(1).substr(0, 200));
                       return run_call(folder);
                     }});
  }
  cases.push_back({"G07", "a run over odd names", "OK", {}, [=](const fs::path& folder) {
                     write_llff_scene(folder);
                     for (int i = 0; i < 3; ++i) {
                       fs::rename(folder / ("scene/images/" + std::to_string(i) + ".png"),
                                  folder / "scene/images" / names[size_t(i)]);
                     }
                     return run_call(folder);
                   }});
}

// German numbers have a decimal comma and points between thousands.
void use_german_locale(const fs::path& folder) {
  const fs::path made = folder / "locales/de_DE.UTF-8";
  fs::create_directories(made.parent_path());
  const std::string command = "localedef -i de_DE -f UTF-8 '" + made.string() + "' >/dev/null 2>&1";
  (void)!std::system(command.c_str());  // warnings count as failure; what it made is asked below
  ::setenv("LOCPATH", made.parent_path().c_str(), 1);
  ::setenv("LC_ALL", "de_DE.UTF-8", 1);
  const char* const is_there = std::setlocale(LC_ALL, "");
  const bool has_comma = is_there != nullptr && *std::localeconv()->decimal_point == ',';
  std::setlocale(LC_ALL, "C");
  if (!has_comma) throw std::runtime_error("needs the Debian package locales");
}

// The files of a run, without those that state times.
std::map<std::string, std::string> results(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(entry.path(), folder);
    const bool has_times = name == "report.html" || name == "report.json" || name == "run.json";
    if (entry.is_regular_file() && !has_times) out[name] = read_bytes(entry.path());
  }
  return out;
}

// The program gives the same bytes wherever its user lives.
void add_locale(Cases& cases) {
  cases.push_back({"G17", "a decimal comma", "OK", {}, [](const fs::path& folder) {
                     write_colmap_text_scene(folder);
                     return Call{{}, [folder] {
                                   const auto run = [&](const std::string& name) {
                                     const fs::path out = folder / "runs" / name;
                                     const ProgramResult ended =
                                         run_cgs("run " + (folder / "scene").string() +
                                                 " --assume-unit cm -q -o " + out.string());
                                     if (ended.exit_code != 0) throw std::runtime_error(ended.err);
                                     return results(out);
                                   };
                                   const auto plain = run("plain");
                                   use_german_locale(folder);
                                   const auto german = run("german");
                                   if (plain.size() < 20) throw std::runtime_error("few files");
                                   for (const auto& [name, bytes] : plain) {
                                     if (german.count(name) == 1 && german.at(name) == bytes)
                                       continue;
                                     throw std::runtime_error("another " + name);
                                   }
                                 }};
                   }});
}

}  // namespace

Cases general_cases() {
  Cases cases;
  PerTarget each(cases);
  each.add("G12", "untouched twin", "OK", [](const fs::path&) {});
  add_odd_files(each);
  add_foreign_content(each);
  add_damage(each);
  add_text(each);
  add_shrinking(cases);
  add_names(cases);
  add_locale(cases);
  return cases;
}

}  // namespace cgs::test
