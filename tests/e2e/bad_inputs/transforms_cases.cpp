// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

using Json = nlohmann::json;

Case json_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::vector<std::string>& words,
               const std::function<void(Json&)>& change) {
  std::vector<std::string> all = words;
  if (expected.rfind("OK", 0) != 0) all.emplace_back("transforms.json");
  return {row, damage, expected, all, [change](const fs::path& folder) {
            Json document = transforms();
            change(document);
            write_transforms_scene(folder, document);
            return info_call(folder);
          }};
}

Case text_case(const std::string& row,
               const std::string& damage,
               const std::string& expected,
               const std::vector<std::string>& words,
               const std::function<std::string(const std::string&)>& change) {
  std::vector<std::string> all = words;
  all.emplace_back("transforms.json");
  return {row, damage, expected, all, [change](const fs::path& folder) {
            write_transforms_scene(folder);
            write_bytes(folder / "scene/transforms.json", change(transforms().dump(1)));
            return info_call(folder);
          }};
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("no " + from);
  return text.replace(at, from.size(), to);
}

void add_documents(Cases& cases) {
  cases.push_back(text_case("T01", "cut", "SYNTAX", {":"}, [](const std::string& text) {
    return text.substr(0, text.size() * 8 / 10);
  }));
  cases.push_back(text_case("T01", "trailing comma", "SYNTAX", {":"}, [](const std::string& text) {
    return with(text, "\"cx\": 16,", "\"cx\": 16,,");
  }));
  cases.push_back(
      text_case("T02", "200 000 nested arrays", "LIMIT", {"64"}, [](const std::string&) {
        return std::string(200000, '[');
      }));
  cases.push_back(
      {"T03", "a document of 300 MiB", "LIMIT", {"transforms.json"}, [](const fs::path& folder) {
         write_transforms_scene(folder);
         fs::resize_file(folder / "scene/transforms.json", 300u << 20);
         return info_call(folder);
       }});
  for (const char* number : {"NaN", "Infinity", "-Infinity", "1e999", "0x10", "1,5"}) {
    cases.push_back(text_case(
        "T04", std::string("number ") + number, "SYNTAX|VALUE", {}, [=](const std::string& text) {
          return with(text, "\"fl_x\": 30.0", std::string("\"fl_x\": ") + number);
        }));
  }
  cases.push_back(text_case("T05", "key twice", "SYNTAX", {"frames"}, [](const std::string& text) {
    return with(text, "\"fl_x\"", "\"frames\": [], \"fl_x\"");
  }));
  cases.push_back(text_case(
      "T05", "key with control characters twice", "SYNTAX", {}, [](const std::string& text) {
        return with(text, "\"fl_x\"", "\"\\u001b[31m\\n\": 1, \"\\u001b[31m\\n\": 2, \"fl_x\"");
      }));
}

void add_matrices(Cases& cases) {
  const auto matrix = [&](const char* row, const char* damage, const char* expected, Json value) {
    cases.push_back(json_case(row, damage, expected, {"/frames/1/transform_matrix"}, [=](Json& d) {
      d["frames"][1]["transform_matrix"] = value;
    }));
  };
  const Json r0 = {1, 0, 0, 0.1};
  const Json r1 = {0, 1, 0, 0};
  const Json r2 = {0, 0, 1, 0};
  const Json r3 = {0, 0, 0, 1};
  matrix("T06", "3 x 3", "SCHEMA", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  matrix("T06", "ragged", "SCHEMA", {r0, {0, 1, 0}, r2, r3});
  matrix("T06", "text", "SCHEMA", {r0, {0, "one", 0, 0}, r2, r3});
  matrix("T06", "a number", "SCHEMA", 5);
  matrix("T06", "null", "SCHEMA", nullptr);
  matrix("T07", "last row", "VALUE", {r0, r1, r2, {0, 0, 1, 1}});
  matrix("T08", "mirrored", "VALUE", {r0, r1, {0, 0, -1, 0}, r3});
  matrix("T08", "stretched", "VALUE", {r0, {0, 1.01, 0, 0}, r2, r3});
  matrix("T09", "all zero", "VALUE", Json(4, Json(4, 0)));
}

void add_paths(Cases& cases) {
  const auto path = [&](const char* row, const std::string& name, const char* expected) {
    cases.push_back(json_case(row, "path " + name.substr(0, 40), expected, {}, [=](Json& d) {
      d["frames"][1]["file_path"] = name;
    }));
  };
  path("T10", "../../../etc/passwd", "PATH");
  path("T11", "/etc/passwd", "PATH");
  path("T12", "file:///etc/passwd", "PATH");
  path("T12", "http://localhost/1.png", "PATH");
  path("T13", std::string("a\0.png", 6), "PATH");
  path("T13", "", "PATH");
  path("T13", std::string(5000, 'a'), "PATH|OPEN|MISSING");
  path("T15", "images/1", "OK");
  path("T15", "images/9", "OK+W");
  cases.push_back(
      {"T14", "link out of the scene", "PATH", {"link.png"}, [](const fs::path& folder) {
         Json document = transforms();
         document["frames"][1]["file_path"] = "images/link.png";
         write_transforms_scene(folder, document);
         write_bytes(folder / "secret.png", picture_png(1));
         fs::create_symlink(folder / "secret.png", folder / "scene/images/link.png");
         return info_call(folder);
       }});
  for (const char* key : {"ply_file_path", "depth_file_path", "mask_path"}) {
    cases.push_back(json_case("T23", key, "PATH", {"passwd"}, [=](Json& d) {
      (std::string(key) == "ply_file_path" ? d : d["frames"][0])[key] = "../../etc/passwd";
    }));
  }
}

void add_frame_cameras(Cases& cases) {
  cases.push_back(
      json_case("T16", "no focal length", "SCHEMA", {"fl_x", "camera_angle_x"}, [](Json& d) {
        d.erase("fl_x");
        d.erase("fl_y");
      }));
  for (const double angle : {0.0, 3.141592653589793, -1.0}) {
    cases.push_back(json_case("T17",
                              "camera_angle_x " + std::to_string(angle),
                              "VALUE",
                              {"/camera_angle_x"},
                              [=](Json& d) {
                                d.erase("fl_x");
                                d["camera_angle_x"] = angle;
                              }));
  }
  cases.push_back(
      json_case("T18", "w and h of another size", "OK+W", {"intrinsics were scaled"}, [](Json& d) {
        d["w"] = 64;
        d["h"] = 48;
      }));
  cases.push_back(
      json_case("T19", "no frames", "EMPTY", {}, [](Json& d) { d["frames"] = Json::array(); }));
  Case one = json_case("T19", "one frame", "EMPTY", {}, [](Json& d) {
    d["frames"].erase(2);
    d["frames"].erase(1);
  });
  one.words = {"scene", "2 views"};
  cases.push_back(one);
  cases.push_back(json_case("T20", "one file twice", "OK+W", {"twice"}, [](Json& d) {
    d["frames"][1]["file_path"] = "images/0.png";
  }));
  cases.push_back(
      json_case("T21", "k1 = -10", "VALUE", {"radius"}, [](Json& d) { d["k1"] = -10; }));
  for (const Json& w : {Json(std::pow(2.0, 70)), Json(1.5), Json("640"), Json(-32)}) {
    cases.push_back(
        json_case("T22", "w = " + w.dump(), "SCHEMA", {"/w"}, [=](Json& d) { d["w"] = w; }));
  }
}

}  // namespace

Cases transforms_cases() {
  Cases cases;
  add_documents(cases);
  add_matrices(cases);
  add_paths(cases);
  add_frame_cameras(cases);
  return cases;
}

}  // namespace cgs::test
