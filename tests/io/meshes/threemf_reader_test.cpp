// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf_reader.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "io/meshes/mesh_file.h"
#include "io/meshes/threemf.h"
#include "libcgs/core/up_axis.h"
#include "tests/support/python.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/threemf_file.h"

namespace cgs::threemf_reader_test {
namespace {

using Eigen::Vector3d;
using test::ThreeMfFile;

class Read3mf : public testing::Test {
 protected:
  ParsedMesh read(const ThreeMfFile& file) {
    test::write_bytes(dir_ / "a.3mf", file.bytes());
    return read_3mf(dir_ / "a.3mf");
  }
  std::string refused(const ThreeMfFile& file) {
    return test::defect_of([&] { (void)read(file); });
  }
  test::TempDir dir_;
};

double volume(const ParsedMesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.mesh.faces) {
    sum += mesh.positions[f[0]].cross(mesh.positions[f[1]]).dot(mesh.positions[f[2]]) / 6;
  }
  return sum;
}

TEST_F(Read3mf, ReadsWhatThisProgramWrites) {
  const TriangleMesh mesh = test::labelled_sphere();
  Frame frame = test::centimetre_frame();
  frame.up = Vector3d::UnitY();
  write_3mf(dir_ / "a.3mf", mesh, frame, z_up_from(frame.up));
  const MeasurableFile back = read_mesh_file(dir_ / "a.3mf");
  EXPECT_TRUE(back.warnings.empty());
  EXPECT_EQ(back.content.mesh.faces, mesh.faces);
  EXPECT_EQ(back.content.mesh.provenance, mesh.provenance);
  EXPECT_EQ(back.content.frame.unit_name(), "mm");
  EXPECT_EQ(back.content.frame.scale_source, frame.scale_source);
  EXPECT_GT(frame.metres_sigma, 0);
  EXPECT_NEAR(back.content.frame.metres_sigma / back.content.frame.metres_per_unit,
              frame.metres_sigma / frame.metres_per_unit,
              1e-9);
  EXPECT_EQ(back.content.frame.up, Vector3d::UnitZ());
  ASSERT_EQ(back.content.points.size(), mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vector3d p = 10 * frame.file_from_internal(mesh.vertices[i].cast<double>());
    const Vector3d q = back.content.file_from_internal(back.content.points[i]);
    EXPECT_LT((q - Vector3d(p.x(), -p.z(), p.y())).norm(), 1e-4);
  }
}

TEST_F(Read3mf, FarFromTheOriginTheDescriptionLeadsBack) {
  const TriangleMesh mesh = test::labelled_sphere();
  Frame frame = test::centimetre_frame();
  frame.file_origin = frame.origin = {448e5 + 0.25, 5.411e8, 12e3};
  write_3mf(dir_ / "a.3mf", mesh, frame, Eigen::Matrix3d::Identity());
  const MeasurableMesh back = read_mesh_file(dir_ / "a.3mf").content;
  const Vector3d in_world = back.frame.world_from_internal(back.mesh.vertices[7].cast<double>());
  const Vector3d wanted = frame.world_from_internal(mesh.vertices[7].cast<double>());
  EXPECT_LT((in_world / 10 - wanted).norm(), 1e-5);
}

// By Python's zipfile and the core specification: centimetres, a component of a component, each
// with a transform, and the build with another; places computed by the script itself.
TEST_F(Read3mf, ReadsWhatOthersWriteByTheSpecification) {
  ASSERT_TRUE(test::run_python(R"(
import zipfile
import numpy as np
core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
corners = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]], float)
faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
rng = np.random.default_rng(5)
steps = [np.vstack([np.linalg.qr(rng.normal(size=(3, 3)))[0] * 1.5, rng.normal(size=(1, 3))])
         for _ in range(3)]
text = lambda m: " ".join(f"{v:.17g}" for v in m.reshape(-1))
vertices = "".join(f'<m:vertex x="{a}" y="{b}" z="{c}"/>' for a, b, c in corners)
triangles = "".join(f'<m:triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
model = f'''<?xml version="1.0" encoding="UTF-8"?>
<m:model unit="centimeter" xml:lang="en-US" xmlns:m="{core}"><m:resources>
<m:object id="4"><m:mesh><m:vertices>{vertices}</m:vertices><m:triangles>{triangles}</m:triangles>
</m:mesh></m:object>
<m:object id="7"><m:components><m:component objectid="4" transform="{text(steps[0])}"/>
<m:component objectid="4"/></m:components></m:object>
<m:object id="9"><m:components><m:component objectid="7" transform="{text(steps[1])}"/>
</m:components></m:object></m:resources>
<m:build><m:item objectid="9" transform="{text(steps[2])}"/><m:item objectid="4"/></m:build></m:model>'''
with zipfile.ZipFile("other.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
    archive.writestr("[Content_Types].xml", '<?xml version="1.0"?><Types '
        'xmlns="http://schemas.openxmlformats.org/package/2006/content-types"/>')
    archive.writestr("_rels/.rels", '<?xml version="1.0"?><Relationships '
        'xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
        'Target="/3D/box.model" Id="rel0" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>')
    archive.writestr("3D/box.model", model)
apply = lambda p, m: p @ m[:3] + m[3]
chains = [[steps[0], steps[1], steps[2]], [steps[1], steps[2]], []]
out = []
for chain in chains:
    p = corners
    for m in chain:
        p = apply(p, m)
    out.append(p)
np.vstack(out).astype("<f8").tofile("places")
)",
                               dir_.path()));
  const ParsedMesh mesh = read_3mf(dir_ / "other.3mf");
  const std::string places = test::read_bytes(dir_ / "places");
  ASSERT_EQ(places.size(), 12 * 3 * sizeof(double));
  ASSERT_EQ(mesh.positions.size(), 12u);
  ASSERT_EQ(mesh.mesh.faces.size(), 12u);
  for (size_t i = 0; i < 12; ++i) {
    Vector3d p;
    std::memcpy(p.data(), places.data() + i * 3 * sizeof(double), 3 * sizeof(double));
    EXPECT_LT((mesh.positions[i] - p).norm(), 1e-12) << i;
  }
  EXPECT_EQ(mesh.comments, (std::vector<std::string>{"metres_per_unit 0.01"}));
  EXPECT_TRUE(mesh.mesh.provenance.empty());
  // Outside is outside, mirrored or not: 4 is the volume of the tetrahedron.
  const double scaled = 4 * std::pow(1.5, 9) + 4 * std::pow(1.5, 6) + 4;
  EXPECT_NEAR(volume(mesh), scaled, 1e-9 * scaled);
}

TEST_F(Read3mf, KnowsAllUnits) {
  const std::vector<std::pair<std::string, std::string>> units = {{"unit=\"micron\"", "0.000001"},
                                                                  {"", "0.001"},
                                                                  {"unit=\"inch\"", "0.0254"},
                                                                  {"unit=\"foot\"", "0.3048"},
                                                                  {"unit=\"meter\"", "1"},
                                                                  {"unit=\"millimeter\"", "0.001"}};
  for (const auto& [attribute, metres] : units) {
    ThreeMfFile file;
    file.attributes = attribute;
    EXPECT_EQ(read(file).comments[0], "metres_per_unit " + metres);
  }
  ThreeMfFile file;
  file.attributes = "unit=\"parsec\"";
  EXPECT_EQ(refused(file), "SCHEMA");
}

// As slicers save projects: objects in files of their own.
TEST_F(Read3mf, ReadsObjectsOfOtherPartsOfTheArchive) {
  ThreeMfFile file;
  file.attributes = "unit=\"meter\" requiredextensions=\"p\"";
  file.resources =
      ThreeMfFile::object(2,
                          ThreeMfFile::components({{1, "p:path=\"/3D/Objects/o.model\""},
                                                   {1, "p:path=\"3D/Objects/o.model\""}}));
  file.build = "<item objectid=\"2\"/><item objectid=\"1\" p:path=\"/3D/Objects/o.model\"/>";
  file.more_files = {
      {"3D/Objects/o.model",
       ThreeMfFile::document(
           "",
           "<resources>" + ThreeMfFile::object(1, ThreeMfFile::tetrahedron()) + "</resources>")}};
  const ParsedMesh mesh = read(file);
  EXPECT_EQ(mesh.mesh.faces.size(), 12u);
  EXPECT_EQ(mesh.comments[0], "metres_per_unit 1");
  file.more_files.clear();
  EXPECT_EQ(refused(file), "MISSING");
}

TEST_F(Read3mf, FindsPartsWhoseNamesDifferInLetterCase) {
  ThreeMfFile file;
  file.target = "/3d/3DModel.MODEL";
  file.build = "<item objectid=\"1\"/><item objectid=\"1\" p:path=\"/3D/Objects/O.model\"/>";
  const std::string other = ThreeMfFile::document(
      "", "<resources>" + ThreeMfFile::object(1, ThreeMfFile::tetrahedron()) + "</resources>");
  file.more_files = {{"3D/objects/o.model", other}};
  EXPECT_EQ(read(file).mesh.faces.size(), 8u);
  file.more_files.emplace_back("3D/OBJECTS/o.model", other);
  EXPECT_EQ(refused(file), "MISSING") << "which of the two is not known";
}

TEST_F(Read3mf, LabelsOfOthersAreNoProvenance) {
  ThreeMfFile file;
  file.resources =
      "<basematerials id=\"5\"><base name=\"observed\" displaycolor=\"#FFFFFF\"/>"
      "</basematerials><object id=\"1\" pid=\"5\" pindex=\"0\">" +
      ThreeMfFile::tetrahedron() + "</object>";
  EXPECT_TRUE(read(file).mesh.provenance.empty());
  const std::string ours = "<metadata name=\"Application\">cgs</metadata>";
  file.build = "<item objectid=\"1\"><metadatagroup>" + ours + "</metadatagroup></item>";
  EXPECT_TRUE(read(file).mesh.provenance.empty()) << "what an item says is not of the model";
  file.metadata = ours;
  EXPECT_EQ(read(file).mesh.provenance, std::vector<Provenance>(4, Provenance::Observed));
  file.resources += ThreeMfFile::object(2, ThreeMfFile::tetrahedron());
  file.build += "<item objectid=\"2\"/>";
  EXPECT_TRUE(read(file).mesh.provenance.empty()) << "half of it says nothing";
}

// As slicers and Blender write them again: metadata of their own, materials by the same names.
TEST_F(Read3mf, TakesLabelsOfMaterialsWhereMetadataWereReplaced) {
  const auto with_materials = [](const std::string& second, const std::string& description) {
    ThreeMfFile file;
    file.metadata = "<metadata name=\"Application\">Blender</metadata>" + description;
    file.resources =
        "<basematerials id=\"5\"><base name=\"observed\" displaycolor=\"#FFFFFF\"/>"
        "<base name=\"" +
        second + "\" displaycolor=\"#FFFFFF\"/></basematerials><object id=\"1\" pid=\"5\" " +
        "pindex=\"1\">" + ThreeMfFile::tetrahedron() + "</object>";
    const std::string first = "<triangle v1=\"0\"";
    file.resources.insert(file.resources.find(first) + first.size(), " pid=\"5\" p1=\"0\"");
    return file;
  };
  const ParsedMesh both = read(with_materials("inferred.001", ""));
  EXPECT_EQ(
      both.mesh.provenance,
      (std::vector<Provenance>{
          Provenance::Observed, Provenance::Inferred, Provenance::Inferred, Provenance::Inferred}));
  ASSERT_EQ(both.warnings.size(), 1U);
  EXPECT_TRUE(both.warnings[0].starts_with("labels are taken from the names of materials"));
  EXPECT_TRUE(both.mesh.colors.empty()) << "they tell labels apart";
  const ParsedMesh some = read(with_materials("PLA", ""));
  EXPECT_TRUE(some.mesh.provenance.empty());
  ASSERT_EQ(some.warnings.size(), 1U);
  EXPECT_TRUE(some.warnings[0].starts_with("where its faces come from is not known"));
  const ParsedMesh lost = read(with_materials(
      "PLA", "<metadata name=\"Description\">Surface by origin: observed 61.2 %.</metadata>"));
  EXPECT_TRUE(lost.mesh.provenance.empty());
  ASSERT_EQ(lost.warnings.size(), 1U);
  EXPECT_TRUE(lost.warnings[0].starts_with("where its faces come from is no longer known"));
}

// By the materials extension: the colour of an object, one face that overrides it with one of each
// corner; a second object in a base material, and a third without any.
TEST_F(Read3mf, VerticesTakeTheColoursOfFaces) {
  ThreeMfFile file;
  file.attributes =
      "unit=\"millimeter\" requiredextensions=\"m\" "
      "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";
  const std::string first = "<triangle v1=\"0\" v2=\"2\" v3=\"1\"";
  std::string mesh = ThreeMfFile::tetrahedron();
  mesh.insert(mesh.find(first) + first.size(), " pid=\"6\" p1=\"0\" p2=\"1\" p3=\"2\"");
  file.resources =
      "<m:colorgroup id=\"5\"><m:color color=\"#336699\"/></m:colorgroup><m:colorgroup id=\"6\">"
      "<m:color color=\"#FF0000\"/><m:color color=\"#00ff0080\"/><m:color color=\"blue\"/>"
      "</m:colorgroup><basematerials id=\"7\"><base name=\"PLA\" displaycolor=\"#000000\"/>"
      "</basematerials><object id=\"1\" pid=\"5\" pindex=\"0\">" +
      mesh + "</object><object id=\"2\" pid=\"7\" pindex=\"0\">" + ThreeMfFile::tetrahedron() +
      "</object>";
  file.build = "<item objectid=\"1\"/><item objectid=\"2\"/>";
  const ParsedMesh all = read(file);
  const Eigen::Vector3f of_object(0.2f, 0.4f, 0.6f);
  ASSERT_EQ(all.mesh.colors.size(), 8u);
  EXPECT_EQ(all.mesh.colors[0], Eigen::Vector3f::UnitX());
  EXPECT_LT((all.mesh.colors[1] - of_object).norm(), 1e-6f) << "\"blue\" is no colour here";
  EXPECT_EQ(all.mesh.colors[2], Eigen::Vector3f::UnitY());
  EXPECT_LT((all.mesh.colors[3] - of_object).norm(), 1e-6f);
  EXPECT_EQ(all.mesh.colors[4], Eigen::Vector3f::Zero());
  EXPECT_EQ(all.warnings,
            std::vector<std::string>{"surfaces of different colours meet at 4 corners; vertices "
                                     "have one, that of the first"});
  file.resources += ThreeMfFile::object(3, ThreeMfFile::tetrahedron());
  file.build = "<item objectid=\"3\"/><item objectid=\"2\"/>";
  const ParsedMesh some = read(file);
  ASSERT_EQ(some.mesh.colors.size(), 8u);
  EXPECT_EQ(some.mesh.colors[0], Eigen::Vector3f::Ones());
  EXPECT_EQ(some.mesh.colors[4], Eigen::Vector3f::Zero());
  EXPECT_EQ(some.warnings, std::vector<std::string>{"4 of 8 vertices state no colour: white"});
  file.build = "<item objectid=\"3\"/>";
  EXPECT_TRUE(read(file).mesh.colors.empty());
  file.resources += "<m:texture2dgroup id=\"9\" texid=\"8\"/>";
  EXPECT_EQ(read(file).warnings, std::vector<std::string>{"textures are not read"});
}

TEST_F(Read3mf, SaysThatMixedMaterialsAreNotRead) {
  for (const std::string mixture :
       {"<m:multiproperties id=\"6\" pids=\"5\"><m:multi pindices=\"0\"/></m:multiproperties>",
        "<m:compositematerials id=\"6\" matid=\"5\" matindices=\"0\">"
        "<m:composite values=\"1\"/></m:compositematerials>"}) {
    ThreeMfFile file;
    file.attributes =
        "unit=\"millimeter\" requiredextensions=\"m\" "
        "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";
    file.resources =
        "<basematerials id=\"5\"><base name=\"PLA\" displaycolor=\"#FF0000\"/>"
        "</basematerials>" +
        mixture + "<object id=\"1\" pid=\"6\" pindex=\"0\">" + ThreeMfFile::tetrahedron() +
        "</object>";
    const ParsedMesh mesh = read(file);
    EXPECT_TRUE(mesh.mesh.colors.empty());
    EXPECT_EQ(mesh.warnings,
              std::vector<std::string>{"mixed materials (multiproperties, compositematerials) are "
                                       "not read, nor their colours"});
  }
}

// A group of colours inside one of materials ends before it, as no file should have it.
TEST_F(Read3mf, KeepsGroupsOfColoursAndMaterialsApart) {
  ThreeMfFile file;
  file.attributes =
      "unit=\"millimeter\" requiredextensions=\"m\" "
      "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\"";
  file.resources =
      "<basematerials id=\"5\"><m:colorgroup id=\"6\"><m:color color=\"#0000FF\"/></m:colorgroup>"
      "<base name=\"PLA\" displaycolor=\"#FF0000\"/></basematerials>"
      "<object id=\"1\" pid=\"5\" pindex=\"0\">" +
      ThreeMfFile::tetrahedron() + "</object>";
  const ParsedMesh parsed = read(file);
  ASSERT_EQ(parsed.mesh.colors.size(), 4u);
  EXPECT_EQ(parsed.mesh.colors[0], Eigen::Vector3f::UnitX());
  const std::string second = "<m:colorgroup id=\"5\"/>";
  file.resources.insert(file.resources.find("<object"), second);
  EXPECT_EQ(refused(file), "SCHEMA");
}

TEST_F(Read3mf, TellsFilesOfThisProgramFromOthers) {
  write_3mf(dir_ / "own.3mf",
            test::labelled_sphere(),
            test::centimetre_frame(),
            Eigen::Matrix3d::Identity());
  EXPECT_TRUE(is_own_3mf(dir_ / "own.3mf"));
  test::write_bytes(dir_ / "other.3mf", ThreeMfFile().bytes());
  EXPECT_FALSE(is_own_3mf(dir_ / "other.3mf"));
  test::write_bytes(dir_ / "none.3mf", "<metadata name=\"Application\">cgs</metadata>");
  EXPECT_FALSE(is_own_3mf(dir_ / "none.3mf"));
  EXPECT_FALSE(is_own_3mf(dir_ / "missing.3mf"));
}

TEST_F(Read3mf, RefusesWhatDoesNotLeadAnywhere) {
  const auto with = [&](const auto& change) {
    ThreeMfFile file;
    change(file);
    return refused(file);
  };
  using File = ThreeMfFile;
  EXPECT_EQ(with([](File&) {}), "");
  EXPECT_EQ(with([](File& f) { f.build = ""; }), "EMPTY");
  EXPECT_EQ(with([](File& f) { f.build = "<item objectid=\"3\"/>"; }), "REF");
  EXPECT_EQ(with([](File& f) { f.resources += File::object(1, ""); }), "SCHEMA");
  EXPECT_EQ(with([](File& f) { f.target = "/3D/other.model"; }), "MISSING");
  EXPECT_EQ(with([](File& f) { f.target = "/../3dmodel.model"; }), "PATH");
  EXPECT_EQ(with([](File& f) {
              f.resources = File::object(1, File::components({{1, ""}}));
            }),
            "REF");
  EXPECT_EQ(with([](File& f) { f.attributes += " requiredextensions=\"b\""; }), "UNSUPPORTED");
  EXPECT_EQ(with([](File& f) { f.build = "<item objectid=\"1\" transform=\"1 0 0\"/>"; }),
            "SCHEMA");
  EXPECT_EQ(with([](File& f) {
              f.build = "<item objectid=\"1\" transform=\"1e300 0 0 0 1 0 0 0 1 1e308 0 0\"/>";
              f.resources.replace(f.resources.find("x=\"1\""), 5, "x=\"1e200\"");
            }),
            "VALUE");
  EXPECT_EQ(with([](File& f) { f.before = "<!DOCTYPE model>"; }), "UNSUPPORTED");
  test::write_bytes(dir_ / "b.3mf", "solid");
  EXPECT_EQ(test::defect_of([&] { (void)read_3mf(dir_ / "b.3mf"); }), "MAGIC");
  test::write_bytes(dir_ / "b.3mf", test::zip_bytes({{"meta.json", "{}"}}));
  EXPECT_EQ(test::defect_of([&] { (void)read_3mf(dir_ / "b.3mf"); }), "MISSING");
}

std::string repeated(int times, const std::string& text) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

// Half a million more of one kind and of another, in one file and in two.
TEST_F(Read3mf, RefusesMoreThanAMillionEntries) {
  constexpr int kHalf = 500'000;
  ThreeMfFile file;
  const std::string objects = file.resources;
  const std::string items = repeated(kHalf, "<item objectid=\"1\"/>");
  const std::string bases =
      "<basematerials id=\"5\">" + repeated(kHalf, "<base name=\"a\"/>") + "</basematerials>";
  file.build = items;
  EXPECT_EQ(read(file).mesh.faces.size(), size_t{4} * kHalf);
  file.resources = objects + bases;
  const std::string said = test::message_of([&] { (void)read(file); });
  EXPECT_NE(said.find("more than 1,000,000 objects, components, items"), std::string::npos) << said;
  file.resources = objects + "<object id=\"6\"><components>" +
                   repeated(kHalf, "<component objectid=\"1\"/>") + "</components></object>";
  EXPECT_EQ(refused(file), "LIMIT");
  file.resources = objects;
  for (int id = 7; id < 7 + kHalf; ++id) file.resources += ThreeMfFile::object(id, "");
  EXPECT_EQ(refused(file), "LIMIT");
  file.resources = objects;
  file.build = items + "<item objectid=\"1\" p:path=\"/3D/o.model\"/>";
  file.more_files = {
      {"3D/o.model", ThreeMfFile::document("", "<resources>" + objects + bases + "</resources>")}};
  EXPECT_EQ(refused(file), "LIMIT") << "two parts";
}

TEST_F(Read3mf, RefusesItemsThatMultiply) {
  ThreeMfFile file;
  std::string vertices;
  for (int i = 0; i < 1000; ++i) vertices += "<vertex x=\"0\" y=\"1\" z=\"2\"/>";
  file.resources = ThreeMfFile::object(1,
                                       "<mesh><vertices>" + vertices +
                                           "</vertices><triangles><triangle v1=\"0\" v2=\"1\" "
                                           "v3=\"2\"/></triangles></mesh>");
  file.build = repeated(34'000, "<item objectid=\"1\"/>");
  const std::string said = test::message_of([&] { (void)read(file); });
  EXPECT_NE(said.find("LIMIT"), std::string::npos) << said;
  EXPECT_NE(said.find("items and components place more than 33 million"), std::string::npos)
      << said;
}

// What write_3mf() says of the origin holds for the file as it was written.
TEST_F(Read3mf, TakesTheOriginOnlyOfFilesThatWereNotChanged) {
  const auto ours = [] {
    ThreeMfFile file;
    file.metadata =
        "<metadata name=\"Application\">cgs</metadata><metadata name=\"Description\">Coordinates "
        "of the scene: add 1000 2000 3000 mm.</metadata>";
    return file;
  };
  const auto has_origin = [](const ParsedMesh& mesh) {
    return std::find(mesh.comments.begin(), mesh.comments.end(), "file_origin 1000 2000 3000") !=
           mesh.comments.end();
  };
  const auto is_left_out = [&](const ThreeMfFile& file) {
    const ParsedMesh mesh = read(file);
    return !has_origin(mesh) && mesh.warnings.size() == 1 &&
           mesh.warnings[0].starts_with("the origin in the description is left out: ");
  };
  ThreeMfFile file = ours();
  EXPECT_TRUE(has_origin(read(file)));
  EXPECT_TRUE(read(file).warnings.empty());
  file.build = "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 0\"/>";
  EXPECT_TRUE(has_origin(read(file)));
  file.build = "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 5\"/>";
  EXPECT_TRUE(is_left_out(file)) << "moved";
  file.build = "<item objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 0 0 0\"/>";
  EXPECT_TRUE(is_left_out(file)) << "turned";
  file.build = "<item objectid=\"1\"/><item objectid=\"1\"/>";
  EXPECT_TRUE(is_left_out(file)) << "twice";
  file = ours();
  file.resources += ThreeMfFile::object(
      2, ThreeMfFile::components({{1, "transform=\"1 0 0 0 1 0 0 0 1 0 0 5\""}}));
  file.build = "<item objectid=\"2\"/>";
  EXPECT_TRUE(is_left_out(file)) << "moved by a component";
  file = ours();
  file.attributes = "unit=\"meter\"";
  EXPECT_EQ(read(file).comments.back(), "file_origin 1 2 3") << "it is in millimetres";
  file = ours();
  file.build = "<item objectid=\"1\"><metadatagroup>" + file.metadata + "</metadatagroup></item>";
  file.metadata = "<metadata name=\"Application\">cgs</metadata>";
  EXPECT_FALSE(has_origin(read(file))) << "of the item";
}

TEST_F(Read3mf, LeavesOutSupportsAndSaysSo) {
  const auto object = [](int id, const std::string& type, const std::string& content) {
    return "<object id=\"" + std::to_string(id) + "\" type=\"" + type + "\">" + content +
           "</object>";
  };
  const std::string mesh = ThreeMfFile::tetrahedron();
  ThreeMfFile file;
  file.resources = object(1, "model", mesh) + object(2, "support", mesh) +
                   object(3, "solidsupport", mesh) + object(4, "other", mesh);
  // The type of an object with components says nothing of them.
  file.resources += object(5, "other", ThreeMfFile::components({{1, ""}, {4, ""}, {4, ""}}));
  file.build = "<item objectid=\"5\"/><item objectid=\"2\"/><item objectid=\"3\"/>";
  const ParsedMesh part = read(file);
  EXPECT_EQ(part.mesh.faces.size(), 4u);
  EXPECT_EQ(part.positions.size(), 4u);
  EXPECT_EQ(part.warnings,
            (std::vector<std::string>{"left out 3 objects that are no part of the model (type "
                                      "support, solidsupport or other)"}));
  file.build = "<item objectid=\"2\"/>";
  EXPECT_EQ(refused(file), "EMPTY");
  file.resources = object(1, "surface", mesh);
  file.build = "<item objectid=\"1\"/>";
  const ParsedMesh surface = read(file);
  EXPECT_EQ(surface.mesh.faces.size(), 4u);
  EXPECT_EQ(surface.warnings,
            std::vector<std::string>{"1 objects are stated to be surfaces, which enclose nothing"});
  file.resources = object(1, "soup", mesh);
  EXPECT_EQ(refused(file), "SCHEMA");
}

TEST_F(Read3mf, TakesNumbersWithASign) {
  ThreeMfFile file;
  file.resources.replace(file.resources.find("x=\"1\""), 5, "x=\"+1\"");
  file.build = "<item objectid=\"1\" transform=\"+1 0 0 0 +1.0 0 0 0 1e+0 +2 -3 +.5\"/>";
  const ParsedMesh mesh = read(file);
  EXPECT_EQ(mesh.positions[1], Vector3d(3, -3, 0.5));
  file.build = "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 2 0,5 0\"/>";
  const std::string said = test::message_of([&] { (void)read(file); });
  EXPECT_NE(said.find("<item>: transform: \"0,5\" is no number"), std::string::npos) << said;
}

TEST_F(Read3mf, RefusesComponentsThatMultiply) {
  ThreeMfFile file;
  const std::vector<std::pair<int, std::string>> ten = {
      {1, ""}, {1, ""}, {1, ""}, {1, ""}, {1, ""}};
  for (int id = 2; id < 20; ++id) {
    std::vector<std::pair<int, std::string>> parts = ten;
    for (auto& part : parts) part.first = id - 1;
    file.resources += ThreeMfFile::object(id, ThreeMfFile::components(parts));
  }
  file.build = "<item objectid=\"6\"/>";
  EXPECT_EQ(read(file).mesh.faces.size(), 4u * 3125);
  file.build = "<item objectid=\"19\"/>";
  EXPECT_EQ(refused(file), "LIMIT");
  for (int id = 20; id < 100; ++id) {
    file.resources += ThreeMfFile::object(id, ThreeMfFile::components({{id - 1, ""}}));
  }
  file.build = "<item objectid=\"99\"/>";
  EXPECT_EQ(refused(file), "LIMIT") << "a long chain";
}

TEST_F(Read3mf, DropsVerticesThatAreNotFinite) {
  ThreeMfFile file;
  std::string mesh = ThreeMfFile::tetrahedron();
  mesh.insert(mesh.find("</vertices>"), "<vertex x=\"NaN\" y=\"0\" z=\"1e999\"/>");
  mesh.insert(mesh.find("</triangles>"), "<triangle v1=\"0\" v2=\"1\" v3=\"4\"/>");
  file.resources = ThreeMfFile::object(1, mesh);
  const ParsedMesh out = read(file);
  EXPECT_EQ(out.positions.size(), 4U);
  EXPECT_EQ(out.mesh.faces.size(), 4U);
  EXPECT_EQ(out.warnings,
            std::vector<std::string>{"dropped 1 vertex of 5 that is not finite, and 1 face there"});
}

}  // namespace
}  // namespace cgs::threemf_reader_test
