// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/container.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "io/bytes/byte_writer.h"
#include "tests/support/scene_files.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_container_test {
namespace {

using Json = nlohmann::json;

/// A binary file of one buffer view and one accessor. For a test to change.
struct OneAccessor {
  Json json = Json::parse(R"({"asset": {"version": "2.0"},
      "accessors": [{"bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 0}],
      "bufferViews": [{"buffer": 0, "byteLength": 0}], "buffers": [{"byteLength": 0}]})");
  std::string binary;

  Json& accessor() { return json["accessors"][0]; }
  Json& view(size_t i = 0) { return json["bufferViews"][i]; }
  std::string bytes() const { return test::glb(json.dump(), binary); }

  std::vector<float> floats(int components) const {
    const GlbContainer file(bytes(), "a.glb");
    return file.floats(file.root().at("accessors").at(size_t{0}), components);
  }
  std::vector<uint32_t> indices() const {
    const GlbContainer file(bytes(), "a.glb");
    return file.indices(file.root().at("accessors").at(size_t{0}));
  }
};

/// One that holds nothing but these numbers.
template <typename T>
OneAccessor holding(const std::vector<T>& values, int component_type) {
  OneAccessor out;
  for (const T value : values) append_bytes(out.binary, value);
  out.accessor()["componentType"] = component_type;
  out.accessor()["count"] = values.size();
  out.view()["byteLength"] = out.binary.size();
  return out;
}

/// Numbers of a type at its ends and in between, as they are and normalised by the formula of
/// glTF 2.0, section 3.11.
/// \param one  the number that stands for 1
template <typename T>
void expect_both_readings(int component_type, double one) {
  constexpr T kLeast = std::numeric_limits<T>::lowest();
  constexpr T kMost = std::numeric_limits<T>::max();
  const std::vector<T> values = {kLeast, static_cast<T>(kLeast + 1), 0, 1, 77, kMost};
  OneAccessor file = holding(values, component_type);
  const std::vector<float> plain = file.floats(1);
  file.accessor()["normalized"] = true;
  const std::vector<float> normalised = file.floats(1);
  ASSERT_EQ(plain.size(), values.size());
  ASSERT_EQ(normalised.size(), values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    const double value = values[i];
    EXPECT_EQ(plain[i], static_cast<float>(value)) << component_type;
    EXPECT_FLOAT_EQ(normalised[i], static_cast<float>(std::max(-1.0, value / one)));
    EXPECT_GE(normalised[i], -1.0f);
  }
}

TEST(GlbContainer, WholeNumbersAreReadAsTheyAreAndNormalised) {
  expect_both_readings<int8_t>(5120, 127);
  expect_both_readings<uint8_t>(5121, 255);
  expect_both_readings<int16_t>(5122, 32767);
  expect_both_readings<uint16_t>(5123, 65535);
  EXPECT_EQ(holding<uint32_t>({3'000'000'000U}, 5125).floats(1), std::vector<float>{3e9f});
  OneAccessor floats = holding<float>({-7.5f, 1e30f}, 5126);
  floats.accessor()["normalized"] = true;  // which says nothing of floats
  EXPECT_EQ(floats.floats(1), (std::vector<float>{-7.5f, 1e30f}));
}

// Vectors of three floats among bytes that are no number. The last element ends at the last byte of
// the view, without the rest of its stride, and one byte less is one element less.
TEST(GlbContainer, ElementsLieWhereOffsetsAndStrideSay) {
  constexpr size_t kCount = 5;
  constexpr size_t kSize = 12;
  for (const size_t view_at : {0, 4, 20}) {
    for (const size_t accessor_at : {0, 8}) {
      for (const size_t stride : {0, 12, 16, 40}) {  // 0 = not stated: packed
        const size_t step = stride == 0 ? kSize : stride;
        OneAccessor file;
        file.binary.assign(view_at + accessor_at, '\xff');
        std::vector<float> wanted;
        for (size_t i = 0; i < kCount; ++i) {
          file.binary.resize(view_at + accessor_at + i * step, '\xff');
          for (int k = 0; k < 3; ++k) {
            wanted.push_back(static_cast<float>(10 * i) + static_cast<float>(k));
            append_bytes(file.binary, wanted.back());
          }
        }
        file.accessor().update({{"type", "VEC3"}, {"count", kCount}, {"byteOffset", accessor_at}});
        const size_t length = accessor_at + (kCount - 1) * step + kSize;
        ASSERT_EQ(file.binary.size(), view_at + length);
        file.view().update({{"byteOffset", view_at}, {"byteLength", length}});
        if (stride > 0) file.view()["byteStride"] = stride;
        EXPECT_EQ(file.floats(3), wanted) << view_at << " " << accessor_at << " " << stride;
        file.view()["byteLength"] = length - 1;
        EXPECT_EQ(test::defect_of([&] { (void)file.floats(3); }), "COUNT");
        file.accessor()["count"] = kCount - 1;
        EXPECT_EQ(file.floats(3).size(), 3 * (kCount - 1));
      }
    }
  }
}

TEST(GlbContainer, IndicesAreUnsignedWholeNumbersOfAnyWidth) {
  EXPECT_EQ(holding<uint8_t>({0, 254, 255}, 5121).indices(), (std::vector<uint32_t>{0, 254, 255}));
  EXPECT_EQ(holding<uint16_t>({65535, 256}, 5123).indices(), (std::vector<uint32_t>{65535, 256}));
  EXPECT_EQ(holding<uint32_t>({4'294'967'295U, 65536}, 5125).indices(),
            (std::vector<uint32_t>{4'294'967'295U, 65536}));
  EXPECT_TRUE(holding<uint16_t>({}, 5123).indices().empty());
  for (const int other : {5120, 5122, 5126, 5124}) {  // signed, a float, and none at all
    const OneAccessor file = holding<uint32_t>({1, 2}, other);
    EXPECT_EQ(test::defect_of([&] { (void)file.indices(); }), "SCHEMA") << other;
  }
}

// Pairs of 16 bits that lie eight bytes apart; two of them are replaced, the later one first.
TEST(GlbContainer, SparseNumbersReplaceInterleavedOnesWhereverTheyStand) {
  OneAccessor file;
  std::vector<float> wanted;
  for (uint16_t i = 0; i < 6; ++i) {
    for (const uint16_t value : {i, static_cast<uint16_t>(100 + i), uint16_t{9}, uint16_t{9}}) {
      append_bytes(file.binary, value);
      if (value != 9) wanted.push_back(value);
    }
  }
  for (const uint16_t place : {9, 9, 4, 1}) append_bytes(file.binary, place);
  for (const uint16_t value : {1000, 2000, 3000, 4000}) append_bytes(file.binary, value);
  file.view().update({{"byteLength", 48}, {"byteStride", 8}});
  for (const int start : {48, 56}) {
    file.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", start}, {"byteLength", 8}});
  }
  file.accessor() = {{"bufferView", 0},
                     {"componentType", 5123},
                     {"type", "VEC2"},
                     {"count", 6},
                     {"sparse",
                      {{"count", 2},
                       {"indices", {{"bufferView", 1}, {"byteOffset", 4}, {"componentType", 5123}}},
                       {"values", {{"bufferView", 2}}}}}};
  ASSERT_EQ(wanted.size(), 12U);
  wanted[8] = 1000;
  wanted[9] = 2000;
  wanted[2] = 3000;
  wanted[3] = 4000;
  EXPECT_EQ(file.floats(2), wanted);
  file.accessor()["sparse"]["indices"]["byteOffset"] = 0;  // the place 9
  EXPECT_EQ(test::defect_of([&] { (void)file.floats(2); }), "REF");
  file.accessor()["sparse"]["indices"]["byteOffset"] = 6;
  EXPECT_EQ(test::defect_of([&] { (void)file.floats(2); }), "COUNT");
}

TEST(GlbContainer, EveryTruncationIsRefusedAndABinaryChunkMayBeLacking) {
  const OneAccessor file = holding<float>({1, 2, 3}, 5126);
  const std::string whole = file.bytes();
  for (size_t n = 0; n < whole.size(); ++n) {
    const std::string cut = whole.substr(0, n);
    EXPECT_EQ(test::defect_of([&] { const GlbContainer read(cut, "a.glb"); }), "TRUNCATED") << n;
  }
  // glTF 2.0, section 4.4.3.3: a file without data has no second chunk.
  const size_t chunk = whole.size() - 8 - file.binary.size();
  std::string bare = whole.substr(0, chunk);
  bare.replace(8, 4, test::packed(static_cast<uint32_t>(chunk)));
  const GlbContainer read(bare, "a.glb");
  EXPECT_EQ(read.root().at("accessors").size(), 1U);
  EXPECT_NE(
      test::defect_of([&] { (void)read.floats(read.root().at("accessors").at(size_t{0}), 1); }), "")
      << "the buffer holds nothing";
}

TEST(GlbContainer, WhatNamesAnotherPartNamesOneThatIsThere) {
  const GlbContainer file(holding<float>({1}, 5126).bytes(), "a.glb");
  const auto defect = [&](const char* array, const Json& index) {
    return test::defect_of([&] { (void)file.element(array, JsonValue(index, "a.glb")); });
  };
  EXPECT_EQ(defect("accessors", 0), "");
  EXPECT_EQ(defect("accessors", 0.0), "") << "programs write whole numbers so, too";
  EXPECT_EQ(defect("accessors", 1), "REF");
  EXPECT_EQ(defect("images", 0), "REF") << "an array that is not there has no element";
  EXPECT_EQ(defect("accessors", -1), "SCHEMA");
  EXPECT_EQ(defect("accessors", 0.5), "SCHEMA");
  EXPECT_EQ(defect("accessors", "0"), "SCHEMA");
  EXPECT_EQ(defect("asset", 0), "SCHEMA") << "no array";
}

TEST(WholeNumber, IsOneThatADoubleHoldsExactly) {
  const auto number = [](const Json& json) { return whole_number(JsonValue(json, "a.glb")); };
  EXPECT_EQ(number(0), 0U);
  EXPECT_EQ(number(4e9), 4'000'000'000U);
  EXPECT_EQ(number(9007199254740992), uint64_t{1} << 53);
  for (const Json& other : {Json(9007199254740994), Json(-1), Json(1e300), Json(0.25), Json()}) {
    EXPECT_EQ(test::defect_of([&] { (void)number(other); }), "SCHEMA") << other;
  }
}

TEST(NumbersOr, AreThoseOfTheFileWhereItStatesThem) {
  const Json json = Json::parse(R"({"scale": [1, 2.5, -3], "none": [], "words": ["1", "2"]})");
  const JsonValue object(json, "a.glb");
  EXPECT_EQ(numbers_or(object, "scale", {1, 1, 1}), (std::vector<double>{1, 2.5, -3}));
  EXPECT_EQ(numbers_or(object, "absent", {4, 5}), (std::vector<double>{4, 5}));
  EXPECT_TRUE(numbers_of(object.at("none")).empty());
  const auto defect = [&](const char* key, size_t count) {
    return test::defect_of([&] { (void)numbers_or(object, key, std::vector<double>(count)); });
  };
  EXPECT_EQ(defect("scale", 4), "COUNT");
  EXPECT_EQ(defect("none", 1), "COUNT");
  EXPECT_EQ(defect("words", 2), "SCHEMA");
}

TEST(IsGltfText, TellsJsonByItsFirstSign) {
  for (const char* text : {"{", " \t\r\n{}", "\xEF\xBB\xBF{}", "\xEF\xBB\xBF\n {"}) {
    EXPECT_TRUE(is_gltf_text(text)) << text;
  }
  for (const char* other : {"", " \n", "glTF{", "[{}]", "\xEF\xBB\xBF", "\xEF\xBB{"}) {
    EXPECT_FALSE(is_gltf_text(other)) << other;
  }
}

}  // namespace
}  // namespace cgs::glb_container_test
