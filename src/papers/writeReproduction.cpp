#include "depthservo/papers/Reproduce.h"
#include "depthservo/text/NewFolder.h"
#include "papers/reproductionPage.h"
#include "report/RunFiles.h"

namespace depthservo {

bool writeReproduction(const std::string& name, const std::vector<ReproducedPaper>& reproduced,
                       const std::filesystem::path& folder) {
  bool areDrawn = true;
  makeFolder(folder, [&](const std::filesystem::path& place) {
    std::vector<JudgedClaim> rows;
    for (const auto& [paper, result] : reproduced) {
      rows.insert(rows.end(), result.rows.begin(), result.rows.end());
      for (const Figure& figure : result.figures) {
        areDrawn = drawFigure(figure, place / figureFile(paper, figure)) && areDrawn;
      }
    }
    writeFile(place / "rows.json", toJson(rows) + '\n');
    writeFile(place / "report.html", reproductionPage(name, reproduced, place));
  });
  return areDrawn;
}

}  // namespace depthservo
