// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/e2e/bad_inputs/valid_inputs.h"

namespace cgs::test {

namespace {

// The scene with its second picture replaced; `call` says what is done with it.
Case picture_case(const std::string& row,
                  const std::string& damage,
                  const std::string& expected,
                  const std::vector<std::string>& words,
                  const std::function<std::string()>& bytes,
                  Call (*call)(const fs::path&) = run_call) {
  std::vector<std::string> all = words;
  if (expected.rfind("OK", 0) != 0) all.emplace_back("1.png");
  return {row, damage, expected, all, [=](const fs::path& folder) {
            write_transforms_scene(folder);
            write_bytes(folder / "scene/images/1.png", bytes());
            return call(folder);
          }};
}

std::vector<std::string> grey_rows(size_t bytes_per_row) {
  std::vector<std::string> rows;
  for (int y = 0; y < kHeight; ++y) {
    std::string row;
    for (size_t i = 0; i < bytes_per_row; ++i) row += char(i * 37 + size_t(y) * 11 * (i % 5 + 1));
    rows.push_back(row);
  }
  return rows;
}

std::string with_alpha(char alpha) {
  std::vector<std::string> rows = grey_rows(4 * kWidth);
  for (std::string& row : rows) {
    for (size_t i = 3; i < row.size(); i += 4) row[i] = alpha;
  }
  return png(kWidth, rows, {6, 8});
}

void add_png(Cases& cases) {
  cases.push_back(picture_case("I01", "30000 x 30000 zeros", "LIMIT", {"30000"}, [] {
    return png(30000, std::vector<std::string>(64, std::string(30000, '\0')), {0, 8})
        .replace(20, 4, big_endian(30000));
  }));
  cases.push_back(picture_case("I02", "2^31 - 1 square", "LIMIT|VALUE", {}, [] {
    const std::string side = big_endian(0x7fffffff);
    return picture_png(1).replace(16, 8, side + side);
  }));
  cases.push_back(picture_case("I02", "0 x 0", "LIMIT|VALUE", {}, [] {
    return picture_png(1).replace(16, 8, std::string(8, '\0'));
  }));
  cases.push_back(picture_case("I03", "cut", "TRUNCATED", {}, [] {
    const std::string good = picture_png(1);
    return good.substr(0, good.size() * 6 / 10);
  }));
  cases.push_back(picture_case("I03", "wrong checksum", "TRUNCATED|SYNTAX", {}, [] {
    std::string bytes = picture_png(1);
    bytes[60] = char(bytes[60] ^ 1);
    return bytes;
  }));
  cases.push_back(picture_case("I03", "fewer rows than announced", "TRUNCATED|SYNTAX", {}, [] {
    std::vector<std::string> rows = grey_rows(kWidth);
    const std::string good = png(kWidth, rows, {0, 8});
    rows.resize(7);
    const std::string data = png(kWidth, rows, {0, 8});
    return good.substr(0, 33) + data.substr(33);  // the header of one, the pixels of the other
  }));
  cases.push_back(picture_case(
      "I07",
      "16 bits",
      "OK",
      {},
      [] {
        return png(kWidth, grey_rows(6 * kWidth), {2, 16});
      },
      train_call));
  cases.push_back(picture_case(
      "I07",
      "1 bit",
      "OK",
      {},
      [] {
        return png(kWidth, grey_rows(kWidth / 8), {0, 1});
      },
      train_call));
  cases.push_back(picture_case(
      "I07",
      "grey and alpha",
      "OK",
      {},
      [] {
        return png(kWidth, grey_rows(2 * kWidth), {4, 8});
      },
      train_call));
  cases.push_back(picture_case(
      "I07",
      "palette",
      "OK",
      {},
      [] {
        std::string palette;
        for (int i = 0; i < 256; ++i) palette += {char(i), char(255 - i), char(i * 7)};
        return png(kWidth, grey_rows(kWidth), {3, 8}, png_chunk("PLTE", palette));
      },
      train_call));
  cases.push_back(picture_case("I07", "palette index out of range", "OK|SYNTAX|TRUNCATED", {}, [] {
    return png(kWidth, grey_rows(kWidth), {3, 8}, png_chunk("PLTE", std::string(9, 'x')));
  }));
  cases.push_back(picture_case(
      "I08", "alpha 0 everywhere", "OK+W", {"masked"}, [] { return with_alpha(0); }, train_call));
  cases.push_back(picture_case("I12", "colour profile that expands to 64 MiB", "OK|LIMIT", {}, [] {
    const std::string profile =
        "icc" + std::string(2, '\0') + deflated(std::string(64 << 20, '\0'));
    return png(kWidth, grey_rows(3 * kWidth), {}, png_chunk("iCCP", profile));
  }));
  cases.push_back(picture_case("I12", "text of 9 MiB", "LIMIT", {}, [] {
    return png(kWidth, grey_rows(3 * kWidth), {}, png_chunk("tEXt", std::string(9 << 20, 'x')));
  }));
  cases.push_back(picture_case("I12", "text of 1 GiB, not there", "LIMIT|TRUNCATED", {}, [] {
    std::string bytes = picture_png(1);
    return bytes.insert(33, big_endian(1u << 30) + "tEXtshort");
  }));
  cases.push_back(picture_case(
      "I11",
      "animated",
      "OK",
      {},
      [] {
        return png(
            kWidth, grey_rows(3 * kWidth), {}, png_chunk("acTL", big_endian(2) + big_endian(0)));
      },
      train_call));
  cases.push_back(picture_case(
      "I16",
      "one colour",
      "OK+W",
      {"one colour"},
      [] {
        return png(kWidth, std::vector<std::string>(kHeight, std::string(3 * kWidth, '\x55')));
      },
      train_call));
  cases.push_back(picture_case(
      "I16",
      "the same picture twice",
      "OK+W",
      {"same picture"},
      [] { return picture_png(0); },
      train_call));
}

void add_jpeg(Cases& cases) {
  for (const int percent : {25, 50, 90}) {
    cases.push_back(picture_case(
        "I04", "JPEG cut at " + std::to_string(percent) + " %", "TRUNCATED|SYNTAX", {}, [=] {
          const std::string good = jpeg(kWidth, kHeight);
          return good.substr(0, good.size() * size_t(percent) / 100);
        }));
  }
  cases.push_back(picture_case(
      "I05", "CMYK JPEG", "OK+W", {"adds nothing"}, [] { return jpeg(kWidth, kHeight, 4); }));
  const auto frame = [](size_t offset, char value) {
    std::string bytes = jpeg(kWidth, kHeight);
    const size_t at = bytes.find("\xff\xc0");
    bytes[at + offset] = value;
    return bytes;
  };
  cases.push_back(
      picture_case("I05", "12-bit JPEG", "UNSUPPORTED", {"12"}, [=] { return frame(4, 12); }));
  cases.push_back(picture_case(
      "I05", "arithmetic JPEG", "OK+W", {"adds nothing"}, [=] { return frame(1, '\xc9'); }));
  cases.push_back(picture_case(
      "I06",
      "orientation tag",
      "OK+W",
      {"lie turned"},
      [] {
        const std::string tag =
            "Exif" + std::string(2, '\0') + "II" + packed(uint16_t{42}, uint32_t{8}) +
            packed(
                uint16_t{1}, uint16_t{0x112}, uint16_t{3}, uint32_t{1}, uint32_t{6}, uint32_t{0});
        const uint32_t length = uint32_t(tag.size()) + 2;
        return jpeg(kWidth, kHeight)
            .insert(2, std::string("\xff\xe1") + char(length >> 8) + char(length & 255) + tag);
      },
      train_call));
}

struct TiffTag {
  uint16_t tag;
  uint16_t type;  ///< 3 = 16 bits, 4 = 32 bits
  uint32_t count;
  uint32_t value;
};

// A TIFF whose pixels stand behind its only directory.
std::string tiff(std::vector<TiffTag> tags, const std::string& pixels) {
  const auto start = uint32_t(8 + 2 + 12 * tags.size() + 4);
  std::string out = "II*" + std::string(1, '\0') + packed(uint32_t{8}, uint16_t(tags.size()));
  for (TiffTag& t : tags) {
    if (t.tag == 273) t.value += start;
    out += packed(t.tag, t.type, t.count, t.value);
  }
  return out + packed(uint32_t{0}) + pixels;
}

std::vector<TiffTag> tiff_tags(uint32_t bits, uint32_t pixel_bytes) {
  return {{256, 4, 1, kWidth},
          {257, 4, 1, kHeight},
          {258, 3, 1, bits},
          {259, 3, 1, 1},
          {262, 3, 1, 1},
          {273, 4, 1, 0},
          {277, 3, 1, 1},
          {278, 4, 1, kHeight},
          {279, 4, 1, kWidth * kHeight * pixel_bytes}};
}

void add_tiff(Cases& cases) {
  cases.push_back(picture_case("I09", "2^32 - 1 strips", "LIMIT|SYNTAX|COUNT|TRUNCATED", {}, [] {
    auto tags = tiff_tags(8, 1);
    tags[5].count = tags[8].count = 0xffffffff;
    return tiff(tags, std::string(kWidth * kHeight, 'x'));
  }));
  cases.push_back(picture_case("I09", "tile of 2^31", "LIMIT|SYNTAX|COUNT|TRUNCATED", {}, [] {
    auto tags = tiff_tags(8, 1);
    tags.resize(5);
    tags.push_back({322, 4, 1, 1u << 31});
    tags.push_back({323, 4, 1, 1u << 31});
    tags.push_back({324, 4, 1, 8});
    tags.push_back({325, 4, 1, 16});
    return tiff(tags, std::string(kWidth * kHeight, 'x'));
  }));
  cases.push_back(picture_case("I09", "LZW stream of zeros", "OK|LIMIT|SYNTAX|TRUNCATED", {}, [] {
    auto tags = tiff_tags(8, 1);
    tags[3].value = 5;
    return tiff(tags, std::string(kWidth * kHeight, '\0'));
  }));
  cases.push_back(picture_case(
      "I10",
      "float with NaN and Inf",
      "OK",
      {},
      [] {
        auto tags = tiff_tags(32, 4);
        tags.push_back({339, 3, 1, 3});
        std::string pixels;
        for (int i = 0; i < kWidth * kHeight; ++i) {
          pixels += packed(i == 40   ? NAN
                           : i == 41 ? INFINITY
                                     : 0.5f + 0.4f * std::sin(0.7f * float(i)));
        }
        return tiff(tags, pixels);
      },
      train_call));
  cases.push_back(picture_case(
      "I11",
      "two pages",
      "OK",
      {},
      [] {
        std::string bytes = tiff(tiff_tags(8, 1), "");
        // The second directory is the first one again.
        const std::string again = bytes.substr(8);
        bytes.replace(bytes.size() - 4, 4, packed(uint32_t(bytes.size() + kWidth * kHeight)));
        return bytes + grey_rows(kWidth * kHeight)[0] + again;
      },
      train_call));
}

void add_others(Cases& cases) {
  for (const char mess : {'\0', '\xff', '\x5a'}) {
    cases.push_back(picture_case("I13", "WebP with broken tables", "SYNTAX|TRUNCATED", {}, [=] {
      const uint32_t size = (kWidth - 1) | (kHeight - 1) << 14;
      const std::string body = std::string("\x2f") + packed(size) + std::string(400, mess);
      const std::string chunk = "VP8L" + packed(uint32_t(body.size())) + body;
      return "RIFF" + packed(uint32_t(chunk.size() + 4 + body.size() % 2)) + "WEBP" + chunk +
             std::string(body.size() % 2, '\0');
    }));
  }
  for (const std::string brand : {"heic", "avif"}) {
    cases.push_back(picture_case("I14", brand + " without content", "SYNTAX", {"HEIF"}, [=] {
      return std::string(
                 "\0\0\0\x18"
                 "ftyp",
                 8) +
             brand + std::string(100, '\0');
    }));
  }
  const std::vector<std::pair<std::string, std::string>> foreign = {
      {"MP4",
       std::string(3, '\0') + "\x18"
                              "ftypisom"},
      {"CR2", std::string("II*\0\x10\0\0\0CR\2\0", 12)},
      {"GIF", "GIF89a"},
      {"BMP", "BM"}};
  for (const auto& [name, start] : foreign) {
    cases.push_back(picture_case("I14", name, "UNSUPPORTED", {"PNG"}, [start = start] {
      return start + std::string(100, '\0');
    }));
  }
}

}  // namespace

Cases image_cases() {
  Cases cases;
  add_png(cases);
  add_jpeg(cases);
  add_tiff(cases);
  add_others(cases);
  return cases;
}

}  // namespace cgs::test
