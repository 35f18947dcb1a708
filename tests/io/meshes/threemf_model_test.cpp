// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf_model.h"

#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"
#include "tests/support/threemf_file.h"

namespace cgs::threemf_model_test {
namespace {

using test::ThreeMfFile;

const std::filesystem::path kPath = "a.model";

constexpr const char* kMaterials =
    "unit=\"millimeter\" "
    "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";

ThreeMfModel parse(const ThreeMfFile& file) { return parse_threemf_model(file.model(), kPath); }

std::string refused(const ThreeMfFile& file) {
  return test::defect_of([&] { (void)parse(file); });
}

/// An object whose mesh has these triangles on the corners of a tetrahedron.
std::string object_of(const std::string& attributes, const std::string& triangles) {
  return "<object " + attributes +
         R"(><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles>)" +
         triangles + "</triangles></mesh></object>";
}

// Core specification, 3.3: a row vector times a matrix of four rows.
TEST(ThreeMfModel, ATransformIsFourRowsThatARowVectorMeets) {
  ThreeMfFile file;
  file.resources +=
      ThreeMfFile::object(2,
                          ThreeMfFile::components({{1, "transform=\"2 0 0 0 3 0 0 0 -4 0 0 0\""},
                                                   {1, "p:path=\"/3D/o.model\""}}));
  file.build = "<item objectid=\"2\" transform=\" 1 2 3\n4 5 6\t7 8 9  10 11 12 \"/>";
  const ThreeMfModel model = parse(file);
  ASSERT_EQ(model.build.size(), 1U);
  EXPECT_EQ(model.build[0].object, 2U);
  EXPECT_EQ(model.build[0].part, "");
  const Eigen::Affine3d& transform = model.build[0].transform;
  EXPECT_EQ(transform * Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 11, 12));
  EXPECT_EQ(transform * Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(11, 13, 15));
  EXPECT_EQ(transform * Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(14, 16, 18));
  EXPECT_EQ(transform * Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(17, 19, 21));
  const std::vector<ThreeMfPlacement>& parts = model.objects.at(2).components;
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].transform * Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 3, -4));
  EXPECT_TRUE(parts[1].transform.matrix().isIdentity(0));
  EXPECT_EQ(parts[1].part, "/3D/o.model");
  EXPECT_TRUE(model.objects.at(2).vertices.empty());
  for (const char* wrong : {"", "1 0 0 0 1 0 0 0 1 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0"}) {
    file.build = std::string("<item objectid=\"2\" transform=\"") + wrong + "\"/>";
    EXPECT_EQ(refused(file), "SCHEMA") << wrong;
  }
  file.build = "<item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 0 0 nan\"/>";
  EXPECT_NE(refused(file), "");
}

// Core specification, 4.1.4: p1 alone is that of all corners; what a triangle does not state, its
// object does, and no other object.
TEST(ThreeMfModel, TrianglesTakeFromTheirObjectWhatTheyDoNotState) {
  ThreeMfFile file;
  file.resources = object_of("id=\"1\" pid=\"5\" pindex=\"3\"",
                             R"(<triangle v1="0" v2="2" v3="1"/>
<triangle v1="0" v2="1" v3="3" p1="4"/><triangle v1="0" v2="3" v3="2" p1="7" p2="8" p3="9"/>
<triangle v1="1" v2="2" v3="3" pid="6" p1="1" p3="2"/>)") +
                   object_of("id=\"2\" type=\"surface\"", R"(<triangle v1="3" v2="2" v3="0"/>)");
  const ThreeMfModel model = parse(file);
  struct Wanted {
    uint32_t group;
    std::array<uint32_t, 3> index;
  };
  const std::vector<Wanted> wanted = {
      {5, {3, 3, 3}}, {5, {4, 4, 4}}, {5, {7, 8, 9}}, {6, {1, 1, 2}}};
  const ThreeMfObject& object = model.objects.at(1);
  ASSERT_EQ(object.properties.size(), wanted.size());
  for (size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(object.properties[i].group, wanted[i].group) << i;
    EXPECT_EQ(object.properties[i].index, wanted[i].index) << i;
  }
  EXPECT_EQ(object.type, ThreeMfType::Model);
  const ThreeMfObject& other = model.objects.at(2);
  EXPECT_EQ(other.type, ThreeMfType::Surface);
  ASSERT_EQ(other.properties.size(), 1U);
  EXPECT_EQ(other.properties[0].group, 0U);
  EXPECT_EQ(other.triangles[0], (std::array<uint32_t, 3>{3, 2, 0}));
  // A number beyond 32 bits is of no group that there is.
  file.resources = object_of("id=\"1\" pid=\"4294967301\"", R"(<triangle v1="0" v2="2" v3="1"/>)");
  EXPECT_EQ(parse(file).objects.at(1).properties[0].group, 4294967295U) << "and not 5";
}

TEST(ThreeMfModel, ColoursAreSixHexadecimalDigitsOrEight) {
  ThreeMfFile file;
  file.attributes = kMaterials;
  file.resources =
      "<basematerials id=\"3\"><base name=\"a\" displaycolor=\"#FF8000\"/><base name=\"b\"/>"
      "</basematerials><m:colorgroup id=\"4\">";
  const std::vector<std::string> known = {"#000000", "#ffFFff", "#33669900"};
  const std::vector<std::string> unknown = {
      "", "336699", "#33669", "#3366990", "#336699000", "#g36699", "#3g6699", "#33669 ", "#-1+2 3"};
  for (const std::string& text : known) file.resources += "<m:color color=\"" + text + "\"/>";
  for (const std::string& text : unknown) file.resources += "<m:color color=\"" + text + "\"/>";
  file.resources += "<m:color/></m:colorgroup>" + ThreeMfFile::object(1, "");
  const ThreeMfModel model = parse(file);
  EXPECT_EQ(model.material_names.at(3), (std::vector<std::string>{"a", "b"}));
  const std::vector<Eigen::Vector3f>& base = model.colors.at(3);
  ASSERT_EQ(base.size(), 2U);
  EXPECT_LT((base[0] - Eigen::Vector3f(1, 128 / 255.0f, 0)).norm(), 1e-6f);
  EXPECT_TRUE(base[1].array().isNaN().all());
  const std::vector<Eigen::Vector3f>& group = model.colors.at(4);
  ASSERT_EQ(group.size(), known.size() + unknown.size() + 1);
  EXPECT_EQ(group[0], Eigen::Vector3f::Zero());
  EXPECT_EQ(group[1], Eigen::Vector3f::Ones());
  EXPECT_LT((group[2] - Eigen::Vector3f(0.2f, 0.4f, 0.6f)).norm(), 1e-6f);
  for (size_t i = known.size(); i < group.size(); ++i) EXPECT_TRUE(group[i].hasNaN()) << i;
  EXPECT_FALSE(model.material_names.contains(4));
}

TEST(ThreeMfModel, EntriesAreCountedThroughAllModelsOfAnArchive) {
  ThreeMfFile file;
  file.attributes = kMaterials;
  file.resources =
      "<basematerials id=\"3\"><base name=\"a\"/><base name=\"b\"/></basematerials>"
      "<m:colorgroup id=\"4\"><m:color color=\"#000000\"/><m:color color=\"#000000\"/>"
      "</m:colorgroup>" +
      ThreeMfFile::object(1, ThreeMfFile::tetrahedron()) +
      ThreeMfFile::object(2, ThreeMfFile::components({{1, ""}, {1, ""}, {1, ""}}));
  file.build = "<item objectid=\"1\"/><item objectid=\"2\"/>";
  // Objects, components, items, base materials, and the two groups.
  constexpr size_t kOwn = 2 + 3 + 2 + 2 + 2;
  constexpr size_t kMost = 1'000'000;
  EXPECT_EQ(parse(file).entries, kOwn);
  EXPECT_EQ(parse_threemf_model(file.model(), kPath, 50).entries, 50 + kOwn);
  EXPECT_EQ(parse_threemf_model(file.model(), kPath, kMost - kOwn).entries, kMost);
  EXPECT_EQ(
      test::defect_of([&] { (void)parse_threemf_model(file.model(), kPath, kMost - kOwn + 1); }),
      "LIMIT");
}

TEST(ThreeMfModel, MetadataAreThoseOfTheModelItself) {
  ThreeMfFile file;
  file.metadata =
      "<metadata name=\"Title\">none</metadata><metadata name=\"Application\">a &amp; b</metadata>"
      "<metadata name=\"Description\">one <!-- not this -->two</metadata>";
  file.resources =
      "<object id=\"1\"><metadatagroup><metadata name=\"Description\">three</metadata>"
      "</metadatagroup></object>";
  const ThreeMfModel model = parse(file);
  EXPECT_EQ(model.application, "a & b");
  EXPECT_EQ(model.description, "one two");
  file.metadata = "<metadata>nameless</metadata>";
  EXPECT_EQ(refused(file), "SCHEMA");
}

TEST(ThreeMfModel, WhatIsOfNoKnownKindIsPassedOver) {
  ThreeMfFile file;
  std::string mesh = ThreeMfFile::tetrahedron();
  mesh.insert(mesh.find("</vertices>"), "<b:vertex x=\"9\" y=\"9\" z=\"9\"/><unheard of=\"1\"/>");
  mesh.insert(mesh.find("</mesh>"),
              "<b:beamlattice><b:beams><b:beam v1=\"0\" v2=\"77\"/>"
              "</b:beams></b:beamlattice>");
  file.resources = ThreeMfFile::object(1, mesh);
  const ThreeMfModel model = parse(file);
  EXPECT_EQ(model.objects.at(1).vertices.size(), 4U);
  EXPECT_EQ(model.objects.at(1).triangles.size(), 4U);
  // Prefixes mean nothing by themselves, only what they stand for.
  const std::string production = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
  file.attributes = "xmlns:b2=\"" + production + "\" requiredextensions=\"p b2\"";
  EXPECT_EQ(refused(file), "");
  file.attributes = "requiredextensions=\"p q\"";
  EXPECT_EQ(refused(file), "UNSUPPORTED") << "q stands for nothing";
  const std::string said = test::message_of([&] { (void)parse(file); });
  EXPECT_NE(said.find("requires the extension q"), std::string::npos) << said;
}

TEST(ThreeMfModel, RefusesWhatStandsWhereItCannot) {
  const auto with = [](const std::string& resources) {
    ThreeMfFile file;
    file.resources = resources;
    return refused(file);
  };
  const std::string triangle = "<triangle v1=\"0\" v2=\"1\" v3=\"2\"/>";
  EXPECT_EQ(with(object_of("id=\"1\"", triangle)), "");
  EXPECT_EQ(with("<vertex x=\"0\" y=\"0\" z=\"0\"/>"), "SCHEMA");
  EXPECT_EQ(with(object_of("id=\"1\"", triangle) + triangle), "SCHEMA") << "the object is over";
  EXPECT_EQ(with("<component objectid=\"1\"/>"), "SCHEMA");
  EXPECT_EQ(with("<object id=\"1\"><object id=\"2\"/></object>"), "SCHEMA");
  EXPECT_EQ(with("<object id=\"1\"/><basematerials id=\"1\"/>"), "SCHEMA");
  EXPECT_EQ(with("<object/>"), "SCHEMA");
  EXPECT_EQ(with(object_of("id=\"1\"", "<triangle v1=\"0\" v2=\"1\"/>")), "SCHEMA");
  EXPECT_EQ(with(object_of("id=\"1\"", "<triangle v1=\"0\" v2=\"1\" v3=\"4\"/>")), "REF");
  EXPECT_EQ(with(object_of("id=\"1\"", "<triangle v1=\"0\" v2=\"1\" v3=\"-1\"/>")), "SYNTAX");
  EXPECT_EQ(with("<object id=\"1\"><mesh><triangles>" + triangle + "</triangles></mesh></object>"),
            "REF")
      << "vertices come before";
  const std::string foreign = "<model xmlns=\"http://example.org/model\"/>";
  EXPECT_EQ(test::defect_of([&] { (void)parse_threemf_model(foreign, kPath); }), "SCHEMA");
}

TEST(ThreeMfModel, RefusesEveryTruncation) {
  ThreeMfFile file;
  file.metadata = "<metadata name=\"Application\">cgs</metadata>";
  const std::string whole = file.model();
  EXPECT_EQ(parse_threemf_model(whole, kPath).objects.size(), 1U);
  for (size_t n = 0; n < whole.size(); ++n) {
    const auto cut = [&] { (void)parse_threemf_model(whole.substr(0, n), kPath); };
    EXPECT_THROW(cut(), BadInput) << "cut to " << n;
  }
}

}  // namespace
}  // namespace cgs::threemf_model_test
