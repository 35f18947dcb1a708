// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/material_labels.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "io/bytes/mesh_arrays.h"

namespace cgs::material_labels_test {
namespace {

TEST(ProvenanceOfMaterial, KnowsNamesAsOtherProgramsChangeThem) {
  for (const Provenance label : kProvenanceOrder) {
    std::string name(provenance_name(label));
    EXPECT_EQ(provenance_of_material(name), label) << name;
    EXPECT_EQ(provenance_of_material(name + " DSC 01.jpg"), label) << name;
    EXPECT_EQ(provenance_of_material(name + ".001"), label) << name;
    std::replace(name.begin(), name.end(), ' ', '_');
    EXPECT_EQ(provenance_of_material(name), label) << name;
    EXPECT_EQ(provenance_of_material(name + "_DSC_01.jpg.002"), label) << name;
  }
}

TEST(ProvenanceOfMaterial, OtherNamesTellNothing) {
  for (const char* name : {"",
                           "stone",
                           "observe",
                           "observedly",
                           "Observed",
                           "un observed",
                           "single",
                           "single-view",
                           "view_observed",
                           "surface"}) {
    EXPECT_EQ(provenance_of_material(name), std::nullopt) << name;
  }
}

TEST(MaterialLabels, TellOnlyWhereEveryFaceHasOneAndTheyDiffer) {
  MaterialLabels labels;
  EXPECT_FALSE(labels.are_told());
  EXPECT_EQ(labels.warning(false), "");
  labels.add(Provenance::Virtual);
  labels.add(Provenance::Virtual);
  EXPECT_FALSE(labels.are_told());
  EXPECT_TRUE(labels.warning(false).starts_with("where its faces come from is not known"));
  labels.add(Provenance::Observed);
  EXPECT_TRUE(labels.are_told());
  EXPECT_TRUE(labels.warning(true).starts_with("labels are taken from the names of materials"));
  labels.add(std::nullopt);
  EXPECT_FALSE(labels.are_told());
  MaterialLabels others;
  others.add(std::nullopt);
  EXPECT_EQ(others.warning(false), "");
}

}  // namespace
}  // namespace cgs::material_labels_test
