// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/support/zip_bytes.h"

namespace cgs::test {

/// A 3MF file written by hand: by default a tetrahedron with corners at 0 and 1 on the axes that is
/// built once.
struct ThreeMfFile {
  std::string attributes = "unit=\"millimeter\"";
  std::string metadata;  ///< Elements before the resources.
  std::string resources = object(1, tetrahedron());
  std::string build = "<item objectid=\"1\"/>";
  std::string target = "/3D/3dmodel.model";
  std::string before;  ///< The root.
  std::vector<std::pair<std::string, std::string>> more_files;

  static std::string tetrahedron() {
    return R"(<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices><triangles>
<triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="0" v2="3" v3="2"/>
<triangle v1="1" v2="2" v3="3"/></triangles></mesh>)";
  }
  static std::string object(int id, const std::string& content) {
    return "<object id=\"" + std::to_string(id) + "\" type=\"model\">" + content + "</object>";
  }
  static std::string components(const std::vector<std::pair<int, std::string>>& parts) {
    std::string out = "<components>";
    for (const auto& [id, more] : parts) {
      out += "<component objectid=\"" + std::to_string(id) + "\" " + more + "/>";
    }
    return out + "</components>";
  }
  static std::string document(const std::string& attributes, const std::string& content) {
    return "<model " + attributes +
           " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
           "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" "
           "xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\">" +
           content + "</model>";
  }
  std::string model() const {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>" + before +
           document(
               attributes,
               metadata + "<resources>" + resources + "</resources><build>" + build + "</build>");
  }
  std::string bytes(ZipDamage damage = {.method = 8}) const {
    std::vector<std::pair<std::string, std::string>> files = {
        {"_rels/.rels",
         "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
         "<Relationship Target=\"" +
             target +
             "\" Id=\"r\" "
             "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
             "</Relationships>"},
        {"3D/3dmodel.model", model()}};
    files.insert(files.end(), more_files.begin(), more_files.end());
    return zip_bytes(files, damage);
  }
};

}  // namespace cgs::test
