// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/core/provenance.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

namespace cgs::provenance_test {
namespace {

TEST(ProvenanceTraits, TellLabelsApart) {
  std::set<std::string_view> names;
  std::set<std::string_view> meanings;
  std::set<std::array<uint8_t, 3>> colors;
  std::set<int> ranks;
  for (const ProvenanceTraits& traits : kProvenanceTraits) {
    names.insert(traits.name);
    meanings.insert(traits.meaning);
    colors.insert(traits.color);
    ranks.insert(traits.evidence_rank);
  }
  EXPECT_EQ(names.size(), kProvenanceCount);
  EXPECT_EQ(meanings.size(), kProvenanceCount);
  EXPECT_EQ(colors.size(), kProvenanceCount);
  EXPECT_EQ(ranks.size(), kProvenanceCount);
}

TEST(ProvenanceTraits, WhatPhotographsVouchForHasTheMostEvidence) {
  for (const ProvenanceTraits& traits : kProvenanceTraits) {
    EXPECT_TRUE(traits.has_evidence || !traits.was_seen) << traits.name;
    for (const ProvenanceTraits& other : kProvenanceTraits) {
      const bool is_better =
          (traits.has_evidence && !other.has_evidence) || (traits.was_seen && !other.was_seen);
      if (is_better) EXPECT_GT(traits.evidence_rank, other.evidence_rank) << traits.name;
    }
  }
}

// The numbers are those in files.
TEST(ProvenanceTraits, StandAtTheNumberOfTheirLabel) {
  EXPECT_EQ(provenance_name(Provenance(0)), "inferred");
  EXPECT_EQ(provenance_name(Provenance(1)), "single view");
  EXPECT_EQ(provenance_name(Provenance(2)), "observed");
  EXPECT_EQ(provenance_name(Provenance(3)), "interpolated");
  EXPECT_EQ(provenance_name(Provenance(4)), "virtual");
  EXPECT_EQ(provenance_name(Provenance(5)), "estimated");
  EXPECT_NEAR(provenance_color(Provenance::Inferred).x(), 242 / 255.0, 1e-6);
}

TEST(ProvenanceOrder, ListsEveryLabelOnce) {
  const std::set<Provenance> all(kProvenanceOrder.begin(), kProvenanceOrder.end());
  EXPECT_EQ(all.size(), kProvenanceCount);
}

TEST(WeakerEvidence, IsInferredBelowAllAndEstimatedBelowTheRest) {
  for (const Provenance label : kProvenanceOrder) {
    EXPECT_EQ(weaker_evidence(label, Provenance::Inferred), Provenance::Inferred);
    EXPECT_EQ(weaker_evidence(label, label), label);
    if (label == Provenance::Inferred) continue;
    EXPECT_EQ(weaker_evidence(label, Provenance::Estimated), Provenance::Estimated);
    EXPECT_EQ(weaker_evidence(Provenance::Estimated, label), Provenance::Estimated);
  }
}

TEST(Provenance, EstimatedSurfaceIsShownButNothingVouchesForIt) {
  EXPECT_TRUE(is_shown(Provenance::Estimated));
  EXPECT_FALSE(was_seen(Provenance::Estimated));
  EXPECT_FALSE(has_evidence(Provenance::Estimated));
  EXPECT_FALSE(is_shown(Provenance::Inferred));
  EXPECT_FALSE(is_shown(Provenance::Interpolated));
  EXPECT_TRUE(is_shown(Provenance::SingleView));
}

}  // namespace
}  // namespace cgs::provenance_test
