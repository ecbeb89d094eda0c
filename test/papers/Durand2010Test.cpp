#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "depthservo/papers/Reproduce.h"

namespace depthservo {
namespace {

TEST(ReproduceDurand2010, everyFigureAgreesAndWhatThePaperPromisesTooMuchIsSaid) {
  const std::vector<JudgedClaim> rows = reproduce("durand2010").rows;
  EXPECT_GT(rows.size(), 150u);
  std::set<std::string> ids, refuted;
  for (const JudgedClaim& row : rows) {
    EXPECT_TRUE(row.pass) << row.id << ": expected " << row.expected << ", ours " << row.ours;
    EXPECT_TRUE(ids.insert(row.id).second) << row.id << " is there twice";
    EXPECT_EQ(row.id.rfind("durand2010/", 0), 0u) << row.id;
    EXPECT_TRUE(std::isfinite(row.ours)) << row.id;
    EXPECT_FALSE(row.claim.empty() || row.unit.empty()) << row.id;
    EXPECT_TRUE(row.reproduces || !row.note.empty()) << row.id << ": why not?";
    if (!row.reproduces) refuted.insert(row.id);
  }
  EXPECT_EQ(refuted, (std::set<std::string>{"durand2010/print/start", "durand2010/print/arctan",
                                            "durand2010/ii/2s/ls/relchi"}));
}

}  // namespace
}  // namespace depthservo
