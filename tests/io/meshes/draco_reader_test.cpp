// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/draco_reader.h"

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>

#include "io/meshes/draco_codec.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/scene_files.h"

namespace cgs::draco_reader_test {
namespace {

const std::filesystem::path kPath = "a.glb";

/// Adds an attribute with a value for each point.
/// \return its number
template <typename T>
int add(draco::PointCloud& cloud,
        draco::GeometryAttribute::Type type,
        int8_t components,
        draco::DataType data_type,
        const std::vector<T>& values) {
  const size_t stride = sizeof(T) * static_cast<size_t>(components);
  draco::GeometryAttribute attribute;
  const bool is_normalized = data_type != draco::DT_FLOAT32;
  attribute.Init(
      type, nullptr, components, data_type, is_normalized, static_cast<int64_t>(stride), 0);
  const int out = cloud.AddAttribute(attribute, true, cloud.num_points());
  cloud.attribute(out)->buffer()->Write(0, values.data(), values.size() * sizeof(T));
  return out;
}

const std::vector<float> kCorners = {0, 0, 0, 1, 0, 0, 1.1f, 2.3f, 0, 0, 2, -0.7f};

/// A square of two triangles.
struct Square : draco::Mesh {
  Square() {
    set_num_points(4);
    using Corner = draco::PointIndex;
    AddFace({Corner(0), Corner(1), Corner(2)});
    AddFace({Corner(0), Corner(2), Corner(3)});
    add(*this, draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, kCorners);
  }
};

/// Without rounding.
std::string encoded(draco::ExpertEncoder encoder, int method) {
  encoder.SetEncodingMethod(method);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  EXPECT_TRUE(status.ok()) << status.error_msg_string();
  return {buffer.data(), buffer.size()};
}

std::string encoded_square() {
  return encoded(draco::ExpertEncoder(Square()), draco::MESH_SEQUENTIAL_ENCODING);
}

/// The values of a vertex.
std::vector<float> of_vertex(const DracoMesh::Attribute& attribute, uint32_t vertex) {
  const auto width = static_cast<std::ptrdiff_t>(attribute.components);
  const auto first = attribute.values.begin() + width * static_cast<std::ptrdiff_t>(vertex);
  return {first, first + width};
}

// Whatever order the library gives points and faces.
TEST(ReadDraco, KeepsFacesAndValuesUnderTheirIds) {
  Square mesh;
  const std::vector<uint8_t> colors = {255, 0, 51, 102, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 254};
  const std::vector<float> weights = {0.25f, -1, 1e30f, 7};
  const int color = add(mesh, draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8, colors);
  const int weight = add(mesh, draco::GeometryAttribute::GENERIC, 1, draco::DT_FLOAT32, weights);
  mesh.attribute(0)->set_unique_id(7);
  mesh.attribute(color)->set_unique_id(300);
  mesh.attribute(weight)->set_unique_id(2);
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const DracoMesh read = read_draco(encoded(draco::ExpertEncoder(mesh), method), kPath);
    ASSERT_EQ(read.vertices, 4U);
    ASSERT_EQ(read.attributes.size(), 3U);
    ASSERT_TRUE(read.attributes.contains(7) && read.attributes.contains(300) &&
                read.attributes.contains(2));
    EXPECT_FALSE(read.attributes.at(7).is_normalized);
    EXPECT_TRUE(read.attributes.at(300).is_normalized);
    EXPECT_FALSE(read.attributes.at(2).is_normalized);
    std::set<size_t> found;  // the points, by what they weigh
    std::vector<uint32_t> point_of(4);
    for (uint32_t i = 0; i < 4; ++i) {
      const auto w =
          std::find(weights.begin(), weights.end(), of_vertex(read.attributes.at(2), i).at(0));
      ASSERT_NE(w, weights.end());
      const auto k = static_cast<size_t>(w - weights.begin());
      found.insert(k);
      point_of[i] = static_cast<uint32_t>(k);
      const std::vector<float> place = of_vertex(read.attributes.at(7), i);
      EXPECT_TRUE(std::equal(place.begin(), place.end(), &kCorners[3 * k]));
      const std::vector<float> shown = of_vertex(read.attributes.at(300), i);
      for (size_t c = 0; c < 4; ++c) {
        EXPECT_FLOAT_EQ(shown.at(c), static_cast<float>(colors[4 * k + c]) / 255.0f);
      }
    }
    EXPECT_EQ(found.size(), 4U);
    std::set<std::array<uint32_t, 3>> faces;
    for (const auto& face : read.faces) {
      std::array<uint32_t, 3> f{};
      for (size_t k = 0; k < 3; ++k) f.at(k) = point_of.at(face.at(k));
      std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
      faces.insert(f);
    }
    EXPECT_EQ(faces, (std::set<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  }
}

// The nearest vertex by trying all.
TEST(ReadDraco, IsWithinTheErrorOfWhatThisProgramCompresses) {
  TriangleMesh mesh = test::labelled_sphere();
  mesh.provenance.clear();
  const GlbPrimitive sphere = glb_primitives(mesh, {}).front();
  const DracoPrimitive packed = draco_compress(sphere, {{-0.5f, -0.5f, -0.5f}, 1.25f, 12}, 5);
  const DracoMesh read = read_draco(packed.bytes, kPath);
  EXPECT_EQ(read.vertices, packed.vertices);
  EXPECT_EQ(read.faces.size(), sphere.faces.size());
  for (const auto& face : read.faces) {
    for (const uint32_t corner : face) EXPECT_LT(corner, read.vertices);
  }
  ASSERT_EQ(read.attributes.size(), packed.attribute_ids.size());
  for (const auto& [name, id] : packed.attribute_ids) {
    const DracoMesh::Attribute& attribute = read.attributes.at(id);
    EXPECT_EQ(attribute.components, name.starts_with('_') ? 1 : 3) << name;
    EXPECT_EQ(attribute.values.size(), read.vertices * static_cast<size_t>(attribute.components));
  }
  const DracoMesh::Attribute& places = read.attributes.at(packed.attribute_ids.at("POSITION"));
  const DracoMesh::Attribute& support = read.attributes.at(packed.attribute_ids.at("_SUPPORT"));
  double worst = 0;
  for (uint32_t i = 0; i < read.vertices; ++i) {
    const Eigen::Vector3f p(of_vertex(places, i).data());
    double nearest = std::numeric_limits<double>::infinity();
    size_t best = 0;
    for (size_t k = 0; k < sphere.positions.size(); ++k) {
      const double distance = (sphere.positions[k] - p).cast<double>().norm();
      if (distance < nearest) best = k;
      nearest = std::min(nearest, distance);
    }
    worst = std::max(worst, nearest);
    EXPECT_EQ(of_vertex(support, i).at(0), sphere.support[best]);
  }
  EXPECT_LE(worst, packed.max_error + 1e-7);
  EXPECT_GT(worst, 0);
}

TEST(ReadDraco, RefusesEveryTruncationAndNamesTheFile) {
  const std::string whole = encoded_square();
  ASSERT_EQ(read_draco(whole, kPath).faces.size(), 2U);
  for (size_t n = 0; n < whole.size(); ++n) {
    EXPECT_EQ(test::defect_of([&] { (void)read_draco(whole.substr(0, n), kPath); }), "SYNTAX") << n;
  }
  const std::string said = test::message_of([&] { (void)read_draco("DRACO", kPath); });
  EXPECT_NE(said.find("a.glb: Draco: "), std::string::npos) << said;
}

TEST(ReadDraco, WhateverAByteIsFacesStayWithinVertices) {
  const std::string good = encoded_square();
  size_t read_all_the_same = 0;
  for (size_t i = 0; i < good.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ flip);
      try {
        const DracoMesh mesh = read_draco(bad, kPath);
        ++read_all_the_same;
        for (const auto& face : mesh.faces) {
          for (const uint32_t corner : face) ASSERT_LT(corner, mesh.vertices) << i;
        }
        for (const auto& [id, attribute] : mesh.attributes) {
          ASSERT_EQ(attribute.values.size(),
                    mesh.vertices * static_cast<size_t>(attribute.components));
        }
      } catch (const Error&) {  // nothing else, and no end of the program
      }
    }
  }
  EXPECT_GT(read_all_the_same, 0U) << "those of the coordinates";
}

TEST(ReadDraco, ACloudOfPointsIsNoMesh) {
  draco::PointCloud cloud;
  cloud.set_num_points(4);
  add(cloud, draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, kCorners);
  const std::string bytes =
      encoded(draco::ExpertEncoder(cloud), draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  EXPECT_EQ(test::defect_of([&] { (void)read_draco(bytes, kPath); }), "SYNTAX");
}

}  // namespace
}  // namespace cgs::draco_reader_test
