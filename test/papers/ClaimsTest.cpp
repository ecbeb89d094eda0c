#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "depthservo/text/InputError.h"
#include "papers/Claims.h"

namespace depthservo {
namespace {

/// One paper of one experiment, these rows.
Claims claims(const std::string& rows, bool full = false) {
  return readClaims(
      "citation: c\nexperiments:\n  1:\n    title: t\n    unit: m\n    within: 10 %\n"
      "    rows:\n" +
          rows,
      "paper", full);
}

JudgedClaim judged(const std::string& row, double ours, bool full = false) {
  Measurements measured;
  measured.add("1/a", ours);
  measured.add("1/other", 5);
  return judge(claims("      a: {claim: x, " + row + "}\n", full), measured).front();
}

TEST(Claims, agree_within_their_tolerance_and_not_beyond) {
  struct Case {
    const char* row;
    double good, bad;
    const char* tolerance;
  };
  for (const Case& c :
       {Case{"expected: 2", 2.199, 2.201, "10 %"}, Case{"expected: -2", -1.801, -1.799, "10 %"},
        Case{"expected: 2, within: 0.1", 1.901, 1.899, "0.1 m"},
        Case{"expected: 2, within: factor 1.5", 1.34, 1.33, "factor 1.5"},
        Case{"expected: 2, within: factor 1.5", 2.99, 3.01, "factor 1.5"},
        Case{"expected: 2, within: at most 3", 3, 3.01, "at most 3 m"},
        Case{"expected: 2, within: 0", 2, 2.0000001, "exact"},
        Case{"expected: yes", 1, 0, "exact"}}) {
    EXPECT_TRUE(judged(c.row, c.good).pass) << c.row;
    EXPECT_TRUE(judged(c.row, c.good).reproduces) << c.row;
    EXPECT_FALSE(judged(c.row, c.bad).pass) << c.row;
    EXPECT_FALSE(judged(c.row, c.bad).reproduces) << c.row;
    EXPECT_EQ(judged(c.row, c.good).tolerance, c.tolerance) << c.row;
  }
}

TEST(Claims, that_are_not_finite_or_not_measured_neither_agree_nor_reproduce) {
  for (const double value : {double(NAN), double(INFINITY), -double(INFINITY)}) {
    for (const char* row : {"expected: 2, within: at most 3", "expected: 2", "expected: yes"}) {
      EXPECT_FALSE(judged(row, value).pass) << row << value;
      EXPECT_TRUE(std::isfinite(judged(row, value).ours));
    }
  }
  const auto rows = judge(claims("      b: {claim: x, expected: 2, holds: '> 0'}\n"), {});
  EXPECT_FALSE(rows.front().pass);
  EXPECT_FALSE(rows.front().reproduces);
  EXPECT_EQ(rows.front().note, "not measured");
}

TEST(Claims, hold_by_their_own_rule_whether_they_agree_or_not) {
  EXPECT_FALSE(judged("expected: 2, holds: no", 2).reproduces);
  EXPECT_TRUE(judged("expected: 2, holds: '> 0'", 7).reproduces);
  EXPECT_FALSE(judged("expected: 2, holds: '> 0'", 0).reproduces);
  EXPECT_TRUE(judged("expected: 5, holds: '>= 1/other'", 5).reproduces);
  EXPECT_FALSE(judged("expected: 5, holds: '< 1/other'", 5).reproduces);
  EXPECT_TRUE(judged("expected: 5, holds: '<= 5'", 5).reproduces);
}

TEST(Claims, of_a_full_reproduction_may_differ) {
  const std::string row = "expected: 2, full: {expected: 4, unit: s, within: 0}";
  EXPECT_TRUE(judged(row, 2).pass);
  EXPECT_FALSE(judged(row, 2, true).pass);
  EXPECT_EQ(judged(row, 4, true).unit, "s");
  const std::string only = "      a: {claim: x, expected: 2, only: full}\n";
  EXPECT_TRUE(claims(only).all.empty());
  EXPECT_EQ(claims(only, true).all.size(), 1u);
}

TEST(Claims, with_unknown_keys_or_values_are_refused_with_their_line) {
  for (const char* row : {"expecetd: 2", "expected: two", "expected: 2, within: about 3",
                          "expected: 2, within: factor x", "expected: 2, holds: maybe",
                          "expected: 2, within: -1", "within: 1"}) {
    try {
      claims("      a: {claim: x, " + std::string(row) + "}\n");
      FAIL() << row;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("paper.yaml:8"), std::string::npos) << error.what();
    }
  }
}

TEST(Claims, of_the_papers_have_ids_of_their_own_units_and_titles) {
  for (const std::string& name : paperNames()) {
    for (const bool full : {false, true}) {
      const Claims all = claimsOf(name, full);
      std::set<std::string> ids;
      for (const Claim& claim : all.all) {
        EXPECT_TRUE(ids.insert(claim.id).second) << claim.id;
        EXPECT_FALSE(claim.text.empty()) << claim.id;
        EXPECT_LE(claim.accepted().first, claim.expected) << claim.id;
        EXPECT_GE(claim.accepted().second, claim.expected) << claim.id;
      }
      EXPECT_GT(ids.size(), 150u);
    }
  }
}

}  // namespace
}  // namespace depthservo
