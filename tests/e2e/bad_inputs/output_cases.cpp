// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/cameras_json.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

using Json = nlohmann::json;

void add_environment(Cases& cases) {
  cases.push_back({"E01", "a folder nobody can write", "IO", {"/proc"}, [](const fs::path& folder) {
                     write_transforms_scene(folder);
                     return Call{{"run", folder / "scene", "-q", "-o", "/proc/cgs/out"}, {}};
                   }});
  cases.push_back({"E02", "the output is a file", "IO", {"taken"}, [](const fs::path& folder) {
                     write_transforms_scene(folder);
                     write_bytes(folder / "taken", "in the way");
                     return Call{{"run", folder / "scene", "-q", "-o", folder / "taken"}, {}};
                   }});
  cases.push_back(
      {"E02", "the output lies in a file", "IO", {"taken"}, [](const fs::path& folder) {
         write_model_folder(folder);
         write_bytes(folder / "taken", "in the way");
         return Call{{"fuse", folder / "model", "-q", "-o", folder / "taken/v.vdb"}, {}};
       }});
  cases.push_back(
      {"E05", "a volume above the budget", "LIMIT", {"MiB, allowed are"}, [](const fs::path& f) {
         write_model_folder(f);
         return Call{{"fuse", f / "model", "-q", "--memory-limit", "1M", "-o", f / "out.vdb"}, {}};
       }});
  cases.push_back(
      {"E05", "a voxel size far too small", "LIMIT|USAGE", {}, [](const fs::path& f) {
         write_model_folder(f);
         return Call{{"fuse", f / "model", "-q", "--voxel-size", "1e-7", "-o", f / "out.vdb"}, {}};
       }});
  const std::vector<std::vector<std::string>> usage = {{"--threads", "100000"},
                                                       {"--threads", "-1"},
                                                       {"--iterations", "-1"},
                                                       {"--downscale", "0"},
                                                       {"--downscale", "1e99"},
                                                       {"--memory-limit", "many"},
                                                       {"--voxel-size", "-1"},
                                                       {"--voxel-size", "nan"},
                                                       {"--views", "0,1e99"}};
  for (const auto& words : usage) {
    cases.push_back(
        {"E07", words[0] + " " + words[1], "USAGE", {}, [words](const fs::path& folder) {
           write_transforms_scene(folder);
           Call call = run_call(folder);
           call.arguments.insert(call.arguments.end(), words.begin(), words.end());
           return call;
         }});
  }
}

// Room for the record and the small files, but not for the large ones.
void add_full_disk(Cases& cases) {
  constexpr uint64_t kDisk = 2048;
  const auto full = [&](const char* what, const std::function<Call(const fs::path&)>& make) {
    cases.push_back({"E04",
                     std::string("disk full in ") + what,
                     "IO",
                     {},
                     [=](const fs::path& f) {
                       Call call = make(f);
                       call.disk_bytes = kDisk;
                       return call;
                     },
                     true});
  };
  full("run", [](const fs::path& folder) {
    write_transforms_scene(folder);
    return run_call(folder);
  });
  full("train", [](const fs::path& folder) {
    write_transforms_scene(folder);
    return train_call(folder);
  });
  full("render", [](const fs::path& folder) {
    write_model_folder(folder);
    return render_call(folder);
  });
  full("fuse", [](const fs::path& folder) {
    write_model_folder(folder);
    return Call{{"fuse", folder / "model", "-q", "-o", folder / "out.vdb"}, {}};
  });
  full("mesh", [](const fs::path& folder) {
    write_volume_file(folder);
    return mesh_call(folder);
  });
  for (const char* gone : {"web/asset.glb", "report.html", "volume.vdb"}) {
    full(gone, [=](const fs::path& folder) {
      write_finished_run(folder);
      fs::remove(folder / "out" / gone);
      return run_call(folder);
    });
  }
}

// Output must not land on what is read.
void add_overwriting(Cases& cases) {
  cases.push_back(
      {"E08", "the output lies in the scene", "USAGE", {"scene"}, [](const fs::path& f) {
         write_transforms_scene(f);
         return Call{{"run", f / "scene", "-q", "-o", f / "scene/images"}, {}};
       }});
  cases.push_back(
      {"E08", "the model goes into the scene", "USAGE", {"scene"}, [](const fs::path& f) {
         write_transforms_scene(f);
         return Call{{"train", f / "scene", "-q", "-o", f / "scene"}, {}};
       }});
  cases.push_back({"E08", "views go into the model", "USAGE", {"model"}, [](const fs::path& f) {
                     write_model_folder(f);
                     return Call{{"render", f / "model", "-q", "-o", f / "model/priors"}, {}};
                   }});
  cases.push_back(
      {"E08", "the volume replaces the cameras", "USAGE", {"model"}, [](const fs::path& f) {
         write_model_folder(f);
         return Call{{"fuse", f / "model", "-q", "-o", f / "model/cameras.json"}, {}};
       }});
}

// A finished run is resumed after one of its files was damaged: `gone` makes the stage run again.
Case resume_case(const std::string& row,
                 const std::string& damage,
                 const std::string& expected,
                 const std::pair<std::string, std::string>& file,
                 const std::string& gone) {
  return {row,
          damage,
          expected,
          {},
          [=](const fs::path& folder) {
            write_finished_run(folder);
            write_bytes(folder / "out" / file.first, file.second);
            if (!gone.empty()) fs::remove(folder / "out" / gone);
            return run_call(folder);
          },
          true};
}

// Rows beyond the matrix: a folder that an earlier run left, damaged since.
void add_records(Cases& cases) {
  cases.push_back(resume_case("R01", "cut record", "USAGE", {"run.json", "{\"program\": "}, ""));
  cases.push_back(resume_case("R01", "empty record", "USAGE|EMPTY", {"run.json", ""}, ""));
  cases.push_back(resume_case("R02",
                              "record nested 200 000 deep",
                              "USAGE|LIMIT",
                              {"run.json", std::string(200000, '[')},
                              ""));
  cases.push_back({"R02",
                   "stages nested 200 000 deep",
                   "USAGE|LIMIT|OK",
                   {},
                   [](const fs::path& folder) {
                     write_finished_run(folder);
                     std::string text = read_bytes(folder / "out/run.json");
                     const size_t at = text.find("\"stages\": {") + 11;
                     const std::string deep =
                         "\"x\": " + std::string(200000, '[') + std::string(200000, ']') + ",";
                     write_bytes(folder / "out/run.json", text.insert(at, deep));
                     return run_call(folder);
                   },
                   true});
  for (const char* stage :
       {"null", "5", "{}", "{\"result\": 5}", "{\"result\": null, \"seconds\": \"x\"}"}) {
    cases.push_back({"R03",
                     std::string("the mesh stage is ") + stage,
                     "USAGE|OK|SCHEMA|SYNTAX",
                     {},
                     [=](const fs::path& folder) {
                       write_finished_run(folder);
                       Json record = Json::parse(read_bytes(folder / "out/run.json"));
                       record["stages"]["mesh"] = Json::parse(stage);
                       write_bytes(folder / "out/run.json", record.dump());
                       return run_call(folder);
                     },
                     true});
  }
  cases.push_back(resume_case("R04",
                              "damaged Gaussians",
                              "TRUNCATED|SYNTAX|COUNT|MAGIC",
                              {"model/gaussians.ply", "ply\nformat ascii 1.0\n"},
                              "report.html"));
  cases.push_back(resume_case("R05",
                              "damaged mesh",
                              "TRUNCATED|SYNTAX|COUNT|MAGIC|SCHEMA",
                              {"mesh/watertight.ply", "ply\nformat ascii 1.0\n"},
                              "web/asset.glb"));
  cases.push_back(resume_case("R05",
                              "mesh without faces",
                              "EMPTY|SCHEMA|VALUE",
                              {"mesh/watertight.ply",
                               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                               "property float y\nproperty float z\nelement face 0\n"
                               "property list uchar int vertex_indices\nend_header\n0 0 0\n"},
                              "web/asset.glb"));
}

Case cameras_case(const std::string& row,
                  const std::string& damage,
                  const std::string& expected,
                  const std::function<void(Json&)>& change) {
  std::vector<std::string> words;
  if (expected.rfind("OK", 0) != 0) words.emplace_back("cameras.json");
  return {row, damage, expected, words, [change](const fs::path& folder) {
            write_model_folder(folder);
            const fs::path path = folder / "model/cameras.json";
            Json document = Json::parse(read_bytes(path));
            change(document);
            write_bytes(path, document.dump());
            return render_call(folder);
          }};
}

// Rows beyond the matrix: the cameras of a model from elsewhere.
void add_cameras(Cases& cases) {
  for (const char* name : {"../../escaped", "/tmp/escaped", "a/b", "..", ""}) {
    cases.push_back(
        cameras_case("R06", std::string("a view named '") + name + "'", "PATH", [=](Json& d) {
          d[0]["img_name"] = name;
        }));
  }
  cases.push_back(cameras_case("R06", "two views of one name", "SYNTAX", [](Json& d) {
    d[1]["img_name"] = d[0]["img_name"];
  }));
  cases.push_back(cameras_case("R07", "not a list", "SCHEMA", [](Json& d) { d = Json::object(); }));
  cases.push_back(cameras_case("R07", "no cameras", "EMPTY", [](Json& d) { d = Json::array(); }));
  cases.push_back(cameras_case(
      "R07", "width 2^30", "VALUE", [](Json& d) { d[0]["width"] = d[0]["height"] = 1 << 30; }));
  cases.push_back(cameras_case("R07", "width 0", "VALUE", [](Json& d) { d[0]["width"] = 0; }));
  cases.push_back(cameras_case("R07", "fx null", "SCHEMA", [](Json& d) { d[0]["fx"] = nullptr; }));
  cases.push_back(cameras_case("R07", "mirrored", "VALUE", [](Json& d) {
    d[0]["rotation"] = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
  }));
  for (const double scale : {0.0, -1.0, 1e-300, 1e300}) {
    cases.push_back(
        cameras_case("R08", "frame of scale " + std::to_string(scale), "VALUE", [=](Json& d) {
          d[0]["frame"]["scale"] = scale;
        }));
  }
  cases.push_back(cameras_case("R08", "frame far away", "VALUE", [](Json& d) {
    d[0]["frame"]["origin"] = {1e300, 0, 0};
  }));
  cases.push_back(cameras_case("R08", "position 1e308", "VALUE", [](Json& d) {
    d[0]["position"] = {1e308, -1e308, 1e308};
  }));
  cases.push_back(cameras_case(
      "R08", "negative metres", "VALUE", [](Json& d) { d[0]["frame"]["metres_per_unit"] = -1; }));
  Case other = cameras_case("R07", "another size than its depth", "MISMATCH", [](Json& d) {
    d[0]["width"] = 16;
    d[0]["height"] = 12;
  });
  other.words = {"0.exr"};
  cases.push_back(other);
}

}  // namespace

Cases output_cases() {
  Cases cases;
  add_environment(cases);
  add_full_disk(cases);
  add_overwriting(cases);
  cases.push_back({"E06",
                   "two runs in one folder",
                   "IO",
                   {"out", "another run (process "},
                   [](const fs::path& folder) {
                     write_transforms_scene(folder);
                     fs::create_directory(folder / "out");
                     // Held by this process until it ends.
                     lock_for_good(folder / "out");
                     return run_call(folder);
                   },
                   true});
  add_records(cases);
  add_cameras(cases);
  return cases;
}

}  // namespace cgs::test
