// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/xml_events.h"

#include <gtest/gtest.h>

#include "tests/support/scene_files.h"

namespace cgs::xml_events_test {
namespace {

std::string defect(const std::string& xml, const XmlHandlers& handlers = {}) {
  return test::defect_of([&] { read_xml(xml, "a.xml", handlers); });
}

TEST(XmlEvents, TellsElementsTextAndPrefixes) {
  std::string told;
  XmlHandlers handlers;
  handlers.start = [&](const XmlElement& e) {
    told += "<" + std::string(e.name()) + " " + std::string(e.find("x").value_or("-")) + " " +
            std::string(e.find("urn:b|x").value_or("-")) + ">";
  };
  handlers.end = [&](std::string_view name) { told += "</" + std::string(name) + ">"; };
  handlers.text = [&](std::string_view text) { told += text; };
  handlers.prefix = [&](std::string_view prefix, std::string_view uri) {
    told += std::string(prefix) + "=" + std::string(uri) + " ";
  };
  read_xml(
      "\xef\xbb\xbf<?xml version=\"1.0\"?><a xmlns=\"urn:a\" xmlns:b=\"urn:b\" x=\"&lt;1\" "
      "b:x=\"2\">1 &amp; 2<b:c/></a>",
      "a.xml",
      handlers);
  EXPECT_EQ(told, "=urn:a b=urn:b <urn:a|a <1 2>1 & 2<urn:b|c - -></urn:b|c></urn:a|a>");
}

TEST(XmlEvents, ReadsNumbersAndSaysWhereTheyAreWrong) {
  XmlHandlers handlers;
  double sum = 0;
  handlers.start = [&](const XmlElement& e) { sum += e.number("x") + double(e.count("n")); };
  EXPECT_EQ(defect("<a x=' 1.5e1 ' n='2'/>", handlers), "");
  EXPECT_EQ(sum, 17);
  EXPECT_EQ(defect("<a x='+.25' n='2'/>", handlers), "");
  EXPECT_EQ(sum, 19.25);
  for (const char* word : {"+", "++1", "+-1", "-+1", "+inf", "+ 1", ""}) {
    EXPECT_EQ(defect("<a x='" + std::string(word) + "' n='2'/>", handlers), "SYNTAX") << word;
  }
  EXPECT_EQ(defect("<a n='2'/>", handlers), "SCHEMA");
  EXPECT_EQ(defect("<a x='1,5' n='2'/>", handlers), "SYNTAX");
  EXPECT_EQ(defect("<a x='inf' n='2'/>", handlers), "VALUE");
  EXPECT_EQ(defect("<a x='1' n='-2'/>", handlers), "SYNTAX");
  const std::string said =
      test::message_of([&] { read_xml("<a x='1' n='2'>\n<b/></a>", "a.xml", handlers); });
  EXPECT_NE(said.find("line 2, <b>: has no attribute x"), std::string::npos) << said;
}

TEST(XmlEvents, ReadsListsOfNumbersAndNamesTheWrongOne) {
  XmlHandlers handlers;
  std::vector<double> all;
  handlers.start = [&](const XmlElement& e) { all = e.numbers("x"); };
  EXPECT_EQ(defect("<a x=' 1\n+2\t-.5 '/>", handlers), "");
  EXPECT_EQ(all, (std::vector<double>{1, 2, -0.5}));
  EXPECT_EQ(defect("<a x='1 nan'/>", handlers), "VALUE");
  const std::string said = test::message_of([&] { read_xml("<a x='1 2,5'/>", "a.xml", handlers); });
  EXPECT_NE(said.find("line 1, <a>: x: \"2,5\" is no number"), std::string::npos) << said;
}

// expat before 2.6 reads a token again from its start at each piece.
TEST(XmlEvents, RefusesTagsAndCommentsThatDoNotEnd) {
  const std::string three(size_t{3} << 20, 'x');
  const std::string six = three + three;
  for (const auto& [filler, expected] : {std::pair(three, ""), std::pair(six, "LIMIT")}) {
    EXPECT_EQ(defect("<!--" + filler + "--><a/>"), expected);
    EXPECT_EQ(defect("<a><!--" + filler + "--></a>"), expected);
    EXPECT_EQ(defect("<a/><!--" + filler + "-->"), expected);
    EXPECT_EQ(defect("<a b='" + filler + "'/>"), expected);
    EXPECT_EQ(defect("<a><?b " + filler + "?></a>"), expected);
  }
  const std::string said =
      test::message_of([&] { read_xml("<a>\n<!--" + six + "--></a>", "a.xml", {}); });
  EXPECT_NE(said.find("a.xml: line 2: one tag, comment or text of more than 4 MiB"),
            std::string::npos)
      << said;
  std::string many;
  for (int i = 0; i < 1'000'000; ++i) many += "<b c='1'/>";
  EXPECT_EQ(defect("<a>" + many + six + "<!--" + three + "-->" + many + "</a>"), "");
}

TEST(XmlEvents, RefusesWhatIsDamagedOrExpands) {
  EXPECT_EQ(defect("<a></b>"), "SYNTAX");
  EXPECT_EQ(defect("<a>"), "TRUNCATED");
  EXPECT_EQ(defect("<a b='"), "TRUNCATED");
  EXPECT_EQ(defect(""), "TRUNCATED");
  EXPECT_EQ(defect("<a>&unknown;</a>"), "SYNTAX");
  EXPECT_EQ(defect("<!DOCTYPE a [<!ENTITY e SYSTEM 'file:///etc/passwd'>]><a>&e;</a>"),
            "UNSUPPORTED");
  EXPECT_EQ(defect("<!DOCTYPE a SYSTEM 'a.dtd'><a/>"), "UNSUPPORTED");
  std::string nested;
  for (int i = 0; i < 65; ++i) nested += "<a>";
  EXPECT_EQ(defect(nested), "LIMIT");
}

}  // namespace
}  // namespace cgs::xml_events_test
