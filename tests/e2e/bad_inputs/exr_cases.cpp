// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exr.h"
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

// The depth of the first view, an EXR that `render` reads.
constexpr const char* kFile = "model/priors/0.exr";

Case exr_case(const std::string& row,
              const std::string& damage,
              const std::string& expected,
              const std::vector<std::string>& words,
              const std::function<void(std::string&)>& change) {
  std::vector<std::string> all = words;
  if (expected.rfind("OK", 0) != 0) all.emplace_back("0.exr");
  return {row, damage, expected, all, [change](const fs::path& folder) {
            write_model_folder(folder);
            std::string bytes = read_bytes(folder / kFile);
            change(bytes);
            write_bytes(folder / kFile, bytes);
            return render_call(folder);
          }};
}

// Where the value of an attribute stands.
size_t value_of(const std::string& bytes, const std::string& name, const std::string& type) {
  const std::string start = name + '\0' + type + '\0';
  const size_t at = bytes.find(start);
  if (at == std::string::npos) throw std::runtime_error("no attribute " + name);
  return at + start.size() + 4;
}

void set_window(std::string& bytes, const std::array<int32_t, 4>& window) {
  bytes.replace(value_of(bytes, "dataWindow", "box2i"),
                16,
                packed(window[0], window[1], window[2], window[3]));
}

// Behind the last attribute (screenWindowWidth) and the NUL that ends the header.
size_t chunk_table(const std::string& bytes) {
  size_t at = value_of(bytes, "screenWindowWidth", "float") + 4;
  while (bytes[at] != '\0') {  // attributes in alphabetical order may follow
    at = bytes.find('\0', bytes.find('\0', at) + 1) + 1;
    int32_t size = 0;
    std::memcpy(&size, bytes.data() + at, 4);
    at += 4 + size_t(size);
  }
  return at + 1;
}

void add_headers(Cases& cases) {
  cases.push_back(exr_case("X01", "wrong magic", "MAGIC", {}, [](auto& b) { b[0] = 'X'; }));
  cases.push_back(exr_case("X01", "version 3", "MAGIC", {"3"}, [](auto& b) { b[4] = 3; }));
  cases.push_back(exr_case("X02", "deep", "UNSUPPORTED", {}, [](auto& b) { b[5] = 0x08; }));
  cases.push_back(
      exr_case("X02", "several parts", "UNSUPPORTED", {}, [](auto& b) { b[5] = 0x10; }));
  cases.push_back(exr_case("X03", "window of 1e9 x 64", "LIMIT|SYNTAX", {}, [](auto& b) {
    set_window(b, {0, 0, 999999999, 63});
  }));
  cases.push_back(exr_case("X03", "window of 46341 squared", "LIMIT|SYNTAX", {}, [](auto& b) {
    set_window(b, {0, 0, 46340, 46340});
  }));
  cases.push_back(exr_case("X03", "window inside out", "LIMIT|SYNTAX", {}, [](auto& b) {
    set_window(b, {5, 5, 4, 4});
  }));
  cases.push_back(exr_case("X03", "window far away", "LIMIT|SYNTAX", {}, [](auto& b) {
    set_window(b, {2000000000, 2000000000, 2000000031, 2000000023});
  }));
  cases.push_back(
      exr_case("X03", "window just inside the limit", "TRUNCATED|SYNTAX|LIMIT", {}, [](auto& b) {
        set_window(b, {0, 0, (1 << 24) - 1, 15});
      }));
  for (const char method : {4, 5, 6, 7, 8, 9}) {
    cases.push_back(
        exr_case("X04",
                 "pixels that are not of compression " + std::to_string(method),
                 "SYNTAX|TRUNCATED|LIMIT",
                 {},
                 [=](auto& b) { b[value_of(b, "compression", "compression")] = method; }));
  }
  cases.push_back(
      exr_case("X05", "cut in half", "TRUNCATED", {}, [](auto& b) { b.resize(b.size() / 2); }));
  cases.push_back(exr_case("X05", "cut by a byte", "TRUNCATED", {}, [](auto& b) { b.pop_back(); }));
  cases.push_back(exr_case("X06", "chunk at the end", "SYNTAX|TRUNCATED", {}, [](auto& b) {
    b.replace(chunk_table(b), 8, packed(uint64_t(b.size())));
  }));
  cases.push_back(exr_case("X06", "chunk in the header", "SYNTAX", {}, [](auto& b) {
    b.replace(chunk_table(b), 8, packed(uint64_t{8}));
  }));
  cases.push_back(exr_case("X06", "chunk twice", "SYNTAX", {}, [](auto& b) {
    const size_t at = chunk_table(b);
    b.replace(at + 8, 8, b.substr(at, 8));
  }));
}

void add_attributes(Cases& cases) {
  // A NUL ends the attributes: more of them go before it.
  const auto insert = [](std::string& bytes, const std::string& attributes) {
    const size_t at = chunk_table(bytes);
    std::string table = bytes.substr(at, 16);
    for (size_t i = 0; i < 16; i += 8) {
      uint64_t offset = 0;
      std::memcpy(&offset, table.data() + i, 8);
      table.replace(i, 8, packed(offset + attributes.size()));
    }
    bytes = bytes.substr(0, at - 1) + attributes + '\0' + table + bytes.substr(at + 16);
  };
  cases.push_back(
      exr_case("X08", "channel Z has another name", "SCHEMA|UNSUPPORTED", {"Z"}, [](auto& b) {
        const size_t at = value_of(b, "channels", "chlist");
        b[b.find(std::string("Z\0", 2), at)] = 'Q';
      }));
  for (const char sampling : {0, 2}) {
    cases.push_back(exr_case(
        "X08", "sampling " + std::to_string(sampling), "SCHEMA|UNSUPPORTED", {}, [=](auto& b) {
          const size_t at = value_of(b, "channels", "chlist");
          b[b.find(std::string("Z\0", 2), at) + 2 + 12] = sampling;
        }));
  }
  cases.push_back(exr_case("X09", "attribute of 2^31 - 1 bytes", "LIMIT", {}, [](auto& b) {
    b.replace(value_of(b, "compression", "compression") - 4, 4, packed(int32_t{0x7fffffff}));
  }));
  cases.push_back(exr_case("X09", "100 000 attributes", "LIMIT", {}, [=](auto& b) {
    std::string many;
    for (int i = 0; i < 100000; ++i) {
      many += "zz" + std::to_string(i) + '\0' + "int" + '\0' + packed(int32_t{4}, i);
    }
    insert(b, many);
  }));
  cases.push_back(exr_case("X10", "empty multiView", "SYNTAX", {}, [=](auto& b) {
    insert(b,
           std::string("zmultiView").substr(1) + '\0' + "stringvector" + '\0' + packed(int32_t{0}));
  }));
  cases.push_back(exr_case("X10", "an attribute more", "OK", {}, [=](auto& b) {
    insert(b, std::string("zz") + '\0' + "int" + '\0' + packed(int32_t{4}, int32_t{7}));
  }));
}

}  // namespace

Cases exr_cases() {
  Cases cases;
  add_headers(cases);
  add_attributes(cases);
  for (const float value : {NAN, INFINITY, -INFINITY, -1.0f, 0.0f, 1e38f}) {
    cases.push_back(
        {"X07", "depths of " + std::to_string(value), "OK", {}, [value](const fs::path& folder) {
           write_model_folder(folder);
           ExrImage image = read_exr(folder / kFile);
           for (auto& [name, values] : image.channels) {
             if (name != "Z" && name != "sigma.Y") continue;
             for (size_t i = 0; i < values.size(); i += 3) values[i] = value;
           }
           write_exr(folder / kFile, image);
           return render_call(folder);
         }});
  }
  return cases;
}

}  // namespace cgs::test
