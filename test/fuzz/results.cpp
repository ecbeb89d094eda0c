// What the tool wrote itself: baselines, run folders, goals. The first line names the file of a folder.
#include <stdlib.h>

#include "Target.h"
#include "depthservo/experiments/Baseline.h"
#include "depthservo/report/Report.h"
#include "depthservo/report/RunFolder.h"
#include "depthservo/servo/TaughtGoal.h"
#include "support/TemporaryFolder.h"
#include "support/exampleLog.h"

namespace depthservo::fuzz {
namespace {

using Files = std::map<std::string, std::string>;

const Target kBaseline("baseline", [](const std::string& bytes) {
  const Baseline baseline = Baseline::load(written("baseline.json", bytes));
  require(baseline.tolerance() >= 0, "a tolerance");
  baseline.differences(baseline);
});

Files runFolder() {
  setenv("PATH", "/nonexistent", 1);  // without gnuplot
  const test::TemporaryFolder place;
  writeRunFolder(test::exampleLog(5), place / "run");
  Files files;
  for (const char* name : {"run.json", "frames.csv", "features.csv"}) {
    files[name] = place.read(std::string("run/") + name);
  }
  return files;
}

const Target kRun("run", [](const std::string& bytes) {
  static const Files files = runFolder();
  writeReport(folderWith("run", files, bytes));
});

const Files kGoalFolder{
    {"camera.yaml",
     "image_width: 8\nimage_height: 6\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
     "  data: [10, 0, 3.5, 0, 11, 2.5, 0, 0, 1]\ndistortion_coefficients: {rows: 1, cols: 2, data: [0, 0]}\n"},
    {"sequence.yaml",
     "name: goal\ntarget: {type: dots, points: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], radius: 0.01}\n"
     "dots: [[1, 2], [3, 4], [5, 1]]\n"},
    {"rgb.txt", "0 goal.pgm\n"},
    {"goal.pgm", "P5\n8 6\n255\n" + std::string(48, 'a')},
    {"tracks.csv", "timestamp,id,u,v\n0,0,1,2\n0,1,3,4\n0,2,5,1\n"},
    {"truth.csv", "timestamp,id,Z\n0,0,1\n0,1,1\n0,2,1\n"}};

const Target kTaught("goal", [](const std::string& bytes) {
  readGoal(folderWith("goal", kGoalFolder, bytes)).servoGoal(1);
});

}  // namespace
}  // namespace depthservo::fuzz
